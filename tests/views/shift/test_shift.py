"""A shift: over REST and on its page, the same as what was pushed and answered in it."""

from contextvars import copy_context
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import text

from app.language.times import begin_of_shift, begins_of_shifts, end_of_shift, keep_time_of, plant_time
from app.settings import Settings
from tests.servers import Server
from tests.shop import Person, Shop

LONG_AGO = "2026-03-05T07:{:02}:00Z"
"""In a shift of its own, whatever hour it is now."""


@pytest.fixture(scope="module")
def ran(common_shop: Shop, server: Server) -> Shop:
    """Five named parts, one of them measured again after it was out, one that stays out, one reading without a name, a fault."""
    shop = common_shop
    second = shop.another("bore", tool_memory=4, average_memory=6)
    for minute, (part, micrometres, characteristic) in enumerate(
        [
            ("p1", 0.4, None),
            ("p2", 12.0, None),  # out
            ("p2", 0.2, second),
            ("p3", 9.0, None),  # out, and cut again
            ("p3", 1.0, None),
            ("p4", 0.1, None),
            (None, 0.3, None),
            ("p5", 3000.0, None),  # a fault measures no part
        ]
    ):
        named = {"part": part} if part else {}
        shop.read(micrometres, characteristic, measured_at=LONG_AGO.format(minute), **named)
    with server.database.begin() as session:  # the alarms of then, answered after 1, 3 and 10 minutes and by itself
        for number, (minutes, by) in enumerate([(1, "ana"), (3, "ben"), (10, "ana"), (600, "bridge"), (None, None)]):
            at = datetime(2026, 3, 5, 7, number, tzinfo=UTC)
            ended = None if minutes is None else at + timedelta(minutes=minutes)
            session.execute(
                text("""
                INSERT INTO alarm (machine_id, tool_memory, kind, raised_at, acknowledged_at, acknowledged_by, outcome, data)
                SELECT id, :tool, 'machine_fault', :at, :ended, :by, CAST(:outcome AS jsonb), '{"location": "receiver"}' FROM machine WHERE key = :key
                """),
                {
                    "tool": number + 1,
                    "at": at,
                    "ended": ended,
                    "by": by,
                    "outcome": {"bridge": '[{"code": "fault_over"}]', "ana": "[]"}.get(by or ""),
                    "key": shop.machine,
                },
            )
    return shop


def test_it_counts_parts_alarms_and_corrections(ran: Shop) -> None:
    found = ran.call("GET", f"/shift?machine={ran.machine}&at={LONG_AGO.format(0)}")
    made, alarms = found["made"], found["alarms"]
    assert (made["readings"], made["faults"], made["unnamed"]) == (8, 1, 1)
    assert (made["parts"], made["inside"], made["outside"]) == (5, 4, 1)
    assert made["corrections"] == made["applied"] + made["held"] + made["not_taken"] + made["rejected"] > 0
    assert made["largest"] > 0.004
    assert (alarms["alarms"], alarms["acknowledged"], alarms["by_itself"], alarms["active"]) == (5, 3, 1, 1)
    assert (alarms["median_seconds"], alarms["longest_seconds"]) == (180, 600)
    assert [each["ended_after_seconds"] for each in found["raised"]] == [None, 36000, 600, 180, 60]
    assert not found["running"]
    (machine,) = found["machines"]
    assert (machine["made"], machine["alarms"]) == (made, alarms)
    assert found["next"]["active_alarms"] >= 1


def test_of_all_machines_it_is_the_sum_and_a_shift_without_anything_is_empty(ran: Shop) -> None:
    everybody = ran.call("GET", f"/shift?at={LONG_AGO.format(0)}")
    (own,) = [each for each in everybody["machines"] if each["machine"] == ran.machine]
    assert own["made"]["parts"] == 5
    assert everybody["made"]["parts"] == sum(each["made"]["parts"] for each in everybody["machines"])
    empty = ran.call("GET", f"/shift?machine={ran.machine}&at=2020-01-01T12:00:00Z")
    assert (empty["made"]["readings"], empty["alarms"]["alarms"], empty["raised"]) == (0, 0, [])
    ahead = (datetime.now(UTC) + timedelta(days=1)).isoformat().replace("+", "%2B")
    assert "has begun" in ran.call("GET", f"/shift?at={ahead}", 422)["detail"]


def test_its_page_leads_from_shift_to_shift(ran: Shop, server: Server) -> None:
    viewer = Person(server, "viewer")
    page = viewer.open(f"/shift?machine={ran.machine}&at=2026-03-05T07:00Z")
    for words in (
        "Out of tolerance",
        "3 min",
        "10 min",
        "Shift before",
        "Next shift",
        "an administrator can set your plant",
        "by itself",
    ):
        assert words in page
    assert "INBAND_" not in page
    assert "INBAND_SHIFTS" in Person(server, "admin").open("/shift")
    assert "Next shift" not in viewer.open("/shift")
    assert "Nothing was measured" in viewer.open("/shift?at=1971-01-01")
    assert "at:" in viewer.open("/shift?at=yesterday", 422)


@pytest.mark.parametrize("zone", ["Europe/Belgrade", "America/New_York", "Africa/Cairo"])
@pytest.mark.parametrize("shifts", ["06:00,14:00,22:00", "02:30", "00:30", "02:00,02:30,03:00,14:00"])
@pytest.mark.parametrize("month", [(2026, 3, 1), (2026, 4, 1), (2026, 10, 1), (2026, 11, 1)])
def test_shifts_follow_each_other_when_the_clock_changes(zone: str, shifts: str, month: tuple[int, int, int]) -> None:
    def looked_at() -> None:
        keep_time_of(plant_time(Settings(timezone=zone, shifts=shifts)))
        moments = [datetime(*month, tzinfo=UTC) + n * timedelta(minutes=30) for n in range(31 * 48)]
        begins = [begin_of_shift(at).astimezone(UTC) for at in moments]
        ends = [end_of_shift(at).astimezone(UTC) for at in moments]
        assert all(begin <= at < end for begin, at, end in zip(begins, moments, ends, strict=True))
        assert all(after in (begin, end) for begin, end, after in zip(begins, ends, begins[1:], strict=False))
        found = [each.astimezone(UTC) for each in begins_of_shifts(moments[0], moments[-1])]
        assert found == sorted(set(begins))

    copy_context().run(looked_at)


def test_shifts_follow_each_other_without_a_gap() -> None:
    at = datetime(2026, 10, 24, 12, tzinfo=UTC)
    for _each in range(9):  # over the night in which clocks are put back
        end = end_of_shift(at)
        assert end > at
        assert begin_of_shift(end) == end
        assert begin_of_shift(end - timedelta(microseconds=1)) <= at
        at = end
