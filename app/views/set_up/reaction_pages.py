"""Set-up pages: reaction plans with their versions, and the catalogue of causes and corrective actions."""

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer
from app.core.spc.rules import RuleName
from app.errors import InbandError
from app.language.i18n import _
from app.loop.alarm_response.reaction_queries import plans_in_force
from app.loop.alarms.kinds import kinds
from app.loop.characteristics import queries as characteristics
from app.loop.notifications import queries as notifications
from app.loop.reactions import actions, queries, wording
from app.loop.reactions.schemas import MOST_STEPS, CatalogueEntryIn, ReactionPlanIn
from app.loop.summaries.wording import rule_name
from app.views.set_up.frame import setup_page
from app.web.deps import FormDep, SessionDep
from app.web.forms import by_field, parsed, typed

router = APIRouter(include_in_schema=False)
SPARE = 3  # empty steps at the end of the form


@router.get("/setup/reactions")
def reactions_page(request: Request, session: SessionDep, caller: Engineer) -> Response:
    return _overview(request, session, caller)


@router.post("/setup/reactions/catalogue")
def send_entry(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    """Add a cause or a corrective action."""
    try:
        with session.begin_nested():
            actions.add_entry(session, typed(CatalogueEntryIn, form), caller)
    except InbandError as error:
        return _overview(request, session, caller, form, error)
    return RedirectResponse("/setup/reactions?done=added#catalogue", 303)


@router.post("/setup/reactions/catalogue/{entry}")
def send_retired(session: SessionDep, caller: Engineer, entry: int, form: FormDep) -> Response:
    """Offer an entry no more, or again."""
    actions.retire_entry(session, entry, form.get("retired") == "true", caller)
    return RedirectResponse("/setup/reactions?done=changed#catalogue", 303)


def _overview(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
) -> Response:
    entries = queries.catalogue(session)
    return setup_page(
        request,
        "reactions.html",
        caller,
        "reactions",
        status=error.status if error else 200,
        plans=plans_in_force(session),
        entries=sorted(entries, key=lambda entry: (entry.sort != "cause", entry.retired_at is not None, entry.name)),
        names={row.id: row.name for row in notifications.receivers(session)},
        typed=form or {},
        errors=by_field(error) if error else {},
        problem=error if error and not error.errors else None,
        words=wording,
    )


@router.get("/setup/reactions/new")
def new_plan(request: Request, session: SessionDep, caller: Engineer) -> Response:
    return _plan(request, session, caller, {"reason": _("First version")})


@router.post("/setup/reactions/new")
def send_new_plan(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    return _send(request, session, caller, form)


@router.get("/setup/reactions/{plan}")
def plan_page(
    request: Request,
    session: SessionDep,
    caller: Engineer,
    plan: int,
    version: Annotated[int | None, Query(ge=1, le=2_147_483_647)] = None,
) -> Response:
    """The form of a plan with its versions; a version before, or one that is withdrawn, to make the next one of."""
    row = queries.plan(session, plan, version)
    return _plan(request, session, caller, _fields(row), row)


@router.post("/setup/reactions/{plan}")
def send_plan(request: Request, session: SessionDep, caller: Engineer, plan: int, form: FormDep) -> Response:
    return _send(request, session, caller, form, queries.plan(session, plan))


def _send(request: Request, session: Session, caller: Caller, form: Mapping[str, str], row: Any = None) -> Response:
    done = "added" if row is None else "changed"
    try:
        with session.begin_nested():
            if row is None:
                actions.add_plan(session, parsed(ReactionPlanIn, _read(form)), caller)
            elif form.get("do") == "withdraw":
                given = parsed(ReactionPlanIn, _read(form))
                actions.withdraw_plan(session, row.id, given.reason, caller)
            else:
                actions.change_plan(session, row.id, parsed(ReactionPlanIn, _read(form)), caller)
    except InbandError as error:
        return _plan(request, session, caller, form, row, error)
    return RedirectResponse(f"/setup/reactions?done={done}", 303)


def _plan(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str],
    row: Any = None,
    error: InbandError | None = None,
) -> Response:
    errors = by_field(error) if error else {}
    steps = max(
        (int(name[5:]) for name, text in form.items() if name[:5] == "step-" and name[5:].isdecimal() and text),
        default=0,
    )
    return setup_page(
        request,
        "reaction_plan.html",
        caller,
        "reactions",
        status=error.status if error else 200,
        row=row,
        versions=queries.versions(session, row.id) if row else [],
        form=form,
        errors=errors,
        other_errors=[text for field, text in errors.items() if field.startswith(("steps", "receivers"))],
        problem=error if error and not error.errors else None,
        kinds=sorted(((kind.name, kind.word()) for kind in kinds()), key=lambda kind: kind[1]),
        rules=[(rule.value, rule_name(rule)) for rule in RuleName],
        characteristics=[
            (each.characteristic.key, f"{each.characteristic.name} · {each.machine.name}")
            for each in characteristics.characteristics(session, limit=100_000)
        ],
        receivers=notifications.receivers(session),
        steps=range(1, min(steps + SPARE, MOST_STEPS) + 1),
        words=wording,
    )


def _read(form: Mapping[str, str]) -> dict[str, Any]:
    """The form of a plan as the API has it."""
    return {
        **{name: form.get(name, "") for name in ("name", "characteristic", "kind", "rule", "reason")},
        **{name: form.get(name) == "true" for name in ("cause_needed", "action_needed")},
        "steps": [{"text": text} for at in range(1, MOST_STEPS + 1) if (text := form.get(f"step-{at}", "").strip())],
        "receivers": [
            int(field[9:])
            for field, value in form.items()
            if value and field[:9] == "receiver-" and field[9:].isdecimal()
        ],
    }


def _fields(row: Any) -> dict[str, str]:
    """The form of a stored version."""
    fields = {name: getattr(row, name) or "" for name in ("name", "characteristic", "kind", "rule")}
    fields |= {name: "true" for name in ("cause_needed", "action_needed") if getattr(row, name)}
    fields |= {f"step-{at}": step["text"] for at, step in enumerate(row.steps, 1)}
    return fields | {f"receiver-{number}": "true" for number in row.receivers}
