"""``inband import``, ``inband export`` and ``inband replay``: readings out of files, into files, and through the rules."""

import getpass
import json
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, TextIO
from zoneinfo import ZoneInfo

import msgspec
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from app.characteristics import wording
from app.cli.base import DatabaseUrl, DataDir, cli, migrated, people, say, settings_from
from app.core.parameters import BY_R, ParameterError, Parameters, read
from app.errors import Invalid, NotFound
from app.formats import r_numbers, values
from app.readings import exporting, queries
from app.readings.importing.actions import import_readings
from app.readings.importing.history import Flawed, Summary
from app.readings.importing.layout import Layout, Wishes, look
from app.readings.importing.lines import Flaw, lines
from app.readings.replaying import replay
from app.web.i18n import _, ngettext
from app.web.numbers import um


class Unit(StrEnum):
    """What lengths in the file are written in."""

    MM = "mm"
    UM = "um"
    INCH = "inch"


class Format(StrEnum):
    """What a file is written as."""

    CSV = "csv"
    NDJSON = "ndjson"


File = Annotated[Path, typer.Argument(help="CSV, NDJSON or JSON.", exists=True, dir_okay=False, readable=True)]
Mapping = Annotated[
    str,
    typer.Option(
        "--map",
        envvar="INBAND_MAP",
        help="Which column is what: measured=Wert,measured_at=Datum+Uhrzeit. A column is named, or numbered from 1.",
        show_default="by their names, in five languages",
    ),
]
Delimiter = Annotated[
    str | None, typer.Option(envvar="INBAND_DELIMITER", help="What parts the cells.", show_default="found out")
]
Decimal = Annotated[
    str | None, typer.Option(envvar="INBAND_DECIMAL", help="Point or comma in numbers.", show_default="found out")
]
UnitOption = Annotated[
    Unit | None, typer.Option(envvar="INBAND_UNIT", help="Unit of the lengths.", show_default="the header's, else mm")
]
Zone = Annotated[
    str | None, typer.Option(envvar="INBAND_TIMEZONE", help="For times without an offset, such as Europe/Belgrade.")
]
TimeFormat = Annotated[
    str | None,
    typer.Option(envvar="INBAND_TIME_FORMAT", help="How times are written, as for strptime: '%d/%m/%Y %H:%M'."),
]
Encoding = Annotated[
    str | None, typer.Option(envvar="INBAND_ENCODING", help="utf-8, utf-16, cp1250, cp1251 …", show_default="found out")
]
Characteristic = Annotated[str, typer.Option(envvar="INBAND_CHARACTERISTIC", help="The key of the characteristic.")]


@cli.command("import")
def import_file(
    file: File,
    characteristic: Characteristic,
    mapping: Mapping = "",
    delimiter: Delimiter = None,
    decimal: Decimal = None,
    unit: UnitOption = None,
    timezone: Zone = None,
    time_format: TimeFormat = None,
    encoding: Encoding = None,
    live: Annotated[
        bool, typer.Option("--live", envvar="INBAND_LIVE", help="Decide as if they came in now: corrections, alarms.")
    ] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", envvar="INBAND_DRY_RUN", help="Say what would happen and store nothing.")
    ] = False,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Import readings from a file: all of them or none. They are history: judged, but they correct nothing."""
    wishes = _wishes(mapping, delimiter, decimal, unit, timezone, time_format, encoding)
    layout = look(file, wishes)
    _tell(layout)
    with migrated(settings_from(data_dir=data_dir, database_url=database_url)) as database, _bar(file) as bar:
        try:
            summary = import_readings(
                database,
                characteristic,
                file,
                layout,
                actor=f"command line ({getpass.getuser()})",
                live=live,
                dry_run=dry_run,
                progress=bar,
            )
        except Flawed as refusal:
            _report(refusal)
            raise typer.Exit(1) from None
    _sum_up(summary, characteristic, live=live, dry_run=dry_run)


@cli.command("export")
def export_file(
    characteristic: Characteristic,
    since: Annotated[str | None, typer.Option("--from", envvar="INBAND_FROM", help="Measured at or after.")] = None,
    until: Annotated[str | None, typer.Option("--to", envvar="INBAND_TO", help="Measured before.")] = None,
    last: Annotated[int | None, typer.Option(envvar="INBAND_LAST", min=1, help="Only so many, the last ones.")] = None,
    timezone: Zone = None,
    format_: Annotated[Format | None, typer.Option("--format", envvar="INBAND_FORMAT", show_default="csv")] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", envvar="INBAND_OUTPUT", help="A file.", show_default="standard output"),
    ] = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Write the readings of a characteristic, oldest first, as CSV or NDJSON."""
    zone = _zone(timezone)
    first, end = _moment(since, zone, "--from"), _moment(until, zone, "--to")
    lines_wanted = format_ is Format.NDJSON or (format_ is None and output is not None and output.suffix == ".ndjson")
    with (
        migrated(settings_from(data_dir=data_dir, database_url=database_url)) as database,
        database.begin() as session,
    ):
        entry = queries.entry_of(session, characteristic)
        if entry is None:
            raise NotFound(_("There is no characteristic {key}.").format(key=repr(characteristic)))
        found = exporting.rows(session, entry, since=first, until=end, last=last)
        with _output(output) as target:
            count = (exporting.write_ndjson if lines_wanted else exporting.write_csv)(found, target)
    say(ngettext("%(num)d reading written.", "%(num)d readings written.", count) % {"num": count})


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
    mapping: Mapping = "",
    delimiter: Delimiter = None,
    decimal: Decimal = None,
    unit: UnitOption = None,
    timezone: Zone = None,
    time_format: TimeFormat = None,
    encoding: Encoding = None,
    as_json: Annotated[
        bool, typer.Option("--json", envvar="INBAND_JSON", help="One JSON object per line, as when piped.")
    ] = False,
) -> None:
    """Run readings through the rules and print the decisions. Stores nothing and needs no database."""
    rules = _parameters(parameters)
    layout = look(file, _wishes(mapping, delimiter, decimal, unit, timezone, time_format, encoding))
    decisions = replay(rules, lines(file, layout, "replay"), "replay")
    flaws: list[Flaw] = []
    good = _aside(decisions, flaws)
    if as_json or not sys.stdout.isatty():
        for each in good:
            sys.stdout.write(msgspec.json.encode(each).decode() + "\n")
    else:
        Console().print(_table(good))
    if flaws:
        _report(Flawed(flaws[:200], len(flaws)), stored=False)
        raise typer.Exit(1)


def _aside(decisions: Iterable[dict[str, Any] | Flaw], flaws: list[Flaw]) -> Iterator[dict[str, Any]]:
    for each in decisions:
        if isinstance(each, Flaw):
            flaws.append(each)
        else:
            yield each


def _table(decisions: Iterable[dict[str, Any]]) -> Table:
    table = Table(header_style="bold", pad_edge=False)
    table.add_column(_("No."), justify="right")
    for heading in (_("Measured"), _("Deviation"), _("Average"), _("Correction")):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column(_("Zone"), no_wrap=True)
    table.add_column(_("Reason"), ratio=1)
    for each in decisions:
        correction = each["correction"]
        table.add_row(
            str(each["sequence"]),
            f"{each['measured']:.4f}",
            um(each["deviation"]),
            um(each["average_after"]),
            um(correction["amount"]) if correction else "",
            each["zone"].replace("_", " "),
            each["reason"]["text"],
            style="bold" if correction else None,
        )
    return table


def _wishes(
    mapping: str,
    delimiter: str | None,
    decimal: str | None,
    unit: Unit | None,
    timezone: str | None,
    time_format: str | None,
    encoding: str | None,
) -> Wishes:
    pairs = [pair.partition("=") for pair in mapping.split(",") if pair.strip()]
    if any(not name.strip() or not sign for name, sign, _column in pairs):
        raise typer.BadParameter("write it as measured=COLUMN,measured_at=COLUMN", param_hint="--map")
    sign = {"tab": "\t", "\\t": "\t", "comma": ",", "semicolon": ";"}
    return Wishes(
        mapping={name.strip(): column.strip() for name, _sign, column in pairs},
        delimiter=sign.get(delimiter or "", delimiter),
        decimal={"comma": ",", "point": "."}.get(decimal or "", decimal),
        unit=unit.value if unit else None,
        timezone=timezone,
        time_format=time_format,
        encoding=encoding.lower() if encoding else None,
    )


def _tell(layout: Layout) -> None:
    """How the file is understood, so that a wrong guess is seen."""
    known = ", ".join(f"{name} ← {layout.named(name)}" for name in layout.columns)
    say(_("Columns: {known} (in {unit})").format(known=known, unit=layout.unit))
    if layout.ignored:
        say(_("Not used: {names}").format(names=", ".join(layout.ignored)))
    if "measured_at" not in layout.columns:
        say(_("There is no column of times: every reading gets the time of this import."), style="yellow")


@contextmanager
def _bar(file: Path) -> Iterator[Any]:
    with file.open("rb") as opened:
        total = sum(part.count(b"\n") for part in iter(lambda: opened.read(1 << 20), b""))
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=people, transient=True, disable=not people.is_terminal) as progress:
        task = progress.add_task(_("Lines"), total=max(1, total - 1))
        yield lambda: progress.advance(task)


def _report(refusal: Flawed, *, stored: bool = True) -> None:
    for flaw in refusal.flaws:
        say(str(flaw))
    more = refusal.count - len(refusal.flaws)
    if more > 0:
        say(_("… and {more} more.").format(more=more))
    say(f"{refusal.detail} {refusal.what_to_do if stored else ''}", style="bold red")


def _sum_up(summary: Summary, characteristic: str, *, live: bool, dry_run: bool) -> None:
    begin = _("Nothing was stored; this would be: ") if dry_run else ""
    text = _("{stored} readings of {characteristic}").format(stored=summary.stored, characteristic=characteristic)
    if dry_run and live:
        text = _("{lines} lines can be read").format(lines=summary.lines)
    if summary.first_sequence is not None:
        text += _(", numbers {first} to {last}").format(first=summary.first_sequence, last=summary.last_sequence)
    if summary.first_at is not None and summary.last_at is not None:
        span = f"{summary.first_at:%Y-%m-%d %H:%M} – {summary.last_at:%Y-%m-%d %H:%M}"
        text += _(", measured {span}").format(span=span)
    say(f"{begin}{text}.", style="bold")
    if summary.repeated:
        say(_("{count} were stored before and are not stored again.").format(count=summary.repeated))
    if summary.zones:
        say(_("Zones: {zones}").format(zones=", ".join(f"{zone} {count}" for zone, count in summary.zones.items())))
    if live and not dry_run:
        say(
            _("{corrections} corrections, {alarms} alarms.").format(
                corrections=summary.corrections, alarms=summary.alarms
            )
        )
    elif not live:
        say(_("They are history: no correction, no alarm, and the running average stays as it was."))


def _zone(name: str | None) -> ZoneInfo:
    try:
        return values.zone_named(name or "UTC")
    except values.Unreadable as error:
        raise typer.BadParameter(str(error), param_hint="--timezone") from None


def _moment(text: str | None, zone: ZoneInfo, option: str) -> Any:
    try:
        return values.moment(text, zone) if text else None
    except values.Unreadable as error:
        raise typer.BadParameter(f"{text!r} {error}", param_hint=option) from None


@contextmanager
def _output(path: Path | None) -> Iterator[TextIO]:
    """Standard output, or a file that is there only once it is complete."""
    if path is None:
        with nullcontext(sys.stdout) as target:
            yield target
            target.flush()
        return
    draft = path.with_name(f".{path.name}.part")
    try:
        with draft.open("w", encoding="utf-8", newline="") as target:
            yield target
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _parameters(path: Path) -> Parameters:
    text = path.read_text("utf-8-sig")
    try:
        given = json.loads(text) if text.lstrip().startswith("{") else _of_program(text)
    except ValueError as error:
        raise Invalid(f"{path.name}: {error}") from None
    if isinstance(given.get("parameters"), dict):  # what GET /characteristics/… answers
        given = given["parameters"]
    try:
        rules, warnings = read(given)
    except ParameterError as error:
        wrong = wording.field_errors(error.problems)
        raise Invalid("\n".join(f"{path.name}: {field}: {message}" for field, message in wrong)) from None
    for field, message in wording.field_errors(warnings):
        say(f"{field}: {message}", style="yellow")
    return rules


def _of_program(text: str) -> dict[str, float]:
    """R parameters of program text; those of calibration and of the touch itself are not asked for here."""
    found = r_numbers.read(text)
    other = [name for name in found if name not in BY_R and name != "R24"]
    if other:
        say(_("Not used: {names}").format(names=", ".join(other)))
    return {name: value for name, value in found.items() if name not in other}
