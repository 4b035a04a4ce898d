"""Measurements by hand: kept beside the machine's value with who, when and why; the decision stays as it was."""

import csv
import io
import json
from typing import Any

import pytest

from tests.servers import Server
from tests.shop import Shop


@pytest.fixture
def measured(shop: Shop) -> Shop:
    """It has measured one part."""
    shop.read(10.0, part="SN-1")
    return shop


def test_a_size_found_by_hand_stands_beside_the_machines(measured: Shop) -> None:
    path = f"/readings/{measured.characteristic}/1"
    before = measured.call("GET", path)
    assert before["by_hand"] == []
    made = measured.call("POST", f"{path}/by-hand", 201, measured=40.002, verdict="good", comment="Micrometer")
    assert {name: made[name] for name in ("sequence", "measured", "verdict", "comment", "alarm")} == {
        "sequence": 1,
        "measured": 40.002,
        "verdict": "good",
        "comment": "Micrometer",
        "alarm": None,
    }
    assert made["by"] == "key a test's key"
    after = measured.call("GET", path)
    assert after.pop("by_hand") == [made]
    before.pop("by_hand")
    assert after == before, "the decision and the machine's value stay as they were"


def test_a_verdict_without_a_size_is_enough_and_there_may_be_more_than_one(measured: Shop) -> None:
    path = f"/readings/{measured.characteristic}/1"
    measured.call("POST", f"{path}/by-hand", 201, verdict="bad", comment="Plug gauge does not go in")
    measured.call("POST", f"{path}/by-hand", 201, measured=40.0095)
    found = measured.call("GET", path)["by_hand"]
    assert [(each["measured"], each["verdict"]) for each in found] == [(None, "bad"), (40.0095, None)]


def test_they_are_listed_page_by_page(measured: Shop) -> None:
    for at in range(3):
        measured.call("POST", f"/readings/{measured.characteristic}/1/by-hand", 201, measured=40.0 + at / 1000)
    first = measured.call("GET", f"/characteristics/{measured.characteristic}/hand-measurements?limit=2")
    second = measured.call("GET", f"/characteristics/{measured.characteristic}/hand-measurements?after={first['next']}")
    sizes = [each["measured"] for each in (*first["items"], *second["items"])]
    assert sizes == [40.0, 40.001, 40.002]
    assert second["next"] is None


@pytest.mark.parametrize(
    ("body", "fields"),
    [
        ({}, ["measured", "verdict"]),
        ({"comment": "looked at"}, ["measured", "verdict"]),
        ({"measured": 4000.2}, ["measured"]),  # µm, or a lost point
        ({"measured": "40.002"}, ["measured"]),
        ({"verdict": "fine"}, ["verdict"]),
        ({"measured": 40.002, "comment": ""}, ["comment"]),
        ({"measured": 40.002, "reason": "x"}, ["reason"]),
    ],
)
def test_what_cannot_be_meant_is_refused(measured: Shop, body: dict[str, Any], fields: list[str]) -> None:
    answer = measured.admin.post(f"/api/v1/readings/{measured.characteristic}/1/by-hand", json=body)
    assert answer.status_code == 422, answer.text
    assert [error["field"] for error in answer.json()["errors"]] == fields
    assert measured.call("GET", f"/readings/{measured.characteristic}/1")["by_hand"] == []


def test_it_needs_a_reading_and_an_operator(measured: Shop, server: Server) -> None:
    measured.call("POST", f"/readings/{measured.characteristic}/99/by-hand", 404, measured=40.0)
    measured.call("POST", "/readings/nowhere/1/by-hand", 404, measured=40.0)
    viewer = server.client(server.key("viewer"))
    measured.call("POST", f"/readings/{measured.characteristic}/1/by-hand", 403, client=viewer, measured=40.0)
    measured.call(
        "POST", f"/readings/{measured.characteristic}/1/by-hand", 403, client=measured.machine_client, measured=40.0
    )


def test_the_record_and_the_events_tell_of_it(measured: Shop, server: Server) -> None:
    measured.call("POST", f"/readings/{measured.characteristic}/1/by-hand", 201, measured=40.002, comment="Micrometer")
    (entry,) = measured.call("GET", f"/audit?subject=reading/{measured.characteristic}/1")["items"]
    assert (entry["action"], entry["before"], entry["after"], entry["why"]) == (
        "measured by hand",
        {"measured": 40.01},
        {"by_hand": 40.002, "good": None},
        "Micrometer",
    )


def test_exports_hold_results_and_the_last_measurement_by_hand(measured: Shop, server: Server) -> None:
    from app.loop.readings import exporting
    from app.loop.readings.queries import entry_of

    name = f"{measured.characteristic}-b"
    measured.add(name, points=3, accept={"n": 2, "m": 3}, average_memory=0)
    for touches in ([[40.02], [40.02], [40.0]], [[40.0], [40.0], [40.0]]):
        measured.call("POST", "/readings", 201, characteristic=name, touches=touches)
    measured.call("POST", f"/readings/{name}/1/by-hand", 201, measured=40.015)
    measured.call("POST", f"/readings/{name}/1/by-hand", 201, measured=40.007, verdict="good")
    with server.database.begin() as session:
        entry = entry_of(session, name)
        assert entry is not None
        table, lines = io.StringIO(), io.StringIO()
        assert exporting.write_csv(exporting.rows(session, entry), table) == 2
        assert exporting.write_ndjson(exporting.rows(session, entry), lines) == 2
    first, second = csv.DictReader(io.StringIO(table.getvalue()))
    assert (first["sections_outside"], first["rejected"], first["hand_measured"], first["hand_verdict"]) == (
        *("2", "true", "40.007", "good"),
    )
    assert (second["sections_outside"], second["rejected"], second["hand_measured"]) == ("0", "false", "")
    found = [json.loads(line) for line in lines.getvalue().splitlines()]
    assert [each["hand_measured"] for each in found] == [40.007, None]
    assert found[0]["touches"] == [[40.02], [40.02], [40.0]]
