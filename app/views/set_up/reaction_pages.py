"""Set-up pages: reaction plans with pictures and versions, and the catalogue of causes and corrective actions."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

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
from app.web.forms import by_field, of_lists, parsed, typed
from app.web.limits import MEGABYTE, takes
from app.web.pictures import FilesDep, SentFile, pictures_of

router = APIRouter(include_in_schema=False)
SPARE = 3  # empty steps at the end of the form
MOST = 32 * MEGABYTE  # of a form with its pictures
OF_STEP = re.compile(r"steps\[(\d+)\]\.(text|picture\.alt|picture)")


@router.get("/setup/reactions")
def reactions_page(
    request: Request, session: SessionDep, caller: Engineer, sort: Literal["cause", "action"] = "cause"
) -> Response:
    """Plans and catalogue. sort: what was added last, for mostly another one follows."""
    return _overview(request, session, caller, {"sort": sort})


@router.post("/setup/reactions/catalogue")
def send_entry(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    """Add a cause or a corrective action."""
    try:
        with session.begin_nested():
            row = actions.add_entry(session, typed(CatalogueEntryIn, form), caller)
    except InbandError as error:
        return _overview(request, session, caller, form, error)
    return RedirectResponse(f"/setup/reactions?done=added&sort={row.sort}#catalogue", 303)


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
        refusal=error,
        plans=plans_in_force(session),
        entries=sorted(entries, key=lambda entry: (entry.sort != "cause", entry.retired_at is not None, entry.name)),
        names={row.id: row.name for row in notifications.receivers(session)},
        typed=form or {},
        words=wording,
    )


@router.get("/setup/reactions/new")
def new_plan(request: Request, session: SessionDep, caller: Engineer) -> Response:
    return _plan(request, session, caller, {"reason": _("First version")})


@router.post("/setup/reactions/new")
@takes(MOST, by="engineer", pictures=True)
def send_new_plan(request: Request, session: SessionDep, caller: Engineer, form: FormDep, files: FilesDep) -> Response:
    return _send(request, session, caller, form, files)


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
@takes(MOST, by="engineer", pictures=True)
def send_plan(
    request: Request, session: SessionDep, caller: Engineer, plan: int, form: FormDep, files: FilesDep
) -> Response:
    return _send(request, session, caller, form, files, plan)


def _send(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str],
    files: list[SentFile],
    number: int | None = None,
) -> Response:
    """Write a version. A form that has to be corrected keeps its pictures: they are stored before."""
    done = "added" if number is None else "changed"
    row = None if number is None else queries.plan(session, number)
    try:
        form = _with_pictures(session, form, files, caller)
        if form.get("do") == "more":
            return _plan(request, session, caller, form, row, more=SPARE)
        with session.begin_nested():
            given = parsed(ReactionPlanIn, _read(form))
            if row is None:
                actions.add_plan(session, given, caller)
            elif form.get("do") == "withdraw":
                actions.withdraw_plan(session, row.id, given.reason, caller)
            else:
                actions.change_plan(session, row.id, given, caller)
    except InbandError as error:
        return _plan(request, session, caller, form, row, error)
    return RedirectResponse(f"/setup/reactions?done={done}", 303)


def _with_pictures(
    session: Session, form: Mapping[str, str], files: list[SentFile], caller: Caller
) -> Mapping[str, str]:
    if not files:
        return form
    session.commit()  # nothing is kept open while pictures are read
    digests = {
        field.removeprefix("picture-"): actions.add_picture(session, picture, caller).row.digest
        for field, picture in pictures_of(files, MOST_STEPS)
    }
    session.commit()
    return {
        **form,
        **{f"digest-{at}": digest for at, digest in digests.items()},
        **{f"without-{at}": "" for at in digests},
    }


def _plan(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str],
    row: Any = None,
    error: InbandError | None = None,
    more: int = 0,
) -> Response:
    places = _places(form)

    def at(field: str, message: str) -> tuple[str, str]:
        found = OF_STEP.match(field)
        if found is None or int(found[1]) >= len(places):
            return field, message
        name = {"text": "step", "picture.alt": "alt"}.get(found[2], "picture")
        return f"{name}-{places[int(found[1])]}", message

    errors = by_field(error, at) if error else {}
    shown = form.get("shown", "")
    steps = max(
        places[-1] + SPARE if places else SPARE, int(shown) + more if shown.isdecimal() and len(shown) < 3 else 0
    )
    return setup_page(
        request,
        "reaction_plan.html",
        caller,
        "reactions",
        refusal=error,
        row=row,
        versions=queries.versions(session, row.id) if row else [],
        form=form,
        errors=errors,
        other_errors=of_lists(errors, {"steps": _("Steps"), "receivers": _("Who must be notified")}),
        kinds=sorted(((kind.name, kind.word()) for kind in kinds()), key=lambda kind: kind[1]),
        rules=[(rule.value, rule_name(rule)) for rule in RuleName],
        characteristics=[
            (each.characteristic.key, f"{each.characteristic.name} · {each.machine.name}")
            for each in characteristics.characteristics(session)
        ],
        receivers=notifications.receivers(session),
        steps=range(1, min(steps, MOST_STEPS) + 1),
        most_steps=MOST_STEPS,
        words=wording,
    )


def _read(form: Mapping[str, str]) -> dict[str, Any]:
    """The form of a plan as the API has it."""
    return {
        **{name: form.get(name, "") for name in ("name", "characteristic", "kind", "rule", "reason")},
        **{name: form.get(name) == "true" for name in ("cause_needed", "action_needed")},
        "steps": [_step(form, at) for at in _places(form)],
        "receivers": [
            int(field[9:])
            for field, value in form.items()
            if value and field[:9] == "receiver-" and field[9:].isdecimal()
        ],
    }


def _places(form: Mapping[str, str]) -> list[int]:
    """The steps that are filled in, by their place in the form."""
    return [at for at in range(1, MOST_STEPS + 1) if form.get(f"step-{at}", "").strip() or _digest(form, at)]


def _digest(form: Mapping[str, str], at: int) -> str:
    return "" if form.get(f"without-{at}") == "true" else form.get(f"digest-{at}", "")


def _step(form: Mapping[str, str], at: int) -> dict[str, Any]:
    step: dict[str, Any] = {"text": form.get(f"step-{at}", "").strip()}
    digest = _digest(form, at)
    return step | ({"picture": {"digest": digest, "alt": form.get(f"alt-{at}", "")}} if digest else {})


def _fields(row: Any) -> dict[str, str]:
    """The form of a stored version."""
    fields = {name: getattr(row, name) or "" for name in ("name", "characteristic", "kind", "rule")}
    fields |= {name: "true" for name in ("cause_needed", "action_needed") if getattr(row, name)}
    fields |= {f"step-{at}": step["text"] for at, step in enumerate(row.steps, 1)}
    for at, step in enumerate(row.steps, 1):
        if step.get("picture"):
            fields |= {f"digest-{at}": step["picture"]["digest"], f"alt-{at}": step["picture"]["alt"]}
    return fields | {f"receiver-{number}": "true" for number in row.receivers}
