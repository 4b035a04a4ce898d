"""The capability of a characteristic through the front door: by hand, by limits in force, and with the loop taken out."""

from datetime import UTC, datetime, timedelta
from random import Random
from statistics import NormalDist
from typing import Any

import pytest
from sqlalchemy import text

from app.jobs.actions import Unit
from app.loop.characteristics.queries import characteristic_named
from app.quality.capability import verdict_queries
from app.quality.capability.actions import JOB
from app.quality.capability.verdict_queries import Verdict, verdicts_by_characteristic
from tests.quality.chart_signals.line import Line
from tests.quality.closed_loop import cut, scatter
from tests.servers import Server
from tests.shop import Person, Shop


def of(shop: Shop, query: str = "last=all", characteristic: str | None = None, status: int = 200) -> Any:
    return shop.call("GET", f"/characteristics/{characteristic or shop.characteristic}/capability?{query}", status)


def quiet(count: int, seed: int = 1, sigma: float = 0.9, mean: float = 0.0) -> list[float]:
    rng = Random(seed)
    return [round(rng.gauss(mean, sigma), 3) for _ in range(count)]


def test_by_hand(shop: Shop) -> None:
    """-2, -1, 0, 1, 2 µm by turns, 20 of each: mean 0, s^2 = 2 x 100/99; limits ±8 µm."""
    key = shop.another("by-hand", mode="measure_only", tool_memory=0)
    shop.push([-2.0, -1.0, 0.0, 1.0, 2.0] * 20, key)
    found = of(shop, characteristic=key)
    s = (2 * 100 / 99) ** 0.5
    assert found["readings"] == 100
    assert found["sigma_overall"] * 1000 == pytest.approx(s)
    assert found["ppk"]["value"] == found["pp"]["value"] == pytest.approx(8 / (3 * s))
    assert found["ppk"]["low"] < found["ppk"]["value"] < found["ppk"]["high"]
    # Moving ranges: 1, 1, 1, 1 and from 2 to -2 4; 80 of 1 and 19 of 4 over 99.
    assert found["sigma_within"] * 1000 == pytest.approx((80 + 19 * 4) / 99 / 1.1283791671)
    assert (found["outside"], found["ppm_observed"]["total"], found["compensated"]) == (0, 0.0, False)
    upper = of(shop, "last=all&side=upper", key)
    assert (upper["lower_limit"], upper["cp"], upper["ppk"]["method"]) == (None, None, "noncentral_t")


def test_what_too_few_readings_carry(shop: Shop) -> None:
    nothing = of(shop)
    assert (nothing["readings"], nothing["ppk"], nothing["stable"], nothing["quote"]) == (0, None, None, "none")
    assert "20 are missing" in nothing["refused"]
    shop.push(quiet(1))
    assert "19 are missing" in of(shop)["refused"]
    shop.push(quiet(40))
    some = of(shop)
    assert some["ppk"] is not None
    assert some["in_time"] is None
    assert any("Fewer than 100" in each for each in some["cautions"])
    equal = shop.another("equal", mode="measure_only", tool_memory=0)
    shop.push([1.0] * 60, equal)
    equal = of(shop, characteristic=equal)
    assert "All values are the same" in equal["refused"]
    assert [each["p_value"] for each in equal["normality"]] == [None, None]


def test_what_is_not_normal_says_whether_percentiles_carry_it(viewer: Person, shop: Shop) -> None:
    keys = []
    for count in (80, 400):
        keys.append(shop.another("skew", mode="measure_only", tool_memory=0, wear_limit=0.9))
        shop.push([value**2 for value in quiet(count, seed=count)], keys[-1])
    few, more = (" ".join(of(shop, characteristic=key)["cautions"]) for key in keys)
    assert "too few for percentiles (80 of 100)" in few
    assert "take the percentile method" not in few
    assert of(shop, characteristic=keys[1])["quote"] == "percentile"
    assert "hardly more than the smallest and the largest" in more
    sections = shop.call("GET", f"/characteristics/{keys[1]}/report.json?last=all&section=capability")["sections"]
    assert "hardly more than the smallest" in " ".join(sections[0]["warnings"])
    page = viewer.open(f"/characteristics/{keys[1]}/capability?last=all")
    assert page.count("hardly more than the smallest") == 1


def test_an_excluded_reading_or_a_probe_fault_makes_no_index_preliminary(shop: Shop) -> None:
    """The window is of the last 1000 that count: a label does not turn because somebody excluded one reading."""
    key = shop.another("kept", mode="measure_only", tool_memory=0, wear_limit=0.9)
    shop.push([*(value**2 for value in quiet(1008, seed=8)), 1500.0], key)
    shop.call("POST", f"/readings/{key}/900/exclude", 200, reason="chip under the stylus")
    found = of(shop, "", key)
    assert (found["readings"], found["first_sequence"], found["last_sequence"]) == (1000, 8, 1008)
    assert (found["excluded"], found["probe_faults"]) == ([900], [1009])
    quoted = found["quoted"]
    assert (quoted["index"], quoted["preliminary"]) == ("percentile", False)
    assert found["percentiles"]["interval"] == {
        "value": quoted["value"], "low": None, "high": quoted["high"], "method": "order_statistics"
    }  # fmt: skip
    report = shop.call("GET", f"/characteristics/{key}/report.json?section=capability")["sections"][0]
    assert next(fact for fact in report["facts"] if fact["key"] == "readings")["value"] == 1000
    assert f"interval up to {quoted['high']:.2f}" in " ".join(
        shop.admin.get(f"/characteristics/{key}/capability").text.split()
    )


def test_a_number_of_readings_that_is_none_is_explained_in_words(shop: Shop) -> None:
    problem = of(shop, "last=0", status=422)
    assert problem["detail"] == "last: must be a number of readings from 1 on, such as 500, or one of: all"


def test_excluded_readings_and_probe_faults_are_named_and_left_out(shop: Shop) -> None:
    key = shop.another("named", mode="measure_only", tool_memory=0)
    shop.push([*quiet(60), 7.9, 1500.0], key)
    shop.call("POST", f"/readings/{key}/61/exclude", 200, reason="chip under the stylus")
    found = of(shop, characteristic=key)
    assert (found["readings"], found["excluded"], found["probe_faults"]) == (60, [61], [62])
    assert found["sigma_overall"] < 0.0015


def test_readings_far_from_all_others_are_named_counted_and_kept_out_of_the_picture(shop: Shop) -> None:
    key = shop.another("far", mode="measure_only", tool_memory=0)
    shop.push([*quiet(120), 250.0, *quiet(30, seed=2), -180.0], key)
    found = of(shop, characteristic=key)
    assert (found["far"], found["readings"], found["outside"]) == ([121, 152], 152, 2)
    assert found["ppk"]["value"] < 0.3
    assert any("Readings 121, 152 lie far from all others (up to +250.0 µm)" in each for each in found["cautions"])
    figure = shop.call("GET", f"/characteristics/{key}/figures/capability?last=all")
    low, high = figure["layout"]["xaxis"]["range"]
    assert -20 < low < high < 20
    assert sum(figure["data"][0]["y"]) == 150
    words = [each["text"] for each in figure["layout"]["annotations"]]
    assert "◂ 1 reading beyond: −180.0 µm  1 reading beyond: +250.0 µm ▸" in words


def test_every_part_is_judged_by_the_tolerance_in_force(shop: Shop) -> None:
    key = shop.another("changed", mode="measure_only", tool_memory=0)
    shop.push([6.0, -6.0, 7.0] * 10, key)
    shop.call(
        "PATCH",
        f"/characteristics/{key}",
        parameters={"target": 40.0, "tolerance_width": 0.01, "averaging_limit": None},
        reason="new drawing",
    )
    shop.push([6.0, *quiet(29)], key)
    found = of(shop, characteristic=key)
    assert [(each["half"], each["readings"]) for each in found["versions"]] == [(0.008, 30), (0.005, 30)]
    assert found["upper_limit"] == 0.005
    assert found["outside"] == 1, "only the one that was judged by the narrow tolerance"
    assert any("tolerance changed" in each for each in found["cautions"])


def test_a_compensated_process_three_ways(shop: Shop) -> None:
    """Wear 0.2 µm a part, scatter 0.5 µm, corrected at once: without corrections the tool runs out of its tolerance."""
    cut(shop, scatter(300, seed=3, sigma=0.5, wear=0.2), delay=0)
    found = of(shop)
    without = found["without"]
    assert found["compensated"]
    assert without["readings"] == 300
    assert without["lives"] == 1
    assert without["standard_deviation"] * 1000 == pytest.approx(300 * 0.2 / 12**0.5, rel=0.03)
    assert without["scatter"] * 1000 == pytest.approx(0.5, rel=0.12)
    assert without["ideal"]["value"] == pytest.approx(8 / 1.5, rel=0.12)
    assert without["gain"] > 10
    assert without["price"] > 1.2
    assert without["ppk"]["value"] < 0 < found["ppk"]["value"] < without["ideal"]["value"]
    assert found["quote"] != "cpk" or found["stable"]


def test_the_model_in_time_and_which_number_it_allows(shop: Shop) -> None:
    drifting = shop.another("drifting", mode="measure_only", tool_memory=0)
    shop.push([value + 0.02 * place for place, value in enumerate(quiet(250))], drifting)
    found = of(shop, characteristic=drifting)
    assert (found["in_time"]["model"], found["in_time"]["location"], found["stable"]) == ("C3", "systematic", False)
    assert found["quote"] in {"ppk", "percentile"}
    steady = shop.another("steady", mode="measure_only", tool_memory=0)
    shop.push(quiet(250, seed=5), steady)
    found = of(shop, characteristic=steady)
    assert (found["in_time"]["model"], found["stable"], found["quote"]) == ("A1", True, "cpk")
    assert "Cp and Cpk may be reported" in found["in_time"]["means"]

    # Heavy tails: the mean and the scatter hold, yet a rule fires more often than chance explains. The model says no other
    # than the verdict of stability and the index named to be quoted.
    tails = shop.another("tails", mode="measure_only", tool_memory=0)
    rng = Random(2)
    shop.push([round(rng.choice((-1, 1)) * rng.expovariate(1 / 0.6), 3) for _ in range(250)], tails)
    found = of(shop, characteristic=tails)
    assert (found["in_time"]["model"], found["stable"], found["quote"]) == ("A2", False, "fitted")
    # Two questions, two names: the run rules speak against it, the model in time does not; the caution says which.
    assert (found["in_control"], found["constant_in_time"]) == (False, True)
    assert found["stability"].startswith("Not in control")
    assert "the process is not in control (run rules). Ppk" in found["cautions"][0]
    assert "report Ppk by fit, not Cp and Cpk" in found["in_time"]["means"]
    page = shop.admin.get(f"/characteristics/{tails}/capability?last=all").text
    assert found["in_time"]["means"] in page
    report = shop.admin.get(f"/characteristics/{tails}/report?section=capability&last=all").text
    assert found["in_time"]["means"] in report


def test_readings_of_two_states_are_quoted_by_the_distribution_that_fits(shop: Shop) -> None:
    key = shop.another("two-states", mode="measure_only", tool_memory=0, wear_limit=0.9)
    rng = Random(12)
    shop.push([round(rng.gauss(0, 3.0 if rng.random() < 0.2 else 0.9), 2) for _ in range(400)], key)
    found = of(shop, characteristic=key)
    fit = found["fitted"]
    assert (found["quote"], fit["distribution"]) == ("fitted", "two_normals")
    assert fit["p_value"] >= 0.01
    assert fit["parameters"].keys() == {"share", "first_mean", "second_mean", "first_sigma", "second_sigma"}
    assert found["quoted"]["value"] == fit["ppk"]["value"]
    assert 0.3 < fit["ppk"]["low"] < fit["ppk"]["value"] < fit["ppk"]["high"] < 2
    assert fit["ppm"]["total"] > found["ppm_overall"]["total"], "the tails that a normal distribution does not have"
    assert len(fit["tried"]) == 1
    assert any("two normal distributions" in each for each in found["cautions"])
    facts = {
        fact["key"]: fact
        for fact in shop.call("GET", f"/characteristics/{key}/report.json?section=capability")["sections"][0]["facts"]
    }
    assert facts["ppk_fitted"]["value"] == pytest.approx(fit["ppk"]["value"])
    assert facts["distribution"]["value"] == "two normal distributions"
    page = shop.admin.get(f"/characteristics/{key}/capability").text
    assert "Which distribution?" in page
    assert fit["why"] in page
    drawn = shop.call("GET", f"/characteristics/{key}/figures/capability?last=all")["data"]
    assert [each["name"] for each in drawn if each.get("meta") == "fitted"] == ["two normal distributions"]


def test_where_all_parts_lie_and_what_the_machine_alone_can_do(shop: Shop) -> None:
    key = shop.another("machine", mode="measure_only", tool_memory=0)
    none = shop.call("GET", f"/characteristics/{key}/machine-performance")
    assert (none["pmk"], none["readings"]) == (None, 0)
    assert "the longest run has 0" in none["refused"]
    shop.push(quiet(49, seed=21), key)
    assert "the longest run has 49" in shop.call("GET", f"/characteristics/{key}/machine-performance")["refused"]
    shop.push([*quiet(1, seed=22), 7.9, *quiet(10, seed=23)], key)
    shop.call("POST", f"/readings/{key}/51/exclude", 200, reason="chip under the stylus")
    run = shop.call("GET", f"/characteristics/{key}/machine-performance")
    assert (run["readings"], run["first_sequence"], run["last_sequence"], run["left_out"]) == (50, 11, 61, 1)
    assert run["pm"]["value"] == pytest.approx(0.016 / (6 * run["sigma"]))
    assert run["pmk"]["low"] < run["pmk"]["value"] <= run["pm"]["value"]
    asked = f"/characteristics/{key}/machine-performance?"
    assert shop.call("GET", f"{asked}from=2001-01-01&to=2001-01-02")["readings"] == 0, "of another time there is none"
    assert "the longest run has 39" in shop.call("GET", f"{asked}last=40")["refused"]
    assert shop.call("GET", f"{asked}last=55")["first_sequence"] == run["first_sequence"]
    found = of(shop, characteristic=key)
    interval = found["tolerance_interval"]
    assert (interval["share"], interval["confidence"], interval["method"]) == (0.9973, 0.95, "normal")
    assert interval["high"] - found["mean"] == pytest.approx(interval["k"] * found["sigma_overall"])
    assert 3.4 < interval["k"] < 3.7
    wider = of(shop, "last=all&coverage=0.9999", key)["tolerance_interval"]
    assert wider["low"] < interval["low"]
    upper = of(shop, "last=all&side=upper", key)["tolerance_interval"]
    assert (upper["low"], upper["k"] < interval["k"]) == (None, True)
    page = shop.admin.get(f"/characteristics/{key}/capability").text
    assert "at least 99.73 % of all parts lie between" in page
    assert "50 parts, readings 11 to 61" in page
    section = shop.call("GET", f"/characteristics/{key}/report.json?section=capability")["sections"][0]
    assert next(fact for fact in section["facts"] if fact["key"] == "pmk")["value"] == pytest.approx(
        run["pmk"]["value"]
    )
    assert any("99.73 % of all parts" in each for each in section["sentences"])


def test_a_correction_ends_the_run_of_a_machine(shop: Shop) -> None:
    cut(shop, scatter(300, seed=3, sigma=0.5, wear=0.2), delay=0)
    run = shop.call("GET", f"/characteristics/{shop.characteristic}/machine-performance")
    assert run["pmk"] is None
    assert "without a correction" in run["refused"]


def test_which_readings(shop: Shop) -> None:
    key = shop.another("chosen", mode="measure_only", tool_memory=0)
    shop.push(quiet(80), key)
    assert of(shop, "last=30", key)["first_sequence"] == 51
    assert of(shop, "", key)["readings"] == 80
    assert of(shop, "from=2001-01-01T00:00:00Z&to=2001-01-02T00:00:00Z", key)["readings"] == 0
    for wrong in ("last=0", "last=-3", "side=left", "confidence=1", "confidence=nan", "last=x", "from=yesterday"):
        of(shop, wrong, key, 422)
    of(shop, "from=2026-01-02T00:00:00Z&to=2026-01-01T00:00:00Z", key, 422)
    of(shop, "last=999999999999999999", key)
    shop.call("GET", "/characteristics/nobody/capability", 404)


@pytest.mark.parametrize("picture", ["histogram", "probability"])
def test_figures_have_limits_and_every_reading(shop: Shop, picture: str) -> None:
    key = shop.another("drawn", mode="measure_only", tool_memory=0)
    path = f"/characteristics/{key}/figures/capability?picture={picture}"
    assert shop.call("GET", path)["data"] == []
    shop.push(quiet(200), key)
    figure = shop.call("GET", path)
    assert [shape["x0"] for shape in figure["layout"]["shapes"]][:2] == [-8.0, 8.0]
    (drawn, *_lines) = figure["data"]
    assert (sum(drawn["y"]) if picture == "histogram" else len(drawn["x"])) == 200


def verdict_for_overview(server: Server, key: str) -> Verdict:
    with server.database.begin() as session:
        current = characteristic_named(session, key)
        return verdicts_by_characteristic(session, current.machine.id)[current.characteristic.id]


def judge(server: Server, key: str) -> None:
    """Run the periodic job on this characteristic."""
    with server.database.begin() as session:
        here = characteristic_named(session, key)
        JOB.do(session, Unit(f"characteristic/{key}", (key,), here.machine.id, here.characteristic.id))


@pytest.mark.parametrize("stored", [False, True])
@pytest.mark.parametrize(("shape", "quote"), [("quiet", "cpk"), ("jump", "percentile"), ("few", "none")])
def test_overview_and_page_say_the_same(server: Server, shop: Shop, shape: str, quote: str, stored: bool) -> None:
    key = shop.another("same", mode="measure_only", tool_memory=0)
    shop.push({"quiet": quiet(200), "jump": [*([7.9] * 30), *quiet(200, seed=9)], "few": quiet(5)}[shape], key)
    if stored:
        judge(server, key)
    told, found = of(shop, "", key), verdict_for_overview(server, key).of
    assert (found.quote, told["quote"], found.readings) == (quote, quote, told["readings"])
    if quote == "none":
        assert (found.value, found.why) == (None, "too_few_readings")
    else:
        assert (found.value, found.low) == (told["quoted"]["value"], told["quoted"]["low"])
        assert told["quoted"]["window"].startswith(f"{found.readings} readings, {found.first} to {found.last}; ")


def test_the_overview_keeps_the_last_verdict_that_could_be_quoted(server: Server, shop: Shop) -> None:
    key = shop.another("broke", mode="measure_only", tool_memory=0)
    shop.push([*quiet(120, seed=9), 250.0], key)  # an edge broke: one part lies far off
    told = of(shop, "", key)
    assert (told["quote"], told["quoted"], told["why_none"]) == ("none", None, "a reading lies far from all others")
    assert told["cautions"][0] == "Do not report an index: a reading lies far from all others."
    assert "take the percentile method" not in str(told["cautions"]), "no method carries what is not to be reported"
    found = verdict_for_overview(server, key)
    assert (found.of.readings, found.of.last, found.now) == (120, 120, "far_off")
    assert found.of.value is not None
    assert found.of.value > 0.5, "not that of the broken edge"
    assert found.of.last_at is not None


def test_a_few_ordinary_readings_hide_no_enormous_one(server: Server, shop: Shop) -> None:
    key = shop.another("hiding", mode="measure_only", tool_memory=0)
    line = [NormalDist(0, 2).inv_cdf((number + 0.5) / 495) for number in range(495)]
    shop.push([*line, 15.0, 19.0, 19.8, 20.6, 600.0], key)
    told = of(shop, "", key)
    assert (told["quote"], told["far"]) == ("none", [500])


def test_a_verdict_that_is_kept_is_judged_again_when_the_rule_changes(server: Server, shop: Shop) -> None:
    key = shop.another("rule", mode="measure_only", tool_memory=0)
    shop.push(quiet(120, seed=9), key)
    judge(server, key)
    shop.push([250.0], key)
    judge(server, key)
    assert verdict_for_overview(server, key).of.last == 120
    with server.database.begin() as session:  # an older rule had quoted an index with the broken edge in its window
        session.execute(
            text(
                "UPDATE capability_verdict SET rule = 0, last = 121, value = CASE WHEN quotable THEN 0.02 END"
                " WHERE characteristic_id = (SELECT id FROM characteristic WHERE key = :key)"
            ),
            {"key": key},
        )
    for stored in (False, True):
        if stored:
            judge(server, key)
        found = verdict_for_overview(server, key)
        assert (found.of.readings, found.of.last, found.now) == (120, 120, "far_off")
        assert found.of.value is not None
        assert found.of.value > 0.5, "not that of the older rule"


def test_it_is_kept_whatever_the_reason_and_until_the_tolerance_changes(
    server: Server, viewer: Person, shop: Shop
) -> None:
    key = shop.another("kept", mode="measure_only", tool_memory=0)
    shop.push(quiet(60), key)
    judge(server, key)
    first = verdict_for_overview(server, key)
    shop.push([0.0] * 100, key)  # the probe's cable is loose: more than half of the readings are equal
    for stored in (False, True):
        if stored:
            judge(server, key)
        found = verdict_for_overview(server, key)
        assert (found.of.value, found.of.last, found.now) == (first.of.value, 60, "unresolved")
    assert "since then: readings too coarse" in viewer.open(f"/overview?machine={shop.machine}")
    shop.call("PATCH", f"/characteristics/{key}", parameters={"tolerance_width": 0.03}, reason="drawing B")
    shop.push([0.0], key)
    for stored in (False, True):
        if stored:
            judge(server, key)
        found = verdict_for_overview(server, key)
        assert (found.of.value, found.of.why, found.now) == (None, "unresolved", None), "that was another tolerance"


def test_a_stored_verdict_is_shown_only_as_long_as_it_may_be(server: Server, shop: Shop) -> None:
    key = shop.another("aging", mode="measure_only", tool_memory=0)
    shop.push(quiet(100), key)
    judge(server, key)

    def waits() -> bool:
        with server.database.begin() as session:
            return (key,) in [unit.key for unit in JOB.due(session)]

    assert not waits()
    shop.push(quiet(2, seed=3), key)
    assert (verdict_for_overview(server, key).of.last, waits()) == (100, False), "two of a hundred change nothing yet"
    shop.push(quiet(1, seed=4), key)
    assert (verdict_for_overview(server, key).of.last, waits()) == (100, True)
    shop.push(quiet(2, seed=5), key)
    assert verdict_for_overview(server, key).of.last == 105, "worked out on the spot"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verdict_queries, "MOST_ON_THE_SPOT", 0)
        assert verdict_for_overview(server, key).of.last == 100, "of too many at once what is stored, with its date"
        with server.database.begin() as session:
            never = verdicts_by_characteristic(session)[
                characteristic_named(session, shop.characteristic).characteristic.id
            ]
        assert (never.of.value, never.of.why) == (None, "not_yet")
    judge(server, key)
    assert not waits()
    shop.call("POST", f"/readings/{key}/7/exclude", reason="chip under the stylus")
    assert (verdict_for_overview(server, key).of.readings, waits()) == (104, True)


def test_the_period_is_typed_as_people_write_it_and_stays_if_it_is_wrong(viewer: Person, shop: Shop) -> None:
    shop.push(quiet(40))
    path = f"/characteristics/{shop.characteristic}/capability"
    page = viewer.open(f"{path}?from=2020-01-01+06:00&to=2020-01-02&timezone=Europe/Belgrade")
    assert "20 are missing" in page
    assert 'value="2020-01-01T05:00"' in page, "by the plant's clock, UTC"
    for wrong in (
        "from=yesterday",
        "from=2026-02-01&to=2026-01-01",
        "to=2026-13-01",
        "timezone=Mars/Base&from=2026-01-01",
        "from=0001-01-01&timezone=Europe/Belgrade",
    ):
        assert "The period was not understood" in viewer.open(f"{path}?{wrong}", 422)
    assert 'value="2026-02-01T00:00"' in viewer.open(f"{path}?from=2026-02-01&to=2026-01-01", 422)
    viewer.open(f"{path}?last=0", 422)


def test_the_page_greys_what_must_not_be_quoted(viewer: Person, shop: Shop) -> None:
    key = shop.another("greyed", mode="measure_only", tool_memory=0)
    shop.push([value + 0.02 * place for place, value in enumerate(quiet(250))], key)
    page = viewer.open(f"/characteristics/{key}/capability")
    assert "Do not report Cp and Cpk" in page
    assert page.count("do not report") >= 2
    assert "No gauge study yet" in page


def test_sigma_within_is_pooled_by_choice(shop: Shop, viewer: Person) -> None:
    """Pairs of one part: the mean of their squared differences is twice the pooled variance; of spindles every pair is two."""
    key = shop.another("pooled", mode="measure_only", tool_memory=0)
    parts = [f"SN-{n // 2}" for n in range(80)]
    moments = [f"2026-10-{1 + n // 4:02d}T{n % 4 * 6 + 1:02d}:00:00Z" for n in range(80)]
    values = quiet(80)
    shop.push(
        values,
        key,
        part=parts,
        measured_at=moments,
        context=[{"nest": n % 2 + 1} for n in range(80)],
    )
    usual, pooled = of(shop, characteristic=key), of(shop, "last=all&sigma_by=part", key)
    assert (usual["sigma_by"], pooled["sigma_by"]) == ("neighbours", "part")
    sigma = (sum((one - other) ** 2 for one, other in zip(values[::2], values[1::2], strict=True)) / 80) ** 0.5
    assert pooled["sigma_within"] * 1000 == pytest.approx(sigma)
    assert pooled["cp"]["value"] == pytest.approx(16 / (6 * sigma))
    assert usual["sigma_within"] != pooled["sigma_within"]
    assert (usual["sigma_overall"], usual["ppk"]) == (pooled["sigma_overall"], pooled["ppk"])
    assert of(shop, "last=all&sigma_by=shift", key)["sigma_within"] > 0
    assert "0 subgroups with two readings or more" in of(shop, "last=all&sigma_by=nest", key)["refused"]
    of(shop, "sigma_by=pallet", key, 422)
    said = "pooled variance inside the readings of one part"
    shown = viewer.open(f"/characteristics/{key}/capability?last=all&sigma_by=part")
    assert said in shown
    assert "section=capability&amp;sigma_by=part" in shown
    report = shop.call("GET", f"/characteristics/{key}/report.json?section=capability&last=all&sigma_by=part")
    (fact,) = [fact for fact in report["sections"][0]["facts"] if fact["key"] == "sigma_within"]
    assert said in fact["note"]


def test_a_window_of_which_no_point_of_the_chart_counts_is_judged_by_itself(
    server: Server, shop: Shop, viewer: Person
) -> None:
    """Of a day that came late there are two probe faults only; between them came a reading of another day."""
    line = Line(shop)
    day = (datetime.now(UTC) - timedelta(days=9)).date()
    late, other = f"{day}T10:00:00Z", f"{day + timedelta(days=2)}T10:00:00Z"
    shop.push([1200.0, 0.0, 1200.0], line.key, measured_at=[late, other, late])
    found = of(shop, f"from={day}&to={day}", line.key)
    assert (found["readings"], found["stable"]) == (0, None)
    assert "20 are missing" in found["refused"]
    assert "20 are missing" in viewer.open(f"/characteristics/{line.key}/capability?from={day}&to={day}")
