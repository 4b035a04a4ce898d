"""``inband program …``: program text read, characteristics and pending corrections written as program text."""

import getpass
import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, cli, existing, say, settings_from
from app.core.programs.correction_forms import Form
from app.core.programs.ring_settings import Offsets

if TYPE_CHECKING:
    from app.core.programs.ring_settings import RingSettings
    from app.loop.characteristics.queries import CurrentCharacteristic

program = typer.Typer(help="Program text of the controls.", no_args_is_help=True)
cli.add_typer(program, name="program")


class Control(StrEnum):
    """Control that the text is for."""

    SINUMERIK = "sinumerik"
    FANUC = "fanuc"
    HAAS = "haas"


class ReadableControl(StrEnum):
    """Controls whose texts are read."""

    SINUMERIK = "sinumerik"
    FANUC = "fanuc"
    HEIDENHAIN = "heidenhain"


class Subprogram(StrEnum):
    """One of the two subprograms."""

    MEASURING = "measuring"
    CALIBRATION = "calibration"


@program.command("read")
def read_program(
    file: Annotated[Path, typer.Argument(help="The text.", exists=True, dir_okay=False, readable=True)],
    control: Annotated[
        ReadableControl | None,
        typer.Option(envvar="INBAND_CONTROL", help="Control that the text is for.", show_default="from the text"),
    ] = None,
) -> None:
    """Read a program text: what was not understood to standard error, the parameters as JSON to standard output."""
    from app.core.programs.lines import MOST_CHARACTERS, LineVerdict
    from app.loop.programs import queries as programs
    from app.loop.programs import wording
    from app.loop.programs.schemas import program_read

    with file.open("rb") as opened:
        text = programs.decoded(opened.read(4 * MOST_CHARACTERS + 4))
    examined = programs.check(text, control.value if control else None)
    answer = program_read(examined)
    for line in answer.lines:
        worth_saying = [
            note.text for note in line.notes if note.warning or line.verdict == LineVerdict.NOT_UNDERSTOOD.value
        ]
        if worth_saying:
            style = "bold red" if line.verdict == LineVerdict.NOT_UNDERSTOOD.value else "yellow"
            words = wording.verdict_word(line.verdict)
            say(f"{line.line}: {line.text.strip()[:120]}\n   {words}: {'; '.join(worth_saying)}", style=style)
    for note in answer.program.notes if answer.program else ():
        say(note.text, style="yellow")
    for problem in answer.problems:
        say(f"{problem.field}: {problem.message}", style="yellow")
    for warning in answer.warnings:
        say(f"{warning.field}: {warning.text}" if warning.field else warning.text, style="yellow")
    content = (
        answer.program.model_dump(include={"kind", "parameters", "about", "values", "results", "touches"})
        if answer.program
        else {}
    )
    json.dump(content, sys.stdout, ensure_ascii=False, indent=2)
    sys.stdout.write("\n")
    if answer.program is None:
        raise typer.Exit(1)


DecisionTime = Annotated[
    float,
    typer.Option(
        envvar="INBAND_DECISION_TIME", min=0, max=600, help="Ring: seconds that a reading waits for its decision."
    ),
]
DecisionStops = Annotated[
    bool, typer.Option("--decision-stops", envvar="INBAND_DECISION_STOPS", help="Ring: stop without a decision then.")
]
HoldStops = Annotated[
    bool, typer.Option("--hold-stops", envvar="INBAND_HOLD_STOPS", help="Ring: a hold stops the machine, too.")
]


@program.command("write")
def write_program(
    characteristic: Annotated[str, typer.Argument(help="The key of the characteristic.")],
    kind: Annotated[Subprogram, typer.Option(envvar="INBAND_KIND", help="Which subprogram.")] = Subprogram.MEASURING,
    control: Annotated[
        Control | None, typer.Option(envvar="INBAND_CONTROL", help="For which control.", show_default="the machine's")
    ] = None,
    gauge: Annotated[
        float | None, typer.Option(envvar="INBAND_GAUGE", min=0, help="Calibration: size of the gauge, mm.")
    ] = None,
    ring: Annotated[
        bool, typer.Option("--ring", envvar="INBAND_RING", help="The NC programs for the bridge, in place of these.")
    ] = False,
    number: Annotated[
        int, typer.Option(envvar="INBAND_NUMBER", min=1, max=9999, help="Ring: number of the characteristic.")
    ] = 1,
    first_register: Annotated[
        int,
        typer.Option(
            envvar="INBAND_FIRST_REGISTER", min=0, help="Ring: its first register.", show_default="the control's usual"
        ),
    ] = 0,
    time_out: Annotated[
        float, typer.Option(envvar="INBAND_TIME_OUT", min=1, max=3600, help="Ring: seconds to wait for the bridge.")
    ] = 30.0,
    go_on: Annotated[
        bool, typer.Option("--go-on", envvar="INBAND_GO_ON", help="Ring: write on then; the oldest reading is lost.")
    ] = False,
    largest_step: Annotated[
        float,
        typer.Option(envvar="INBAND_LARGEST_STEP", min=0.001, max=10, help="Ring: largest step of an offset, mm."),
    ] = 0.1,
    decision_time: DecisionTime = 3.0,
    decision_stops: DecisionStops = False,
    hold_stops: HoldStops = False,
    measured: Annotated[
        str | None, typer.Option(envvar="INBAND_MEASURED", help="Ring: where the measuring cycle leaves the size.")
    ] = None,
    offsets: Annotated[
        Offsets | None,
        typer.Option(envvar="INBAND_OFFSETS", help="Ring: place of the wear.", show_default="as such a machine has it"),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(envvar="INBAND_FOLDER", file_okay=False, help="Ring: write each program into a file here."),
    ] = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Write the measuring or the calibration subprogram of a characteristic, or the programs for the bridge."""
    from app.loop.characteristics import queries
    from app.loop.programs import queries as programs
    from app.loop.programs import ring_queries

    settings = settings_from(data_dir=data_dir, database_url=database_url)
    with existing(settings) as database, database.begin() as session:
        current = queries.characteristic_named(session, characteristic)
        if ring:
            chosen_control = ring_queries.ring_control(current, control.value if control else None)
            ring_of = ring_queries.ring_settings(
                current,
                chosen_control,
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
            _write_ring(current, ring_of, folder)
            return
        chosen = programs.control_of(current, control.value if control else None)
        sys.stdout.write(programs.program_of(current, chosen, kind.value, gauge=gauge))


def _write_ring(current: "CurrentCharacteristic", settings: "RingSettings", folder: Path | None) -> None:
    from app.loop.programs import ring_queries

    if folder is None:
        sys.stdout.write(ring_queries.ring_text(current, settings, "all").text)
        return
    folder.mkdir(parents=True, exist_ok=True)
    for text in ring_queries.ring_texts(current, settings):
        (folder / text.file).write_text(text.text, encoding="ascii", newline="\r\n")
        say(f"{folder / text.file}: {ring_queries.ring_word(text.key)}")


@program.command("corrections")
def write_corrections(
    machine: Annotated[str, typer.Argument(help="The key of the machine.")],
    form: Annotated[
        Form | None,
        typer.Option(envvar="INBAND_FORM", help="How offsets are changed.", show_default="as the control does it"),
    ] = None,
    fetched: Annotated[
        bool, typer.Option("--fetched", envvar="INBAND_FETCHED", help="Mark them as fetched, too.")
    ] = False,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Write the pending corrections of a machine as program text to standard output."""
    from app.access.callers import Caller
    from app.loop.machines.queries import machine_named
    from app.loop.programs import wording
    from app.loop.tools import fetching

    settings = settings_from(data_dir=data_dir, database_url=database_url)
    with existing(settings) as database, database.begin() as session:
        machine_row = machine_named(session, machine)
        handed = fetching.pending_text(session, machine_row, form)
        if fetched and handed.numbers:
            caller = Caller("key", f"command line ({getpass.getuser()})", role="operator")
            fetching.mark_fetched(session, machine_row, handed.numbers, handed.form, caller)
        sys.stdout.write(handed.text)
    say(wording.guarded(handed.form))
