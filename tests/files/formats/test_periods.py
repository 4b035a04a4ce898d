"""Days of clocks that change at midnight, twice at midnight, or by half an hour: each begins where the one before ends."""

from datetime import UTC, timedelta
from zoneinfo import ZoneInfo

import pytest

from app.files.formats.periods import period_of


@pytest.mark.parametrize(
    ("zone", "days", "hours"),
    [
        ("America/Havana", ("2026-03-07", "2026-03-08", "2026-03-09"), (24, 23, 24)),  # no midnight on the 8th
        ("America/Havana", ("2026-10-31", "2026-11-01", "2026-11-02"), (24, 25, 24)),  # midnight again at one
        ("Africa/Cairo", ("2026-04-23", "2026-04-24", "2026-04-25"), (24, 23, 24)),
        ("Atlantic/Azores", ("2026-10-24", "2026-10-25", "2026-10-26"), (24, 25, 24)),
        ("Australia/Lord_Howe", ("2026-04-04", "2026-04-05", "2026-04-06"), (24, 24.5, 24)),
        ("Asia/Kathmandu", ("2026-02-28", "2026-03-01", "2026-03-02"), (24, 24, 24)),
    ],
)
def test_days_follow_each_other_without_a_gap(zone: str, days: tuple[str, ...], hours: tuple[float, ...]) -> None:
    found = [period_of({"from": day, "to": day}, ZoneInfo(zone)) for day in days]
    ends = [(each.start, each.end) for each in found]
    assert [
        (end.astimezone(UTC) - start.astimezone(UTC)) / timedelta(hours=1) for start, end in ends if start and end
    ] == list(hours)
    assert [each.end for each in found[:-1]] == [each.start for each in found[1:]]
    whole = period_of({"from": days[0], "to": days[-1]}, ZoneInfo(zone))
    assert (whole.start, whole.end) == (found[0].start, found[-1].end)
