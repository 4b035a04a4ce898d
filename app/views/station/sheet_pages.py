"""Pages: the measuring sheet of a machine, on which a person types the sizes of a part, at the station or signed in."""

from collections.abc import Mapping
from datetime import UTC, datetime
from secrets import token_hex

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import AtStation, Station
from app.errors import Conflict, InbandError
from app.language.i18n import _
from app.loop.control_plan import queries as control_plans
from app.loop.machines.queries import machine_named
from app.loop.readings.by_hand import sheet_actions as sheet
from app.loop.readings.wording import field_word
from app.views.station.who import REFUSED, asked, who
from app.web.deps import FormDep, SessionDep, Word
from app.web.paging import address
from app.web.templates import page

router = APIRouter(prefix="/station", include_in_schema=False)
NO_FORM: Mapping[str, str] = {}


@router.get("/{machine}/sizes")
def sheet_page(
    request: Request,
    session: SessionDep,
    at: Station,
    machine: str,
    of: Word = None,
    characteristic: Word = None,
    done: Word = None,
) -> Response:
    """The empty sheet: of a drawing (``of``) or of one characteristic; ``done``: the sheet that was stored just now."""
    at.must_act()
    return _sheet(request, session, at, machine, of, characteristic, done=done)


@router.post("/{machine}/sizes")
def send_sizes(request: Request, session: SessionDep, at: Station, machine: str, form: FormDep) -> Response:
    """Store the sizes as readings by hand; sent twice, they are stored once. What looks like a slip is asked about first."""
    at.must_act()
    of, only = form.get("of"), form.get("characteristic")
    named = machine_named(session, machine)
    shown = sheet.sheet_of(session, named, of, only)
    try:
        required = control_plans.required_on(session, named.id)
        found = sheet.filled(shown, form, "", datetime.now(UTC), required)
        if found.questions:
            return _sheet(request, session, at, machine, of, only, form=form, questions=found.questions)
        caller = who(request, session, at, form)
        found = sheet.filled(shown, form, caller.name, datetime.now(UTC), required)
        sheet.store(session, request.app.state.doors, request.app.state.writer, named, found, caller)
    except (*REFUSED, Conflict) as error:
        return _sheet(request, session, at, machine, of, only, form=form, error=error)
    return RedirectResponse(address(f"/station/{machine}/sizes", of=of, characteristic=only, done=form["key"]), 303)


def _sheet(
    request: Request,
    session: Session,
    at: AtStation,
    machine: str,
    of: str | None,
    only: str | None,
    *,
    done: str | None = None,
    form: Mapping[str, str] = NO_FORM,
    questions: Mapping[str, str] | None = None,
    error: InbandError | None = None,
) -> Response:
    named = machine_named(session, machine)
    shown = sheet.sheet_of(session, named, of, only)
    stored = sheet.stored_of(session, shown, done) if done else []
    kept = stored[0][2] if stored else {}
    required = control_plans.required_on(session, named.id)
    needed = {field for line in shown.lines for field in required.get(line.entry.characteristic, ())}
    return page(
        request,
        "station/sheet.html",
        refusal=error,
        status=422 if questions else 200,
        machine=named,
        sheet=shown,
        only=only,
        drawings=[
            (name or _("Without a drawing"), address(f"/station/{machine}/sizes", of=name), name == shown.drawing)
            for name in shown.drawings
        ],
        key=form.get("key") or token_hex(8),
        typed={field.value: kept.get(field.value) for field in sheet.SCANNED} | dict(form),
        scanned=[(field.value, field_word(field), field in needed) for field in sheet.SCANNED],
        stored=stored,
        questions=questions or {},
        address=address,
        **asked(session, at, form, error),
    )
