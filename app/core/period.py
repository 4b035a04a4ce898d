"""Periods of time, half-open: the end is where the next one begins, so no reading belongs to two of them, and none to neither.

The border is here for moments and columns of moments; `app.db.period` says the same to PostgreSQL.
"""

from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, NamedTuple, Self

if TYPE_CHECKING:  # commands take periods, and start sooner without NumPy
    import numpy as np
    from numpy.typing import NDArray


class Period(NamedTuple):
    """From `start` on and before `end`; an open end is None. Moments have an offset."""

    start: datetime | None = None
    end: datetime | None = None

    @classmethod
    def through(cls, first: datetime, last: datetime) -> Self:
        """The shortest that holds everything from `first` to `last`, both included; the finest step is a microsecond."""
        return cls(first, last + timedelta(microseconds=1))

    @property
    def bounded(self) -> bool:
        """Tell if an end is named; else it is all of time."""
        return self.start is not None or self.end is not None

    @property
    def backwards(self) -> bool:
        """Tell if it ends before it begins. One that ends where it begins is empty, and no mistake."""
        return self.start is not None and self.end is not None and self.start > self.end

    def touches(self, first: datetime, last: datetime) -> bool:
        """Tell if something of a run from `first` to `last`, both included, can lie in it."""
        return (self.start is None or last >= self.start) and (self.end is None or first < self.end)

    def covers(self, first: datetime, last: datetime) -> bool:
        """Tell if all of a run from `first` to `last`, both included, lies in it.

        >>> hour = Period(datetime(2026, 3, 5, 6, tzinfo=UTC), datetime(2026, 3, 5, 7, tzinfo=UTC))
        >>> hour.covers(hour.start, hour.start), hour.covers(hour.start, hour.end), hour.touches(hour.end, hour.end)
        (True, False, False)
        """
        return (self.start is None or first >= self.start) and (self.end is None or last < self.end)

    def among(self, moments: "NDArray[np.datetime64]") -> "NDArray[np.bool_]":
        """Mask of the moments (UTC) that lie in it."""
        import numpy as np

        inside = np.ones(len(moments), np.bool_)
        if self.start is not None:
            inside &= moments >= moment_of(self.start)
        if self.end is not None:
            inside &= moments < moment_of(self.end)
        return inside


ALWAYS = Period()


def moment_of(at: datetime) -> "np.datetime64":
    """As NumPy keeps it, in UTC."""
    import numpy as np

    return np.datetime64(at.astimezone(UTC).replace(tzinfo=None), "us")
