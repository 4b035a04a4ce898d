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
    table_of,
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


def parts_table(rows: list[PartRow]) -> Table:
    """The parts, a row each."""
    return table_of(
        rows,
        (Column("number", _("No."), 0.5, "right"), lambda row: count(row.part.number)),
        (
            Column("part", _("Part"), 1.4),
            lambda row: words(wording.part_name(row.part.part, row.part.part_to) if row.part.part else None),
        ),
        (Column("order", _("Order"), 1.0), lambda row: words(row.part.order)),
        (Column("characteristic", _("Characteristic"), 1.4), lambda row: words(row.characteristic.key)),
        (Column("reading", _("Reading"), 0.8, "right"), lambda row: count(row.part.sequence)),
        (Column("cut_at", _("Cut or measured"), 1.4), lambda row: moment(row.part.cut_at)),
        (Column("tool", _("Tool"), 0.5, "right"), lambda row: count(row.part.tool_memory)),
        (Column("offset", _("Cut with offset"), 1.1, "right"), lambda row: size(row.part.offset)),
        (
            Column("cut_without", _("Cut without correction"), 1.0),
            lambda row: words(", ".join(map(str, row.part.cut_without))),
        ),
        (Column("measured", _("Size"), 1.1, "right"), lambda row: size(row.part.measured)),
        (Column("deviation", _("Deviation"), 0.9, "right"), lambda row: deviation(row.part.deviation)),
        (Column("found", _("Measured?"), 1.2), lambda row: words(wording.found_word(row.part.found))),
        (Column("status", _("Status"), 0.9), lambda row: words(wording.status_word(row.part.status))),
        (Column("remeasured", _("Measured again"), 1.1, "right"), lambda row: size(row.part.remeasured)),
        (Column("decided", _("By whom, when, why"), 2.2), lambda row: words(wording.decided(row.part))),
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
        sections=(Section("parts", _("Parts"), table=parts_table(rows)),),
    )


def file_of_quarantine(row: QuarantineRow, rows: list[PartRow], as_: Format, now: datetime) -> bytes:
    """The file. CSV has a line a part, under the names of the columns."""
    return _csv(parts_table(rows)) if as_ is Format.CSV else file_of(report_of(row, rows, now), as_)


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
