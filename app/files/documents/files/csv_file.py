"""A report as CSV: one line per value, so that a program finds each by its names; a spreadsheet opens it as well.

Columns: section, row (in a table, from 1), key, name, value, unit, text. `value` is the plain number in `unit`, a moment with its
offset, or the text; `text` is what the page shows. Texts that a spreadsheet would take for a formula are defused.
"""

import csv
import io
from zoneinfo import ZoneInfo

from app.files.documents.content import Report, Value
from app.files.formats.delimited import defused

COLUMNS = ("section", "row", "key", "name", "value", "unit", "text")


def csv_of(report: Report) -> bytes:
    """The file; UTF-8 with a byte order mark, without which spreadsheets take µ for something else."""
    file = io.StringIO(newline="")
    writer = csv.writer(file, lineterminator="\r\n")
    writer.writerow(COLUMNS)

    def line(section: str, row: int | str, key: str, name: str, value: Value) -> None:
        text = report.words(value)
        plain = _plain(value, ZoneInfo(report.zone))
        texts = (section, row, key, defused(name), plain, value.unit, defused(text))
        writer.writerow(texts)

    def sentence(section: str, kind: str, number: int, text: str) -> None:
        writer.writerow((section, number, kind, "", defused(text), "", defused(text)))

    for number, text in enumerate(report.warnings, start=1):
        sentence("head", "warning", number, text)
    for fact in report.head:
        line("head", "", fact.key, fact.name, fact.value)
    sentence("head", "name", 1, report.name)
    sentence("head", "period", 1, report.period)
    sentence("head", "timezone", 1, report.zone)
    line("head", "", "made_at", "", report.made_at)
    for section in report.sections:
        for number, text in enumerate(section.sentences, start=1):
            sentence(section.key, "sentence", number, text)
        for number, text in enumerate(section.warnings, start=1):
            sentence(section.key, "warning", number, text)
        for fact in section.facts:
            line(section.key, "", fact.key, fact.name, fact.value)
            for end, value in (("low", fact.low), ("high", fact.high)):
                if value is not None:
                    line(section.key, "", f"{fact.key}_{end}", fact.name, value)
        for number, row in enumerate(section.table.rows if section.table else (), start=1):
            for column, value in zip(section.table.columns if section.table else (), row, strict=True):
                line(section.key, number, column.key, column.name, value)
    return ("\ufeff" + file.getvalue()).encode()


def _plain(value: Value, zone: ZoneInfo) -> str | float | int:
    if value.value is None:
        return ""
    if value.moment is not None:
        return value.moment.astimezone(zone).isoformat()
    return defused(str(value.value)) if value.number is None else value.number
