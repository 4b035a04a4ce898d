"""Corrections that were issued before parameters changed: what no longer holds never reaches the machine."""

from typing import Any

import pytest

from tests.shop import Person, Shop

WHY = "drawing index C"
VOID: list[dict[str, Any]] = [
    {"factor": 0.5},  # the other way, and by half
    {"tool_memory": 4},
    {"target": 40.02},
    {"mode": "measure_only"},
    {"mode": "approval"},
    {"tool_memory": 0},
]
VALID: list[dict[str, Any]] = [{"zero_range": 0.0005}, {"weighting_factor": 3}, {"wear_limit": 0.2}]


def change(shop: Shop, parameters: dict[str, Any]) -> Any:
    path = f"/characteristics/{shop.characteristic}"
    return shop.call("PATCH", path, parameters=parameters, reason=WHY)


@pytest.mark.parametrize("parameters", VOID, ids=str)
def test_a_change_of_what_it_was_computed_with_supersedes_a_correction(shop: Shop, parameters: dict[str, Any]) -> None:
    other = shop.another("seat", average_memory=6)  # of the same tool: its correction is as right as before
    mine = shop.read(20)["correction"]["number"]
    theirs = shop.read(40, other)["correction"]["number"]
    (warning,) = [each for each in change(shop, parameters)["warnings"] if each["code"] == "corrections_superseded"]
    assert f"Correction {mine} was computed with the parameters before" in warning["text"]
    fallen = shop.correction(mine)
    assert (fallen["status"], fallen["status_reason"]) == ("superseded", WHY)
    assert shop.correction(theirs)["status"] == "pending"
    waiting = shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending", client=shop.machine_client)
    assert [each["number"] for each in waiting["items"]] == [theirs]
    refused = shop.call("POST", f"/corrections/{shop.machine}/{mine}/applied", 409, client=shop.machine_client)
    assert "must not be in the offset" in refused["what_to_do"]
    entry = shop.call("GET", f"/audit?subject=characteristic/{shop.characteristic}")["items"][0]
    assert entry["after"]["superseded"] == [mine]


@pytest.mark.parametrize("parameters", VALID, ids=str)
def test_a_change_of_limits_leaves_a_correction(shop: Shop, parameters: dict[str, Any]) -> None:
    number = shop.read(20)["correction"]["number"]
    assert "corrections_superseded" not in {each["code"] for each in change(shop, parameters)["warnings"]}
    assert shop.correction(number)["status"] == "pending"


@pytest.mark.parametrize(("location", "fate"), [(7, "superseded"), (8, "pending"), (0, "pending")])
def test_another_location_voids_a_correction_where_its_empirical_value_is_another(
    shop: Shop, location: int, fate: str
) -> None:
    shop.call("PUT", f"/machines/{shop.machine}/averages/7", empirical_value=0.05, reason="ring")
    number = shop.read(20)["correction"]["number"]
    change(shop, {"average_memory": location})
    assert shop.correction(number)["status"] == fate


def test_another_tool_is_corrected_for_the_same_error_and_the_first_is_not(shop: Shop) -> None:
    first = shop.read(20)["correction"]
    change(shop, {"tool_memory": 4})
    second = shop.read(20)["correction"]
    assert (second["tool_memory"], second["amount"]) == (4, first["amount"])
    pending = shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"]
    assert [each["number"] for each in pending] == [second["number"]]


def test_a_held_correction_falls_with_the_sign_that_it_was_computed_with(shop: Shop) -> None:
    held = shop.read(350)["correction"]
    assert held["status"] == "held"
    change(shop, {"factor": 1})
    assert shop.correction(held["number"])["status"] == "superseded"
    shop.correction(held["number"], "release", 409, reason="insert is fine")


def test_the_page_says_once_which_correction_fell(shop: Shop) -> None:
    number = shop.read(20)["correction"]["number"]
    engineer = Person(shop.server, "engineer")
    change(shop, {"factor": 1})
    path = f"/setup/characteristics/{shop.characteristic}"
    sentence = f"Correction {number} was computed with the parameters before and is superseded"
    assert sentence in engineer.open(f"{path}?done=changed")
    assert sentence not in engineer.open(path)


def test_a_false_reading_takes_the_correction_along_that_it_asked_for(shop: Shop) -> None:
    number = shop.read(20)["correction"]["number"]
    shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", reason="chip on the stylus")
    fallen = shop.correction(number)
    assert (fallen["status"], fallen["status_reason"]) == ("rejected", "chip on the stylus")
    assert shop.read(0)["correction"] is None, "nothing is outstanding any more"
    assert shop.call("GET", f"/audit?subject=reading/{shop.characteristic}/1")["items"][0]["after"] == {
        "excluded": True,
        "rejected": [number],
    }
    applied = shop.read(20)["correction"]["number"]
    shop.correction(applied, "applied")
    shop.call("POST", f"/readings/{shop.characteristic}/3/exclude", reason="chip on the stylus")
    assert shop.correction(applied)["status"] == "applied", "it is in the offset"


def test_a_key_twice_in_a_batch_names_no_reading_that_is_not_there(shop: Shop) -> None:
    rows = [{"characteristic": shop.characteristic, "measured": size, "key": "e1"} for size in (40.0, 40.001)]
    answer = shop.admin.post("/api/v1/readings/batch", json=rows)
    assert answer.status_code == 409
    assert f"Key e1 of {shop.characteristic} comes twice: with 40.0 mm and with 40.001 mm." in answer.json()["detail"]
    assert shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"] == []
