"""What is read on a page, line by line, and what no reader should meet in it: stray blanks, joins, words of the program."""

import re
from html.parser import HTMLParser

INLINE = {
    "a",
    "abbr",
    "b",
    "code",
    "em",
    "i",
    "kbd",
    "label",
    "mark",
    "q",
    "s",
    "samp",
    "small",
    "span",
    "strong",
    "sub",
    "sup",
}
INLINE |= {"time", "time-ago", "u", "var", "wbr"}
UNREAD = {"script", "style", "svg", "template", "textarea", "pre", "code", "samp", "kbd"}
"""Pictures, and what people and machines wrote as it is: blanks in it are theirs."""
SAID = ("alt", "aria-label", "data-label", "label", "placeholder", "title")
"""Attributes that are read aloud or seen."""
UNIT = r"(?:µm|mm|°C|°|K|%|‰|ppm|min|s|h)"

FLAWS = {
    "two blanks": re.compile(r"[ \xa0]{2}"),
    "blank before a mark": re.compile(r"(?<=[\w)\]”%°])[ \xa0][.,;:)](?![.\w…])"),
    "blank after a bracket": re.compile(r"\([ \xa0]"),
    "words without a blank": re.compile(r"[a-zäöüß)][.,;:!?](?!Rd|Annotated)[A-ZÄÖÜ][a-z]"),  # they end names of files
    "word of the program": re.compile(
        r"(?<![\w-])(?:nan|NaN|undefined|inf)(?![\w-])|(?<!default )\{\}|%\(|(?<!/)\{[a-z_]+\}|<[\w.]+ object|^None$|"
        r"(?:[a-z0-9,;=(\[] ?)None\b|\bNone(?=[ \xa0]?(?:µm|mm|[)\]]))"  # a sentence may begin with it
    ),
    "range of dots": re.compile(rf"(?<![\d.,])(?<!, )\d[\d.,]*(?:[ \xa0]?{UNIT})?[ \xa0]?…[ \xa0]?[+−-]?\d"),
    "two signs": re.compile(r"= ?[<>≤≥=]|±[ \xa0]?[+−-]|[+−][+−-]\d"),
    "number without a blank": re.compile(r"\d(?:µm|mm|ppm)\b"),
}
BREAKS = re.compile(rf"[+−±<>≤≥]?\d[\d.,]* {UNIT}")
"""A cell's whole text that a narrow screen breaks between number and unit."""


class _Read(HTMLParser):
    """Lines as a browser shows them: runs of blanks are one, a block begins a line, a unit stands apart by its style."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.cells: list[str] = []
        self._line = ""
        self._unread: list[str] = []
        self._cell: str | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.lines += [given[name] for name in SAID if given.get(name)]
        if self._unread or tag in UNREAD:
            self._line += "" if self._unread else "\N{OBJECT REPLACEMENT CHARACTER}"
            if tag in UNREAD:
                self._unread.append(tag)
            return
        classes = given.get("class", "").split()
        if tag not in INLINE:
            self._end()
        if "unit" in classes and self._line[-1:].strip():
            self._line += "\xa0"
        if tag in ("td", "th"):
            self._cell = None if {"num", "nowrap"} & set(classes) else ""

    def handle_endtag(self, tag: str) -> None:
        if self._unread:
            if tag == self._unread[-1]:
                self._unread.pop()
        elif tag not in INLINE:
            self._end()
            if tag in ("td", "th") and self._cell is not None:
                self.cells.append(self._cell)
                self._cell = None

    def handle_data(self, data: str) -> None:
        if not self._unread:
            self._line += data

    def _end(self) -> None:
        if line := re.sub(r"[ \t\n\r\f]+", " ", self._line).strip(" \t\n\r\f"):
            self.lines.append(line)
            if self._cell is not None:
                self._cell = f"{self._cell}\n{line}".strip("\n")
        self._line = ""

    def close(self) -> None:
        super().close()
        self._end()


def flaws_in(page: str) -> list[str]:
    """What is wrong with the words of a page, each with some words around it."""
    read = _Read()
    read.feed(page)
    read.close()
    found = [
        f"{flaw}: {line[max(0, at.start() - 40) : at.end() + 30]}"
        for line in read.lines
        for flaw, pattern in FLAWS.items()
        for at in pattern.finditer(line)
    ]
    return found + [f"number broken from its unit: {cell}" for cell in read.cells if BREAKS.fullmatch(cell)]
