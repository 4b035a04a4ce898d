"""Page: what a machine works at, scanned or typed at its station."""

from collections.abc import Mapping

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import AtStation, Station
from app.core.context import ContextField
from app.errors import InbandError
from app.loop.machines.queries import machine_named
from app.loop.present_context import actions
from app.loop.present_context.queries import present_of
from app.loop.present_context.schemas import PresentContextIn
from app.loop.readings.wording import field_word
from app.views.station.who import REFUSED, asked, who
from app.web.deps import FormDep, SessionDep, Word
from app.web.forms import typed
from app.web.templates import page

router = APIRouter(prefix="/station", include_in_schema=False)
NO_FORM: Mapping[str, str] = {}


@router.get("/{machine}/context")
def context_page(request: Request, session: SessionDep, at: Station, machine: str, done: Word = None) -> Response:
    """The present context, to scan the next order over it."""
    at.must_act()
    return _page(request, session, at, machine, done=bool(done))


@router.post("/{machine}/context")
def send_context(request: Request, session: SessionDep, at: Station, machine: str, form: FormDep) -> Response:
    """Set it as it was typed; an empty field is not known."""
    at.must_act()
    try:
        given = typed(PresentContextIn, form)
        actions.set_present(session, machine, given, who(request, session, at, form))
    except REFUSED as error:
        return _page(request, session, at, machine, form=form, error=error)
    return RedirectResponse(f"/station/{machine}/context?done=1", 303)


def _page(
    request: Request,
    session: Session,
    at: AtStation,
    machine: str,
    *,
    done: bool = False,
    form: Mapping[str, str] = NO_FORM,
    error: InbandError | None = None,
) -> Response:
    named = machine_named(session, machine)
    row = present_of(session, named.id)
    said = {name: str(value) for name, value in (row.context if row else {}).items()}
    return page(
        request,
        "station/context.html",
        refusal=error,
        machine=named,
        row=row,
        fields=[(field.value, field_word(field)) for field in ContextField],
        typed=said if error is None else form,
        done=done,
        **asked(session, at, form, error),
    )
