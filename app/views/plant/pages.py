"""Pages: the plant, and one machine of it."""

from datetime import UTC, datetime
from typing import Annotated, Any, Literal, NamedTuple

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session

from app.access.deps import require
from app.core.state import CharacteristicState
from app.loop.machines import queries as machines
from app.loop.maintenance.queries import running
from app.loop.notes import queries as notes
from app.loop.notes.queries import NEWEST
from app.quality.wear.queries import next_event
from app.quality.wear.wording import hunting_word
from app.views.characteristic import state_queries as queries
from app.views.characteristic.glance import band_picture, sparkline
from app.views.characteristic.state_queries import CharacteristicRow, Group
from app.views.characteristic.wording import state_word
from app.views.plant.connections import connections_of
from app.views.plant.trying_pages import trying
from app.web.deps import SessionDep, Word
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[require("viewer")])
Show = Annotated[Literal["all", "attention", "short"], Query()]

MOST = 300  # characteristics that the plant's page shows one by one
MOST_OF_A_MACHINE = 500


class MachineView(NamedTuple):
    """A machine with those of its characteristics that are shown, and how many are not."""

    group: Group
    rows: list[CharacteristicRow]
    folded: int


@router.get("/")
def plant_page(request: Request, session: SessionDep, show: Show = "all", done: Word = None) -> Response:
    """Every machine and characteristic."""
    return _page(request, session, show, None, done)


@router.get("/machines/{machine}")
def machine_home(request: Request, session: SessionDep, machine: str, show: Show = "all") -> Response:
    """The home of one machine: its state now, and the way to everything that belongs to it."""
    return _page(request, session, show, machine)


@router.get("/plant/{machine}")
def machine_page(request: Request, session: SessionDep, machine: str, show: Show = "all") -> Response:
    """The same; also the part of the plant's page that is fetched again when something happens to it (`short` if folded)."""
    return _page(request, session, show, machine)


@router.get("/plant-summary")
def summary(request: Request, session: SessionDep, show: Show = "all") -> Response:
    """Number of characteristics in each state, for the head of the plant's page."""
    groups = queries.plant(session, trends=False)
    return page(request, "plant/summary.html", **_summary(groups), show=show)


def _page(request: Request, session: Session, show: str, machine: str | None, done: str | None = None) -> Response:
    groups, now = queries.plant(session, machine=machine), datetime.now(UTC)
    if show == "all" and machine is None and sum(len(group.rows) for group in groups) > MOST:
        show = "short"
    return page(
        request,
        "plant/plant.html",
        groups=[_view(group, show, MOST_OF_A_MACHINE if machine else MOST // max(1, len(groups))) for group in groups],
        machine=groups[0].machine if machine else None,
        notes=notes.notes(session, machine_id=groups[0].machine.id, limit=NEWEST) if machine else [],
        maintenance=running(session, now, groups[0].machine.id) if machine else [],
        connections=connections_of(session, groups[0].machine) if machine else [],
        machines=machines.machines(session) if machine else [],
        show=show,
        done=done,
        trying=trying(session, empty=not groups),
        state_word=state_word,
        band=lambda row: band_picture(row.stream.last_deviation, row.parameters, None, row.average),
        spark=lambda row: sparkline(row.trend, row.parameters),
        next_event=lambda row: next_event(row.outlook),
        hunting_word=hunting_word,
        now=now,
        **_summary(groups),
    )


def _view(group: Group, show: str, most: int) -> MachineView:
    """Those that are asked for; those that need someone first where they are too many, or where `short` folds the others."""
    rows = [row for row in group.rows if show == "all" or row.needs_someone]
    if len(rows) > most:
        rows = sorted(rows, key=lambda row: not row.needs_someone)[:most]
    folded = 0 if show == "attention" else len(group.rows) - len(rows)
    return MachineView(group, rows, folded)


def _summary(groups: list[Group]) -> dict[str, Any]:
    """Count those that need attention, have nothing new, are OK, or wait for their first reading."""
    now = datetime.now(UTC)
    rows = [row for group in groups for row in group.rows]
    need = [row for row in rows if row.needs_someone]
    calm = [row for row in rows if not row.needs_someone]
    empty = [row for row in calm if row.state is CharacteristicState.NO_DATA]
    old = [row for row in calm if row.is_old(now)]
    return {
        "total": len(rows),
        "need": len(need),
        "old": len(old),
        "empty": len(empty),
        "calm": len(calm) - len(empty) - len(old),
    }
