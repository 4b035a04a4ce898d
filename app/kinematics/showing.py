"""The page of a machine and that of a run, as they answer when looked at and when something could not be done."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from fastapi import Request, Response
from sqlalchemy.orm import Session

from app.errors import Invalid
from app.kinematics import forms, looking, queries, wording
from app.kinematics.answers import parameters_of
from app.kinematics.queries import RunRow
from app.kinematics.values import UNITS, errors_of
from app.machines.queries import machine_named
from app.web.deps import Caller
from app.web.templates import page

ON_PAGE = 25


def machine_url(machine: str, **query: Any) -> str:
    """The page of a machine."""
    given = {name: value for name, value in query.items() if value is not None}
    return f"/kinematics/machines/{machine}" + (f"?{urlencode(given)}" if given else "")


def compare_url(run: int, other: int) -> str:
    """Two runs in one picture."""
    return f"/kinematics/compare?{urlencode({'run': run, 'with': other})}"


COMMON: dict[str, Any] = {
    "wording": wording,
    "units": UNITS,
    "machine_url": machine_url,
    "compare_url": compare_url,
    "days_left": looking.days_left,
    "in_order": looking.in_order,
}


def shown_machine(
    request: Request,
    session: Session,
    caller: Caller,
    machine: str,
    *,
    head: str | None = None,
    value: str | None = None,
    before: int | None = None,
    said: str | None = None,
    late: bool = False,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    """The page of a machine. late: somebody else was first; form, error: what was typed, and what is wrong with it."""
    shown = machine_named(session, machine)
    row = looking.machine_row(session, shown)
    reference = row.plan.reference_head or ""
    heads = list(row.heads)
    if head not in row.heads:
        latest = row.newest.run.head if row.newest else ""
        head = reference if reference in row.heads else latest if latest in row.heads else (heads or [""])[0]
    head = head or ""
    drifts = row.drifts.get(head, [])
    if not any(each.name == value for each in drifts):
        value = looking.first_to_see(drifts)
    runs = queries.runs(session, shown.id, before=before, newest_first=True, limit=ON_PAGE + 1)
    kept = queries.backups(session, shown.id)
    current = {each.head: each for each in kept}
    standard = row.heads.get(reference)
    return page(
        request,
        "kinematics/machine.html",
        status=error.status if error else 409 if late else 200,
        machine=shown,
        row=row,
        head=head,
        reference=reference,
        heads=[(name, each, looking.changes(standard, each) if standard else []) for name, each in row.heads.items()],
        standard=standard,
        drifts=drifts,
        value=value,
        chosen=next((each for each in drifts if each.name == value), None),
        runs=runs[:ON_PAGE],
        older=machine_url(machine, head=head, before=runs[ON_PAGE - 1].run.id) if len(runs) > ON_PAGE else None,
        newest=machine_url(machine, head=head) if before else None,
        backups=list(reversed(kept)),
        in_effect={each.version for each in current.values()},
        same={each.version for each in kept if queries.alike(each.errors, current[each.head].errors)},
        form=forms.filled_in(row.plan) | dict(form or {}),
        errors=forms.at_fields(error, {}) if error else {},
        said=said,
        late=late,
        may_plan=caller.may("engineer"),
        may_take=caller.may("operator"),
        **COMMON,
    )


def shown_run(
    request: Request, session: Session, caller: Caller, number: int, *, said: str | None = None, late: bool = False
) -> Response:
    """The page of a run. late: somebody else was first."""
    row = queries.run(session, number)
    others = others_of(session, row)
    standing = queries.in_force(queries.course(session, row.machine.id, row.run.head))
    undoable = row.status == "entered" and bool(standing) and standing[-1].run == number
    return page(
        request,
        "kinematics/run.html",
        status=409 if late else 200,
        row=row,
        run=row.run,
        results=looking.surer(row.run.results),
        stated=row.run.form == "protocol",
        errors=looking.in_order(errors_of(row.run.results)),
        entering=looking.to_enter(row),
        parameters=parameters_of(row.run.results),
        others=others,
        earlier=looking.earlier(row, others),
        said=said,
        late=late,
        may_take=caller.may("operator"),
        may_undo=undoable and caller.may("engineer"),
        taken_back=row.status == "entered" and not undoable and not any(each.run == number for each in standing),
        **COMMON,
    )


def others_of(session: Session, row: RunRow) -> list[RunRow]:
    """What a run can be compared with, newest first."""
    found = queries.runs(session, row.machine.id, newest_first=True, limit=100)
    return [each for each in found if each.run.id != row.run.id and each.run.outcome != "refused"]
