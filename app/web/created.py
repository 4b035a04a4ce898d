"""Records that are sent with a key: a key names one for ever, and what is sent once more is answered as the first time."""

from typing import Any, Generic, NamedTuple, TypeVar

from app.errors import Conflict
from app.language.i18n import _

Row = TypeVar("Row")


class Created(NamedTuple, Generic[Row]):
    """A record; again: it was sent before with the same key, and nothing happened now."""

    row: Row
    again: bool = False


def sent_before(row: Row, key: str | None, what: str, *, same: bool, **number: Any) -> Created[Row]:
    """The record that was sent with this key before. Raises `Conflict` unless it is the same.

    what: the word for such a record. number: its number, as the answer calls it.
    """
    if same:
        return Created(row, again=True)
    raise Conflict(
        _("{what} {number} was sent with the key {key} already, and with other values.").format(
            what=what[:1].upper() + what[1:], number=next(iter(number.values())), key=repr(key)
        ),
        _("A key names one {what} for ever: use another one.").format(what=what),
        **number,
    )
