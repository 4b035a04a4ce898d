"""Page: the control plan of a characteristic, its state, and the measurements that were missed."""

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer
from app.core.context import ContextField
from app.core.control_plan import Plan
from app.errors import Invalid
from app.loop.characteristics.queries import characteristic_named
from app.loop.control_plan import actions, queries, wording
from app.loop.control_plan.schemas import ControlPlanIn
from app.loop.readings.wording import field_word
from app.web.deps import Before, FormDep, SessionDep, Word
from app.web.forms import typed
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 25


@router.get("/characteristics/{characteristic}/control-plan")
def control_plan_page(
    request: Request, session: SessionDep, caller: Viewer, characteristic: str, before: Before = None, done: Word = None
) -> Response:
    """The plan as a form, its state now, and what was missed, the last first."""
    return _page(request, session, caller, characteristic, before=before, done=bool(done))


@router.post("/characteristics/{characteristic}/control-plan")
def set_control_plan(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep
) -> Response:
    """Set the plan as it was typed. A field left empty asks for nothing."""
    try:
        required = [field for field in ContextField if form.get(f"required_context.{field.value}") == "true"]
        actions.set_plan(session, characteristic, typed(ControlPlanIn, form, required_context=required), caller)
    except Invalid as error:
        return _page(request, session, caller, characteristic, form=form, error=error)
    return RedirectResponse(f"/characteristics/{characteristic}/control-plan?done=1", 303)


def _page(
    request: Request,
    session: Session,
    caller: Caller,
    key: str,
    *,
    before: int | None = None,
    done: bool = False,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    current = characteristic_named(session, key)
    row = queries.plan_of(session, current)
    plan = queries.stated(row)
    rows = queries.missed(session, characteristic=current.characteristic, before=before, limit=ON_PAGE + 1)
    link = partial(address, f"/characteristics/{key}/control-plan")
    return page(
        request,
        "control_plan/control_plan.html",
        refusal=error,
        characteristic=current.characteristic,
        machine=current.machine,
        row=row,
        plan=plan,
        look=queries.look(session, row) if row and plan.asks else None,
        lacking=queries.lacking(session, row) if row and plan.required_context else None,
        context_fields=[(f"required_context.{field.value}", field_word(field)) for field in ContextField],
        lately=queries.missed_lately(session, current.characteristic, datetime.now(UTC)),
        part=part_of(rows, ON_PAGE, before, lambda each: each.missed.id, link),
        form=form if form is not None else _as_typed(plan),
        may_plan=caller.may("engineer"),
        done=done,
        words=wording,
    )


def _as_typed(plan: Plan) -> dict[str, str]:
    """The plan as its form has it; what it does not ask for is left empty."""
    numbers = [name for name in Plan.__dataclass_fields__ if name != "required_context"]
    said = {name: value for name in numbers if (value := getattr(plan, name))}
    typed_as = {name: "true" if value is True else f"{value:g}" for name, value in said.items()}
    return typed_as | {f"required_context.{field.value}": "true" for field in plan.required_context}
