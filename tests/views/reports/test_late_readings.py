"""A period by time of readings some of which came late: every page, figure and file counts the same ones."""

import csv
import io
import json
from html import unescape
from typing import Any

import pytest

from tests.shop import Person, Shop
from tests.views.reports.story import facts, report, scatter, table

HOUR = "2026-11-21T{:02d}:{:02d}:00Z"
PERIOD = "from=2026-11-21T09:00:00Z&to=2026-11-21T10:00:00Z"
# Thirty from eight, sixty from nine, thirty from ten; of each hour one comes late (or its clock is fast), far out.
LATE = {50: (8, 7.5), 70: (10, -7.0), 100: (9, 6.0), 110: (9, 5.5)}
MEANT = [*range(31, 50), *range(51, 70), *range(71, 91), 100, 110]


@pytest.fixture(scope="module")
def late(common_shop: Shop) -> Shop:
    rows = []
    for sequence, value in enumerate(scatter(120, seed=7, mean=0.0), start=1):
        hour, minute = (
            (8, sequence) if sequence <= 30 else (9, sequence - 31) if sequence <= 90 else (10, sequence - 91)
        )
        if sequence in LATE:
            hour, value = LATE[sequence]  # noqa: PLW2901
        measured = round(40 + value / 1000, 7)
        rows.append(
            {
                "characteristic": common_shop.characteristic,
                "measured": measured,
                "measured_at": HOUR.format(hour, minute),
            }
        )
    assert common_shop.admin.post("/api/v1/readings/batch", json=rows).status_code == 201
    baseline: dict[str, Any] = {"quantity": "deviation", "first_sequence": 1, "last_sequence": 30, "reason": "calm"}
    common_shop.call("POST", f"/characteristics/{common_shop.characteristic}/baselines", 201, **baseline)
    return common_shop


def of(shop: Shop, what: str, query: str = PERIOD) -> Any:
    return shop.call("GET", f"/characteristics/{shop.characteristic}/{what}?{query}")


def test_the_numbers_of_page_api_and_report_are_those_of_the_period(late: Shop, viewer: Person) -> None:
    found = of(late, "statistics")
    assert found["count"] == len(MEANT)
    assert (found["minimum"], found["maximum"]) == (pytest.approx(found["minimum"]), 0.006)
    said = facts(report(late, PERIOD), "numbers")
    assert said["count"]["value"] == found["count"]
    assert said["mean"]["value"] == pytest.approx(found["mean"] * 1000, abs=1e-9)
    assert of(late, "capability")["readings"] == found["count"]
    page = " ".join(unescape(viewer.open(f"/characteristics/{late.characteristic}?{PERIOD}")).split())
    for words in (f">{len(MEANT)}</span>", f"{found['minimum'] * 1000:.1f}", "+6.0"):
        assert words.replace("-", "\N{MINUS SIGN}") in page, words
    assert "+7.5" not in page.partition("Decisions")[0]


def test_the_figures_show_them(late: Shop) -> None:
    bars = of(late, "figures/histogram")["data"][0]
    assert sum(bars["x"]) == len(MEANT)
    for name in ("zones", "run", "control"):
        shown = {
            int(link.rsplit("/", 1)[1])
            for trace in of(late, f"figures/{name}")["data"]
            if trace.get("meta") in {"readings", "run", "points"}
            for link in trace["customdata"]
        }
        assert sorted(shown) == MEANT, name


@pytest.mark.parametrize("chart", ["individuals", "moving_range", "ewma", "cusum"])
def test_a_control_chart_has_their_points_which_are_what_they_are_in_any_window(late: Shop, chart: str) -> None:
    found, whole = (of(late, "control", f"{query}&chart={chart}") for query in (PERIOD, "last=all"))
    assert found["points"]["last"] == MEANT
    values = dict(zip(whole["points"]["last"], whole["points"]["value"], strict=True))
    assert found["points"]["value"] == [values[sequence] for sequence in MEANT]
    signals = {(each["rule"], at) for each in whole["signals"] for at in range(each["first"], each["last"] + 1)}
    ends = {(each["rule"], each[end]) for each in found["signals"] for end in ("first", "last")}
    assert ends <= {(rule, at) for rule, at in signals if at in MEANT}
    file = late.admin.get(f"/api/v1/characteristics/{late.characteristic}/control.csv?{PERIOD}&chart={chart}").text
    assert [int(row["last_reading"]) for row in csv.DictReader(io.StringIO(file.lstrip("\ufeff")))] == MEANT


def test_a_report_lists_the_decisions_and_corrections_of_them_alone(late: Shop) -> None:
    whole = report(late, PERIOD + "&section=decisions&section=corrections&section=numbers")
    assert [row["reading"]["value"] for row in table(whole, "decisions")] == MEANT[:-51:-1]
    decisions = next(each for each in whole["sections"] if each["key"] == "decisions")
    assert decisions["table"]["more"] == len(MEANT) - 50
    corrected = {row["reading"]["value"] for row in table(whole, "corrections")}
    assert corrected
    assert corrected <= set(MEANT), json.dumps(sorted(corrected))
    assert facts(whole, "corrections")["issued"]["value"] == of(late, "statistics")["corrections"]
