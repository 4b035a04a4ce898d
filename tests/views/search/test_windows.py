"""Lists of readings that came over years: they are read in windows of time, and none is lost or doubled at a border."""

from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import text

from app.views.search.readings import FIRST_WINDOW, WIDER, WINDOWS
from tests.shop import Shop
from tests.views.search.test_reading_list import listed

LAST = datetime.now(UTC).replace(microsecond=0) - timedelta(hours=1)
BORDERS = [FIRST_WINDOW * sum(WIDER**each for each in range(number + 1)) for number in range(WINDOWS)]
MICROSECOND = timedelta(microseconds=1)
AGES = sorted(
    {
        timedelta(0),
        *(border + each for border in BORDERS for each in (-MICROSECOND, timedelta(0), MICROSECOND)),
        *(BORDERS[-1] - border for border in BORDERS),
        BORDERS[-1] + timedelta(days=500),
    },
    reverse=True,
)
ARRIVALS = [LAST - age for age in AGES]


@pytest.fixture(scope="module")
def old(common_shop: Shop) -> Shop:
    """Readings of two characteristics that came at the same times, the first of them worn."""
    shop = common_shop
    shop.add(f"{shop.characteristic}-b", tool_memory=0, average_memory=0)
    with shop.server.database.begin() as session:
        session.execute(
            text("""
            INSERT INTO reading (machine_id, characteristic_id, sequence, measured, deviation, decided, average_before,
                average_after, measured_at, received_at, parameters_version, late, zone, action, code, part)
            SELECT c.machine_id, c.id, n, 40, 0, 0, 0, 0, at, at, 1, false, CASE WHEN n = 1 THEN 'wear' ELSE 'zero' END, 'none',
                'within_zero_range', 'Windowed-' || n
            FROM characteristic c, unnest(CAST(:arrivals AS timestamptz[])) WITH ORDINALITY AS a(at, n)
            WHERE c.key IN (:key, :key || '-b')
            """),
            {"key": shop.characteristic, "arrivals": ARRIVALS},
        )
        session.execute(
            text("""
            UPDATE stream s SET sequence = :last, last_received_at = :at, last_measured_at = :at
            FROM characteristic c WHERE c.key IN (:key, :key || '-b') AND s.characteristic_id = c.id
            """),
            {"key": shop.characteristic, "last": len(ARRIVALS), "at": LAST},
        )
    return shop


def rows(shop: Shop, *numbers: int) -> list[tuple[str, int]]:
    return [(shop.characteristic + end, number) for number in numbers for end in ("", "-b")]


def test_all_of_them_from_either_end(old: Shop) -> None:
    everything = rows(old, *range(1, len(ARRIVALS) + 1))
    assert listed(old, machine=old.machine) == everything
    assert listed(old, machine=old.machine, order="newest") == everything[::-1]


def test_of_a_period_and_a_zone(old: Shop) -> None:
    period = {"from": ARRIVALS[2].isoformat(), "to": ARRIVALS[-2].isoformat()}
    within = rows(old, *range(3, len(ARRIVALS) - 1))
    assert listed(old, machine=old.machine, **period) == within
    assert listed(old, machine=old.machine, order="newest", **period) == within[::-1]
    assert listed(old, machine=old.machine, zone="wear", order="newest") == rows(old, 1)[::-1]
    ages = {"from": "0001-01-01T00:00:00Z", "to": "9999-12-31T23:59:59Z"}
    assert listed(old, machine=old.machine, zone="wear", **ages) == rows(old, 1)


def test_parts_are_found_wherever_they_are(old: Shop) -> None:
    def found(q: str) -> list[str]:
        return [item["key"] for item in old.call("GET", f"/search?q={q}")["items"] if item["kind"] == "part"]

    assert found("Windowed-1") == ["Windowed-1"], "the oldest, by its whole name"
    assert found("Windowed-0") == found("Wi") == []
    assert set(found("Window")) == {f"Windowed-{len(ARRIVALS) - number}" for number in range(6)}, "the newest"
