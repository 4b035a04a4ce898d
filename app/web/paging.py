"""Long lists, a part at a time: addresses of pages, and of the parts beside the one that is shown."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar
from urllib.parse import urlencode

Row = TypeVar("Row")


def address(path: str, **query: Any) -> str:
    """A path with those of the query that are given; a list is said again and again.

    >>> address("/alarms", machine="lathe-1", before=None), address("/compare", of=["d35", "d40"])
    ('/alarms?machine=lathe-1', '/compare?of=d35&of=d40')
    """
    given = {name: value for name, value in query.items() if value is not None}
    return f"{path}?{urlencode(given, doseq=True)}" if given else path


@dataclass(frozen=True)
class Part(Generic[Row]):
    """Rows that a page shows of a list. on, back: addresses of the next part, and of the first or the one before."""

    rows: list[Row]
    on: str | None
    back: str | None

    @property
    def whole(self) -> bool:
        """True where the page shows all of the list, so that the browser can sort and filter it."""
        return not self.on and not self.back


@dataclass(frozen=True)
class Order:
    """Column by which the server sorts a list of several pages, the largest first after a minus; link makes the page's address."""

    by: str
    link: Callable[..., str]

    def turned(self, column: str) -> str:
        """Address of the page sorted by this column; the other way round where it is already."""
        return self.link(sort=f"-{column}" if self.by == column else column)

    def direction(self, column: str) -> str | None:
        """Direction of this column as `aria-sort` names it; None if the list is sorted by another."""
        return {column: "ascending", f"-{column}": "descending"}.get(self.by)


def part_of(
    rows: Sequence[Row],
    limit: int,
    at: int | str | None,
    cursor: Callable[[Row], int | str],
    link: Callable[..., str],
    name: str = "before",
) -> Part[Row]:
    """At most `limit` of rows that were read from the cursor `at` on: one more than that where the list goes on.

    link: makes the address of a part from its cursor, given by that name.
    """
    shown = list(rows[:limit])
    return Part(shown, link(**{name: cursor(shown[-1])}) if len(rows) > limit else None, link() if at else None)


def holds(text: str, *places: str | None) -> bool:
    """Tell if every word of the text is in one of these places, in capitals or not: `app.db.text.holds_words` for values.

    >>> holds("lathe SEAT", "Lathe 3", None, "Seat 4"), holds("mill", "Lathe 3")
    (True, False)
    """
    lower = [place.lower() for place in places if place]
    return all(any(word in place for place in lower) for word in text.lower().split())


def slice_of(rows: Sequence[Row], limit: int, after: int, link: Callable[..., str]) -> Part[Row]:
    """At most `limit` of all the rows, those that come after the first `after`."""
    on = link(after=after + limit) if after + limit < len(rows) else None
    return Part(list(rows[after : after + limit]), on, link(after=max(after - limit, 0) or None) if after else None)
