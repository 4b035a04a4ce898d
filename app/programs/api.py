"""JSON and text routes: program text read, written, and fetched."""

from typing import Annotated, Literal

from fastapi import Path, Query
from fastapi.responses import PlainTextResponse

from app.characteristics import queries as characteristics
from app.core.parameters import LARGEST_LENGTH, Axis
from app.core.programs.corrections import Form, Wanted, steps, write
from app.machines.queries import machine_named
from app.offsets import fetching
from app.programs import reading, writing
from app.programs.schemas import (
    ConfirmedIn,
    ConfirmedOut,
    FetchedIn,
    FetchedOut,
    ProgramIn,
    ProgramRead,
    fetched_out,
    looked_out,
)
from app.web.api import api_router, problems
from app.web.deps import AnyCaller, SessionDep, require

router = api_router("programs")
CharacteristicKey = Annotated[str, Path(description="The key of the characteristic.", examples=["shaft-d40"])]
MachineKey = Annotated[str, Path(description="The key of the machine.", examples=["lathe-1"])]
MEASURING = (
    "L15 (MEASURING SUBPROGRAM)\n(INBAND CHARACTERISTIC=shaft-d40)\n(INBAND FACTOR=-1)\nN5 R10=3 R11=5 R24=0 R25=0 …\n"
)
CORRECTIONS = write(Form.TURNING, "lathe-1", steps([Wanted(18, 3, -0.0061, Axis.X)], {3: -0.0081}, 17, 17))


def plain(example: str) -> dict[int | str, dict[str, object]]:
    """How an answer in plain text is described."""
    return {200: {"description": "The text", "content": {"text/plain": {"example": example}}}}


@router.post("/programs/read", dependencies=[require("viewer")])
def read_program(program: ProgramIn) -> ProgramRead:
    """Read a program text: the parameters in it, and every line with a verdict. Nothing is stored.

    Understood are the subprograms `L05` and `L15`, R assignments (`R33=0.001`, and run together `R240` for R24 = 0), the
    later names (`_TZL`), and the macro variables of the lathe line (`#505=40.`). What was passed over on purpose and what
    was not understood is named, line by line. Send `parameters` on to `POST /characteristics`.
    """
    return looked_out(reading.look(program.text, program.control))


@router.get(
    "/characteristics/{characteristic}/program",
    responses=problems(404) | plain(MEASURING),
    response_class=PlainTextResponse,
)
def write_program(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    control: Annotated[
        Literal["sinumerik", "fanuc"] | None, Query(description="For which control; if left out, the machine's.")
    ] = None,
    kind: Annotated[writing.Kind, Query(description="Which of the two subprograms.")] = "measuring",
    gauge: Annotated[
        float | None,
        Query(description="Calibration: size of the gauge (R32), mm.", gt=0, le=LARGEST_LENGTH, allow_inf_nan=False),
    ] = None,
    surface: Annotated[Literal["free", "groove"], Query(description="Calibration: where (R21, R23).")] = "free",
    probe: Annotated[Literal["axial", "radial"], Query(description="Calibration: type of the probe (R22).")] = "axial",
) -> PlainTextResponse:
    """The measuring or the calibration subprogram of a characteristic. Read back it gives the same parameters.

    What R numbers cannot say (factor, mode, acceptance …) stands in comments such as `(INBAND FACTOR=-1)`.
    """
    standing = characteristics.characteristic_named(session, characteristic)
    caller.must_at(standing.machine.id, "viewer")
    chosen = writing.control_of(standing, control)
    text = writing.program_of(standing, chosen, kind, gauge=gauge, surface=surface, probe=probe)
    name = writing.file_name(standing, chosen, kind)
    return PlainTextResponse(text, headers={"Content-Disposition": f'attachment; filename="{name}"'})


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
    found = machine_named(session, machine)
    caller.must_at(found.id, "viewer")
    handed = fetching.pending_text(session, found, form)
    fetched = [c.number for c in handed.corrections if c.fetched_at is not None]
    return PlainTextResponse(
        handed.text,
        headers={
            "Content-Disposition": f'attachment; filename="{corrections_file(found.key, found.control)}"',
            "Cache-Control": "no-store",
            "ETag": f'"{handed.check}"',
            "Inband-Corrections": ", ".join(map(str, handed.numbers)),
            "Inband-Fetched": ", ".join(map(str, fetched)),
        },
    )


def corrections_file(machine: str, control: str) -> str:
    """What the file with the corrections is called."""
    ending = {"sinumerik": "spf", "fanuc": "nc"}.get(control, "txt")
    return f"{machine.replace('.', '-').replace('_', '-')}-corrections.{ending}"


@router.post("/machines/{machine}/corrections/fetched", responses=problems(404, 409))
def mark_fetched(session: SessionDep, caller: AnyCaller, machine: MachineKey, fetched: FetchedIn) -> FetchedOut:
    """Say that these corrections were fetched as program text. They stay pending until they are confirmed.

    Marking twice is harmless: the answer says who fetched first. All of them are marked, or none.
    """
    found = machine_named(session, machine)
    caller.must_at(found.id, "operator")
    return fetched_out(fetching.mark_fetched(session, found, fetched.numbers, fetched.form, caller))


@router.post("/machines/{machine}/corrections/applied", responses=problems(404))
def confirm_corrections(
    session: SessionDep, caller: AnyCaller, machine: MachineKey, confirmed: ConfirmedIn
) -> ConfirmedOut:
    """Confirm that these corrections are in the control, all at once. Confirming twice is harmless.

    Those that were rejected or superseded meanwhile are named in `must_not_be_in`, and are not confirmed.
    """
    found = machine_named(session, machine)
    caller.must_at(found.id, "operator")
    done = fetching.confirm_all(session, found, confirmed.numbers, caller)
    refused = [fetching.must_not_be_in(correction, found) for correction in done.refused]
    return ConfirmedOut(
        applied=done.now,
        applied_before=done.already,
        must_not_be_in=[correction.number for correction in done.refused],
        note=" ".join(refused) or None,
    )
