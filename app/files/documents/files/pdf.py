"""A report as PDF: A4 or Letter, page numbers, the characteristic and the period on every page, charts as vectors.

Nothing of the wall clock goes into it beyond the moment that the report says it was made at: the same report gives the same bytes.
"""

import io
from collections.abc import Sequence
from typing import Any

from reportlab.lib.colors import Color
from reportlab.lib.enums import TA_RIGHT
from reportlab.lib.pagesizes import A4, LETTER
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    CondPageBreak,
    Flowable,
    KeepTogether,
    LongTable,
    PageBreak,
    Paragraph,
    SimpleDocTemplate,
    Spacer,
    TableStyle,
)
from reportlab.platypus import Table as Grid

from app.charts import to_drawing
from app.files.documents.content import Fact, Paper, Picture, Report, Section, Table
from app.files.documents.files.canvas import Chart, colour
from app.files.documents.files.fonts import BOLD, REGULAR, fonts, markup, runs, width_of
from app.language.i18n import _

PAPERS = {Paper.A4: A4, Paper.LETTER: LETTER}
MARGIN, TOP, BOTTOM = 16 * mm, 24 * mm, 18 * mm
INK, QUIET, RULE, ATTENTION = (colour(text) for text in ("#1d2328", "#5a646c", "#c3cacd", "#a84b00"))
GROUND, BAND = colour("#e9ecec"), colour("#f6f7f7")
SIDE = 0.58  # of the width that facts take beside a picture


def pdf_of(report: Report, paper: Paper = Paper.A4) -> bytes:
    """The file."""
    fonts()
    file = io.BytesIO()
    width, _height = PAPERS[paper]
    document = SimpleDocTemplate(
        file,
        pagesize=PAPERS[paper],
        leftMargin=MARGIN,
        rightMargin=MARGIN,
        topMargin=TOP,
        bottomMargin=BOTTOM,
        title=f"{report.name} ({report.key})",
        author="Inband",
        subject=report.period,
        invariant=1,
        lang="en",
    )
    inner = width - 2 * MARGIN - 12  # the frame keeps 6 points on either side
    story = _head(report, inner)
    for section in report.sections:
        story += _section(report, section, inner)
    document.build(story, canvasmaker=lambda *given, **more: _Numbered(report, PAPERS[paper], *given, **more))
    return file.getvalue()


class _Numbered(Canvas):
    """Writes head and foot of every page once it is known how many there are."""

    def __init__(self, report: Report, size: tuple[float, float], *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._report, self._size = report, size
        self._pages: list[dict[str, Any]] = []

    def showPage(self) -> None:  # noqa: N802 - ReportLab's name
        self._pages.append(dict(self.__dict__))
        self._startPage()  # type: ignore[attr-defined]

    def save(self) -> None:
        pages = self._pages
        for number, page in enumerate(pages, start=1):
            self.__dict__.update(page)
            self._frame(number, len(pages))
            super().showPage()
        super().save()

    def _frame(self, number: int, of: int) -> None:
        width, height = self._size
        report = self._report
        left, right, top = MARGIN + 6, width - MARGIN - 6, height - 13 * mm
        self._words(left, top, f"{report.name} ({report.key})", 9.5, INK, right - left - 90, bold=True)
        self._words(left, top - 12, report.period, 8, QUIET, right - left)
        machine = report.machine
        self._words(right - min(width_of(machine, 8), 90), top, machine, 8, QUIET, 90)
        self.setStrokeColor(RULE)
        self.setLineWidth(0.75)
        self.line(left, top - 18, right, top - 18)
        self._words(left, 10 * mm, report.made, 8, QUIET, right - left - 60)
        pages = _("{page} of {pages}").format(page=number, pages=of)
        self._words(right - width_of(pages, 8), 10 * mm, pages, 8, QUIET, 60)

    def _words(
        self, x: float, y: float, text: str, size: float, ink: Color, room: float, *, bold: bool = False
    ) -> None:
        text = " ".join(text.split())
        if width_of(text, size, bold=bold) > room:
            while text and width_of(f"{text}…", size, bold=bold) > room:
                text = text[:-1]
            text += "…"
        self.setFillColor(ink)
        for piece, chinese in runs(text):
            font = "STSong-Light" if chinese else BOLD if bold else REGULAR
            self.setFont(font, size)
            self.drawString(x, y, piece)
            x += self.stringWidth(piece, font, size)


def _style(name: str, size: float, leading: float, **more: Any) -> ParagraphStyle:
    attributes: dict[str, Any] = {"fontName": REGULAR, "textColor": INK, "splitLongWords": 1} | more
    return ParagraphStyle(name, fontSize=size, leading=leading, **attributes)


TITLE = _style("title", 19, 23, fontName=BOLD)
HEADING = _style("heading", 12.5, 16, fontName=BOLD, spaceBefore=14, spaceAfter=4, keepWithNext=1)
TEXT = _style("text", 8.5, 11.5, textColor=QUIET, spaceAfter=2)
WARNING = _style("warning", 8.5, 11.5, textColor=ATTENTION, fontName=BOLD, spaceAfter=2)
CAPTION = _style("caption", 9, 12, fontName=BOLD, spaceBefore=8)
CELL = _style("cell", 7, 8.8)
NUMBER = _style("number", 7, 8.8, alignment=TA_RIGHT)
HEAD, HEAD_RIGHT = (
    _style("column", 7, 8.8, fontName=BOLD),
    _style("column-right", 7, 8.8, fontName=BOLD, alignment=TA_RIGHT),
)
NAME, VALUE = _style("name", 8, 10.5, textColor=QUIET), _style("value", 8, 10.5, alignment=TA_RIGHT)


def _head(report: Report, width: float) -> list[Flowable]:
    title: list[Flowable] = [Paragraph(markup(report.name), TITLE), Paragraph(markup(report.period), TEXT)]
    if any(section.signatures for section in report.sections):
        logo = Grid([[Paragraph(markup(_("Logo")), TEXT)]], colWidths=[LOGO[0]], rowHeights=[LOGO[1]], style=_EMPTY)
        title = [Grid([[title, logo]], colWidths=[width - LOGO[0], LOGO[0]], style=_BESIDE)]
    return [
        *title,
        *(Paragraph(f"▲ {markup(warning)}", WARNING) for warning in report.warnings),
        Spacer(0, 6),
        _facts(report, report.head, width, 2),
    ]


def _section(report: Report, section: Section, width: float) -> list[Flowable]:
    begin: list[Flowable] = [Paragraph(markup(section.title), HEADING)]
    begin += [Paragraph(markup(sentence), TEXT) for sentence in section.sentences]
    begin += [Paragraph(f"▲ {markup(sentence)}", WARNING) for sentence in section.warnings]
    beside = next((picture for picture in section.pictures if picture.beside), None)
    story: list[Flowable] = []
    if section.facts and beside is not None:
        room = width * (1 - SIDE) - 10
        pair = [[_facts(report, section.facts, width * SIDE, 1), _chart(beside, room)]]
        begin.append(Grid(pair, colWidths=[width * SIDE + 10, room], style=_BESIDE))
    elif section.facts:
        begin.append(_facts(report, section.facts, width, 2))
    wide = [picture for picture in section.pictures if picture is not beside]
    for picture in wide:
        named = [Paragraph(markup(picture.title), CAPTION)] if len(wide) > 1 else [Spacer(0, 4)]
        story.append(KeepTogether([*named, _chart(picture, width)]))
    table = section.table
    if table is not None and table.rows:
        story += [Spacer(0, 5), _table(report, table, width)]
    if table is not None and table.more:
        story.append(Paragraph(markup(_("… and {n} older ones.").format(n=table.more)), TEXT))
    if section.signatures:
        gap, one = 14.0, (width - 14.0 * (len(section.signatures) - 1)) / len(section.signatures)
        places = [Paragraph(markup(name), TEXT) for name in section.signatures]
        cells = [cell for place in places for cell in (place, "")][:-1]
        widths = [size for _place in places for size in (one, gap)][:-1]
        rules = [("LINEABOVE", (2 * at, 0), (2 * at, 0), 0.6, INK) for at in range(len(places))]
        story += [Spacer(0, 34), Grid([cells], colWidths=widths, style=TableStyle(rules)), PageBreak()]
    # A heading stands with what it is the heading of; names and values are read downward, so they are not parted either.
    return [KeepTogether(begin), *story] if section.facts else [CondPageBreak(_least(section, width)), *begin, *story]


def _least(section: Section, width: float) -> float:
    """Least room below a heading for it to be printed there, points."""
    lines = len(section.sentences) + 1.3 * len(section.warnings)
    if section.pictures:
        return 44 + 14 * lines + max(picture.height / picture.width for picture in section.pictures) * width
    return 110 + 14 * lines


def _chart(picture: Picture, width: float) -> Flowable:
    return Chart(to_drawing(picture.figure, picture.width, picture.height), width)


LOGO = (42 * mm, 16 * mm)
_EMPTY = TableStyle([("BOX", (0, 0), (-1, -1), 0.6, RULE, None, (3, 2)), ("VALIGN", (0, 0), (-1, -1), "MIDDLE")])
_BESIDE = TableStyle([
    ("VALIGN", (0, 0), (-1, -1), "TOP"),
    ("LEFTPADDING", (0, 0), (-1, -1), 0),
    ("RIGHTPADDING", (0, 0), (-1, -1), 0),
])  # fmt: skip


def _facts(report: Report, facts: Sequence[Fact], width: float, columns: int) -> Flowable:
    """Names and values, in as many columns, filled downward."""
    tall = -(-len(facts) // columns)
    rows: list[list[Any]] = []
    ruled: list[tuple[int, int]] = []
    for at in range(tall):
        row: list[Any] = []
        for column in range(columns):
            number = column * tall + at
            if number >= len(facts):
                row += ["", "", ""]
                continue
            fact = facts[number]
            code = f' <font size="6.5">{markup(fact.code)}</font>' if fact.code else ""
            note = f'<br/><font size="6.5">{markup(fact.note)}</font>' if fact.note else ""
            value = markup(report.words(fact.value))
            between = report.between(fact)
            value += f' <font size="6.5" color="#5a646c">({markup(between)})</font>' if between else ""
            row += [Paragraph(markup(fact.name) + code + note, NAME), Paragraph(value, VALUE), ""]
            ruled.append((column, at))
        rows.append(row)
    gap = 16.0 if columns > 1 else 0.01
    one = (width - gap * (columns - 1)) / columns
    widths = [one * 0.52, one * 0.48, gap] * columns
    widths[-1] = 0.01
    rules = [("LINEBELOW", (3 * column, at), (3 * column + 1, at), 0.4, RULE) for column, at in ruled]
    padding = [
        ("TOPPADDING", (0, 0), (-1, -1), 1.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2),
        ("LEFTPADDING", (0, 0), (-1, -1), 0),
        ("RIGHTPADDING", (0, 0), (-1, -1), 0),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
    ]
    return LongTable(rows, colWidths=widths, style=TableStyle([*rules, *padding]), hAlign="LEFT")


def _widths(report: Report, table: Table, width: float) -> list[float]:
    """Widths of columns by their shares, but none narrower than its longest word: numbers stay with their units."""
    columns = [table.columns[at] for at in table.filled]
    shares = sum(column.share for column in columns)
    least = []
    for column, at in zip(columns, table.filled, strict=True):
        texts = [report.words(row[at]) for row in table.rows]
        longest = max((width_of(word, 7) for text in texts for word in text.split(" ")), default=0.0)
        heading = max(width_of(word, 7, bold=True) for word in column.name.split(" "))
        least.append(min(max(longest, heading) + 7.5, width * 0.3))
    if sum(least) >= width:
        return [width * low / sum(least) for low in least]
    # What is beyond the least is given by the shares, to those that would get less than it first.
    widths = [max(width * column.share / shares, low) for column, low in zip(columns, least, strict=True)]
    over, spare = sum(widths) - width, [want - low for want, low in zip(widths, least, strict=True)]
    return [want - over * room / sum(spare) if over > 0 else want for want, room in zip(widths, spare, strict=True)]


def _table(report: Report, table: Table, width: float) -> Flowable:
    """Its heading is on every page; a row is never parted."""
    columns = [table.columns[at] for at in table.filled]
    widths = _widths(report, table, width)
    heading = [Paragraph(markup(column.name), HEAD_RIGHT if column.aligned == "right" else HEAD) for column in columns]
    rows = [
        [
            Paragraph(markup(report.words(row[at])), NUMBER if column.aligned == "right" else CELL)
            for column, at in zip(columns, table.filled, strict=True)
        ]
        for row in table.rows
    ]
    style = TableStyle([
        ("BACKGROUND", (0, 0), (-1, 0), GROUND),
        ("ROWBACKGROUNDS", (0, 1), (-1, -1), [None, BAND]),
        ("LINEBELOW", (0, 0), (-1, -1), 0.3, RULE),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("TOPPADDING", (0, 0), (-1, -1), 1.8),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2.2),
        ("LEFTPADDING", (0, 0), (-1, -1), 4),
        ("RIGHTPADDING", (0, 0), (-1, -1), 3),
    ])  # fmt: skip
    return LongTable([heading, *rows], colWidths=widths, repeatRows=1, style=style, hAlign="LEFT")
