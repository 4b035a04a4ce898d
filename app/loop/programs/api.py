"""JSON and text routes: program text read and written."""

from typing import Annotated, Literal

from fastapi import Query, Response
from fastapi.responses import PlainTextResponse

from app.access.deps import AnyCaller, require
from app.core.parameters import LARGEST_LENGTH
from app.core.programs.ring_settings import HIGHEST_OF_ALL, MOST_CHARACTERISTICS, Offsets
from app.loop.characteristics import queries as characteristics
from app.loop.machines.queries import machine_named
from app.loop.programs import queries, ring_queries
from app.loop.programs.schemas import ProgramIn, ProgramRead, program_read
from app.web.api import CharacteristicKey, api_router, plain, problems
from app.web.deps import SessionDep
from app.web.downloads import download

router = api_router("programs")
MEASURING = (
    "L15 (MEASURING SUBPROGRAM)\n(INBAND CHARACTERISTIC=shaft-d40)\n(INBAND FACTOR=-1)\nN5 R10=3 R11=5 R24=0 R25=0 …\n"
)


@router.post("/programs/read", dependencies=[require("viewer")], responses=problems(404))
def read_program(session: SessionDep, program: ProgramIn) -> ProgramRead:
    """Read a program text: the parameters in it, and every line with a verdict. Nothing is stored.

    Understood are the subprograms `L05` and `L15`, R assignments (`R33=0.001`, and run together `R240` for R24 = 0), the
    later names (`_TZL`), and the macro variables of the lathe line (`#505=40.`). What was passed over on purpose and what
    was not understood is named, line by line. Send `parameters` on to `POST /characteristics`.
    """
    machine = machine_named(session, program.machine) if program.machine is not None else None
    return program_read(queries.check(program.text, program.control, machine))


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
        Literal["sinumerik", "fanuc", "haas"] | None,
        Query(description="For which control; if left out, the machine's. haas: with ring only."),
    ] = None,
    kind: Annotated[queries.Kind, Query(description="Which of the two subprograms.")] = "measuring",
    gauge: Annotated[
        float | None,
        Query(description="Calibration: size of the gauge (R32), mm.", gt=0, le=LARGEST_LENGTH, allow_inf_nan=False),
    ] = None,
    surface: Annotated[Literal["free", "groove"], Query(description="Calibration: where (R21, R23).")] = "free",
    probe: Annotated[Literal["axial", "radial"], Query(description="Calibration: type of the probe (R22).")] = "axial",
    ring: Annotated[
        ring_queries.RingPart | None,
        Query(description="In place of the two: programs for the bridge, one of them or all in one text."),
    ] = None,
    number: Annotated[
        int, Query(description="Ring: number of the characteristic there.", ge=1, le=MOST_CHARACTERISTICS)
    ] = 1,
    first_register: Annotated[
        int, Query(description="Ring: its first register; 0 is the usual one of the control.", ge=0, le=HIGHEST_OF_ALL)
    ] = 0,
    time_out: Annotated[
        float, Query(description="Ring: seconds to wait for the bridge.", ge=1, le=3600, allow_inf_nan=False)
    ] = 30.0,
    go_on: Annotated[bool, Query(description="Ring: write on then; the oldest reading is lost.")] = False,
    largest_step: Annotated[
        float, Query(description="Ring: largest step of an offset, mm.", gt=0, le=10, allow_inf_nan=False)
    ] = 0.1,
    decision_time: Annotated[
        float,
        Query(description="Ring: seconds that a reading waits for its decision.", ge=0, le=600, allow_inf_nan=False),
    ] = 3.0,
    decision_stops: Annotated[
        bool, Query(description="Ring: stop without a decision in that time; else go on.")
    ] = False,
    hold_stops: Annotated[
        bool, Query(description="Ring: a hold stops the machine as a stop does; else it goes on.")
    ] = False,
    offsets: Annotated[
        Offsets | None, Query(description="Ring: place of the wear; if left out, as such a machine has it.")
    ] = None,
    measured: Annotated[
        str | None,
        Query(description="Ring: where the measuring cycle leaves the size.", pattern=ring_queries.SIZE_WORD),
    ] = None,
) -> Response:
    """The measuring or the calibration subprogram of a characteristic. Read back it gives the same parameters.

    What R numbers cannot say (factor, mode, acceptance …) is in comments such as `(INBAND FACTOR=-1)`. With `ring` the
    programs that send readings to the bridge and take corrections from it.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    if ring is not None:
        settings = ring_queries.ring_settings(
            current,
            ring_queries.ring_control(current, control),
            number=number,
            first_register=first_register,
            time_out=time_out,
            go_on=go_on,
            largest_step=largest_step,
            measured=measured,
            offsets=offsets,
            decision_time=decision_time,
            decision_stops=decision_stops,
            hold_stops=hold_stops,
        )
        text = ring_queries.ring_text(current, settings, ring)
        return download(text.text, text.file)
    chosen = queries.control_of(current, control)
    subprogram = queries.program_of(current, chosen, kind, gauge=gauge, surface=surface, probe=probe)
    return download(subprogram, queries.file_name(current, chosen, kind))
