"""The glossary as the program shows it: the sentence of a term or an R number, where it stands on a page.

Every sentence is a row of `docs/reference/glossary.md` and nowhere else; an R number has the row whose third column is it.
"""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import NamedTuple

from app import HOUSE

DOCS = HOUSE / "docs"
PAGE = "/help/reference/glossary"
_ROW = re.compile(r"^\| (?P<names>[^|]+) \| (?P<sentence>[^|]+) \| *(?P<source>[^|]*?) *\|$", re.MULTILINE)
_NUMBERS = re.compile(r"R\d+(?:, R\d+)*")
_MARKS = re.compile(r"\[([^\[\]]*)\]\([^()]*\)|[*`][*`_]*")


class Term(NamedTuple):
    """A row of the glossary: its anchor on the page, its sentence as plain text."""

    anchor: str
    sentence: str

    @property
    def path(self) -> str:
        """The row on the page of the glossary."""
        return f"{PAGE}#{self.anchor}"


def slug(heading: str) -> str:
    """The anchor of a heading or a row, as forges write it.

    >>> slug("Cp, Cpk"), slug("`inband serve`"), slug("Why confirming matters")
    ('cp-cpk', 'inband-serve', 'why-confirming-matters')
    """
    return re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")


def plain(markdown: str) -> str:
    """A line of Markdown without its marks.

    >>> plain("The *zero* range of `R33`; see [there](a.md#b)")
    'The zero range of R33; see there'
    """
    return _MARKS.sub(lambda found: found[1] or "", markdown)


def anchor_of(names: str) -> str:
    """The anchor of a row of the glossary, by its first column."""
    return f"term-{slug(plain(names))}"


def rows(text: str) -> Iterator[tuple[tuple[str, ...], Term]]:
    """The rows of a glossary: all names of each, R numbers among them, and its term."""
    for row in _ROW.finditer(text):
        names, source = plain(row["names"]), row["source"]
        if names == "term" or names.startswith("---"):
            continue
        known = [each for each in re.split(r"[,()]\s*", names) if each.strip()]
        known += source.split(", ") if _NUMBERS.fullmatch(source) else []
        yield tuple(each.strip() for each in known), Term(anchor_of(names), plain(row["sentence"]))


@cache
def terms() -> Mapping[str, Term]:
    """Every term by each of its names, in small letters. Of a name in several rows the first counts."""
    found: dict[str, Term] = {}
    for names, term in rows((DOCS / "reference" / "glossary.md").read_text(encoding="utf-8")):
        for name in names:
            found.setdefault(name.lower(), term)
    return found


def term_of(name: str) -> Term | None:
    """The term of a name, or of what it begins with (*R11 = 5*; *Nelson 1, Western Electric 1*); None of what the glossary has not.

    >>> term_of("R11 = 5") == term_of("average memory"), term_of("R999")
    (True, None)
    """
    lower = name.lower()
    found = (terms().get(each) for each in (lower, lower.split(",", 1)[0], lower.split(" ", 1)[0]))
    return next(filter(None, found), None)
