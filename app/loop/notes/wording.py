"""The words of a note where there is little room."""

from html import escape
from textwrap import shorten, wrap

BEGINNING = 24  # characters beside its mark on a chart
LINE, MOST_LINES = 60, 8  # of what is said when it is pointed at


def beginning(text: str, most: int = BEGINNING) -> str:
    """The first words of a note, in one line.

    >>> beginning("Coolant changed;\\nconcentration 6 %"), beginning("Ein" + "s" * 30, 10)
    ('Coolant changed; …', 'Einssssss…')
    """
    line = " ".join(text.split())
    return shorten(line, most, placeholder=" …") if " " in line[:most] else line[: most - 1] + "…" * (len(line) >= most)


def in_lines(text: str) -> str:
    """A note as the markup of a chart's label: lines of some words each; a long one ends in …"""
    lines = [line for paragraph in text.splitlines() for line in wrap(paragraph, LINE)]
    shown = [escape(line) for line in lines[:MOST_LINES]]
    return "<br>".join([*shown, *(["…"] if len(lines) > MOST_LINES else [])])
