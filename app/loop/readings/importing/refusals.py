"""Refusals of files that are no table of readings, and of columns that nobody can read without asking."""

from collections.abc import Collection, Sequence

from app.errors import FieldError, Invalid
from app.language.i18n import _

MOST_COLUMNS = 500
LONGEST_NAME = 1_000
"""Characters of a column's name, or a characteristic's: the page shows each a dozen times, and a cell may have 131,072."""


def wrong(where: str, message: str) -> Invalid:
    """One thing that is wrong with the file or with what was said about it."""
    return Invalid(f"{where}: {message}", _("Nothing was imported."), errors=[FieldError(where, message)])


def refuse_wide(header: Collection[str]) -> None:
    """Refuse what is no table of readings, before each column is looked at and offered for choice."""
    if len(header) > MOST_COLUMNS:
        raise wrong(
            "file",
            _("The file has {columns} columns; at most {most} are taken. Is its first line the header?").format(
                columns=len(header), most=MOST_COLUMNS
            ),
        )
    for number, name in enumerate(header, 1):
        if len(name) > LONGEST_NAME:
            raise wrong("file", _("column {n}").format(n=number) + " " + long_name(name))


def long_name(name: str) -> str:
    """The reason against a name that no page can show."""
    words = _("has a name of {n} characters; at most {most} are taken. It begins: {name}")
    return words.format(n=len(name), most=LONGEST_NAME, name=name[:40])


def heading_or_reading(line: int, names: Sequence[str]) -> tuple[str, str]:
    """The question about a line of numbers, with the choice that answers it."""
    words = _(
        "Line {n} ({cells}) may name the columns, or be a reading. Say which it is: the line of the column names (--header-line {n}), or "
        "the first line of readings (--first-line {n})."
    )
    return "header_line", words.format(n=line, cells="; ".join(names)[:80])


def refuse_no_table(begin: str) -> None:
    """Refuse what is no table by its first cell."""
    if begin.startswith("K0100 "):
        raise wrong("file", _("This is AQDEF (Q-DAS): import it under a name that ends with .dfq."))
    for mark, kind in (("<?xml", "XML"), ("<html", "HTML"), ("<!doctype", "HTML"), ("%pdf", "PDF"), ("{\\rtf", "RTF")):
        if begin.lower().startswith(mark):
            raise wrong("file", _("This is {kind}, no table: export one as CSV or XLSX.").format(kind=kind))
