"""``inband import`` and ``inband export``: readings out of files and into files."""

import getpass
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO
from zoneinfo import ZoneInfo

import typer

from app.cli import aqdef
from app.cli.base import DatabaseUrl, DataDir, cli, existing, people, say, settings_from
from app.cli.context import OfContext, chosen_context
from app.cli.stored import sentences, stored_before, stored_of, which
from app.errors import Invalid
from app.language.i18n import _, ngettext
from app.language.times import in_zone, plant_zone

if TYPE_CHECKING:
    from app.core.period import Period
    from app.loop.readings.aqdef.sorting import Wishes as AqdefWishes
    from app.loop.readings.importing.history import Flawed, Summary
    from app.loop.readings.importing.layout import Layout, Wishes
    from app.loop.readings.importing.wide import Column, ColumnResult

SINCE, UNTIL = (
    "Measured at this moment or later; a day begins at midnight.",
    "Measured before this moment; a day is included, all of it.",
)


class Unit(StrEnum):
    """Unit of the lengths in the file."""

    MM = "mm"
    UM = "um"
    NM = "nm"
    CM = "cm"
    M = "m"
    INCH = "inch"
    MIL = "mil"
    TENTH = "tenth"
    UIN = "uin"


class Format(StrEnum):
    """Format of a written file."""

    CSV = "csv"
    NDJSON = "ndjson"
    DFQ = "dfq"


File = Annotated[
    Path,
    typer.Argument(
        help="CSV, NDJSON, JSON, XLSX or AQDEF (.dfq, .dfd with .dfx).", exists=True, dir_okay=False, readable=True
    ),
]
Mapping = Annotated[
    str,
    typer.Option(
        "--map",
        envvar="INBAND_MAP",
        help="Which column is what: measured=Wert,measured_at=Datum+Uhrzeit. A column is named, or numbered from 1; measured_at= says that none is. "
        "Of AQDEF, which characteristic is which: D40=shaft-d40; D41=+ sets it up, D42= leaves it out.",
        show_default="by their names, in five languages",
    ),
]
Delimiter = Annotated[
    str | None,
    typer.Option(
        envvar="INBAND_DELIMITER",
        help="Column separator: a sign, tab, or blanks for two and more.",
        show_default="automatic",
    ),
]
Decimal = Annotated[
    str | None, typer.Option(envvar="INBAND_DECIMAL", help="Point or comma in numbers.", show_default="automatic")
]
UnitOption = Annotated[
    Unit | None, typer.Option(envvar="INBAND_UNIT", help="Unit of the lengths.", show_default="the header's, else mm")
]
Zone = Annotated[
    str | None, typer.Option(envvar="INBAND_TIMEZONE", help="For times without an offset, such as Europe/Belgrade.")
]
TimeFormat = Annotated[
    str | None,
    typer.Option(
        envvar="INBAND_TIME_FORMAT",
        help="How times are written, as for strptime: '%d/%m/%Y %H:%M'; or days since 1899-12-30.",
    ),
]
Encoding = Annotated[
    str | None, typer.Option(envvar="INBAND_ENCODING", help="utf-8, utf-16, cp1250, cp1251 …", show_default="automatic")
]
HeaderLine = Annotated[
    int | None,
    typer.Option(envvar="INBAND_HEADER_LINE", min=1, help="Line of the column names.", show_default="automatic"),
]
FirstLine = Annotated[
    int | None,
    typer.Option(
        envvar="INBAND_FIRST_LINE", min=2, help="First line of readings.", show_default="below the column names"
    ),
]
LastLine = Annotated[
    int | None,
    typer.Option(envvar="INBAND_LAST_LINE", min=2, help="Last line of readings: means or sums follow below."),
]
Missing = Annotated[
    str,
    typer.Option(
        envvar="INBAND_MISSING",
        help="Marks of missing sizes, parted by commas: '---,n.i.O.,NaN'. * is every cell without a digit, an empty one too.",
    ),
]
Sheet = Annotated[
    str | None, typer.Option(envvar="INBAND_SHEET", help="Sheet of a workbook.", show_default="the first with cells")
]
Characteristic = Annotated[str, typer.Option(envvar="INBAND_CHARACTERISTIC", help="The key of the characteristic.")]
DayFirst = Annotated[
    bool | None,
    typer.Option(
        "--day-first/--month-first",
        envvar="INBAND_DAY_FIRST",
        help="Of AQDEF: dates with / begin with the day, or the month.",
        show_default="dates that could be either are refused",
    ),
]
CreateMissing = Annotated[
    bool, typer.Option("--create-missing", envvar="INBAND_CREATE_MISSING", help="Set up what is not here yet.")
]
OnMachine = Annotated[str | None, typer.Option(envvar="INBAND_MACHINE", help="On which machine it is set up.")]
Columns = Annotated[
    str,
    typer.Option(
        envvar="INBAND_COLUMNS",
        help="In place of --characteristic, for a wide sheet: D35=shaft-d35,D40=shaft-d40, a column for each; for a table "
        "whose rows name their characteristic those names.",
    ),
]


@cli.command("import")
def import_file(
    file: File,
    characteristic: Characteristic = "",
    columns: Columns = "",
    sheet: Sheet = None,
    mapping: Mapping = "",
    delimiter: Delimiter = None,
    decimal: Decimal = None,
    unit: UnitOption = None,
    timezone: Zone = None,
    time_format: TimeFormat = None,
    encoding: Encoding = None,
    header_line: HeaderLine = None,
    first_line: FirstLine = None,
    last_line: LastLine = None,
    missing: Missing = "",
    create_missing: CreateMissing = False,
    machine: OnMachine = None,
    day_first: DayFirst = None,
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
    from app.loop.readings.importing.actions import import_readings
    from app.loop.readings.importing.history import Flawed
    from app.loop.readings.importing.layout import look, refuse_incomplete
    from app.loop.readings.importing.wide import Column, ColumnResult, columns_known, columns_said, import_wide

    if aqdef.is_aqdef(file):
        if live:
            raise typer.BadParameter(_("AQDEF is imported as history only."), param_hint="--live")
        chosen = aqdef.wishes_for(_zone(timezone), unit.value if unit else None, encoding, day_first=day_first)
        given = {"mapping": mapping, "characteristic": characteristic, "create_missing": create_missing}
        _import_aqdef(file, chosen, data_dir, database_url, machine=machine, dry_run=dry_run, **given)
        return
    _one_or_several(not (characteristic and columns))
    if live and not characteristic:
        raise typer.BadParameter(_("A wide sheet is imported as history only."), param_hint="--live")
    wishes = replace(
        wishes_of(mapping, delimiter, decimal, unit, timezone, time_format, encoding),
        header_line=header_line,
        first_line=first_line,
        last_line=last_line,
        missing=frozenset(mark.strip() for mark in missing.split(",") if mark.strip()),
    )
    actor = f"command line ({getpass.getuser()})"
    with (
        readable(file, sheet) as path,
        existing(settings_from(data_dir=data_dir, database_url=database_url)) as database,
        _bar(file) as bar,
    ):
        layout = look(path, wishes, file.name, complete=bool(characteristic))
        _one_or_several(bool(characteristic or columns or layout.names))
        if layout.names:
            refuse_incomplete(layout)
        _tell(layout, wide=not characteristic)
        how: dict[str, Any] = {"actor": actor, "source": file.name, "dry_run": dry_run, "progress": bar}
        try:
            if not characteristic:
                several = columns_said(columns, layout) or columns_known(database, layout)
                if create_missing:
                    several, machine = _with_missing(database, several, layout, machine)
                results = import_wide(database, several, path, layout, unit=wishes.unit, machine=machine, **how)
            else:
                summary = import_readings(database, characteristic, path, layout, live=live, **how)
                results = [ColumnResult(Column(0, characteristic), summary)]
        except Flawed as refusal:
            report(refusal)
            raise typer.Exit(1) from None
    with in_zone(_zone(timezone)):
        _sum_up_all(results, live=live, dry_run=dry_run)
    if any(result.trouble is not None for result in results):
        raise typer.Exit(1)


def _one_or_several(said: bool) -> None:
    if not said:
        words = _("Name one characteristic, the columns of several, or their names: --map characteristic=COLUMN.")
        raise typer.BadParameter(words, param_hint="--characteristic")


def _with_missing(
    database: Any, chosen: "list[Column]", layout: "Layout", machine: str | None
) -> "tuple[list[Column], str | None]":
    """The columns, with one for each characteristic that the rows describe and nobody has chosen; and its machine."""
    from app.loop.readings.importing.wide import with_missing

    if not layout.names:
        reason = _("Only AQDEF, and tables in which each row names its characteristic, say what is to be set up.")
        raise typer.BadParameter(reason, param_hint="--create-missing")
    columns, left_out, machine = with_missing(database, chosen, layout, machine)
    for each in left_out:
        say(_("{title}: left out: {reason}.").format(title=each.title, reason=each.not_new), style="yellow")
    return columns, machine


def _sum_up_all(results: "Collection[ColumnResult]", *, live: bool, dry_run: bool) -> None:
    from app.loop.readings.importing.history import Flawed

    for column, result, trouble, created in results:
        if created:
            text = _("{key} is set up with the drawing's limits; it measures only. Check its zones before it corrects.")
            say(text.format(key=column.characteristic))
        if result is not None:
            _sum_up(result, column.characteristic, live=live, dry_run=dry_run)
        elif isinstance(trouble, Flawed):
            report(trouble)
        elif trouble is not None:
            say(f"{column.characteristic}: {trouble.detail} {trouble.what_to_do or ''}", style="bold red")
    if not live and any(result is not None for _column, result, _trouble, _created in results):
        say(_("They are history: no correction, no alarm, and the running average stays as it was."))


def _import_aqdef(
    file: Path, wishes: "AqdefWishes", data_dir: Path | None, database_url: str | None, **given: Any
) -> None:
    from app.loop.readings.importing.history import Flawed

    with (
        existing(settings_from(data_dir=data_dir, database_url=database_url)) as database,
        _bar(file) as bar,
        in_zone(wishes.zone),
    ):
        try:
            outcome = aqdef.import_file(database, file, wishes, progress=bar, **given)
        except Flawed as refusal:
            report(refusal)
            raise typer.Exit(1) from None
    if any(each.trouble is not None for each in outcome.results):
        raise typer.Exit(1)


@contextmanager
def readable(file: Path, sheet: str | None = None) -> "Iterator[Path]":
    """The file as text: itself, or a sheet of the workbook that it is."""
    from app.files.formats import spreadsheet
    from app.files.formats.delimited import Unusable

    if file.suffix.lower() not in spreadsheet.ENDINGS:
        yield file
        return
    try:
        with spreadsheet.text_of(file, sheet) as path:
            yield path
    except Unusable as error:
        raise typer.BadParameter(str(error), param_hint="FILE") from None


@cli.command("export")
def export_file(
    characteristic: Annotated[
        str,
        typer.Option(
            envvar="INBAND_CHARACTERISTIC", help="The key of the characteristic; of AQDEF several, parted by commas."
        ),
    ],
    since: Annotated[str | None, typer.Option("--from", envvar="INBAND_FROM", help=SINCE)] = None,
    until: Annotated[str | None, typer.Option("--to", envvar="INBAND_TO", help=UNTIL)] = None,
    last: Annotated[int | None, typer.Option(envvar="INBAND_LAST", min=1, help="Only the last N.")] = None,
    timezone: Zone = None,
    context: OfContext = None,
    format_: Annotated[Format | None, typer.Option("--format", envvar="INBAND_FORMAT", show_default="csv")] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", envvar="INBAND_OUTPUT", help="A file.", show_default="standard output"),
    ] = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Write the readings of a characteristic, oldest first, as CSV or NDJSON, or those of several as AQDEF."""
    from app.access.audit import actions as audit
    from app.loop.readings import exporting, queries

    zone = _zone(timezone)
    period = _period(since, until, zone)
    dfq = format_ is Format.DFQ or (format_ is None and output is not None and output.suffix.lower() == ".dfq")
    chosen = chosen_context(context, aqdef=dfq)
    if dfq:
        if output is None:
            raise typer.BadParameter(_("name the file: AQDEF is not written to standard output"), param_hint="--output")
        keys = [key.strip() for key in characteristic.split(",") if key.strip()]
        with (
            existing(settings_from(data_dir=data_dir, database_url=database_url)) as database,
            database.begin() as session,
            in_zone(zone),
        ):
            aqdef.export_file(session, keys, output, period=period, last=last)
        return
    lines_wanted = format_ is Format.NDJSON or (format_ is None and output is not None and output.suffix == ".ndjson")
    with (
        existing(settings_from(data_dir=data_dir, database_url=database_url)) as database,
        database.begin() as session,
    ):
        entry = queries.entry_named(session, characteristic)
        ends, said = exporting.Ends(), {"context": dict(chosen)} if chosen else {}
        exported = ends.of(exporting.rows(session, entry, period=period, last=last, chosen=chosen))
        with _output(output) as target, in_zone(zone):
            count = (exporting.write_ndjson if lines_wanted else exporting.write_csv)(exported, target)
        audit.record(
            session,
            f"command line ({getpass.getuser()})",
            "readings exported",
            f"characteristic/{characteristic}",
            after={"readings": count, "format": "ndjson" if lines_wanted else "csv"} | said,
        )
    text = ngettext("%(num)d reading written", "%(num)d readings written", count) % {"num": count}
    with in_zone(zone):
        say(f"{text}{which(ends.numbers, ends.span)}.")


def wishes_of(
    mapping: str,
    delimiter: str | None,
    decimal: str | None,
    unit: Unit | None,
    timezone: str | None,
    time_format: str | None,
    encoding: str | None,
) -> "Wishes":
    from app.files.formats.delimited import BLANKS
    from app.loop.readings.importing.layout import Wishes

    pairs = [pair.partition("=") for pair in mapping.split(",") if pair.strip()]
    if any(not name.strip() or not sign for name, sign, _column in pairs):
        raise typer.BadParameter("write it as measured=COLUMN,measured_at=COLUMN", param_hint="--map")
    sign = {"tab": "\t", "\\t": "\t", "comma": ",", "semicolon": ";", "blanks": BLANKS}
    return Wishes(
        mapping={name.strip(): column.strip() for name, _sign, column in pairs},
        delimiter=sign.get(delimiter or "", delimiter),
        decimal={"comma": ",", "point": "."}.get(decimal or "", decimal),
        unit=unit.value if unit else None,
        timezone=timezone,
        time_format=time_format,
        encoding=encoding.lower() if encoding else None,
    )


def _tell(layout: "Layout", *, wide: bool = False) -> None:
    """Print how the file is understood, so that a wrong guess is seen."""
    known = ", ".join(f"{name} ← {layout.named(name)}" for name in layout.columns)
    say(_("Columns: {known} (in {unit})").format(known=known, unit=layout.unit))
    if layout.letters:
        words = _("Letters are read as {encoding}: “{text}”. If that is wrong, name the encoding: --encoding.")
        say(words.format(encoding=layout.encoding, text=layout.letters), style="yellow")
    if layout.ignored and not wide:
        say(_("Not used: {names}").format(names=", ".join(layout.ignored)))
    if layout.on_times:
        say(layout.on_times, style="yellow")


@contextmanager
def _bar(file: Path) -> Iterator[Any]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    with file.open("rb") as opened:
        total = sum(part.count(b"\n") for part in iter(lambda: opened.read(1 << 20), b""))
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=people, transient=True, disable=not people.is_terminal) as progress:
        task = progress.add_task(_("Lines"), total=max(1, total - 1))
        yield lambda: progress.advance(task)


def report(refusal: "Flawed", *, stored: bool = True) -> None:
    """Say how many lines are wrong, then each with its reason; where line after line is wrong in one way, the first and how far."""
    say(refusal.detail, style="bold red")
    for sentence in sentences(refusal.flaws):
        say(sentence)
    more = refusal.count - len(refusal.flaws)
    if more > 0:
        say(_("… and {more} more.").format(more=more))
    if stored and refusal.what_to_do:
        say(refusal.what_to_do, style="bold red")


def _sum_up(summary: "Summary", characteristic: str, *, live: bool, dry_run: bool) -> None:
    begin = _("Nothing was stored; this would be: ") if dry_run else ""
    text = stored_of(summary.stored, characteristic)
    if dry_run and live:
        text = _("{lines} lines can be read").format(lines=summary.lines)
    numbers = None if summary.first_sequence is None else (summary.first_sequence, summary.last_sequence)
    span = (summary.first_at, summary.last_at) if summary.stored and summary.first_at and summary.last_at else None
    say(f"{begin}{text}{which(numbers, span)}.", style="bold")
    for note in summary.notes:
        say(note, style="yellow")
    if summary.repeated:
        say(stored_before(summary.repeated))
    if summary.zones:
        say(_("Zones: {zones}").format(zones=", ".join(f"{zone} {count}" for zone, count in summary.zones.items())))
    if live and not dry_run:
        say(
            _("{corrections} corrections, {alarms} alarms.").format(
                corrections=summary.corrections, alarms=summary.alarms
            )
        )


def _zone(name: str | None) -> ZoneInfo:
    from app.files.formats import cell_values

    try:
        return cell_values.zone_named(name) if name else plant_zone()
    except cell_values.Unreadable as error:
        raise typer.BadParameter(str(error), param_hint="--timezone") from None


def _period(since: str | None, until: str | None, zone: ZoneInfo) -> "Period":
    from app.files.formats import periods

    typed = {"from": since or "", "to": until or ""}
    try:
        return periods.period_of(typed, zone)
    except Invalid as error:
        wrong = error.errors[0]
        raise typer.BadParameter(f"{typed[wrong.field]!r} {wrong.message}", param_hint=f"--{wrong.field}") from None


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
