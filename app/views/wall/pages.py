"""The wall screen: a page that holds nothing, and what it shows, for its key alone.

The key stands behind the # of the link, which browsers send to nobody: it is in no log and no address that is passed on. The page
sends it as a key with each look.
"""

import time
from collections import OrderedDict, deque
from collections.abc import AsyncIterator, Hashable
from threading import Lock
from typing import cast

from fastapi import APIRouter, Depends, Request, Response, params
from sqlalchemy.orm import Session
from starlette.responses import PlainTextResponse

from app.access import screens
from app.errors import TooManyRequests
from app.language.i18n import _
from app.language.times import written
from app.views.wall import queries
from app.views.wall.queries import Wall
from app.web.deps import SessionDep
from app.web.templates import page

router = APIRouter(include_in_schema=False)
EVERY = 5
"""Seconds between two looks of a screen."""
MOST, WITHIN = 120, 60.0
"""Looks of one screen, or wrong keys of one address, and the seconds in which they are counted."""
MOST_KNOWN = 1_000
LASTS = 2.0
"""Seconds for which what was found is shown to every screen: twenty of them ask the database as often as one."""


class Rate:
    """At most `MOST` calls of each in `WITHIN` seconds, of the `MOST_KNOWN` that called last."""

    def __init__(self) -> None:
        self._calls: OrderedDict[Hashable, deque[float]] = OrderedDict()
        self._lock = Lock()

    def call(self, who: Hashable, now: float) -> None:
        """Note a call. Raises `TooManyRequests`."""
        with self._lock:
            calls = self._calls.setdefault(who, deque())
            self._calls.move_to_end(who)
            while calls and calls[0] <= now - WITHIN:
                calls.popleft()
            if len(calls) >= MOST:
                raise TooManyRequests(
                    _("The wall screen looks too often."), _("Wait a minute."), retry_after=round(WITHIN)
                )
            calls.append(now)
            while len(self._calls) > MOST_KNOWN:
                self._calls.popitem(last=False)


class WallDoor:
    """The rate of the screens of a plant, and what they were shown last. One per plant and process."""

    def __init__(self) -> None:
        self.rate = Rate()
        self._shown: tuple[float, Wall] | None = None
        self._alone = Lock()

    def wall(self, session: Session) -> Wall:
        """Return what is shown now. One look asks the database; those that come meanwhile wait for it and show the same."""
        with self._alone:
            if self._shown is None or time.monotonic() - self._shown[0] >= LASTS:
                wall = queries.wall(session)
                self._shown = (time.monotonic(), wall)  # by when it was found: a slow database is not asked more often
            return self._shown[1]


@router.get("/wall")
def shell(request: Request) -> Response:
    """The page; for everybody, because it holds nothing."""
    return page(request, "wall/shell.html", every=EVERY)


async def _turn() -> AsyncIterator[None]:
    yield


_IN_TURN = cast("params.Depends", Depends(_turn, scope="function", max_concurrency=2))
"""Screens wait for each other, and nobody who signs in waits for them."""


@router.get("/wall/now", dependencies=[_IN_TURN])
def look(request: Request, session: SessionDep) -> Response:
    """The screen as it is now. A key that is no screen's is answered 401, no way to sign in: nobody does there.

    Raises `TooManyRequests`.
    """
    door: WallDoor = request.app.state.wall
    now = time.monotonic()
    screen = screens.screen_at(request, session)
    if screen is None:
        door.rate.call(request.client.host if request.client else "", now)
        return PlainTextResponse(_("This link does not open a wall screen, or was revoked."), 401)
    door.rate.call(screen, now)
    wall = door.wall(session)
    return page(
        request, "wall/now.html", wall=wall, since=written(wall.since, "%H:%M"), at=written(wall.at, "%H:%M:%S")
    )
