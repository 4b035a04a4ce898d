"""The words of an HTML document as rows of cells, with the line that each begins on. Nothing of it is ever run or shown as HTML.

Broken markup is skipped up to the next line and named; nothing raises.
"""

from html.parser import HTMLParser
from typing import NamedTuple

BLOCKS = frozenset(
    [
        "address",
        "article",
        "blockquote",
        "body",
        "br",
        "caption",
        "dd",
        "div",
        "dl",
        "dt",
        "figcaption",
        "footer",
        "form",
        "h1",
        "h2",
        "h3",
        "h4",
        "h5",
        "h6",
        "head",
        "header",
        "hr",
        "html",
        "li",
        "main",
        "nav",
        "ol",
        "option",
        "p",
        "pre",
        "section",
        "table",
        "tbody",
        "tfoot",
        "thead",
        "title",
        "tr",
        "ul",
    ]
)
CELLS = frozenset({"td", "th"})
SILENT = frozenset({"script", "style", "svg", "template", "noscript"})
MOST_ROWS = 20_000
LONGEST = 2_000  # characters of a cell; the rest of a longer one is no value
DEEPEST = 100  # of silent elements within each other
MOST_BREAKS = 20  # places of broken markup that are skipped; a file with more is no document


class Row(NamedTuple):
    """A line of text, or a row of a table: its cells, and the line of the file it begins on."""

    line: int
    cells: tuple[str, ...]

    @property
    def text(self) -> str:
        return " ".join(self.cells)


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.rows: list[Row] = []
        self.first_line = 0
        self._cells: list[str] = []
        self._words: list[str] = []
        self._line = 1
        self._silent: list[str] = []
        self._table_row = False

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag in SILENT:
            if len(self._silent) < DEEPEST:
                self._silent.append(tag)
        elif tag in CELLS:
            self._table_row = True
            self._end_cell()
        elif tag in BLOCKS and not (self._table_row and tag not in {"tr", "table", "tbody"}):
            self.end_row()
            self._table_row = tag == "tr"
        elif tag in BLOCKS:
            self._words.append(" ")

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        if tag not in SILENT:
            self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        if tag in SILENT:
            if tag in self._silent:
                del self._silent[self._silent.index(tag) :]
        elif tag in CELLS:
            self._end_cell()
        elif tag in {"tr", "table"} or (tag in BLOCKS and not self._table_row):
            self.end_row()
            self._table_row = False

    def handle_data(self, data: str) -> None:
        if self._silent:
            return
        for number, piece in enumerate(data.split("\n")):
            if number and not self._table_row:  # a text file within the markup has a line for each value
                self.end_row()
            if piece.strip():
                if not self._words and not self._cells:
                    self._line = self.first_line + self.getpos()[0] + number
                self._words.append(piece)

    def _end_cell(self) -> None:
        text = " ".join(" ".join(self._words).split())
        if text:
            self._cells.append(text[:LONGEST])
        self._words = []

    def end_row(self) -> None:
        if self._words:
            self._end_cell()
        if self._cells and len(self.rows) < MOST_ROWS:
            self.rows.append(Row(self._line, tuple(self._cells)))
        self._cells, self._words = [], []


def rows_of(text: str) -> tuple[list[Row], list[int]]:
    """The rows of a document, and the lines from which on broken markup was skipped.

    >>> rows_of("<p>Ball</p><table><tr><td>Radius<td>12,5 mm</table>")[0]
    [Row(line=1, cells=('Ball',)), Row(line=1, cells=('Radius', '12,5 mm'))]
    """
    rows: list[Row] = []
    broken: list[int] = []
    line = 0
    for _again in range(MOST_BREAKS + 1):
        reader = _Reader()
        reader.first_line = line
        try:
            reader.feed(text)  # without close(): what is unfinished stays in rawdata, and costs no more than its length
            left = reader.rawdata
        except AssertionError:  # a declaration that html.parser gives up at, in this line of the text
            left = "\n".join(text.split("\n")[reader.getpos()[0] - 1 :])
        if left and "<" not in left:
            reader.handle_data(left)
            left = ""
        reader.end_row()
        rows += reader.rows
        if not left:
            break
        line += text[: len(text) - len(left)].count("\n")
        broken.append(line + 1)
        _skipped, newline, text = left.partition("\n")
        line += 1
        if not newline or not text.strip():
            break
    return rows[:MOST_ROWS], broken
