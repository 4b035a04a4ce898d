"""What is made of the readings of files: capability, control charts and gauge studies, whichever door they came through."""

import html
from pathlib import Path
from typing import Any

import pytest

from app.bridge.file_entries import Entry
from app.bridge.plausible import Target, far_off
from tests.loop.readings.importing.doors import LENGTHS, Plant, bridged, in_utc

CASES = Path(__file__).parent / "cases"
RUN_OUT = {
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


def through_all_doors(plant: Plant, path: Path, **parameters: Any) -> str:
    """The key of a characteristic with the readings of a file, after all doors found the same in it."""
    written = [line.split(",") for line in path.read_text().splitlines()[1:]]
    wanted = [(float(size), in_utc(at)) for at, size in written]
    keys = [plant.shop.another(door, **parameters) for door in ("cli", "page", "rest")]
    assert plant.command(path, characteristic=keys[0]) == plant.page(path, keys[1]) == ""
    plant.table(path, path.read_text(), characteristic=keys[2])
    for key in keys:
        assert plant.stored(key) == wanted
    readings, _lines, words = bridged(path, {"*": "x"}, columns={"measured": "Value", "measured_at": "Time"})
    assert (readings, words) == (wanted, "")
    return keys[2]


def test_run_outs_of_a_file_are_judged_by_their_natural_limit(plant: Plant) -> None:
    path = Path(__file__).parents[3] / "quality" / "capability" / "runout-half-normal.csv"
    key = through_all_doors(plant, path, **RUN_OUT)
    found = plant.shop.call("GET", f"/characteristics/{key}/capability?last=all")
    assert round(found["percentiles"]["ppk"], 4) == 1.9398
    assert round(found["ppk"]["value"], 4) == 2.4087
    assert (found["natural_limit"], found["lower_limit"], found["cp"]) == ("lower", None, None)
    assert {found[name]["below"] for name in ("ppm_within", "ppm_overall", "ppm_observed")} == {None}


def test_rules_begin_again_with_the_baseline_of_a_file_that_shifts(plant: Plant) -> None:
    key = through_all_doors(plant, CASES / "rebase-after-shift.csv", target=40.0, tolerance_width=0.1)
    path = f"/characteristics/{key}"
    part: dict[str, Any] = {"quantity": "deviation", "first_sequence": 101, "last_sequence": 160, "reason": "shift"}
    frozen = plant.shop.call("POST", f"{path}/baselines", 201, **part)
    assert (frozen["centre"], frozen["sigma"]) == pytest.approx((0.00614, 0.0020158), abs=6e-7)
    rules = {"main": {f"nelson_{number}": "watch" for number in range(1, 9)}}
    plant.shop.call("PUT", f"{path}/rules", rules=rules, reason="all")
    shown = plant.shop.call("GET", f"{path}/control?first=101&last=60")
    assert [(each["rule"], each["first"], each["last"]) for each in shown["signals"]] == [("nelson_6", 135, 138)]


def test_a_gauge_study_with_one_row_a_reading_is_the_same_pasted_and_posted(plant: Plant) -> None:
    """As readings of a part of another size it is refused at each door, as every such file is."""
    path = CASES / "grr-long.csv"
    text = path.read_text()
    rows = [dict(zip(("part", "operator", "values"), line.split(","), strict=True)) for line in text.splitlines()[1:]]
    posted = [each | {"values": [float(each["values"])]} for each in rows]
    shop = plant.shop
    settings: dict[str, Any] = {"gauge": "Probe", "characteristic": shop.characteristic}
    shop.call("POST", "/gauge-studies", 201, kind="grr", rows=posted, **settings)
    typed = settings | {"kind": "grr", "machine": shop.machine, "do": "store", "table": text}
    plant.engineer.send("/gauges/new", **typed)
    for study in shop.call("GET", f"/gauge-studies?machine={shop.machine}&limit=2")["items"]:
        anova, ranges = study["grr"]
        (tested,) = [each for each in anova["table"] if each["source"] == "interaction"]
        assert (tested["f"], tested["p_value"]) == pytest.approx((0.5955, 0.767), abs=5e-4)
        sigma = {each["name"]: each["sigma"] for each in anova["components"]}
        wanted = {
            "grr": 0.00103834,
            "repeatability": 0.00103834,
            "reproducibility": 0,
            "part": 0.0157385,
            "total": 0.0157727,
        }
        assert {name: sigma[name] for name in wanted} == pytest.approx(wanted, abs=5e-8)
        assert (anova["pooled"], anova["ndc"]) == (True, 21)
        shares = [
            each["percent"] for method in (anova, ranges) for each in method["components"] if each["name"] == "grr"
        ]
        assert shares == pytest.approx([6.583, 6.685], abs=5e-4)
    key = shop.another(
        "part", **LENGTHS["16"]
    )  # as readings: no size is near the target, and nothing says whose they are
    assert "lies more than" in plant.command(path, characteristic=key)
    assert "lies more than" in html.unescape(plant.page(path, key))
    assert "lies more than" in str(plant.table(path, text, characteristic=key))
    readings, _lines, _words = bridged(path, {"*": "x"}, columns={"measured": "Measurement"})
    entries = [Entry(2, "*", {"characteristic": "x", "measured": size}, "") for size, _at in readings]
    assert far_off(entries, {"x": Target(16.0, 1.0)})
