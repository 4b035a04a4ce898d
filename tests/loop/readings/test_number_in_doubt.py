"""A correction_in_effect that does not fit is asked about, once, and leads to no wrong base."""

from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg
import pytest

from tests.loop.readings.test_compensated import kept
from tests.shop import Shop


def doubts(shop: Shop, state: str = "active") -> list[Any]:
    return [each for each in shop.alarms(state) if each["kind"] == "correction_in_doubt"]


def issued(shop: Shop) -> int:
    number: int = shop.read(6)["correction"]["number"]
    return number


def test_one_that_was_rejected_is_asked_about_once(shop: Shop) -> None:
    number = issued(shop)
    shop.correction(number, "rejected", reason="control is busy")
    answer = shop.read(0.5, correction_in_effect=number)
    assert answer["outstanding"] == []
    (alarm,) = doubts(shop)
    assert answer["alarms"] == [{"id": alarm["id"], "kind": "correction_in_doubt"}]
    assert f"says that its part was cut with correction {number}. That cannot be: it was rejected" in alarm["text"]
    assert alarm["tool_memory"] == 3
    shop.acknowledge(alarm["id"], "noted")
    assert shop.read(0.5, correction_in_effect=number)["alarms"] == []
    assert doubts(shop) == []
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute("SET session_replication_role = replica")  # else it is refused: an answer is a fact
        connection.execute(
            "UPDATE alarm SET acknowledged_at = acknowledged_at - interval '91 days'"
            " WHERE id = %s AND machine_id = (SELECT id FROM machine WHERE key = %s)",
            [alarm["id"], shop.machine],
        )
    shop.read(0.5, correction_in_effect=number)
    assert len(doubts(shop)) == 1, "the answer is long ago"


def test_it_says_nothing_of_the_effect_of_corrections(shop: Shop) -> None:
    number = issued(shop)
    shop.correction(number, "rejected", reason="control is busy")
    shop.read(0.5, correction_in_effect=number)
    shop.push([0.4] * 70, correction_in_effect=[number] * 70)
    assert len(doubts(shop)) == 1
    assert [compensated for compensated, _numbers in kept(shop)] == [0.0] + [None] * 71


def test_one_that_awaits_approval(shop: Shop) -> None:
    key = shop.another("approved", tool_memory=4, average_memory=6, mode="approval")
    number = shop.read(6, key)["correction"]["number"]
    shop.read(0.5, key, correction_in_effect=number)
    (alarm,) = doubts(shop)
    assert "it awaits approval" in alarm["text"]
    assert shop.correction(number)["status"] == "awaiting_approval"


def test_a_part_that_was_cut_before_it_was_issued(shop: Shop) -> None:
    number = issued(shop)
    cut = datetime.now(UTC) - timedelta(hours=2)
    answer = shop.read(0.5, correction_in_effect=number, machined_at=cut.isoformat())
    assert answer["outstanding"] == [], "the number is what counts"
    (alarm,) = doubts(shop)
    assert f"names correction {number}, which was issued at " in alarm["text"]
    assert "its part was cut before, at " in alarm["text"]
    assert f"A reading of Seat {shop.characteristic} names" in alarm["text"], "its name, not its key"
    assert "the clock of the machine is behind" in alarm["text"]


def applied(shop: Shop, ago: timedelta) -> Any:
    """A correction that the machine says to have applied so long ago, although it is of now."""
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="new")
    at = (datetime.now(UTC) - ago).isoformat()
    return shop.correction(issued(shop), "applied", client=shop.machine_client, applied_at=at)


def test_a_correction_that_was_applied_before_it_was_issued(shop: Shop) -> None:
    """It cannot be true: the clock is behind. The time is kept as it was said, for the parts are told by the same clock."""
    done = applied(shop, timedelta(hours=2))
    assert done["status"] == "applied"
    assert datetime.fromisoformat(done["applied_at"]) < datetime.fromisoformat(done["created_at"])
    (alarm,) = doubts(shop)
    assert alarm["tool_memory"] is None
    assert f"says that it applied correction {done['number']} of tool 3 before it was issued." in alarm["text"]
    assert "is behind by 2 h or more" in alarm["text"]
    shop.acknowledge(alarm["id"], "noted")
    applied(shop, timedelta(hours=2, minutes=5))
    assert doubts(shop) == [], "as it was answered"
    applied(shop, timedelta(hours=3))
    assert len(doubts(shop)) == 1, "it went wrong by more since"


def test_a_time_of_applying_that_may_be_true_is_not_asked_about(shop: Shop) -> None:
    applied(shop, timedelta(seconds=30))
    applied(shop, timedelta(seconds=-30))
    assert doubts(shop, "all") == []


def test_numbers_of_all_tools_are_one_order(shop: Shop) -> None:
    other = shop.another("bore", tool_memory=7, average_memory=7)
    own = issued(shop)
    number = shop.read(6, other)["correction"]["number"]
    shop.read(0.5, correction_in_effect=number)
    assert shop.correction(own)["status"] == "applied"
    assert doubts(shop, "all") == []


@pytest.mark.parametrize("batch", [False, True])
def test_what_fits_raises_no_doubt(shop: Shop, batch: bool) -> None:
    number = issued(shop)
    cut = datetime.now(UTC).isoformat()
    if batch:
        shop.push([0.5, 0.4], correction_in_effect=[number] * 2, machined_at=[cut] * 2)
    else:
        shop.read(0.5, correction_in_effect=number, machined_at=cut)
    shop.read(0.5, correction_in_effect=0)
    assert doubts(shop, "all") == []


def test_a_person_who_marks_what_the_machine_does_not_name_hears_what_its_number_does(shop: Shop) -> None:
    """A machine that always sends 0: the correction counts as missing from its parts, and would be taken back."""
    number = shop.read(6, correction_in_effect=0)["correction"]["number"]
    note = shop.correction(number, "applied")["note"]
    assert f"while they name one before {number}, parts count as cut without it" in note
    assert shop.read(0, correction_in_effect=0)["outstanding"] == [number]
    other = shop.read(6, correction_in_effect=number)["correction"]["number"]
    assert shop.correction(other, "applied", client=shop.machine_client)["note"] is None, "the machine itself knows"
    without = shop.read(6)["correction"]["number"]
    assert shop.correction(without, "applied")["note"] is None, "it names none"
