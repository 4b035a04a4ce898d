"""Rows that hold words: what a reader types into the field above a list."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import ColumnElement, or_


def holds_words(
    text: str, *columns: Any, coded: tuple[Any, Mapping[str, str]] | None = None
) -> list[ColumnElement[bool]]:
    """Conditions of a row in which every word of the text stands somewhere in these columns, in capitals or not.

    The same rule as for tables that are shown whole (table-tools.js). coded: a column of codes, with what readers see for each.
    """
    conditions = []
    for word in text.split():
        places = [column.icontains(word, autoescape=True) for column in columns]
        if coded is not None:
            column, words = coded
            places.append(column.in_([code for code, shown in words.items() if word.lower() in shown.lower()]))
        conditions.append(or_(*places))
    return conditions
