"""A characteristic with a natural limit through the front door: run-out that is good is not barely capable, and not drifting."""

from pathlib import Path
from typing import Any

import pytest

from tests.shop import Person, Shop

CASE = [
    float(line.split(",")[1])
    for line in Path(__file__).with_name("runout-half-normal.csv").read_text("utf-8").splitlines()[1:]
]
"""300 run-outs, drawn from a half-normal distribution; the largest is 0.00739 mm."""
RUN_OUT: dict[str, Any] = {
    "target": None,
    "tolerance_width": None,
    "nominal": 0,
    "upper_deviation": 0.0127,
    "lower_deviation": 0,
    "averaging_limit": 0.004,
    "tool_memory": 0,
    "average_memory": 0,
    "weighting_factor": 1,
}


def measured(shop: Shop, key: str, values: list[float]) -> None:
    rows = [{"characteristic": key, "measured": value} for value in values]
    assert shop.admin.post("/api/v1/readings/batch?decisions=false", json=rows).status_code == 201


def study(shop: Shop, key: str, query: str = "last=all", status: int = 200) -> Any:
    return shop.call("GET", f"/characteristics/{key}/capability?{query}", status)


@pytest.fixture
def run_out(shop: Shop) -> str:
    key = shop.another("run-out", **RUN_OUT)
    measured(shop, key, CASE)
    return key


def test_run_out_is_judged_by_its_upper_limit_alone(shop: Shop, viewer: Person, run_out: str) -> None:
    found = study(shop, run_out)
    assert (found["natural_limit"], found["lower_limit"], found["upper_limit"]) == ("lower", None, 0.0127)
    assert (found["quoted"]["index"], round(found["quoted"]["value"], 2)) == (
        "fitted",
        1.76,
    )  # half-normal; 1.94 beside it is that of the largest reading
    assert round(found["percentiles"]["ppk"], 4) == 1.9398
    assert round(found["ppk"]["value"], 4) == 2.4087
    assert (found["cp"], found["pp"], found["cpm"], found["percentiles"]["pp"]) == (None, None, None, None)
    assert [found[name]["below"] for name in ("ppm_within", "ppm_overall", "ppm_observed")] == [None, None, None]
    assert found["ppm_observed"]["total"] == 0
    assert found["tolerance_interval"] is None, "it is not normal, and 300 are too few for one by the extremes"
    assert found["one_sided"].startswith("The lower limit 0 mm is a natural one: no part can be below it.")
    assert study(shop, run_out, "last=all&side=upper") == found
    assert "carries no index" in study(shop, run_out, "side=lower", 422)["detail"]
    page = viewer.open(f"/characteristics/{run_out}/capability?last=all")
    assert "1.76" in page
    assert "The lower limit 0 mm is a natural one" in page
    assert "Lower only" not in page


def test_the_overview_says_the_same(shop: Shop, run_out: str) -> None:
    rows = shop.call("GET", f"/overview?machine={shop.machine}&limit=200")
    mine = next(row for row in rows["items"] if row["characteristic"] == run_out)
    assert (mine["quote"], round(mine["ppk"], 2)) == ("fitted", 1.76)
    assert mine["state"] == "measure_only"


def test_readings_from_before_it_was_entered_are_judged_by_it(shop: Shop) -> None:
    key = shop.another("two-sided", **RUN_OUT, natural_limit="none")
    measured(shop, key, CASE)
    assert study(shop, key)["percentiles"]["ppk"] == pytest.approx(1.0058, abs=5e-5)
    change = {"natural_limit": "lower"}
    shop.call("PATCH", f"/characteristics/{key}", parameters=change, reason="nothing is below 0")
    assert study(shop, key)["percentiles"]["ppk"] == pytest.approx(1.9398, abs=5e-5)
    measured(shop, key, [0.001])
    found = study(shop, key)
    assert (found["readings"], round(found["percentiles"]["ppk"], 2), found["far"]) == (301, 1.94, [])


def test_a_limit_that_was_taken_for_natural_is_named_and_can_be_refused(shop: Shop) -> None:
    sizes = {"R42": 0, "R40": 0.01, "R41": 0, "R33": 0.001, "R37": 0.3, "R36": 1}
    added = shop.call(
        "POST",
        "/characteristics",
        201,
        key=f"{shop.machine}-rnd",
        name="Roundness",
        machine=shop.machine,
        parameters=sizes,
    )
    assert (added["parameters"]["natural_limit"], added["parameters"]["target"]) == ("lower", 0)
    assert [each["code"] for each in added["warnings"]] == ["natural_assumed"]
    key = added["key"]
    changed = shop.call("PATCH", f"/characteristics/{key}", parameters={"natural_limit": "none"}, reason="a position")
    assert changed["parameters"]["target"] == 0.005
    assert [each["code"] for each in changed["warnings"]] == ["natural_likely"]  # by its name
    refused = shop.call(
        "PATCH", f"/characteristics/{key}", 422, reason="correct it",
        parameters={"natural_limit": "lower", "R10": 3, "factor": -1},
    )  # fmt: skip
    assert "no offset corrects it" in refused["detail"]


def test_a_size_far_from_0_is_no_form_whatever_its_name(shop: Shop) -> None:
    changed = shop.call("PATCH", f"/characteristics/{shop.characteristic}", name="ra-g", reason="as on the drawing")
    assert changed["warnings"] == []


def test_what_no_part_can_be_is_a_probe_fault(shop: Shop) -> None:
    key = shop.another("below", **RUN_OUT)
    answer = shop.call("POST", "/readings", 201, characteristic=key, measured=-0.002)
    assert (answer["zone"], answer["reason"]["code"]) == ("probe_fault", "beyond_natural_limit")
    assert "beyond the natural limit" in answer["reason"]["text"]
    alarm = next(each for each in shop.alarms() if each["characteristic"] == key)
    assert "natural limit" in alarm["text"]


def test_set_up_offers_it_and_draws_one_side(shop: Shop, engineer: Person, run_out: str) -> None:
    page = engineer.open(f"/setup/characteristics/{run_out}")
    assert '<option value="lower" selected' in page
    assert page.count('data-limit="tolerance"') == 2
    assert "+12.7" in page
    assert "−12.7" not in page
