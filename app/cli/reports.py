"""``inband report``: reports of characteristics as files."""

import getpass
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, cli, existing, people, say, settings_from
from app.cli.context import OfContext, chosen_context
from app.cli.data import SINCE, UNTIL, Zone
from app.errors import InbandError
from app.files.documents.content import Format, Paper
from app.language.i18n import _, ngettext
from app.views.reports.request import ReportRequest, SectionName, typed

if TYPE_CHECKING:
    from app.db.engine import Database
    from app.views.reports.bundle import Bundle, BundleFormat, Part

Keys = Annotated[list[str], typer.Argument(help="Keys of characteristics.", metavar="CHARACTERISTIC...")]


@cli.command("report")
def report_files(
    characteristic: Keys,
    since: Annotated[str | None, typer.Option("--from", envvar="INBAND_FROM", help=SINCE)] = None,
    until: Annotated[str | None, typer.Option("--to", envvar="INBAND_TO", help=UNTIL)] = None,
    last: Annotated[
        int | None,
        typer.Option(
            envvar="INBAND_LAST",
            min=1,
            help="Only the last N.",
            show_default="1000 if neither period nor context is named",
        ),
    ] = None,
    timezone: Zone = None,
    context: OfContext = None,
    section: Annotated[
        list[SectionName] | None,
        typer.Option(help="Only this section; may be named more than once.", show_default="all"),
    ] = None,
    format_: Annotated[Format | None, typer.Option("--format", envvar="INBAND_FORMAT", show_default="pdf")] = None,
    paper: Annotated[Paper, typer.Option(envvar="INBAND_PAPER", help="For PDF.")] = Paper.A4,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            envvar="INBAND_OUTPUT",
            help="A file; for several characteristics a folder, a .zip, or an .xlsx with a sheet for each.",
            show_default="standard output",
        ),
    ] = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Write reports of characteristics: numbers, capability, wear, corrections, alarms, parameters, decisions."""
    keys = list(dict.fromkeys(characteristic))
    form = format_ or _form_by(output)
    request = typed(
        {
            "from": since or "",
            "to": until or "",
            "last": str(last or ""),
            "timezone": timezone or "",
            "paper": paper.value,
        },
        [name.value for name in section or ()],
        chosen_context(context),
    )
    _check(keys, form, output)
    from app.quality.proof import queries as proof
    from app.views.reports.bundle import Bundle

    proof.begin()
    bundle = Bundle(request, _bundled(form, output, keys))
    with existing(settings_from(data_dir=data_dir, database_url=database_url)) as database:
        parts = _made(database, keys, bundle, request)
    _write(parts, bundle, form, output)
    failed = [part for part in parts if part.trouble is not None]
    for part in failed:
        say(f"{part.key}: {part.trouble}", style="bold red")
    many = len(parts) - len(failed)
    say(ngettext("%(num)d report written.", "%(num)d reports written.", many) % {"num": many})
    if failed:
        raise typer.Exit(1)


def _form_by(output: Path | None) -> Format:
    """By the end of the file's name; else PDF."""
    end = output.suffix.removeprefix(".").lower() if output else ""
    return Format(end) if end in set(Format) else Format.PDF


def _check(keys: Sequence[str], form: Format, output: Path | None) -> None:
    if output is None and len(keys) > 1:
        raise typer.BadParameter("name a folder, a .zip or an .xlsx for several reports", param_hint="--output")
    if output is None and form is not Format.CSV and sys.stdout.isatty():
        raise typer.BadParameter(f"{form.value} is nothing for a terminal; name a file", param_hint="--output")
    if output is not None and not output.is_dir() and len(keys) > 1 and output.suffix.lower() in {".pdf", ".csv"}:
        raise typer.BadParameter(
            f"{output} can hold one report; name a folder, a .zip or an .xlsx for several", param_hint="--output"
        )
    folder = output if output is None or output.is_dir() else output.parent
    if folder is not None and output is not None and output.suffix and not folder.is_dir():
        raise typer.BadParameter(f"there is no folder {folder}", param_hint="--output")


def _bundled(form: Format, output: Path | None, keys: Sequence[str]) -> "BundleFormat":
    """One workbook for several characteristics where the output is one .xlsx; else files."""
    one_sheet_each = output is not None and output.suffix.lower() == ".xlsx" and not output.is_dir() and len(keys) > 1
    return "workbook" if one_sheet_each else form.value


def _made(database: "Database", keys: Sequence[str], bundle: "Bundle", request: ReportRequest) -> "list[Part]":
    """Every report, or why there is none."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from app.access.audit.actions import record
    from app.loop.characteristics import queries as characteristics
    from app.quality.proof import queries as proof
    from app.views.reports import queries
    from app.views.reports.bundle import Part

    parts: list[Part] = []
    proof.proof()  # what is handed over says it if an example fails
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=people, transient=True, disable=not people.is_terminal) as progress:
        task = progress.add_task(_("Reports"), total=len(keys))
        for key in keys:
            progress.update(task, description=key)
            try:
                with database.begin() as session:
                    current = characteristics.characteristic_named(session, key)
                    report = queries.report_of(session, current, request, datetime.now(UTC), getpass.getuser())
                    actor, subject = f"command line ({getpass.getuser()})", f"characteristic/{key}"
                    record(session, actor, "report written", subject, after={"format": bundle.form})
                parts.append(Part(key, bundle.part(report), None))
            except InbandError as error:
                parts.append(Part(key, None, f"{error.detail} {error.what_to_do or ''}".strip()))
            progress.advance(task)
    return parts


def _write(parts: "Sequence[Part]", bundle: "Bundle", form: Format, output: Path | None) -> None:
    from app.views.reports.bundle import packed

    finished = [part for part in parts if part.content is not None]
    if not finished:
        return
    if output is None:
        sys.stdout.buffer.write(finished[0].content or b"")
        sys.stdout.buffer.flush()
    elif output.is_dir() or not output.suffix:
        output.mkdir(parents=True, exist_ok=True)
        for part in finished:
            _replace(output / f"report-{part.key}.{form.value}", part.content or b"")
    elif bundle.form == "workbook" or output.suffix.lower() == ".zip":
        _replace(output, packed(bundle.form, parts, datetime.now(UTC)))
    else:
        _replace(output, finished[0].content or b"")


def _replace(path: Path, content: bytes) -> None:
    """A file that is there only once it is complete."""
    draft = path.with_name(f".{path.name}.part")
    try:
        draft.write_bytes(content)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
