"""Wear, forecast and hunting through the front door, and what the rounds make of them."""

from typing import Any

import pytest
from sqlalchemy import select, text

from app.core.forecast import ENOUGH, PUBLIC_WIDENING
from app.jobs.actions import run_jobs
from app.loop.tables.characteristics import Characteristic
from app.quality.wear.actions import JOB
from app.quality.wear.tables import Outlook
from tests.quality.closed_loop import cut, scatter
from tests.shop import Shop


def of(shop: Shop, **query: Any) -> Any:
    asked = "&".join(f"{name}={value}" for name, value in query.items())
    return shop.call("GET", f"/characteristics/{shop.characteristic}/wear?{asked}")


def figure(shop: Shop, query: str = "") -> Any:
    return shop.call("GET", f"/characteristics/{shop.characteristic}/figures/wear?{query}")


def test_behind_a_closed_loop_the_wear_shows_though_the_sizes_stay(shop: Shop) -> None:
    cut(shop, scatter(120, sigma=0.5, wear=0.2), delay=0)
    told = of(shop)
    per_part = told["wear_per_part"]
    assert per_part["is_wear"]
    assert per_part["low"] <= 0.0002 <= per_part["high"]
    assert per_part["value"] == pytest.approx(0.0002, rel=0.05)
    assert per_part["level"] == pytest.approx(0.0238, abs=0.0005)
    assert told["corrections_total"] == pytest.approx(-0.0238, abs=0.003)
    sizes = shop.call("GET", f"/characteristics/{shop.characteristic}/statistics")
    assert abs(sizes["mean"]) < 0.002, "the loop was closed"


def test_parts_left_by_hand(shop: Shop) -> None:
    """Without scatter: 0.2 µm per part. Of 40 parts the last has worn 7.8 µm; R37 lies at 300 µm."""
    cut(shop, scatter(40, sigma=0.001, wear=0.2), delay=0)
    told = {each["towards"]: each for each in of(shop)["forecasts"]}
    assert told["wear"]["parts"] == pytest.approx((300 - 7.8) / 0.2, rel=0.001)
    assert told["wear"]["low"] <= told["wear"]["parts"] <= told["wear"]["high"]
    total = of(shop)["corrections_total"] * 1000
    assert told["tolerance"]["parts"] == pytest.approx((8 - total - 7.8) / 0.2, rel=0.01)
    assert "offset" not in told
    assert of(shop)["first"] == "wear"


def test_the_offset_limit_comes_before_r37(shop: Shop) -> None:
    shop.characteristic = shop.another("limited", max_total=0.05, tool_memory=4, average_memory=6)
    cut(shop, scatter(40, sigma=0.001, wear=0.2), delay=0, tool=4)
    told = of(shop)
    assert told["first"] == "offset"
    first = told["forecasts"][0] if told["forecasts"][0]["towards"] == "offset" else told["forecasts"][1]
    assert first["parts"] == pytest.approx((50 - 7.8) / 0.2, rel=0.001)


def test_measure_only_comes_to_the_end_of_its_tolerance(shop: Shop) -> None:
    shop.characteristic = shop.another("open", mode="measure_only", tool_memory=4, average_memory=6)
    cut(shop, scatter(30, sigma=0.001, wear=-0.1), delay=0, tool=4)
    told = of(shop)
    assert told["first"] == "tolerance"
    assert told["forecasts"][0]["parts"] == pytest.approx((8 - 2.9) / 0.1, rel=0.01)
    assert told["hunting"] is None


def test_no_wear_no_number_and_too_few_readings_no_line(shop: Shop) -> None:
    cut(shop, scatter(5, sigma=0.5, wear=0.0), delay=0)
    assert of(shop)["wear_per_part"] is None
    cut(shop, scatter(40, seed=4, sigma=0.5, wear=0.0), delay=0)
    told = of(shop)
    assert not told["wear_per_part"]["is_wear"]
    assert told["forecasts"] == []
    assert told["first"] is None


def test_a_new_tool_begins_a_new_curve(shop: Shop) -> None:
    cut(shop, scatter(40, sigma=0.1, wear=0.2), delay=0)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="new insert")
    cut(shop, scatter(15, seed=2, sigma=0.1, wear=0.5), delay=0)
    told = of(shop)
    assert told["first_sequence"] == 41
    assert told["wear_per_part"]["value"] == pytest.approx(0.0005, rel=0.1)
    drawn = [trace for trace in figure(shop, "last=all")["data"] if trace["meta"] == "wear"]
    assert [len(trace["x"]) for trace in drawn] == [40, 15]
    assert "Tool changed" in str(figure(shop, "last=all")["layout"]["annotations"])


@pytest.mark.parametrize("moves", [True, False], ids=["the parts move with it", "it is only told"])
def test_the_curve_goes_on_over_an_edit_by_hand(shop: Shop, moves: bool) -> None:
    cut(shop, scatter(30, sigma=0.1, wear=0.1), delay=0)
    before = shop.tool()["offset"]
    shop.call("PUT", f"/machines/{shop.machine}/tools/3", offset=before - 0.04, reason="typed in")
    # What the machine really holds: 40 µm less, or what it held all along, which only now is known.
    cut(shop, scatter(30, seed=2, sigma=0.1, wear=0.1, begin=3.0 + (0.0 if moves else 40.0)), delay=0)
    told = of(shop)
    assert told["wear_per_part"]["readings"] > 50
    assert told["wear_per_part"]["value"] == pytest.approx(0.0001, rel=0.15)
    assert told["wear_per_part"]["level"] == pytest.approx(0.0059, abs=0.0004)


def test_a_new_target_and_an_empirical_value_do_not_bend_the_curve(shop: Shop) -> None:
    cut(shop, scatter(30, sigma=0.1, wear=0.1), delay=0)
    shop.call(
        "PATCH",
        f"/characteristics/{shop.characteristic}",
        parameters={"target": 40.002},
        reason="fit was too tight",
    )
    cut(shop, scatter(30, seed=2, sigma=0.1, wear=0.1, begin=3.0), delay=0)
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.004, reason="micrometer")
    cut(shop, scatter(30, seed=3, sigma=0.1, wear=0.1, begin=6.0), delay=0)
    told = of(shop)["wear_per_part"]
    assert told["readings"] > 80
    assert told["value"] == pytest.approx(0.0001, rel=0.1)


def test_excluded_readings_are_left_out(shop: Shop) -> None:
    cut(shop, scatter(20, sigma=0.1, wear=0.1), delay=0)
    shop.call("POST", f"/readings/{shop.characteristic}/7/exclude", reason="chip")
    assert of(shop)["wear_per_part"]["readings"] == 19


def test_last_says_how_far_back(shop: Shop) -> None:
    cut(shop, scatter(60, sigma=0.1, wear=0.1), delay=0)
    told = of(shop, last=20)
    assert (told["first_sequence"], told["last_sequence"]) == (41, 60)
    assert told["wear_per_part"]["readings"] == 20


# --- hunting, and the rounds


def nervous(shop: Shop) -> None:
    """A characteristic that corrects every part in full."""
    shop.characteristic += "-nervous"
    shop.add(shop.characteristic, weighting_factor=1, zero_range=0.0, tool_memory=4, average_memory=6)


def go(shop: Shop) -> None:
    run_jobs(shop.server.database, [JOB])


def outlook(shop: Shop) -> Outlook:
    number = shop.call("GET", f"/characteristics/{shop.characteristic}")["key"]
    with shop.server.database.begin() as session:
        found: Outlook = session.scalars(
            select(Outlook)
            .join(Characteristic, Characteristic.id == Outlook.characteristic_id)
            .where(Characteristic.key == number)
        ).one()
        session.expunge(found)
        return found


def test_a_loop_that_runs_after_its_scatter_is_reported_once_and_by_how_much(shop: Shop) -> None:
    nervous(shop)
    cut(shop, scatter(60, sigma=1.0, wear=0.0), delay=0, tool=4)
    told = of(shop)["hunting"]
    assert told["state"] == "hunting"
    assert told["reversals"] > 25
    assert told["scatter"] == pytest.approx(0.001, rel=0.25)
    assert 0.003 < told["remedy"]["zero_range"] < 0.005
    assert told["remedy"]["weighting_factor"] is None
    assert "With R33 at" in told["what_to_do"]
    for _round in range(3):
        go(shop)
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "hunting"
    assert alarm["characteristic"] == shop.characteristic
    assert alarm["count"] == 1
    assert "With R33 at" in alarm["text"]
    assert outlook(shop).hunting == "hunting"
    shop.acknowledge(alarm["id"], "noted")
    cut(shop, scatter(10, seed=2, sigma=1.0, wear=0.0), delay=0, tool=4)
    go(shop)
    assert shop.alarms() == [], "once while it lasts"
    shop.call(
        "PATCH",
        f"/characteristics/{shop.characteristic}",
        parameters={"zero_range": told["remedy"]["zero_range"]},
        reason="hunted",
    )
    cut(shop, scatter(60, seed=3, sigma=1.0, wear=0.0), delay=0, tool=4)
    go(shop)
    assert shop.alarms() == []
    assert of(shop)["hunting"]["state"] == "quiet"


def test_the_signal_path_is_the_floor_of_the_advice(shop: Shop) -> None:
    nervous(shop)
    shop.call("PATCH", f"/machines/{shop.machine}", signal_path="plc", probing_feed=1200)  # 5 µm
    cut(shop, scatter(40, sigma=0.5, wear=0.0), delay=0, tool=4)
    told = of(shop)["hunting"]
    assert told["state"] == "hunting"
    assert told["remedy"]["zero_range"] is None or told["remedy"]["zero_range"] >= 0.0049


def test_the_outlook_is_what_the_numbers_say_and_is_made_again_only_where_something_moved(shop: Shop) -> None:
    cut(shop, scatter(40, sigma=0.1, wear=0.2), delay=0)
    go(shop)
    noted = outlook(shop)
    told = {each["towards"]: each for each in of(shop)["forecasts"]}
    assert (noted.sequence, noted.towards) == (40, "wear")
    assert noted.parts == pytest.approx(told["wear"]["parts"])
    go(shop)
    assert outlook(shop).at == noted.at
    shop.read(1.0)
    go(shop)
    assert outlook(shop).sequence == 41


# --- long histories


def test_of_a_very_long_life_older_readings_are_thinned_into_groups(shop: Shop) -> None:
    with shop.server.database.begin() as session:
        session.execute(
            text("""
            INSERT INTO reading (machine_id, characteristic_id, sequence, measured, deviation, decided, average_before,
                average_after, measured_at, received_at, parameters_version, late, zone, action, code, compensated)
            SELECT c.machine_id, c.id, n, 40 + n * 1e-7, n * 1e-7, n * 1e-7, 0, 0, now(), now(), 1, false, 'zero', 'none',
                'within_zero_range', 0 FROM characteristic c, generate_series(1, 50000) AS n WHERE c.key = :key
            """),
            {"key": shop.characteristic},
        )
        session.execute(
            text(
                "UPDATE stream s SET sequence = 50000 FROM characteristic c WHERE c.key = :key AND s.characteristic_id = c.id"
            ),
            {"key": shop.characteristic},
        )
    (drawn,) = [trace for trace in figure(shop)["data"] if trace["meta"] == "wear"]
    assert 1_200 < len(drawn["x"]) <= 1_200 + 300
    assert drawn["x"] == sorted(set(drawn["x"]))
    assert drawn["y"][0] == pytest.approx(0.85e-3, abs=1e-3)  # mean of the first sixteen, µm
    assert drawn["x"][-1] == 50_000
    assert of(shop)["wear_per_part"]["value"] == pytest.approx(1e-7)


def test_forecasts_are_tested_on_the_edges_before_and_reported_with_what_comes(shop: Shop) -> None:
    """Two edges that wore faster in the end: the rounds test what would have been foretold, and page and API say so."""
    none = of(shop)["record"]
    assert (none["lives"], none["tested"], none["held"], none["widened"]) == (0, 0, 0, True)
    assert none["widening"] == PUBLIC_WIDENING
    for edge in (1, 2):
        cut(shop, scatter(60, seed=edge, sigma=0.2, wear=0.2), delay=0)
        cut(shop, scatter(12, seed=edge + 10, sigma=0.2, wear=2.0, begin=12.0), delay=0)
        shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="worn")
    cut(shop, scatter(40, seed=5, sigma=0.2, wear=0.2), delay=0)
    go(shop)
    told = of(shop)
    record = told["record"]
    assert record["lives"] == 2
    assert 0 < record["held"] <= record["tested"] <= 8
    assert record["widened"]
    assert record["widening"] >= PUBLIC_WIDENING
    assert f"{record['held']} of {record['tested']} forecasts held here, on 2 earlier edges." in record["text"]
    assert f"Until {ENOUGH} edges are over" in record["text"]
    wear = next(each for each in told["forecasts"] if each["towards"] == "wear")
    assert wear["low"] < wear["parts"] / 2
