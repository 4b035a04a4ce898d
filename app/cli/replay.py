"""``inband replay``: readings out of a file through the rules, and nothing is stored."""

import json
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from app.cli.base import cli, say
from app.cli.data import (
    Decimal,
    Delimiter,
    Encoding,
    File,
    FirstLine,
    HeaderLine,
    Mapping,
    TimeFormat,
    UnitOption,
    Zone,
    readable,
    report,
    wishes_of,
)
from app.core.parameters import ParameterError, Parameters, read
from app.errors import Invalid
from app.language.i18n import _

if TYPE_CHECKING:
    from rich.table import Table

    from app.loop.readings.importing.cells import Flaw


@cli.command("replay")
def replay_file(
    file: File,
    parameters: Annotated[
        Path,
        typer.Option(
            envvar="INBAND_PARAMETERS",
            help="JSON as the API has it, or program text with R33=0.001 …",
            exists=True,
            dir_okay=False,
            readable=True,
        ),
    ],
    factor: Annotated[
        float | None,
        typer.Option(
            envvar="INBAND_FACTOR",
            help="Which way the offset acts, where the parameters do not say: R numbers have no name for it.",
        ),
    ] = None,
    mapping: Mapping = "",
    delimiter: Delimiter = None,
    decimal: Decimal = None,
    unit: UnitOption = None,
    timezone: Zone = None,
    time_format: TimeFormat = None,
    encoding: Encoding = None,
    header_line: HeaderLine = None,
    first_line: FirstLine = None,
    as_json: Annotated[
        bool, typer.Option("--json", envvar="INBAND_JSON", help="One JSON object per line, as when piped.")
    ] = False,
) -> None:
    """Run readings through the rules and print the decisions. Stores nothing and needs no database."""
    import msgspec
    from rich.console import Console

    from app.loop.readings.importing.history import Flawed
    from app.loop.readings.importing.layout import look
    from app.loop.readings.importing.lines import lines
    from app.loop.readings.replaying import replay

    rules = _parameters(parameters, factor)
    flaws: list[Flaw] = []
    with readable(file) as path:
        wishes = wishes_of(mapping, delimiter, decimal, unit, timezone, time_format, encoding)
        layout = look(path, replace(wishes, header_line=header_line, first_line=first_line), file.name)
        good = _aside(replay(rules, lines(path, layout, "replay"), "replay"), flaws)
        if as_json or not sys.stdout.isatty():
            for decision in good:
                sys.stdout.write(msgspec.json.encode(decision).decode() + "\n")
        else:
            Console().print(_table(good))
    if flaws:
        report(Flawed(flaws[:200], len(flaws)), stored=False)
        raise typer.Exit(1)


def _aside(decisions: "Iterable[dict[str, Any] | Flaw]", flaws: "list[Flaw]") -> Iterator[dict[str, Any]]:
    from app.loop.readings.importing.cells import Flaw

    for decision in decisions:
        if isinstance(decision, Flaw):
            flaws.append(decision)
        else:
            yield decision


def _table(decisions: Iterable[dict[str, Any]]) -> "Table":
    from rich.table import Table

    from app.language.formatting import um

    table = Table(header_style="bold", pad_edge=False)
    table.add_column(_("No."), justify="right")
    for heading in (_("Measured"), _("Deviation"), _("Average"), _("Correction")):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column(_("Zone"), no_wrap=True)
    table.add_column(_("Reason"), ratio=1)
    for decision in decisions:
        correction = decision["correction"]
        table.add_row(
            str(decision["sequence"]),
            f"{decision['measured']:.4f}",
            um(decision["deviation"]),
            um(decision["average_after"]),
            um(correction["amount"]) if correction else "",
            decision["zone"].replace("_", " "),
            decision["reason"]["text"],
            style="bold" if correction else None,
        )
    return table


def _parameters(path: Path, factor: float | None) -> Parameters:
    from app.loop.characteristics import wording

    text = path.read_text("utf-8-sig")
    try:
        stored = json.loads(text) if text.lstrip().startswith("{") else _of_program(text)
    except ValueError as error:
        raise Invalid(f"{path.name}: {error}") from None
    if isinstance(stored.get("parameters"), dict):  # what GET /characteristics/… answers
        stored = stored["parameters"]
    if factor is not None:
        stored["factor"] = factor
    try:
        rules, warnings = read(stored)
    except ParameterError as error:
        wrong = wording.field_errors(error.problems)
        missing = any(problem.code == "sign_missing" for problem in error.problems)
        raise Invalid(
            "\n".join(f"{path.name}: {field}: {message}" for field, message in wrong),
            _("Say it with --factor, for example --factor -1.") if missing else None,
        ) from None
    for field, message in wording.field_errors(warnings):
        say(f"{field}: {message}", style="yellow")
    return rules


def _of_program(text: str) -> dict[str, Any]:
    """The parameters of program text. Raises `ValueError` where a line holds something that was not understood."""
    from app.loop.programs.queries import check as check_program
    from app.loop.programs.schemas import program_read

    examined = program_read(check_program(text))
    for line in examined.lines:
        notes = "; ".join(note.text for note in line.notes)
        if line.verdict == "not_understood":
            raise ValueError(_("line {line}: {said}").format(line=line.line, said=notes))
        if any(note.warning for note in line.notes):
            say(_("line {line}: {said}").format(line=line.line, said=notes), style="yellow")
    if examined.program is None or not examined.program.parameters:
        raise ValueError(_("There are no R parameters such as R33=0.001 in it."))
    return examined.program.parameters
