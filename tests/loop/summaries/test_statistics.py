"""The numbers over HTTP, against numbers worked out by hand."""

from math import sqrt
from typing import Any

import pytest

from tests.shop import Shop

DEVIATIONS = [1.0, 2.0, -3.0, 6.0, 9.0]  # µm: zero, average, average, full, oversize
MEAN = 3.0
SQUARES = 4 + 1 + 36 + 9 + 36  # about the mean


def statistics(shop: Shop, query: str = "", status: int = 200) -> Any:
    return shop.call("GET", f"/characteristics/{shop.characteristic}/statistics{query}", status)


@pytest.fixture
def measured(shop: Shop) -> Shop:
    """Five readings, a minute apart; only judged, so that no correction counts among the deviations."""
    parameters = {"tool_memory": 0, "average_memory": 0}
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters=parameters, reason="only measure")
    for minute, deviation in enumerate(DEVIATIONS):
        shop.read(deviation, measured_at=f"2026-11-21T08:0{minute}:00Z")
    return shop


def test_by_hand(measured: Shop) -> None:
    found = statistics(measured)
    assert found["count"] == 5
    assert found["mean"] == pytest.approx(MEAN / 1000, abs=1e-12)
    assert found["standard_deviation"] == pytest.approx(sqrt(SQUARES / 4) / 1000, abs=1e-12)
    assert (found["minimum"], found["maximum"]) == (-0.003, 0.009)
    assert (found["in_tolerance"], found["share_in_tolerance"]) == (4, 0.8)
    assert found["zones"] == {
        "zero": 1, "average": 2, "full": 1, "oversize": 1, "undersize": 0, "wear": 0, "probe_fault": 0
    }  # fmt: skip
    assert (found["corrections"], found["excluded"]) == (0, 0)
    assert (found["first_sequence"], found["last_sequence"]) == (1, 5)


@pytest.mark.parametrize(
    ("query", "count", "mean"),
    [
        ("?last=2", 2, 7.5),
        ("?last=100", 5, 3.0),
        ("?from=2026-11-21T08:03:00Z", 2, 7.5),
        ("?to=2026-11-21T08:02:00Z", 2, 1.5),
        ("?from=2026-11-21T09:01:00%2B01:00&to=2026-11-21T08:02:59Z", 2, -0.5),
        ("?last=3&to=2026-11-21T08:03:00Z", 1, -3.0),
    ],
)
def test_of_a_range(measured: Shop, query: str, count: int, mean: float) -> None:
    found = statistics(measured, query)
    assert found["count"] == count
    assert found["mean"] == pytest.approx(mean / 1000, abs=1e-12)


def test_nothing_is_said_of_too_few(shop: Shop) -> None:
    nothing = statistics(shop)
    assert (nothing["count"], nothing["first_sequence"]) == (0, None)
    assert all(nothing[name] is None for name in ("mean", "standard_deviation", "minimum", "share_in_tolerance"))
    shop.read(4.0)
    one = statistics(shop)
    assert (one["count"], one["standard_deviation"]) == (1, None)
    assert one["mean"] == pytest.approx(0.004, abs=1e-12)


def test_an_empty_range_is_no_error(measured: Shop) -> None:
    found = statistics(measured, "?from=2030-01-01T00:00:00Z")
    assert (found["count"], found["mean"], sum(found["zones"].values())) == (0, None, 0)


def test_a_period_names_the_first_and_last_of_what_it_counts(measured: Shop) -> None:
    path = f"/readings?characteristic={measured.characteristic}"
    times = {each["sequence"]: each["measured_at"] for each in measured.call("GET", path)["items"]}
    found = statistics(measured, f"?from={times[2]}&to={times[4]}".replace("+", "%2B"))
    assert (found["count"], found["first_sequence"], found["last_sequence"]) == (2, 2, 3)


def test_the_excluded_are_left_out(measured: Shop) -> None:
    measured.call("POST", f"/readings/{measured.characteristic}/5/exclude", reason="chip on the stylus")
    found = statistics(measured)
    assert (found["count"], found["excluded"], found["maximum"]) == (4, 1, 0.006)
    assert found["mean"] == pytest.approx(0.0015, abs=1e-12)
    assert found["share_in_tolerance"] == 1.0


def test_a_probe_fault_is_counted_and_in_no_other_number(measured: Shop) -> None:
    before = statistics(measured)
    measured.read(1500.0)
    found = statistics(measured)
    assert (found["count"], found["probe_faults"], found["zones"]["probe_fault"]) == (6, 1, 1)
    same = ("mean", "standard_deviation", "minimum", "maximum", "in_tolerance", "share_in_tolerance", "corrections")
    assert [found[name] for name in same] == [before[name] for name in same]
    only = statistics(measured, "?last=1")
    assert (only["count"], only["probe_faults"], only["in_tolerance"]) == (1, 1, 0)
    assert all(
        only[name] is None for name in ("mean", "standard_deviation", "minimum", "maximum", "share_in_tolerance")
    )
    figure = measured.call("GET", f"/characteristics/{measured.characteristic}/figures/histogram")
    assert sum(figure["data"][0]["x"]) == 5


def test_a_part_counts_as_it_is_not_as_it_was_decided(shop: Shop) -> None:
    """The second part was cut before the correction of the first: decided as good, yet it is out of tolerance."""
    shop.read(20.0)
    second = shop.read(20.5, correction_in_effect=0)
    assert second["zone"] == "zero"
    found = statistics(shop)
    assert (found["count"], found["in_tolerance"], found["zones"]["zero"]) == (2, 0, 1)


def test_each_part_is_judged_by_the_tolerance_of_its_time(measured: Shop) -> None:
    parameters = {"tolerance_width": 0.030}
    measured.call("PATCH", f"/characteristics/{measured.characteristic}", parameters=parameters, reason="rework")
    measured.read(9.0)
    assert statistics(measured)["in_tolerance"] == 5


@pytest.mark.parametrize(
    ("query", "field", "words"),
    [
        ("?from=2026-11-22T00:00:00Z&to=2026-11-21T00:00:00Z", "from", "later than"),
        ("?from=2026-11-22T00:00:00", "from", "offset from UTC"),
        ("?to=yesterday", "to", "time with its offset"),
        ("?last=0", "last", "at least 1"),
        ("?last=many", "last", "whole number"),
    ],
)
def test_a_wrong_range_is_refused_in_words(shop: Shop, query: str, field: str, words: str) -> None:
    problem = statistics(shop, query, 422)
    assert [error["field"] for error in problem["errors"]] == [field]
    assert words in problem["errors"][0]["message"]


def test_who_may_ask(shop: Shop) -> None:
    path = f"/characteristics/{shop.characteristic}/statistics"
    assert shop.call("GET", path, client=shop.machine_client)["count"] == 0
    assert Shop(shop.server).machine_client.get(f"/api/v1{path}").status_code == 403
    assert shop.server.client().get(f"/api/v1{path}").status_code == 401
    shop.call("GET", "/characteristics/nothing/statistics", 404)
