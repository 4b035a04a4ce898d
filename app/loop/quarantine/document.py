"""A quarantine as a document: to be printed, and handed on as PDF, XLSX or CSV."""

import csv
import io
from datetime import datetime
from zoneinfo import ZoneInfo

from app.files.documents.content import (
    Column,
    Fact,
    Format,
    Report,
    Section,
    Table,
    Value,
    count,
    deviation,
    moment,
    size,
    width,
    words,
)
from app.files.documents.files import file_of
from app.files.formats.delimited import defused
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.alarm_response.wording import kind_word
from app.loop.quarantine import wording
from app.loop.quarantine.queries import PartRow, QuarantineRow


def table_of(rows: list[PartRow]) -> Table:
    """The parts, a row each."""
    return Table(
        (
            Column("number", _("No."), 0.5, "right"),
            Column("part", _("Part"), 1.4),
            Column("order", _("Order"), 1.0),
            Column("characteristic", _("Characteristic"), 1.4),
            Column("reading", _("Reading"), 0.8, "right"),
            Column("cut_at", _("Cut or measured"), 1.4),
            Column("tool", _("Tool"), 0.5, "right"),
            Column("offset", _("Cut with offset"), 1.1, "right"),
            Column("cut_without", _("Cut without correction"), 1.0),
            Column("measured", _("Size"), 1.1, "right"),
            Column("deviation", _("Deviation"), 0.9, "right"),
            Column("found", _("Measured?"), 1.2),
            Column("status", _("Status"), 0.9),
            Column("remeasured", _("Measured again"), 1.1, "right"),
            Column("decided", _("By whom, when, why"), 2.2),
        ),
        tuple(_row(row) for row in rows),
    )


def _row(row: PartRow) -> tuple[Value, ...]:
    part = row.part
    return (
        count(part.number),
        words(wording.part_name(part.part, part.part_to) if part.part else None),
        words(part.order),
        words(row.characteristic.key),
        count(part.sequence),
        moment(part.cut_at),
        count(part.tool_memory),
        size(part.offset),
        words(", ".join(map(str, part.cut_without))),
        size(part.measured),
        deviation(part.deviation),
        words(wording.found_word(part.found)),
        words(wording.status_word(part.status)),
        size(part.remeasured),
        words(wording.decided(part)),
    )


def report_of(row: QuarantineRow, rows: list[PartRow], now: datetime) -> Report:
    """The whole quarantine. now: the moment that it bears."""
    made = row.quarantine
    head = (
        Fact("quarantine", _("Quarantine"), count(made.id)),
        Fact("machine", _("Machine"), words(f"{row.machine.name} ({row.machine.key})")),
        Fact("alarm", _("Alarm"), words(f"{made.alarm_id}, {kind_word(row.kind)}")),
        Fact("made", _("Set aside"), moment(made.made_at)),
        Fact("by", _("By whom"), words(made.made_by)),
        Fact("why", _("Why"), words(made.reason)),
        Fact("guard", _("Measuring uncertainty"), width(made.guard)),
        Fact("open", wording.status_word("open"), count(row.open)),
        Fact("released", wording.status_word("released"), count(row.released)),
        Fact("scrapped", wording.status_word("scrapped"), count(row.scrapped)),
    )
    return Report(
        key=f"quarantine-{made.id}",
        name=_("Quarantine {number}").format(number=made.id),
        machine=row.machine.name,
        part="",
        period=_("parts of alarm {number}").format(number=made.alarm_id),
        zone=plant_zone().key,
        made_at=moment(now),
        head=head,
        sections=(Section("parts", _("Parts"), table=table_of(rows)),),
    )


def file_of_quarantine(row: QuarantineRow, rows: list[PartRow], as_: Format, now: datetime) -> bytes:
    """The file. CSV has a line a part, under the names of the columns."""
    return _csv(table_of(rows)) if as_ is Format.CSV else file_of(report_of(row, rows, now), as_)


def _csv(table: Table) -> bytes:
    file = io.StringIO(newline="")
    writer = csv.writer(file, lineterminator="\r\n")
    writer.writerow(column.key for column in table.columns)
    zone = ZoneInfo(plant_zone().key)
    for row in table.rows:
        writer.writerow(_cell(value, zone) for value in row)
    return ("\ufeff" + file.getvalue()).encode()


def _cell(value: Value, zone: ZoneInfo) -> str | float | int:
    """Lengths in mm, as they are kept."""
    if value.value is None:
        return ""
    if value.moment is not None:
        return value.moment.astimezone(zone).isoformat()
    return defused(value.value) if isinstance(value.value, str) else value.value
