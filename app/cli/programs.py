"""``inband program …``: program text read, characteristics and pending corrections written as program text."""

import getpass
import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from app.characteristics import queries
from app.cli.base import DatabaseUrl, DataDir, cli, migrated, say, settings_from
from app.core.programs.corrections import Form
from app.core.programs.lines import MOST_CHARACTERS, Verdict
from app.machines.queries import machine_named
from app.offsets import fetching
from app.people.callers import Caller
from app.programs import queries as programs
from app.programs import wording
from app.programs.schemas import looked_out

program = typer.Typer(help="Program text of the controls.", no_args_is_help=True)
cli.add_typer(program, name="program")
NOT_UNDERSTOOD = Verdict.NOT_UNDERSTOOD.value


class Control(StrEnum):
    """Whose text it is."""

    SINUMERIK = "sinumerik"
    FANUC = "fanuc"


class Kind(StrEnum):
    """Which of the two subprograms."""

    MEASURING = "measuring"
    CALIBRATION = "calibration"


@program.command("read")
def read_program(
    file: Annotated[Path, typer.Argument(help="The text.", exists=True, dir_okay=False, readable=True)],
    control: Annotated[
        Control | None,
        typer.Option(envvar="INBAND_CONTROL", help="Whose text it is.", show_default="found out by the text"),
    ] = None,
) -> None:
    """Read a program text: what was not understood to standard error, the parameters as JSON to standard output."""
    with file.open("rb") as opened:
        text = programs.decoded(opened.read(4 * MOST_CHARACTERS + 4))
    looked = programs.look(text, control.value if control else None)
    answer = looked_out(looked)
    for line in answer.lines:
        worth_saying = [note.text for note in line.notes if note.warning or line.verdict == NOT_UNDERSTOOD]
        if worth_saying:
            style = "bold red" if line.verdict == NOT_UNDERSTOOD else "yellow"
            words = wording.verdict_word(line.verdict)
            say(f"{line.line}: {line.text.strip()[:120]}\n   {words}: {'; '.join(worth_saying)}", style=style)
    for note in answer.program.notes if answer.program else ():
        say(note.text, style="yellow")
    for problem in (*answer.problems, *answer.warnings):
        say(f"{problem.field}: {problem.message}", style="yellow")
    found = (
        answer.program.model_dump(include={"kind", "parameters", "about", "values", "results", "touches"})
        if answer.program
        else {}
    )
    json.dump(found, sys.stdout, ensure_ascii=False, indent=2)
    sys.stdout.write("\n")
    if answer.program is None:
        raise typer.Exit(1)


@program.command("write")
def write_program(
    characteristic: Annotated[str, typer.Argument(help="The key of the characteristic.")],
    kind: Annotated[Kind, typer.Option(envvar="INBAND_KIND", help="Which subprogram.")] = Kind.MEASURING,
    control: Annotated[
        Control | None, typer.Option(envvar="INBAND_CONTROL", help="For which control.", show_default="the machine's")
    ] = None,
    gauge: Annotated[
        float | None, typer.Option(envvar="INBAND_GAUGE", min=0, help="Calibration: size of the gauge, mm.")
    ] = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Write the measuring or the calibration subprogram of a characteristic to standard output."""
    settings = settings_from(data_dir=data_dir, database_url=database_url)
    with migrated(settings) as database, database.begin() as session:
        standing = queries.characteristic_named(session, characteristic)
        chosen = programs.control_of(standing, control.value if control else None)
        sys.stdout.write(programs.program_of(standing, chosen, kind.value, gauge=gauge))


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
    settings = settings_from(data_dir=data_dir, database_url=database_url)
    with migrated(settings) as database, database.begin() as session:
        found = machine_named(session, machine)
        handed = fetching.pending_text(session, found, form)
        if fetched and handed.numbers:
            caller = Caller("key", f"command line ({getpass.getuser()})", role="operator")
            fetching.mark_fetched(session, found, handed.numbers, handed.form, caller)
        sys.stdout.write(handed.text)
    say(wording.guarded(handed.form))
