"""Each reading keeps the corrections that its part was cut with, so that true wear can be told behind a closed loop."""

from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg

from tests.shop import Shop


def kept(shop: Shop) -> list[tuple[float | None, list[int] | None]]:
    with psycopg.connect(shop.server.database.dsn.replace("+psycopg", "")) as conn:
        return conn.execute(
            "SELECT r.compensated, r.outstanding FROM reading r JOIN characteristic c ON c.id = r.characteristic_id "
            "WHERE c.key = %s ORDER BY r.sequence",
            [shop.characteristic],
        ).fetchall()


def push(shop: Shop, measured: float, **told: Any) -> Any:
    return shop.call("POST", "/readings", 201, characteristic=shop.characteristic, measured=measured, **told)


def test_corrections_count_from_the_part_that_was_cut_with_them(shop: Shop) -> None:
    push(shop, 40.007)  # asks for correction 1, -7 µm
    push(shop, 40.007)  # pending: not in effect
    shop.correction(1, "applied")
    push(shop, 40.007, correction_in_effect=0)  # applied, but this part was cut before
    push(shop, 40.000, correction_in_effect=1)
    assert kept(shop) == [(0.0, None), (0.0, [1]), (0.0, [1]), (-0.007, None)]


def test_a_reading_that_names_its_correction_confirms_it_and_has_it(shop: Shop) -> None:
    push(shop, 40.007)
    push(shop, 40.000, correction_in_effect=1)
    assert kept(shop) == [(0.0, None), (-0.007, None)]


def test_rejected_and_held_corrections_never_count_and_a_released_one_does(shop: Shop) -> None:
    push(shop, 40.007)
    shop.correction(1, "rejected", reason="not now")
    push(shop, 40.4)  # wear zone: correction 2 is held
    push(shop, 40.4)  # 3 replaces 2
    shop.correction(3, "release", reason="edge looked at")
    shop.correction(3, "applied")
    push(shop, 40.0)
    assert [compensated for compensated, _numbers in kept(shop)] == [0.0, 0.0, 0.0, -0.4]


def test_a_new_tool_begins_at_zero_and_a_part_of_the_old_one_says_nothing(shop: Shop) -> None:
    push(shop, 40.007)
    push(shop, 40.000, correction_in_effect=1)
    before = datetime.now(UTC) - timedelta(seconds=30)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", 200, offset=0.5, reason="new insert")
    push(shop, 40.000, machined_at=before.isoformat())
    push(shop, 40.0005)
    assert [compensated for compensated, _numbers in kept(shop)] == [0.0, -0.007, None, 0.0]


def test_an_edit_by_hand_leaves_the_sum_of_corrections(shop: Shop) -> None:
    push(shop, 40.007)
    push(shop, 40.000, correction_in_effect=1)
    shop.call("PUT", f"/machines/{shop.machine}/tools/3", 200, offset=0.25, reason="typed in")
    push(shop, 40.000)
    assert [compensated for compensated, _numbers in kept(shop)] == [0.0, -0.007, -0.007]


def test_without_a_tool_nothing_is_corrected(shop: Shop) -> None:
    shop.add("length", tool_memory=0)
    shop.characteristic = "length"
    push(shop, 40.003)
    assert kept(shop) == [(0.0, None)]
