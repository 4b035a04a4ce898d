"""Readings across characteristics and machines, over REST."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from tests.servers import Server
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
def lathes(server: Server) -> TwoLathes:
    lathes, other = TwoLathes(server), Shop(server)
    lathes.add(f"{lathes.characteristic}-b", tool_memory=0, average_memory=0)
    for number in range(6):
        part = {5: ODD}.get(number, f"SN-{number:04d}")
        lathes.read(number / 10, part=part, measured_at=at(number))
        lathes.read(9.0 if number == 3 else 0.0, f"{lathes.characteristic}-b", part=part, measured_at=at(number))
        if number % 2 == 0:
            other.read(6.0 if number == 4 else 0.1, part=part, measured_at=at(60 + number))
    lathes.read(0.0)  # of no part
    lathes.other = other
    return lathes


def listed(lathes: Shop, client: Any = None, **query: Any) -> list[tuple[str, int]]:
    """All the pages of two readings each, as (characteristic, number)."""
    rows: list[tuple[str, int]] = []
    after = None
    while True:
        answer = (client or lathes.admin).get(
            "/api/v1/readings", params=query | {"limit": 2} | ({"after": after} if after else {})
        )
        assert answer.status_code == 200, answer.text
        page = answer.json()
        rows += [(item["characteristic"], item["sequence"]) for item in page["items"]]
        if (after := page["next"]) is None:
            return rows


def test_a_part_is_found_over_all_characteristics_and_machines(lathes: TwoLathes) -> None:
    one, two, other = lathes.characteristic, f"{lathes.characteristic}-b", lathes.other.characteristic
    assert listed(lathes, part="SN-0002") == [(one, 3), (two, 3), (other, 2)]
    assert listed(lathes, part="SN-0002", order="newest") == [(other, 2), (two, 3), (one, 3)]
    assert listed(lathes, part="SN-0002", machine=lathes.machine) == [(one, 3), (two, 3)]
    assert listed(lathes, part="SN-0002", characteristic=two) == [(two, 3)]
    assert listed(lathes, part=ODD) == [(one, 6), (two, 6)]
    assert listed(lathes, part="SN-000") == []


def test_one_characteristic_by_number_from_either_end(lathes: TwoLathes) -> None:
    forward = listed(lathes, characteristic=lathes.characteristic)
    assert forward == [(lathes.characteristic, number) for number in range(1, 8)]
    assert listed(lathes, characteristic=lathes.characteristic, order="newest") == forward[::-1]


def test_machines_together_by_arrival(lathes: TwoLathes) -> None:
    everything = listed(lathes)
    assert len(everything) == len(set(everything)) == 16
    assert listed(lathes, order="newest") == everything[::-1]
    assert listed(lathes, machine=lathes.machine) == [
        row for row in everything if row[0] != lathes.other.characteristic
    ]


def test_period_zone_and_action(lathes: TwoLathes) -> None:
    one, two, other = lathes.characteristic, f"{lathes.characteristic}-b", lathes.other.characteristic
    late = [(one, 5), (two, 5), (one, 6), (two, 6), (other, 1), (other, 2)]
    assert sorted(listed(lathes, **{"from": at(4), "to": at(63)})) == sorted(late)
    assert listed(lathes, characteristic=one, **{"from": at(1), "to": at(4)}, order="newest") == [
        (one, 4),
        (one, 3),
        (one, 2),
    ]
    assert listed(lathes, zone="oversize") == [(two, 4)]
    assert listed(lathes, zone=["oversize", "full"]) == [(two, 4), (other, 3)]
    assert listed(lathes, action="correct") == [(other, 3)]
    assert listed(lathes, characteristic=one, zone="wear") == []


def test_the_key_of_a_machine_sees_its_own(lathes: TwoLathes) -> None:
    other = lathes.other
    assert listed(lathes, other.machine_client, part="SN-0002") == [(other.characteristic, 2)]
    assert listed(lathes, other.machine_client) == [(other.characteristic, number) for number in (1, 2, 3)]
    assert other.machine_client.get(f"/api/v1/readings?machine={lathes.machine}").status_code == 403
    assert other.machine_client.get(f"/api/v1/readings?characteristic={lathes.characteristic}").status_code == 403


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
        ({"from": "2026-03-05", "to": "2026-03-04"}, "from"),
        ({"from": "yesterday"}, "from"),
    ],
)
def test_what_is_no_filter_is_refused_by_name(lathes: TwoLathes, query: dict[str, str], field: str) -> None:
    params = {name: value.replace("{characteristic}", lathes.characteristic) for name, value in query.items()}
    answer = lathes.admin.get("/api/v1/readings", params=params)
    assert answer.status_code == 422, answer.text
    assert [error["field"].split("[")[0] for error in answer.json()["errors"]] == [field]


def test_what_is_not_there_is_not_found(lathes: TwoLathes) -> None:
    assert lathes.admin.get("/api/v1/readings?machine=nowhere").status_code == 404
    assert lathes.admin.get("/api/v1/readings?characteristic=nowhere").status_code == 404
