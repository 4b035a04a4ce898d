"""Pages: one tool of a machine – its edge, its life against the plan and against the edges before, and how its offset came about."""

from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Operator, require
from app.errors import Invalid
from app.language.formatting import as_typed
from app.language.i18n import _
from app.loop.machines.queries import machine_named
from app.loop.tools import queries, verbs, wording
from app.loop.tools.edge_schemas import ToolSettings
from app.loop.tools.edges import describe_tool
from app.loop.tools.lives_queries import lives
from app.web.deps import FormDep, SessionDep
from app.web.forms import by_field, parsed, read
from app.web.templates import page

router = APIRouter(include_in_schema=False)
LIVES_SHOWN = 20
STEPS_SHOWN = 6
FIELDS = tuple(ToolSettings.model_fields)


@router.get("/machines/{machine}/tools/{number}", dependencies=[require("viewer")])
def tool_page(
    request: Request,
    session: SessionDep,
    machine: str,
    number: int,
    done: Annotated[str | None, Query(max_length=40)] = None,
) -> Response:
    """One location of the tool memory with everything about it."""
    return _tool(request, session, machine, number, done=verbs.done(done, number) if done else None)


@router.post("/machines/{machine}/tools/{number}")
def describe(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep
) -> Response:
    """Describe the tool in a location: its edge, planned life and sister tool."""
    machine_row = machine_named(session, machine)
    try:
        describe_tool(session, machine_row, number, parsed_settings(form), caller)
    except Invalid as error:
        return _tool(request, session, machine, number, form=form, error=error)
    return RedirectResponse(f"/machines/{machine}/tools/{number}?done=described", 303)


def parsed_settings(form: Mapping[str, str]) -> ToolSettings:
    """The form as the API takes it: every field is said, an empty one is taken away. Wear life is typed in µm."""
    fields = {name: None if value == "" else value for name, value in read(ToolSettings, form).items()}
    parsed(ToolSettings, fields)
    return ToolSettings.model_validate(fields)


def _tool(
    request: Request,
    session: Session,
    machine: str,
    number: int,
    *,
    done: str | None = None,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    machine_row = machine_named(session, machine)
    tool = queries.tool(session, machine_row, number)
    row = queries.tools(session, machine_row, only=number)[0]
    steps = queries.offset_history(session, machine_row, number, limit=STEPS_SHOWN + 1)
    known = lives(session, machine_row, number, limit=LIVES_SHOWN)
    return page(
        request,
        "tools/tool.html",
        refusal=error,
        machine=machine_row,
        row=row,
        known=known,
        sister=queries.tools(session, machine_row, only=tool.sister)[0] if tool.sister else None,
        waiting=queries.rows_of(session, machine_row, row.open),
        steps=steps[:STEPS_SHOWN],
        more_steps=len(steps) > STEPS_SHOWN,
        typed=form or _typed(row),
        errors=_errors(error) if error else {},
        done=done,
        wording=wording,
        offered=verbs.offered,
    )


def _errors(error: Invalid) -> dict[str, str]:
    """Errors by field. Wear life is typed in µm, so its limits are not given in mm."""
    errors = by_field(error)
    if "planned_total" in errors:
        errors["planned_total"] = _("Must be a number of µm larger than 0")
    return errors


def _typed(row: queries.ToolRow) -> dict[str, str]:
    """The form as it would have been typed."""
    typed = {name: "" if getattr(row.tool, name) is None else str(getattr(row.tool, name)) for name in FIELDS}
    total = row.tool.planned_total
    return typed | {"planned_total": "" if total is None else as_typed(total * 1000, 6)}
