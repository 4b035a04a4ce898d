"""Page: drift of a characteristic by temperature, and its thermal expansion."""

from collections.abc import Mapping
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer
from app.core.drift import Column, Drift
from app.core.temperature import Expansion
from app.errors import Invalid
from app.loop.characteristics.queries import characteristic_named
from app.loop.expansion.actions import ExpansionIn, set_expansion
from app.loop.expansion.queries import row_of
from app.quality.temperature import queries, wording
from app.web.deps import FormDep, SessionDep, Word
from app.web.forms import typed
from app.web.templates import page

router = APIRouter(include_in_schema=False)
Of = Annotated[Literal["part", "machine"] | None, Query()]


@router.get("/characteristics/{characteristic}/temperature")
def temperature_page(
    request: Request, session: SessionDep, caller: Viewer, characteristic: str, of: Of = None, done: Word = None
) -> Response:
    """The drift by a kelvin with its confidence, and what is stated of the expansion."""
    return _page(request, session, caller, characteristic, of=of, done=bool(done))


@router.post("/characteristics/{characteristic}/temperature")
def send_expansion(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep
) -> Response:
    """State the expansion as it was typed. A field left empty states nothing."""
    try:
        set_expansion(session, characteristic, typed(ExpansionIn, form), caller)
    except Invalid as error:
        return _page(request, session, caller, characteristic, form=form, error=error)
    return RedirectResponse(f"/characteristics/{characteristic}/temperature?done=1", 303)


def _page(
    request: Request,
    session: Session,
    caller: Caller,
    key: str,
    *,
    of: Literal["part", "machine"] | None = None,
    done: bool = False,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    current = characteristic_named(session, key)
    study = queries.study_of(session, current, of=of)
    drift = study.drift if isinstance(study.drift, Drift) else None
    return page(
        request,
        "temperature/temperature.html",
        refusal=error,
        characteristic=current.characteristic,
        study=study,
        drift=drift,
        slope=drift.regression.effects.get(Column.TEMPERATURE.value) if drift else None,
        row=row_of(session, current.machine.id, current.characteristic.id),
        form=form if form is not None else _as_typed(study.expansion),
        may_state=caller.may("engineer"),
        done=done,
        words=wording,
        usual=queries.USUAL,
    )


def _as_typed(expansion: Expansion) -> dict[str, str]:
    stated = {name: getattr(expansion, name) for name in Expansion.__dataclass_fields__}
    return {name: repr(value).removesuffix(".0") for name, value in stated.items() if value is not None}
