"""The page of a machine and that of a run, as they answer when looked at and when something could not be done."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from fastapi import Request, Response
from sqlalchemy.orm import Session

from app.access.deps import Caller
from app.errors import Invalid
from app.geometry.rotary_axes import form_reader, queries, run_history, wording
from app.geometry.rotary_axes.answers import parameters_of
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.result_values import UNITS, errors_of
from app.loop.machines.queries import machine_named
from app.web.paging import address, part_of
from app.web.templates import page

ON_PAGE = 25


def machine_url(machine: str, **query: Any) -> str:
    """The page of a machine."""
    return address(f"/kinematics/machines/{machine}", **query)


def compare_url(run: int, other: int) -> str:
    """Two runs in one picture."""
    return address("/kinematics/compare", **{"run": run, "with": other})


COMMON: dict[str, Any] = {
    "wording": wording,
    "units": UNITS,
    "machine_url": machine_url,
    "compare_url": compare_url,
    "days_left": run_history.days_left,
    "in_order": run_history.in_order,
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
    message: str | None = None,
    late: bool = False,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    """The page of a machine. late: someone else was first; form, error: what was typed, and what is wrong with it."""
    machine_shown = machine_named(session, machine)
    row = run_history.machine_row(session, machine_shown)
    reference = row.plan.reference_head or ""
    heads = list(row.heads)
    if head not in row.heads:
        latest = row.newest.run.head if row.newest else ""
        head = reference if reference in row.heads else latest if latest in row.heads else (heads or [""])[0]
    head = head or ""
    drifts = row.drifts.get(head, [])
    if not any(item.name == value for item in drifts):
        value = run_history.first_to_see(drifts)
    runs = queries.runs(session, machine_shown.id, before=before, newest_first=True, limit=ON_PAGE + 1)
    versions = queries.backups(session, machine_shown.id)
    current = {item.head: item for item in versions}
    standard = row.heads.get(reference)
    return page(
        request,
        "rotary_axes/machine.html",
        status=error.status if error else 409 if late else 200,
        machine=machine_shown,
        row=row,
        head=head,
        reference=reference,
        heads=[
            (name, item, run_history.changes(standard, item) if standard else []) for name, item in row.heads.items()
        ],
        standard=standard,
        drifts=drifts,
        value=value,
        chosen=next((item for item in drifts if item.name == value), None),
        part=part_of(runs, ON_PAGE, before, lambda item: item.run.id, partial(machine_url, machine, head=head)),
        backups=list(reversed(versions)),
        in_effect={item.version for item in current.values()},
        same={item.version for item in versions if queries.alike(item.errors, current[item.head].errors)},
        form=form_reader.filled_in(row.plan) | dict(form or {}),
        errors=form_reader.at_fields(error, {}) if error else {},
        message=message,
        late=late,
        may_plan=caller.may("engineer"),
        may_take=caller.may("operator"),
        **COMMON,
    )


def shown_run(
    request: Request, session: Session, caller: Caller, number: int, *, message: str | None = None, late: bool = False
) -> Response:
    """The page of a run. late: someone else was first."""
    row = queries.run(session, number)
    in_force = queries.in_force(queries.course(session, row.machine.id, row.run.head))
    undoable = row.status == "entered" and bool(in_force) and in_force[-1].run == number
    return page(
        request,
        "rotary_axes/run.html",
        status=409 if late else 200,
        row=row,
        run=row.run,
        results=run_history.surer(row.run.results),
        stated=row.run.form == "protocol",
        errors=run_history.in_order(errors_of(row.run.results)),
        entering=run_history.to_enter(row),
        parameters=parameters_of(row),
        earlier=run_history.earlier(row, others_of(session, row)),
        message=message,
        late=late,
        may_undo=undoable and caller.may("engineer"),
        taken_back=row.status == "entered" and not undoable and not any(version.run == number for version in in_force),
        **COMMON,
    )


def others_of(session: Session, row: RunRow) -> list[RunRow]:
    """Runs that a run can be compared with, newest first."""
    rows = queries.runs(session, row.machine.id, newest_first=True, limit=100)
    return [other for other in rows if other.run.id != row.run.id and other.run.outcome != "refused"]
