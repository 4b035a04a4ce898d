"""Pages above all plants: the overview, and signing in to every plant that one belongs to."""

import asyncio
import logging
from typing import NamedTuple

from fastapi import APIRouter, Depends, Request
from psycopg import Error
from sqlalchemy.exc import SQLAlchemyError
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from app.access import queries as people
from app.access.sign_in import SignedIn, SignInRefused, knows, sign_in
from app.db.engine import Database
from app.errors import InbandError, NotFound
from app.language.i18n import _
from app.plants.prefix import cookies_of
from app.plants.serving import Plants, Served
from app.plants.summary_queries import Summary, summary
from app.web.deps import IN_TURN, SESSION_COOKIE, FormDep, SettingsDep, from_this_site, keep_cookie
from app.web.limits import FEW, takes
from app.web.problems import is_for_programs
from app.web.templates import page

router = APIRouter(include_in_schema=False)
log = logging.getLogger(__name__)


class Row(NamedTuple):
    """A plant on the overview. person: who is signed in there; summary: None if nobody is, or the plant does not answer."""

    name: str
    address: str
    person: str | None
    summary: Summary | None
    answers: bool


@router.get("/plants")
async def plants_page(request: Request) -> Response:
    """Every plant with its alarms, its tasks and its connections, as far as one is signed in there."""
    return await _page(request)


@router.post("/plants/sign-in", dependencies=[Depends(from_this_site), IN_TURN])
@takes(FEW, by="anybody")
async def send_sign_in(request: Request, form: FormDep, settings: SettingsDep) -> Response:
    """Sign in to every plant in which there is a person of this name with this password."""
    name, password = form.get("name", ""), form.get("password", "")
    address = request.client.host if request.client else "unknown"
    plants: Plants = request.app.state.plants
    answer = RedirectResponse("/plants", 303)
    refusal: InbandError | None = None
    signed_in = False
    reachable = [each for each in plants.served if each.plant.prefix]
    knowing = [each for each in reachable if await run_in_threadpool(_knows, each, name)]
    for each in knowing or reachable[:1]:  # a name that is unknown everywhere counts as a failure all the same
        try:
            session = await run_in_threadpool(_sign_in, each, name, password, address)
        except InbandError as error:
            refusal = error if refusal is None or isinstance(refusal, SignInRefused) else refusal
            continue
        signed_in = True
        name_of = f"{SESSION_COOKIE}.{each.plant.key}"
        keep_cookie(answer, settings, name_of, session.token, settings.session_hours * 3600)
    if signed_in or refusal is None:
        return answer
    return await _page(request, name=name, refusal=refusal)


@router.get("/{path:path}")
async def elsewhere(path: str) -> Response:
    """Lead every other address to the overview, there being no plant at the root. Raises `NotFound` for programs."""
    if is_for_programs(f"/{path}"):
        if path.startswith("p/"):
            raise NotFound(_("There is no plant {key} on this server.").format(key=repr(path.split("/")[1][:64])))
        raise NotFound(
            _("There is no plant at the root of this server."),
            _("Write the plant before the path: /p/PLANT/{path}.").format(path=path),
        )
    return RedirectResponse("/plants", 303)


def _database(served: Served) -> Database:
    database: Database = served.application.app.state.database
    return database


def _knows(served: Served, name: str) -> bool:
    try:
        return knows(_database(served), name)
    except (SQLAlchemyError, Error):
        return False


def _sign_in(served: Served, name: str, password: str, address: str) -> SignedIn:
    return sign_in(_database(served), name, password, address, served.settings.session_hours)


async def _page(request: Request, name: str = "", refusal: InbandError | None = None) -> Response:
    plants: Plants = request.app.state.plants
    tokens = cookies_of(request.headers.get("cookie", ""), SESSION_COOKIE, [each.plant.key for each in plants.served])
    rows = await asyncio.gather(*(run_in_threadpool(_row, each, tokens.get(each.plant.key)) for each in plants.served))
    return page(
        request,
        "plants/plants.html",
        refusal=refusal,
        rows=rows,
        not_served=[plant.name for plant in plants.not_served],
        signed_in=any(row.person for row in rows),
        everywhere=all(row.person for row in rows),
        name=name,
    )


def _row(served: Served, token: str | None) -> Row:
    plant = served.plant
    address = f"{plant.prefix}/" if plant.prefix else f"{served.settings.address}/"
    try:
        with _database(served).begin() as session:
            browser = people.signed_in(session, token, {}) if token else None
            known = browser.caller.name if browser else None
            return Row(plant.name, address, known, summary(session) if browser else None, answers=True)
    except (SQLAlchemyError, Error) as error:
        log.warning("plant %s does not answer: %s", plant.key, error)
        return Row(plant.name, address, None, None, answers=False)
