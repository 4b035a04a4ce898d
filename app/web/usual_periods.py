"""Periods that people often look at, and moments as a field of a form holds them; by the clock of the plant.

`app.web.choice` reads the period of an address.
"""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from app.core.period import Period
from app.files.formats import cell_values, periods
from app.language.i18n import _
from app.language.times import begin_of_day, begin_of_shift, local, plant_zone
from app.web.choice import in_address


class UsualPeriod(NamedTuple):
    """One to choose: without an end it goes on. key: its name in a form."""

    key: str
    name: str
    start: datetime
    end: datetime | None = None

    @property
    def query(self) -> dict[str, str | None]:
        """The period as an address says it."""
        return in_address(Period(self.start, self.end))

    @property
    def choice(self) -> tuple[str, str]:
        """The period as a field to choose from says it."""
        return self.key, self.name

    def is_chosen(self, start: datetime | None, end: datetime | None) -> bool:
        return (self.start, self.end) == (start, end)


def usual_periods(tool_since: datetime | None = None, now: datetime | None = None) -> list[UsualPeriod]:
    """The periods that every page offers. tool_since: the first reading of the tool in the machine."""
    now = now or datetime.now(UTC)
    today, monday = begin_of_day(now), begin_of_day(now, -local(now).weekday())
    tool = [] if tool_since is None else [UsualPeriod("tool", _("This tool"), local(tool_since))]
    return [
        UsualPeriod("shift", _("This shift"), begin_of_shift(now)),
        UsualPeriod("today", _("Today"), today),
        UsualPeriod("yesterday", _("Yesterday"), begin_of_day(now, -1), today),
        *tool,
        UsualPeriod("week", _("This week"), monday),
        UsualPeriod("last-week", _("Last week"), begin_of_day(monday, -7), monday),
    ]


def with_preset(fields: Mapping[str, str], key: str | None, tool_since: datetime | None = None) -> dict[str, str]:
    """The fields of a form with the usual period of this key in place of `from`, `to` and `last`; as they are for no such key.

    So a period is chosen without script; with it the fields are filled in at once (period-presets.js).
    """
    chosen = next((each for each in usual_periods(tool_since) if each.key == key), None)
    if chosen is None:
        return dict(fields)
    end = chosen.end.isoformat() if chosen.end else ""
    return {**fields, "from": chosen.start.isoformat(), "to": end, "last": ""}


def field(moment: datetime | str | None, *, end: bool = False) -> str:
    """A moment, or what was typed as one, as `<input type="datetime-local">` has it; nothing where it is none.

    The field knows milliseconds: a beginning is rounded down to them, an `end` up.
    """
    if isinstance(moment, str):
        try:
            read = periods.bound(moment, plant_zone(), end=end)
            if read is None:
                return ""
            at = local(read).replace(tzinfo=None)
        except cell_values.Unreadable:
            return _as_typed(moment)
    elif moment is None:
        return ""
    else:
        at = local(moment).replace(tzinfo=None)
    finer = timedelta(microseconds=at.microsecond % 1000)
    at += timedelta(milliseconds=1) - finer if end and finer else -finer
    return at.isoformat(timespec="milliseconds" if at.microsecond else "seconds" if at.second else "minutes")


def _as_typed(text: str) -> str:
    """A time that the plant's clock never showed, as it was typed; nothing of what is no time."""
    try:
        return datetime.fromisoformat(text.strip()).replace(tzinfo=None).isoformat(timespec="minutes")
    except ValueError:
        return ""
