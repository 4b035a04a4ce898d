"""Batches: up to 10,000 readings in one request, in the given order, all or nothing."""

import random
from typing import Any

import httpx
import pytest

from app.core.parameters import read
from app.db.engine import Database
from app.errors import NotFound
from app.loop.readings.api import _looked_up
from app.loop.readings.door import Directory
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from tests.loop.readings.load import ndjson, scattered
from tests.loop.readings.record import counts, history, must_hold, must_replay
from tests.shop import PARAMETERS, Shop

pytestmark = pytest.mark.own_server  # the whole record of its database is held against the rules

NDJSON = {"Content-Type": "application/x-ndjson"}


def batch(shop: Shop, readings: list[Any], client: httpx.Client | None = None, **query: Any) -> httpx.Response:
    return (client or shop.machine_client).post("/api/v1/readings/batch", json=readings, params=query)


def refused(shop: Shop, status: int, readings: list[Any], *, alarms: int = 0, **more: Any) -> dict[str, Any]:
    """A batch that must be refused and leave no trace but so many alarms."""
    before = counts(shop.server.database.dsn)
    before = before | {table: before[table] + alarms for table in ("alarm", "event")}
    answer = batch(shop, readings, **more)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert counts(shop.server.database.dsn) == before
    problem: dict[str, Any] = answer.json()
    return problem


def fields(problem: dict[str, Any]) -> list[str]:
    return [error["field"] for error in problem["errors"]]


def good(shop: Shop, count: int = 3) -> list[dict[str, Any]]:
    return [{"characteristic": shop.characteristic, "measured": 40.0 + n / 1e6} for n in range(count)]


def test_a_list_is_answered_with_counts(shop: Shop) -> None:
    wanted = [{"characteristic": shop.characteristic, "measured": 40 + um / 1000} for um in (0.0, 6.0, 6.0, 350.0)]
    answer = batch(shop, wanted)
    assert answer.status_code == 201
    assert answer.json() == {
        "stored": 4,
        "repeated": 0,
        "zones": {"zero": 2, "full": 1, "wear": 1},
        "corrections": 2,
        "alarms": 1,
    }


def test_lines_are_taken_as_a_list_is(shop: Shop) -> None:
    readings = list(scattered(shop.characteristic, 50, 1))
    body = b"\n" + ndjson(readings[:25]) + b"\r\n\r\n" + ndjson(readings[25:]) + b"\n"
    answer = shop.machine_client.post("/api/v1/readings/batch?decisions=true", content=body, headers=NDJSON)
    assert answer.status_code == 201, answer.text
    items = answer.json()["items"]
    assert [item["key"] for item in items] == [reading["key"] for reading in readings]
    again = batch(shop, readings, decisions=True).json()
    assert (again["stored"], again["repeated"], again["items"]) == (0, 50, items)


def test_decisions_are_those_of_the_record(shop: Shop) -> None:
    answer = batch(shop, list(scattered(shop.characteristic, 600, 2)), decisions=True)
    items = answer.json()["items"]
    listed = shop.call("GET", f"/readings?characteristic={shop.characteristic}&limit=1000")["items"]
    assert [{name: row[name] for name in items[0]} for row in listed] == items
    assert must_replay(read(PARAMETERS)[0], history(shop.server.database.dsn, shop.characteristic)) > 5
    must_hold(shop.server.database.dsn)


def test_an_empty_list_is_nothing(shop: Shop) -> None:
    answer = batch(shop, [], decisions=True)
    assert (answer.status_code, answer.json()["stored"], answer.json()["items"]) == (201, 0, [])
    answer = shop.machine_client.post("/api/v1/readings/batch", content=b"\n\n", headers=NDJSON)
    assert (answer.status_code, answer.json()["stored"]) == (201, 0)


def test_ten_thousand_are_taken_and_one_more_is_too_many(shop: Shop) -> None:
    readings = list(scattered(shop.characteristic, 10_001, 3, wide=0.0006))
    problem = refused(shop, 413, readings)
    assert "10001" in problem["detail"].replace(",", "")
    assert batch(shop, readings[:-1]).json()["stored"] == 10_000
    again = batch(shop, readings[:-1], decisions=True)
    assert (again.json()["repeated"], len(again.json()["items"])) == (10_000, 10_000)
    must_replay(read(PARAMETERS)[0], history(shop.server.database.dsn, shop.characteristic))
    must_hold(shop.server.database.dsn)


def test_several_characteristics_and_machines_in_one(shop: Shop, server: Any) -> None:
    other = Shop(server)
    second = f"{shop.characteristic}-2"
    shop.add(second)
    names = (shop.characteristic, other.characteristic, second)
    mixed = [
        reading for trio in zip(*(scattered(n, 40, at) for at, n in enumerate(names)), strict=True) for reading in trio
    ]
    answer = batch(shop, mixed, shop.admin, decisions=True)
    assert answer.status_code == 201, answer.text
    items = answer.json()["items"]
    assert [(item["characteristic"], item["key"]) for item in items] == [(r["characteristic"], r["key"]) for r in mixed]
    for name in names:
        assert [item["sequence"] for item in items if item["characteristic"] == name] == list(range(1, 41))
    must_replay(read(PARAMETERS)[0], history(server.database.dsn, other.characteristic))
    must_hold(server.database.dsn)
    problem = refused(shop, 403, mixed)  # the machine's own key
    assert "another machine" in problem["detail"]


def test_the_same_key_within_a_batch_is_one_reading(shop: Shop) -> None:
    one = {"characteristic": shop.characteristic, "measured": 40.006, "key": "k"}
    answer = batch(shop, [one, one | {"key": "other"}, one, one], decisions=True).json()
    assert (answer["stored"], answer["repeated"], answer["corrections"]) == (2, 2, 1)
    assert [item["sequence"] for item in answer["items"]] == [1, 2, 1, 1]
    assert answer["items"][0] == answer["items"][2] == answer["items"][3]
    problem = refused(shop, 409, [good(shop)[0], one | {"measured": 40.007}])
    assert fields(problem) == ["[1].key"]


def test_the_same_new_key_with_two_values_is_refused_whole(shop: Shop) -> None:
    one = {"characteristic": shop.characteristic, "measured": 40.006, "key": "k"}
    assert fields(refused(shop, 409, [one, one | {"measured": 40.0}])) == ["[1].key"]
    assert shop.read(0.0)["sequence"] == 1


class TestAllOrNothing:
    def test_what_the_state_forbids_is_named_by_position(self, shop: Shop) -> None:
        readings = good(shop, 5)
        readings[1]["correction_in_effect"] = 7
        readings[4] = {"characteristic": shop.characteristic, "touches": [[40.0], [40.0]]}
        problem = refused(shop, 422, readings, alarms=1)  # of too many touches: nobody else would see them
        assert fields(problem) == ["[1].correction_in_effect", "[4].touches"]
        assert problem["detail"].startswith("2 of 5 readings cannot be taken; the first is [1]")

    def test_what_is_wrong_with_fields_is_named_by_position(self, shop: Shop) -> None:
        readings = good(shop, 4)
        readings[0]["measured"] = "forty"
        readings[2] |= {"colour": "red", "measured_at": 1763709302}
        assert sorted(fields(refused(shop, 422, readings))) == ["[0].measured", "[2].colour", "[2].measured_at"]
        answer = shop.machine_client.post("/api/v1/readings/batch", content=ndjson(readings), headers=NDJSON)
        assert sorted(fields(answer.json())) == ["[0].measured", "[2].colour", "[2].measured_at"]

    def test_every_characteristic_that_is_not_there_is_named(self, shop: Shop) -> None:
        readings = good(shop, 2) + [{"characteristic": name, "measured": 1.0} for name in ("no", "nor", "no")]
        assert fields(refused(shop, 404, readings)) == [
            "[2].characteristic",
            "[3].characteristic",
            "[4].characteristic",
        ]

    def test_one_that_is_not_there_is_looked_up_once(self, database: Database) -> None:
        asked: list[str] = []

        class Counting(Directory):
            def look_up(self, characteristic: str) -> Entry:
                asked.append(characteristic)
                return super().look_up(characteristic)

        with pytest.raises(NotFound):
            _looked_up(Counting(database), [ReadingIn(characteristic="no", measured=1.0)] * 1000)
        assert asked == ["no"]

    def test_a_broken_line_is_named(self, shop: Shop) -> None:
        body = ndjson(good(shop)) + b'\n{"characteristic": '
        answer = shop.machine_client.post("/api/v1/readings/batch", content=body, headers=NDJSON)
        assert (answer.status_code, fields(answer.json())) == (422, ["[3]"])

    def test_no_more_errors_are_reported_than_somebody_reads(self, shop: Shop) -> None:
        readings = [{"characteristic": shop.characteristic, "measured": None} for _ in range(500)]
        problem = refused(shop, 422, readings)
        assert len(problem["errors"]) == 100
        assert problem["detail"].startswith("500")

    @pytest.mark.parametrize("body", [b"{}", b"7", b"null", b'"x"', b"[[]]", b"[1]", b"[", b"", b"\xff", b"[" * 9000])
    def test_what_is_no_list_of_readings(self, shop: Shop, body: bytes) -> None:
        answer = shop.machine_client.post("/api/v1/readings/batch", content=body)
        assert answer.status_code == 422, answer.text
        assert answer.json()["errors"]

    def test_too_many_bytes(self, shop: Shop) -> None:
        answer = shop.machine_client.post("/api/v1/readings/batch", content=b" " * 33_000_000)
        assert answer.status_code == 413
        assert answer.headers["content-type"] == "application/problem+json"

    def test_a_viewer_may_not(self, shop: Shop, server: Any) -> None:
        refused(shop, 403, good(shop), client=server.client(server.key("viewer")))
        refused(shop, 401, good(shop), client=server.client())


def test_any_order_of_duplicates_changes_nothing(shop: Shop, server: Any) -> None:
    """Sent once in order, and sent again and again in between: the same record."""
    chance = random.Random(11)
    readings = list(scattered(shop.characteristic, 200, 4))
    batch(shop, readings)
    other = Shop(server)
    noisy: list[dict[str, Any]] = []
    for number, reading in enumerate(readings):
        noisy.append(reading | {"characteristic": other.characteristic})
        noisy += [noisy[chance.randrange(len(noisy))] for _ in range(chance.randrange(3))]
        if number == 100:
            assert batch(other, noisy).status_code == 201
    answer = batch(other, noisy).json()
    assert answer["stored"] == 99
    same = ("sequence", "measured", "decided", "average_before", "average_after", "zone", "action", "amount", "key")
    one, two = (history(server.database.dsn, name) for name in (shop.characteristic, other.characteristic))
    assert [[r[n] for n in same] for r in one] == [[r[n] for n in same] for r in two]
    must_hold(server.database.dsn)
