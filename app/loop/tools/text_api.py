"""JSON and text routes: pending corrections as program text, who fetched them, and that they are in."""

from typing import Annotated

from fastapi import Query
from fastapi.responses import PlainTextResponse

from app.access.deps import AnyCaller, OperatorOrMachine
from app.core.parameters import Axis
from app.core.programs.correction_forms import Form
from app.core.programs.corrections import PendingCorrection, steps, write
from app.loop.machines.queries import machine_for
from app.loop.tools import fetching
from app.loop.tools.text_schemas import ConfirmedIn, ConfirmedOut, FetchedIn, FetchedOut, fetched_out
from app.web.api import MachineKey, api_router, plain, problems
from app.web.deps import SessionDep

router = api_router("programs")
CORRECTIONS = write(Form.TURNING, "lathe-1", steps([PendingCorrection(18, 3, -0.0061, Axis.X)], {3: -0.0081}, 17, 17))


@router.get(
    "/machines/{machine}/corrections/program",
    responses=problems(404, 409) | plain(CORRECTIONS),
    response_class=PlainTextResponse,
)
def write_corrections(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    form: Annotated[
        Form | None, Query(description="How offsets are changed; if left out, the usual way of the control.")
    ] = None,
) -> PlainTextResponse:
    """The pending corrections as program text, for a control without a network. Running it twice changes nothing.

    The header `Inband-Corrections` names the corrections in it, in the order of the text; `Inband-Fetched` those that were
    fetched before. Say that you took it with `POST …/corrections/fetched`. While nothing else changes, the text is the same.
    """
    machine_row = machine_for(session, caller, machine, "viewer")
    handed = fetching.pending_text(session, machine_row, form)
    fetched = [c.number for c in handed.corrections if c.fetched_at is not None]
    return PlainTextResponse(
        handed.text,
        headers={
            "Content-Disposition": f'attachment; filename="{corrections_file(machine_row.key, machine_row.control)}"',
            "Cache-Control": "no-store",
            "ETag": f'"{handed.check}"',
            "Inband-Corrections": ", ".join(map(str, handed.numbers)),
            "Inband-Fetched": ", ".join(map(str, fetched)),
        },
    )


def corrections_file(machine: str, control: str) -> str:
    """Name of the file with the corrections."""
    ending = {"sinumerik": "spf", "fanuc": "nc"}.get(control, "txt")
    return f"{machine.replace('.', '-').replace('_', '-')}-corrections.{ending}"


@router.post("/machines/{machine}/corrections/fetched", responses=problems(404, 409))
def mark_fetched(session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, fetched: FetchedIn) -> FetchedOut:
    """Say that these corrections were fetched as program text. They stay pending until they are confirmed.

    Marking twice is harmless: the answer says who fetched first. All of them are marked, or none.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    return fetched_out(fetching.mark_fetched(session, machine_row, fetched.numbers, fetched.form, caller))


@router.post("/machines/{machine}/corrections/applied", responses=problems(404))
def confirm_corrections(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, confirmed: ConfirmedIn
) -> ConfirmedOut:
    """Confirm that these corrections are in the control, all at once. Confirming twice is harmless.

    Those that were rejected or superseded meanwhile are named in `must_not_be_in`, and are not confirmed.
    """
    machine_row = machine_for(session, caller, machine, "operator")
    done = fetching.confirm_all(session, machine_row, confirmed.numbers, caller)
    refused = [fetching.must_not_be_in(correction, machine_row) for correction in done.refused]
    return ConfirmedOut(
        applied=done.now,
        applied_before=done.already,
        must_not_be_in=[correction.number for correction in done.refused],
        note=" ".join(refused) or None,
    )
