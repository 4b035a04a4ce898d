"""Page: the editor that freezes a baseline."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.datastructures import FormData, UploadFile
from starlette.responses import RedirectResponse

from app.access.deps import Engineer
from app.core.spc.quantity import Quantity
from app.errors import Conflict, Invalid
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import wording as statistics_wording
from app.quality.baselines import actions, form_reader, queries, wording
from app.quality.baselines.draft_queries import Draft, draft_of, suited
from app.quality.baselines.schemas import BaselineIn, PeriodIn
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web.choice import Choice, ChosenOnPage
from app.web.deps import FormDep, SessionDep, texts
from app.web.forms import parsed
from app.web.templates import page

router = APIRouter(include_in_schema=False)


@router.get("/characteristics/{characteristic}/control/freeze")
def freeze_page(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, choice: ChosenOnPage
) -> Response:
    """Choose a period, see what its baseline would be, and freeze it. What is chosen is in the address."""
    del caller
    current = characteristics.characteristic_named(session, characteristic)
    return _freeze(request, session, current, choice, texts_of(request))


def texts_of(request: Request) -> dict[str, str]:
    """The text fields of the address."""
    return texts(FormData(list[tuple[str, str | UploadFile]](request.query_params.multi_items())))


def _freeze(
    request: Request,
    session: Session,
    current: CurrentCharacteristic,
    choice: Choice,
    form: Mapping[str, str],
    error: Invalid | Conflict | None = None,
) -> Response:
    key = current.characteristic.key
    suits = suited(session, current)
    draft: Draft | None = None
    chosen = bool(form.get("first_sequence") or form.get("last_sequence"))
    typed = (
        form_reader.begun(None) | {"quantity": suits.value, "chart": "individuals", "ewma_exact": "true"} | dict(form)
    )
    if chosen:
        try:
            draft = draft_of(session, current, parsed(PeriodIn, form_reader.period(typed)))
        except Invalid as wrong:
            error = error or wrong
    return page(
        request,
        "baselines/freeze.html",
        refusal=error,
        machine=current.machine,
        characteristic=current.characteristic,
        choice=choice,
        draft=draft,
        seen_version=queries.newest_version(session, current.characteristic),
        suits=suits,
        typed=typed,
        fields=form_reader.FIELDS,
        limits_said=any(name.startswith("limits.") and text for name, text in typed.items()),
        errors=form_reader.at_fields(error) if error else {},
        quantities=list(Quantity),
        figure=f"/api/v1/characteristics/{key}/figures/baseline?{urlencode(_pictured(typed, choice))}",
        link=lambda last: f"/characteristics/{key}/control/freeze?{urlencode({**form, 'last': last})}",
        wording=wording,
        said=statistics_wording,
        proof_failing=proof.failing(),
        proof_warning=proof_wording.warning(len(proof.failing())),
    )


def _pictured(typed: Mapping[str, str], choice: Choice) -> dict[str, Any]:
    """Request for the picture: as much of the form as can be understood."""
    try:
        period = parsed(PeriodIn, form_reader.period(typed))
    except Invalid:
        known = typed.get("quantity") in set(Quantity)
        return choice.query | ({"quantity": typed["quantity"]} if known else {})
    names = ("chart", "grouping", "group_size", "group_pause", "settle", "first_sequence", "last_sequence")
    pooled = {"pooled": "true"} if period.pooled else {}
    values = (
        {name: getattr(period, name) for name in names}
        | pooled
        | ({} if period.limits is None else period.limits.model_dump())
        | {
            "quantity": period.quantity.value,
            "excluded": ",".join(f"{run.first}-{run.last}" for run in period.excluded),
        }
    )
    return choice.query | {name: value for name, value in values.items() if value not in (None, "")}


@router.post("/characteristics/{characteristic}/control/freeze")
def freeze(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, choice: ChosenOnPage, form: FormDep
) -> Response:
    """Freeze what was previewed, with a reason."""
    current = characteristics.characteristic_named(session, characteristic)
    try:
        with session.begin_nested():
            seen = form.get("seen_version", "")
            seen_version = int(seen) if seen.isdecimal() and len(seen) < 10 else None
            more = {"reason": form.get("reason"), "seen_version": seen_version}
            actions.freeze(session, current, parsed(BaselineIn, form_reader.period(form) | more), caller)
    except (Invalid, Conflict) as error:
        return _freeze(request, session, current, choice, form, error)
    return RedirectResponse(f"/characteristics/{current.characteristic.key}/control", 303)
