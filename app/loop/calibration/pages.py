"""Pages: every place that is calibrated, one place with its history and forms, and the second touch before a value is set."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer, require
from app.core.parameters import MOST_LOCATIONS
from app.errors import FieldError, Invalid, NotFound
from app.language.i18n import _
from app.loop.calibration import actions, form_reader, pairs, places, queries, single, verbs, wording
from app.loop.calibration.answers import calibration_out
from app.loop.calibration.queries import Place
from app.loop.calibration.schemas import CalibrationPlanIn, PairIn
from app.loop.calibration.verbs import OfPlace
from app.loop.characteristics import queries as characteristics
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.warnings.wording import sentence
from app.web import paging
from app.web.deps import FormDep, Number, SessionDep, Sought, Word
from app.web.forms import typed
from app.web.templates import page
from app.web.verb import Outcome, Verb, add_question_page

router = APIRouter(include_in_schema=False)
ON_PAGE = 25
MEMORIES = {"averages": "average", "probes": "tool"}


def address(machine: str, place: Place, **query: Any) -> str:
    """The page of a place."""
    folder = "averages" if place.memory == "average" else "probes"
    return paging.address(f"/calibration/{machine}/{folder}/{place.location}", **query)


@router.get("/calibration", dependencies=[require("viewer")])
def overview(
    request: Request,
    session: SessionDep,
    machine: Annotated[str | None, Query(max_length=64)] = None,
    after: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
    q: Sought = "",
) -> Response:
    """Machines and places: what was found last, and when the next calibration is places."""
    every = machines.machines(session)
    chosen = [machine_named(session, machine)] if machine else every
    chosen = [each for each in chosen if paging.holds(q, each.name, each.key)]
    link = partial(paging.address, "/calibration", q=q or None)
    part = paging.slice_of(chosen, ON_PAGE, 0 if machine else after, link)
    rows = places.places(session, part.rows)
    groups = [(machine, [row for row in rows if row.machine.id == machine.id]) for machine in part.rows]
    return page(
        request,
        "calibration/overview.html",
        groups=groups,
        machines=every,
        machine=machine,
        after=after,
        total=len(chosen),
        q=q,
        part=part,
        most_locations=MOST_LOCATIONS,
        wording=wording,
        address=address,
    )


@router.get("/calibration/probes", dependencies=[require("viewer")])
def choose_probe(
    session: SessionDep,
    machine: Annotated[str, Query(max_length=64)],
    tool: Annotated[int, Query(ge=1, le=MOST_LOCATIONS)],
) -> Response:
    """The page of the probe in this location of the tool memory."""
    return RedirectResponse(address(machine_named(session, machine).key, Place("tool", tool)), 303)


@router.get("/calibration/{machine}/{memory}/{location}")
def place_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: str,
    memory: str,
    location: int,
    before: Number = None,
    done: Word = None,
    n: Number = None,
) -> Response:
    """One place: its state, its history, the pairs, and the forms."""
    message = verbs.done(done, n) if done else None
    return _place(request, session, caller, machine, _of(memory, location), before=before, said=message)


@router.get("/calibration/{machine}/{memory}/{location}/{number}", dependencies=[require("viewer")])
def one(request: Request, session: SessionDep, machine: str, memory: str, location: int, number: int) -> Response:
    """One calibration: R42 to R49, its touches, and what it was made with."""
    machine_row, place = machine_named(session, machine), _of(memory, location)
    row = queries.calibration(session, machine_row, number)
    if (row.record.memory, row.record.location) != place:
        raise NotFound(wording.no_such_page(), wording.go_to_overview())
    return page(
        request,
        "calibration/calibration.html",
        machine=machine_row,
        place=place,
        calibration=row,
        results=single.results(row.record, calibration_out(row, machine_row.key).results),
        single=single,
        wording=wording,
        address=address,
    )


def _of(memory: str, location: int) -> Place:
    if memory not in MEMORIES:
        raise NotFound(wording.no_such_page(), wording.go_to_overview())
    return Place(MEMORIES[memory], location)


def _place(
    request: Request,
    session: Session,
    caller: Caller,
    machine: str,
    place: Place,
    *,
    before: int | None = None,
    said: str | None = None,
    late: bool = False,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    machine_row = machine_named(session, machine)
    value = queries.value_of(session, machine_row, place)
    row = places.place_row(session, machine_row, place, value)
    average = place.memory == "average"
    history = queries.calibrations(session, machine_row, place, before=before, newest_first=True, limit=ON_PAGE + 1)
    return page(
        request,
        "calibration/place.html" if average else "calibration/probe.html",
        status=error.status if error else 409 if late else 200,
        machine=machine_row,
        place=place,
        row=row,
        history=paging.part_of(
            history, ON_PAGE, before, lambda item: item.record.number, partial(address, machine, place)
        ),
        origin=queries.origin(session, machine_row, place.location) if average else None,
        suggestion=queries.suggestion(session, machine_row, place.location) if average else None,
        form=form_reader.filled_in(row, _limits(session, row)) | dict(form or {}),
        errors=form_reader.at_fields(error) if error else {},
        in_sections=form_reader.IN_SECTIONS,
        said=said,
        late=late,
        wording=wording,
        warned=sentence,
        address=address,
        may_plan=caller.may("engineer"),
    )


def _limits(session: Session, row: places.PlaceRow) -> dict[str, float]:
    """R33, R34, R36 and R28 of a characteristic that uses the location."""
    if not row.characteristics:
        return {}
    parameters = characteristics.characteristic_named(session, row.characteristics[0]).parameters
    return {name: getattr(parameters, name) for name in form_reader.LENGTHS}


@router.post("/calibration/{machine}/{memory}/{location}")
def enter(
    request: Request,
    session: SessionDep,
    caller: Operator,
    machine: str,
    memory: str,
    location: int,
    form: FormDep,
) -> Response:
    """A calibration typed in, pairs pasted, or a plan: `do` says which. All of it is taken, or nothing."""
    machine_row, place = machine_named(session, machine), _of(memory, location)
    queries.value_of(session, machine_row, place)
    verb, number = form.get("do", ""), None
    try:
        with session.begin_nested():
            if verb == "plan":
                caller.must("engineer")
                actions.set_plan(session, machine_row, place, typed(CalibrationPlanIn, form), caller)
            elif verb == "pairs" and place.memory == "average":
                number = _add_pairs(session, machine_row, location, form_reader.pairs(form), caller)
            elif place.memory == "average":
                gauge = form_reader.gauge(form, location)
                number = actions.calibrate_gauge(session, machine_row, gauge, caller).row.record.number
            else:
                ring = form_reader.ring(form, location)
                number = actions.calibrate_ring(session, machine_row, ring, caller).row.record.number
    except Invalid as error:
        return _place(request, session, caller, machine, place, form=form, error=error)
    done = verb if verb in {"plan", "pairs"} else "calibrated"  # whatever else the form said
    return RedirectResponse(address(machine, place, done=done, n=number), 303)


def _add_pairs(session: Session, machine: Any, location: int, given: list[PairIn], caller: Caller) -> int:
    try:
        return len(pairs.add_pairs(session, machine, location, given, caller))
    except NotFound as missing:  # a reading that is not there is a slip in a line, not a page that is not there
        raise Invalid(missing.detail, errors=[FieldError("lines", missing.detail)]) from None


def _place_of(session: SessionDep, caller: Operator, machine: str, memory: str, location: int, number: int) -> OfPlace:
    return OfPlace(session, machine_named(session, machine), _of(memory, location), number, caller)


def _around(on: OfPlace, _verb: Verb[OfPlace, Any]) -> dict[str, Any]:
    here = address(on.machine.key, on.place)
    trail = [(_("Calibration"), "/calibration"), (f"{on.machine.name}, {wording.place_words(on.place)}", here)]
    return {"machine": on.machine, "trail": trail, "back": here}


def _after(request: Request, on: OfPlace, verb: Verb[OfPlace, Any], outcome: Outcome) -> Response:
    """Anyone who comes too late sees the state now."""
    if outcome.kind == "late":
        return _place(request, on.session, on.caller, on.machine.key, on.place, said=outcome.refused, late=True)
    n = outcome.result.record.number if verb is verbs.SUGGESTION else on.number
    return RedirectResponse(address(on.machine.key, on.place, done=verb.name, n=n), 303)


add_question_page(
    router,
    "/calibration/{machine}/{memory}/{location}/{what}/{number}",
    verbs.PLACE,
    _place_of,
    around=_around,
    after=_after,
    astray=wording.go_to_overview,
)
