"""Paired readings against an external gauge over HTTP: what they say together, and what follows when it is accepted."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from tests.shop import Shop

DIFFERENCES = (0.0021, 0.0030, 0.0024, 0.0028, 0.0027)


def path(shop: Shop, what: str = "pairs") -> str:
    return f"/machines/{shop.machine}/averages/5/{what}"


def add(shop: Shop, status: int = 201, **more: Any) -> Any:
    body: dict[str, Any] = {"machine_value": 40.0025, "external_value": 40.0, "instrument": "Micrometer 7"} | more
    return shop.call("POST", path(shop), status, **{name: each for name, each in body.items() if each is not None})


def compared(shop: Shop, *differences: float) -> Any:
    for difference in differences:
        add(shop, machine_value=round(40 + difference, 6))
    return shop.call("GET", path(shop, "suggestion"))


def test_a_reading_is_named_or_typed(shop: Shop) -> None:
    shop.read(6.1)
    named = add(shop, machine_value=None, characteristic=shop.characteristic, sequence=1, external_value=40.0041)
    assert (named["machine_value"], named["difference"], named["sequence"]) == (40.0061, 0.002, 1)
    typed = add(shop)
    assert (typed["difference"], typed["characteristic"], typed["counts"]) == (0.0025, None, True)
    assert [pair["id"] for pair in shop.call("GET", path(shop))["items"]] == [named["id"], typed["id"]]
    assert shop.call("GET", f"{path(shop)}?limit=1")["next"] == str(named["id"])


@pytest.mark.parametrize(
    ("more", "code", "field"),
    [
        ({"external_value": 1.5748}, "looks_like_inches", "external_value"),
        ({"machine_value": 1.5749, "external_value": 1.5748}, "looks_like_inches", "machine_value"),
        ({"external_value": 30.0}, "pair_apart", "external_value"),
    ],
)
def test_a_pair_that_may_be_wrong_is_named(shop: Shop, more: dict[str, Any], code: str, field: str) -> None:
    warning = add(shop, **more)["warnings"][0]
    assert (warning["code"], warning["field"]) == (code, field)
    assert add(shop)["warnings"] == []


@pytest.mark.parametrize(
    ("more", "status", "field"),
    [
        ({"machine_value": None}, 422, "machine_value"),
        ({"characteristic": "nowhere", "machine_value": None, "sequence": 1}, 422, "characteristic"),
        ({"characteristic": "nowhere"}, 422, "sequence"),
        ({"sequence": 3}, 422, "machine_value"),
        ({"instrument": ""}, 422, "instrument"),
        ({"external_value": None}, 422, "external_value"),
    ],
)
def test_half_a_pair_is_refused(shop: Shop, more: dict[str, Any], status: int, field: str) -> None:
    assert add(shop, status, **more)["errors"][0]["field"] == field
    assert shop.call("GET", path(shop))["items"] == []


def test_a_reading_of_another_machine_is_refused(shop: Shop) -> None:
    other = Shop(shop.server)
    other.read(1.0)
    add(shop, 422, machine_value=None, characteristic=other.characteristic, sequence=1)
    add(shop, 404, machine_value=None, characteristic=shop.characteristic, sequence=9)


def test_few_pairs_say_how_many_are_missing(shop: Shop) -> None:
    said = compared(shop)
    assert (said["pairs"], said["missing"], said["mean"]) == (0, 5, None)
    said = compared(shop, *DIFFERENCES[:3])
    assert (said["pairs"], said["missing"], said["suggested"], said["mean"]) == (3, 2, None, 0.0025)
    assert "2 more pairs" in said["text"]
    problem = shop.call("POST", path(shop, "suggestion/accept"), 409, reason="x")
    assert "2 more pairs" in problem["detail"]


def test_the_suggestion_by_hand(shop: Shop) -> None:
    """d = 2.1, 3.0, 2.4, 2.8, 2.7 µm: mean 2.6, s = 0.3536; t(0.975, 4) = 2.7764; 2.6 ± 2.7764 · 0.3536/√5 = 2.161 to 3.039."""
    said = compared(shop, *DIFFERENCES)
    assert said["mean"] == said["suggested"] == 0.0026
    assert said["deviation"] == pytest.approx(0.00035355, abs=1e-8)
    assert said["low"] == pytest.approx(0.002161, abs=1e-6)
    assert said["high"] == pytest.approx(0.003039, abs=1e-6)
    surer = shop.call("GET", f"{path(shop, 'suggestion')}?confidence=0.99")
    assert surer["low"] < said["low"]
    shop.call("GET", f"{path(shop, 'suggestion')}?confidence=1.5", 422)


def test_accepting_sets_the_value_and_a_new_series_begins(shop: Shop) -> None:
    compared(shop, *DIFFERENCES)
    accept = path(shop, "suggestion/accept")
    assert "another one by now" in shop.call("POST", accept, 409, empirical_value=0.0025, reason="x")["detail"]
    made = shop.call("POST", accept, 201, empirical_value=0.0026, reason="compared with the CMM")
    assert (made["kind"], made["status"], made["proposed"]) == ("pairs", "accepted", 0.0026)
    assert made["settings"]["instruments"] == ["Micrometer 7"]
    assert len(made["touches"]) == 5
    assert shop.call("GET", f"/machines/{shop.machine}/averages/5")["empirical_value"] == 0.0026
    said = compared(shop)
    assert (said["pairs"], said["missing"]) == (0, 5)
    assert said["since"] is not None
    assert {pair["counts"] for pair in shop.call("GET", path(shop))["items"]} == {False}
    assert shop.read(2.6)["deviation"] == 0.0


def test_pairs_that_agree_suggest_nothing(shop: Shop) -> None:
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.0025, reason="CMM")
    said = compared(shop, *DIFFERENCES)
    assert (said["suggested"], said["missing"]) == (None, 0)
    assert "agree" in said["text"]
    shop.call("POST", path(shop, "suggestion/accept"), 409, reason="x")


def test_one_that_stands_out_is_marked_and_can_be_excluded(shop: Shop) -> None:
    said = compared(shop, *DIFFERENCES, 0.025)
    odd = shop.call("GET", path(shop))["items"][-1]["id"]
    assert said["outlier"] == odd
    done = shop.call("POST", f"{path(shop)}/{odd}/exclude", reason="another part")
    assert (done["counts"], done["excluded"]["reason"]) == (False, "another part")
    assert "another part" in shop.call("POST", f"{path(shop)}/{odd}/exclude", 409, reason="x")["detail"]
    said = compared(shop)
    assert (said["pairs"], said["outlier"], said["mean"]) == (5, None, 0.0026)
    shop.call("POST", f"{path(shop)}/{odd + 1000}/exclude", 404, reason="x")


def test_a_key_makes_sending_again_harmless(shop: Shop) -> None:
    first = add(shop, key="cmm:1")
    assert add(shop, key="cmm:1")["id"] == first["id"]
    assert "other values" in add(shop, 409, key="cmm:1", external_value=40.1)["detail"]
    assert len(shop.call("GET", path(shop))["items"]) == 1


def test_of_two_who_accept_the_suggestion_at_once_one_wins(shop: Shop) -> None:
    compared(shop, *DIFFERENCES)
    clients = [shop.server.client(shop.server.key(role="operator")) for _ in range(6)]
    with ThreadPoolExecutor(6) as pool:
        answers = list(
            pool.map(
                lambda client: client.post(f"/api/v1{path(shop, 'suggestion/accept')}", json={"reason": "seen"}),
                clients,
            )
        )
    assert sorted(answer.status_code for answer in answers) == [201] + [409] * 5
    assert len(shop.call("GET", f"/machines/{shop.machine}/calibrations")["items"]) == 1
