"""Readings across characteristics and machines, over REST."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from tests.conftest import Server
from tests.shop import Shop

pytestmark = pytest.mark.own_server

ODD = " 7/8 ?x=1&y #% ö.. "
BEGIN = datetime.now(UTC).replace(microsecond=0) - timedelta(hours=3)


def at(minutes: int) -> str:
    return (BEGIN + timedelta(minutes=minutes)).isoformat()


class TwoLathes(Shop):
    """Six parts through two characteristics of a lathe, every other of them once more on a second lathe."""

    other: Shop


@pytest.fixture(scope="module")
def shop(server: Server) -> TwoLathes:
    shop, other = TwoLathes(server), Shop(server)
    shop.add(f"{shop.characteristic}-b", tool_memory=0, average_memory=0)
    for number in range(6):
        part = {5: ODD}.get(number, f"SN-{number:04d}")
        shop.read(number / 10, part=part, measured_at=at(number))
        shop.read(9.0 if number == 3 else 0.0, f"{shop.characteristic}-b", part=part, measured_at=at(number))
        if number % 2 == 0:
            other.read(6.0 if number == 4 else 0.1, part=part, measured_at=at(60 + number))
    shop.read(0.0)  # of no part
    shop.other = other
    return shop


def listed(shop: Shop, client: Any = None, **query: Any) -> list[tuple[str, int]]:
    """All the pages of two readings each, as (characteristic, number)."""
    rows: list[tuple[str, int]] = []
    after = None
    while True:
        answer = (client or shop.admin).get(
            "/api/v1/readings", params=query | {"limit": 2} | ({"after": after} if after else {})
        )
        assert answer.status_code == 200, answer.text
        page = answer.json()
        rows += [(item["characteristic"], item["sequence"]) for item in page["items"]]
        if (after := page["next"]) is None:
            return rows


def test_a_part_is_found_over_all_characteristics_and_machines(shop: TwoLathes) -> None:
    one, two, other = shop.characteristic, f"{shop.characteristic}-b", shop.other.characteristic
    assert listed(shop, part="SN-0002") == [(one, 3), (two, 3), (other, 2)]
    assert listed(shop, part="SN-0002", order="newest") == [(other, 2), (two, 3), (one, 3)]
    assert listed(shop, part="SN-0002", machine=shop.machine) == [(one, 3), (two, 3)]
    assert listed(shop, part="SN-0002", characteristic=two) == [(two, 3)]
    assert listed(shop, part=ODD) == [(one, 6), (two, 6)]
    assert listed(shop, part="SN-000") == []


def test_one_characteristic_by_number_from_either_end(shop: TwoLathes) -> None:
    forward = listed(shop, characteristic=shop.characteristic)
    assert forward == [(shop.characteristic, number) for number in range(1, 8)]
    assert listed(shop, characteristic=shop.characteristic, order="newest") == forward[::-1]


def test_machines_together_by_arrival(shop: TwoLathes) -> None:
    everything = listed(shop)
    assert len(everything) == len(set(everything)) == 16
    assert listed(shop, order="newest") == everything[::-1]
    assert listed(shop, machine=shop.machine) == [row for row in everything if row[0] != shop.other.characteristic]


def test_period_zone_and_action(shop: TwoLathes) -> None:
    one, two, other = shop.characteristic, f"{shop.characteristic}-b", shop.other.characteristic
    late = [(one, 5), (two, 5), (one, 6), (two, 6), (other, 1), (other, 2)]
    assert sorted(listed(shop, **{"from": at(4), "to": at(62)})) == sorted(late)
    assert listed(shop, characteristic=one, **{"from": at(1), "to": at(3)}, order="newest") == [
        (one, 4),
        (one, 3),
        (one, 2),
    ]
    assert listed(shop, zone="oversize") == [(two, 4)]
    assert listed(shop, zone=["oversize", "full"]) == [(two, 4), (other, 3)]
    assert listed(shop, action="correct") == [(other, 3)]
    assert listed(shop, characteristic=one, zone="wear") == []


def test_the_key_of_a_machine_sees_its_own(shop: TwoLathes) -> None:
    other = shop.other
    assert listed(shop, other.machine_client, part="SN-0002") == [(other.characteristic, 2)]
    assert listed(shop, other.machine_client) == [(other.characteristic, number) for number in (1, 2, 3)]
    assert other.machine_client.get(f"/api/v1/readings?machine={shop.machine}").status_code == 403
    assert other.machine_client.get(f"/api/v1/readings?characteristic={shop.characteristic}").status_code == 403


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"zone": "green"}, "zone"),
        ({"action": "dance"}, "action"),
        ({"order": "random"}, "order"),
        ({"after": "x"}, "after"),
        ({"after": "5"}, "after"),
        ({"after": "9999999999999999999-1-1-1"}, "after"),
        ({"characteristic": "{characteristic}", "after": "1-1-1-1"}, "after"),
        ({"part": ""}, "part"),
        ({"part": "a\0b"}, "part"),
        ({"part": "x" * 129}, "part"),
        ({"from": at(5), "to": at(1)}, "from"),
        ({"from": "yesterday"}, "from"),
    ],
)
def test_what_is_no_filter_is_refused_by_name(shop: TwoLathes, query: dict[str, str], field: str) -> None:
    params = {name: value.replace("{characteristic}", shop.characteristic) for name, value in query.items()}
    answer = shop.admin.get("/api/v1/readings", params=params)
    assert answer.status_code == 422, answer.text
    assert [error["field"].split("[")[0] for error in answer.json()["errors"]] == [field]


def test_what_is_not_there_is_not_found(shop: TwoLathes) -> None:
    assert shop.admin.get("/api/v1/readings?machine=nowhere").status_code == 404
    assert shop.admin.get("/api/v1/readings?characteristic=nowhere").status_code == 404
