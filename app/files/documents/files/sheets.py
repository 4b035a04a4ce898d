"""Reports as an XLSX workbook: typed cells, charts that the spreadsheet draws itself, one sheet per characteristic.

A text is always written as a text: nothing that comes from outside can become a formula or a link.
"""

import io
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any
from zoneinfo import ZoneInfo

from xlsxwriter import Workbook
from xlsxwriter.chart import Chart
from xlsxwriter.format import Format
from xlsxwriter.worksheet import Worksheet

from app.files.documents.content import Picture, Report, Section, Table, Value
from app.language.i18n import _
from app.language.times import is_twice

WIDEST = 60  # letters of a column
STEADY = "#4a5560"
NO_LINKS = {"strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False, "in_memory": True}
SUMMARY = (
    "numbers.count",
    "numbers.mean",
    "numbers.standard_deviation",
    "numbers.share_in_tolerance",
    "capability.cpk",
    "capability.ppk",
    "alarms.raised",
)


def workbook(reports: Sequence[Report], problems: Sequence[tuple[str, str]] = ()) -> bytes:
    """All of them in one file. problems: characteristics without a report, each with why."""
    file = io.BytesIO()
    book = Workbook(file, NO_LINKS)
    created = max(
        (report.made_at.moment for report in reports if report.made_at.moment), default=datetime(2000, 1, 1, tzinfo=UTC)
    )
    book.set_properties({"created": created.replace(tzinfo=None), "author": "Inband", "title": _("Report")})
    writing = _Writing(book)
    if len(reports) != 1 or problems:
        writing.summary(reports, problems)
    for report in reports:
        writing.report(report, apart=len(reports) == 1 and not problems)
    book.close()
    return file.getvalue()


class _Writing:
    """One workbook being written."""

    def __init__(self, book: Workbook) -> None:
        self.book = book
        self.names: set[str] = {"history"}  # which spreadsheets keep for themselves
        self.title = book.add_format({"bold": True, "font_size": 16})
        self.heading = book.add_format({"bold": True, "font_size": 12, "bottom": 1})
        self.head = book.add_format({"bold": True, "bg_color": "#e4e7e8", "text_wrap": True, "valign": "top"})
        self.text = book.add_format({"text_wrap": True, "valign": "top"})
        self.quiet = book.add_format({"font_color": "#5a646c", "valign": "top"})
        self.warning = book.add_format({"font_color": "#a84b00", "bold": True})
        self.formats: dict[str, Format] = {}

    def sheet(self, title: str) -> Worksheet:
        """A new sheet with a name that spreadsheets take: 31 letters at most, none of []:*?/\\, no two alike."""
        name = re.sub(r"[\[\]:*?/\\]", "-", title)[:31].strip("'") or "-"
        base, number = name, 1
        while name.casefold() in self.names:
            number += 1
            name = f"{base[: 30 - len(str(number))]}~{number}"
        self.names.add(name.casefold())
        return self.book.add_worksheet(name)

    def summary(self, reports: Sequence[Report], problems: Sequence[tuple[str, str]]) -> None:
        """One line for every characteristic, and what could not be made."""
        sheet = self.sheet(_("Summary"))
        sheet.write_string(0, 0, _("Summary"), self.title)
        paths = [name.split(".") for name in SUMMARY]
        titles = {
            (section.key, fact.key): (fact.name, fact.value.unit)
            for report in reports
            for section in report.sections
            for fact in section.facts
        }
        columns = [(section, key, *titles[section, key]) for section, key in paths if (section, key) in titles]
        names = [_("Characteristic"), _("Name"), _("Machine"), _("Period")]
        names += [f"{name}, {unit}" if unit else name for _section, _key, name, unit in columns]
        for at, name in enumerate(names):
            sheet.write_string(2, at, name, self.head)
        for row, report in enumerate(reports, start=3):
            for at, text in enumerate((report.key, report.name, report.machine, report.period)):
                sheet.write_string(row, at, text, self.text)
            for at, (section, key, _name, _unit) in enumerate(columns, start=4):
                section_of_report = report.section(section)
                value = (
                    next((fact.value for fact in section_of_report.facts if fact.key == key), None)
                    if section_of_report
                    else None
                )
                if value is not None:
                    self.cell(sheet, row, at, value, ZoneInfo(report.zone))
        sheet.set_column(0, 2, 24)
        sheet.set_column(3, 3, 52)
        sheet.set_column(4, len(names), 16)
        sheet.freeze_panes(3, 1)
        row = len(reports) + 5
        if problems:
            sheet.write_string(row, 0, _("Without a report"), self.heading)
        for at, (key, why) in enumerate(problems, start=row + 1):
            sheet.write_string(at, 0, key, self.text)
            sheet.write_string(at, 1, why, self.warning)

    def report(self, report: Report, *, apart: bool) -> None:
        """One report: on a sheet of its own, its tables below, or apart on sheets of theirs."""
        sheet = self.sheet(_("Report") if apart else report.key)
        zone = ZoneInfo(report.zone)
        sheet.write_string(0, 0, report.name, self.title)
        sheet.write_string(1, 0, report.period, self.quiet)
        sheet.write_string(2, 0, report.made, self.quiet)
        for at, warning in enumerate(report.warnings, start=3):
            sheet.write_string(at, 0, warning, self.warning)
        row = self.facts(sheet, 4 + len(report.warnings), report.head, zone)
        pictures: list[Picture] = []
        for section in report.sections:
            row = self.section(sheet, row + 1, section, zone, apart=apart)
            if not section.signatures:  # the charts of the first page are those of its appendices
                pictures += section.pictures
            if section.table is not None and apart:
                self.table(self.sheet(section.title), 0, section.table, zone, alone=True)
        sheet.set_column(0, 0, 44)
        sheet.set_column(1, 1, 10)
        sheet.set_column(2, 10, 20)
        sheet.set_landscape()
        sheet.fit_to_pages(1, 0)
        for picture in pictures if apart else ():
            self.picture(picture, zone)

    def section(self, sheet: Worksheet, row: int, section: Section, zone: ZoneInfo, *, apart: bool) -> int:
        """Title, sentences, facts, and the table if it is below; the row after them."""
        sheet.write_string(row, 0, section.title, self.heading)
        row += 1
        for sentence in section.sentences:
            sheet.write_string(row, 0, sentence, self.quiet)
            row += 1
        for sentence in section.warnings:
            sheet.write_string(row, 0, sentence, self.warning)
            row += 1
        if any(fact.low is not None for fact in section.facts):
            sheet.write_string(row, 4, _("Interval from"), self.head)
            sheet.write_string(row, 5, _("to"), self.head)
            row += 1
        row = self.facts(sheet, row, section.facts, zone)
        if section.table is not None and not apart:
            row = self.table(sheet, row, section.table, zone, alone=False)
        return row

    def facts(self, sheet: Worksheet, row: int, facts: Sequence[Any], zone: ZoneInfo) -> int:
        """Name, R number, value, unit, interval, note."""
        for fact in facts:
            sheet.write_string(row, 0, fact.name, self.text)
            sheet.write_string(row, 1, fact.code, self.quiet)
            self.cell(sheet, row, 2, fact.value, zone)
            sheet.write_string(row, 3, fact.value.unit, self.quiet)
            for at, end in ((4, fact.low), (5, fact.high)):
                if end is not None:
                    self.cell(sheet, row, at, end, zone)
            sheet.write_string(row, 6, fact.note, self.quiet)
            row += 1
        return row

    def table(self, sheet: Worksheet, row: int, table: Table, zone: ZoneInfo, *, alone: bool) -> int:
        """A heading and its rows; the row after them. Alone on its sheet it can be filtered and stays under its heading."""
        for at, column in enumerate(table.columns):
            sheet.write_string(row, at, _titled(column.name, table.rows, at, zone), self.head)
            if alone:
                sheet.set_column(at, at, min(WIDEST, max(10, column.share * 14)))
        for line in table.rows:
            row += 1
            for at, value in enumerate(line):
                self.cell(sheet, row, at, value, zone)
        if alone and table.rows:
            sheet.freeze_panes(1, 0)
            sheet.autofilter(0, 0, row, len(table.columns) - 1)
        if table.more:
            row += 1
            sheet.write_string(row, 0, _("… and {n} older ones.").format(n=table.more), self.quiet)
        return row + 1

    def cell(self, sheet: Worksheet, row: int, column: int, value: Value, zone: ZoneInfo) -> None:
        """A value as what it is: number, moment, or text."""
        moment, number = value.moment, value.number
        if moment is not None:
            local = moment.astimezone(zone)
            if is_twice(local):  # a cell that is a moment cannot say which of the two it is
                sheet.write_string(row, column, value.words(zone), self.text)
            else:
                sheet.write_datetime(row, column, local.replace(tzinfo=None), self.shaped("yyyy-mm-dd hh:mm:ss"))
        elif number is not None:
            sheet.write_number(row, column, number, self.shaped(_shape(value)))
        elif value.value is not None:
            sheet.write_string(row, column, str(value.value), self.text)

    def shaped(self, shape: str) -> Format:
        if shape not in self.formats:
            self.formats[shape] = self.book.add_format({"num_format": shape, "align": "left", "valign": "top"})
        return self.formats[shape]

    def picture(self, picture: Picture, zone: ZoneInfo) -> None:
        """The data of a chart as cells, and the chart that the spreadsheet draws of them."""
        sheet = self.sheet(picture.title)
        data = picture.data()
        self.table(sheet, 0, data, zone, alone=True)
        rows = data.rows
        bars = picture.key == "histogram"
        chart = self.book.add_chart({"type": "column"} if bars else {"type": "scatter", "subtype": "straight"})
        assert isinstance(chart, Chart)
        for at, column in list(enumerate(data.columns))[1:]:
            if not any(row[at].number is not None for row in rows):
                continue
            dots = at == 1
            chart.add_series({
                "name": column.name,
                "categories": [sheet.name, 1, 0, len(rows), 0],
                "values": [sheet.name, 1, at, len(rows), at],
                **({"gap": 10, "fill": {"color": STEADY}} if bars else {}),
                **({} if bars else {"line": {"none": True} if dots else {"width": 1}}),
                **({} if bars else {"marker": {"type": "circle" if dots else "none", "size": 3}}),
            })  # fmt: skip
        across, up = data.columns[0], data.columns[1]
        chart.set_x_axis({"name": _titled(across.name, rows, 0), "label_position": "low"})
        chart.set_y_axis({"name": _titled(up.name, rows, 1)})
        if bars:
            chart.set_legend({"none": True})
        chart.set_size({"width": 980, "height": 480})
        sheet.insert_chart(1, len(data.columns) + 1, chart, {"description": picture.says})


def _titled(name: str, rows: Sequence[Sequence[Value]], at: int, zone: ZoneInfo | None = None) -> str:
    if zone is not None and any(row[at].moment for row in rows):
        return f"{name}, {zone.key}"
    unit = next((row[at].unit for row in rows), "")
    return f"{name}, {unit}" if unit else name


def _shape(value: Value) -> str:
    decimals = value.shown_decimals
    digits = f"0.{'0' * decimals}" if decimals else "0"
    return {"count": "#,##0", "deviation": f"+{digits};-{digits};{digits}"}.get(value.kind, digits)
