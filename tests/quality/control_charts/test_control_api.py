"""Baselines and control charts through the front door."""

from math import pi, sqrt
from random import Random
from typing import Any

import pytest

from tests.quality.baselines.rows import control, frozen
from tests.quality.closed_loop import cut, scatter
from tests.servers import Server
from tests.shop import Person, Shop

D2 = 2 / sqrt(pi)  # of two readings, exactly


@pytest.fixture
def gauged(shop: Shop) -> Shop:
    """A shop whose characteristic only measures: what is pushed is what is charted."""
    shop.characteristic = shop.another("gauged", mode="measure_only", tool_memory=0, average_memory=0)
    return shop


@pytest.fixture(scope="module")
def turned(common_shop: Shop) -> Shop:
    """A loop that corrects, on two tools that wear by 0.5 µm a part."""
    cut(common_shop, scatter(120, sigma=0.4, wear=0.5), delay=0)
    common_shop.call("POST", f"/machines/{common_shop.machine}/tools/3/change", offset=0.0, reason="Worn")
    cut(common_shop, scatter(80, seed=9, sigma=0.4, wear=0.5, begin=7.0), delay=0)
    return common_shop


def preview(shop: Shop, status: int = 200, **body: Any) -> Any:
    given: dict[str, Any] = {"quantity": "deviation", "first_sequence": 1, "last_sequence": 40} | body
    return shop.call("POST", f"/characteristics/{shop.characteristic}/baselines/preview", status, **given)


def versions(shop: Shop) -> list[Any]:
    items: list[Any] = shop.call("GET", f"/characteristics/{shop.characteristic}/baselines")["items"]
    return items


class TestByHand:
    def test_individuals_and_moving_range(self, gauged: Shop) -> None:
        """0, 1, 0, 1 …: mean 1/2, every range 1, so sigma = 1/d2."""
        gauged.push([0, 1] * 20)
        made = frozen(gauged, 1, 40)
        assert (made["version"], made["in_force"], made["actor"] != "") == (1, True, True)
        assert made["centre"] * 1000 == pytest.approx(0.5)
        assert made["sigma"] * 1000 == pytest.approx(1 / D2)
        assert made["upper"] * 1000 == pytest.approx(0.5 + 3 / D2)
        assert (made["readings"], made["groups"], made["provisional"]) == (40, 39, True)
        gauged.push([0.5 + 3 / D2 - 0.001, 0.5 + 3 / D2 + 0.001, 0])
        shown = control(gauged, last=3)
        assert [(s["first"], s["last"], s["side"], s["rule"]) for s in shown["signals"]] == [(42, 42, 1, "nelson_1")]
        ranges = control(gauged, last=3, chart="moving_range")
        assert ranges["points"]["value"][-1] * 1000 == pytest.approx(0.5 + 3 / D2 + 0.001)
        assert ranges["points"]["upper"] * 1000 == pytest.approx(
            1 + 3 / D2 * sqrt(2 - 4 / pi)
        )  # D4 R, d3 = sqrt(2 - d2^2)

    def test_rules_begin_again_with_a_new_baseline(self, gauged: Shop) -> None:
        """Thirty readings about 0, forty about 6 µm: the ten on one side of the new centre were another process."""
        rules = {"main": dict.fromkeys(("nelson_1", "nelson_2", "nelson_3", "nelson_4"), "watch")}
        rules |= {place: {"nelson_1": "watch"} for place in ("scatter", "ewma", "moving_average", "cusum")}
        path = f"/characteristics/{gauged.characteristic}/rules"
        gauged.push([-1, 1, 0, 1] * 7 + [-1, 1])
        gauged.push([5, 7, 6, 6] * 9 + [5, 7, 6, 7])
        frozen(gauged, 31, 70)
        gauged.call("PUT", path, rules=rules, reason="all")
        for chart in ("individuals", "moving_range", "ewma", "moving_average", "cusum"):
            shown = control(gauged, chart=chart, first=20)
            inside = [(s["rule"], s["first"], s["last"]) for s in shown["signals"] if s["last"] >= 31]
            assert inside == [], chart
        assert 31 not in control(gauged, chart="moving_range", first=20)["points"]["last"]
        tried = gauged.call("GET", f"{path}/preview?last=40")
        assert {each["signals"] for each in tried["rules"] if each["do"]} == {0}
        tried = gauged.call("GET", f"{path}/preview?last=70")["rules"]
        (side,) = [each for each in tried if (each["place"], each["rule"]) == ("main", "nelson_2")]
        assert (side["signals"], side["points_inside"]) == (1, 30), "the run ends where the other process ended"
        gauged.push([6.5] * 9)
        after = [(s["rule"], s["first"], s["last"]) for s in control(gauged, first=31)["signals"]]
        assert after == [("nelson_2", 71, 79)], "as the job stores it, without the reading before it"

    def test_subgroups(self, gauged: Shop) -> None:
        """Pairs (0, 2) and (1, 3): every range 2, every s sqrt(2), grand mean 1.5."""
        gauged.push([0, 2, 1, 3] * 10)
        made = frozen(gauged, 1, 40, chart="xbar_r", grouping="consecutive", group_size=2)
        assert made["sigma"] * 1000 == pytest.approx(2 / D2)
        gauged.push([1.5, 1.5 + 7.4, 1.5 + 7.4, 1])
        shown = control(gauged, last=4)
        reach = 3 * 2 / D2 / sqrt(2)
        assert shown["points"]["value"] == pytest.approx([0.0052, 0.00495])
        assert shown["points"]["upper"] * 1000 == pytest.approx(1.5 + reach)
        assert shown["signals"] == [], "their means lie within 3.76"
        spread = control(gauged, last=4, chart="ranges")
        assert [(s["first"], s["last"]) for s in spread["signals"]] == [(41, 44)], "one run"
        again = frozen(gauged, 1, 40, chart="xbar_s", grouping="consecutive", group_size=2)
        assert again["sigma"] * 1000 == pytest.approx(sqrt(2) / (sqrt(2) / sqrt(pi)) / 1), "s/c4, c4 = sqrt(2/pi)"

    def test_sigma_of_subgroups_may_be_pooled(self, gauged: Shop) -> None:
        """Pairs with s of sqrt(2) and 3 sqrt(2): pooled sqrt((2 + 18) / 2) = sqrt(10), by their ranges (2 + 6) / 2 / d2."""
        gauged.push([0, 2, 1, 7] * 10)
        pairs: dict[str, Any] = {"grouping": "consecutive", "group_size": 2}
        assert frozen(gauged, 1, 40, chart="xbar_r", **pairs)["sigma"] * 1000 == pytest.approx(4 / D2)
        for chart in ("xbar_r", "xbar_s"):
            made = frozen(gauged, 1, 40, chart=chart, pooled=True, **pairs)
            assert (made["estimator"], made["degrees_of_freedom"]) == ("pooled", 20)
            assert made["sigma"] * 1000 == pytest.approx(sqrt(10))
        again = frozen(gauged, 1, 40, chart="xbar_s", pooled=True, key="once", **pairs)
        repeated = frozen(gauged, 1, 40, status=200, chart="xbar_s", pooled=True, key="once", **pairs)
        assert repeated["version"] == again["version"]

    def test_ewma_cusum_and_moving_average_begin_behind_the_baseline(self, gauged: Shop) -> None:
        gauged.push([0, 1] * 20)
        made = frozen(gauged, 1, 40, ewma_lambda=0.5, cusum_h=4, cusum_headstart=2, average_span=2)
        centre, sigma = made["centre"] * 1000, made["sigma"] * 1000
        gauged.push([2.5, 4.5])
        ewma = control(gauged, last=2, chart="ewma")["points"]
        assert [value * 1000 for value in ewma["value"]] == pytest.approx([1.5, 3.0])
        exact = [3 * sigma * sqrt(1 / 3 * (1 - 0.25**i)) for i in (1, 2)]
        assert [value * 1000 for value in ewma["upper"]] == pytest.approx([centre + each for each in exact])
        average = control(gauged, last=2, chart="moving_average")["points"]
        assert [value * 1000 for value in average["value"]] == pytest.approx([2.5, 3.5])
        sums = control(gauged, last=2, chart="cusum")["points"]
        first = 2 * sigma + 2 - sigma / 2
        assert [value * 1000 for value in sums["value"]] == pytest.approx([first, first + 4 - sigma / 2])
        assert sums["below"][0] * 1000 == pytest.approx(-max(0, 2 * sigma - 2 - sigma / 2), abs=1e-9)


class TestFrozen:
    def test_what_comes_later_is_judged_and_changes_nothing(self, gauged: Shop) -> None:
        rng = Random(2)
        gauged.push([rng.gauss(0, 1) for _ in range(150)])
        made = frozen(gauged, 1, 150)
        gauged.push([rng.gauss(9, 3) for _ in range(150)])
        shown = control(gauged, last=150)
        assert shown["points"]["upper"] == made["upper"]
        assert shown["points"]["centre"] == made["centre"]
        assert shown["signal_count"] > 3
        assert versions(gauged) == [made]

    def test_versions_count_and_the_newest_is_in_force(self, gauged: Shop) -> None:
        gauged.push([0, 1] * 30)
        first, second = (
            frozen(gauged, 1, 40),
            frozen(gauged, 11, 60, excluded=[{"first": 20, "last": 21, "reason": "Chip"}]),
        )
        assert [(each["version"], each["in_force"]) for each in versions(gauged)] == [(2, True), (1, False)]
        path = f"/characteristics/{gauged.characteristic}/baselines"
        assert gauged.call("GET", f"{path}/1")["in_force"] is False
        gauged.call("GET", f"{path}/3", 404)
        assert control(gauged, baseline=1)["baseline"] == 1
        assert control(gauged)["baseline"] == 2
        again = gauged.call("POST", f"{path}/1/put-in-force", 201, reason="The new one was too wide")
        assert (again["version"], again["repeats"], again["sigma"]) == (3, 1, first["sigma"])
        gauged.call("POST", f"{path}/3/put-in-force", 409, reason="Again")
        told = gauged.call("POST", f"{path}/1/put-in-force", 409, reason="Pressed twice")
        assert "its numbers are those of version 3" in told["detail"]
        gauged.call("POST", f"{path}/2/retire", 409, reason="It is not in force")
        gone = gauged.call("POST", f"{path}/3/retire", reason="Rebuilt spindle")
        assert (gone["retired_why"], gone["in_force"]) == ("Rebuilt spindle", False)
        assert control(gauged)["baseline"] is None, "an older one does not come back by itself"
        assert control(gauged)["points"]["upper"] is None
        assert second["excluded"] == [{"first": 20, "last": 21, "reason": "Chip"}]
        entries = gauged.call("GET", f"/audit?subject=characteristic/{gauged.characteristic}")["items"]
        said = [entry["action"] for entry in entries]
        assert said.count("baseline frozen") == 2
        assert {"baseline retired", "baseline put in force again"} <= set(said)

    def test_the_same_key_freezes_once(self, gauged: Shop) -> None:
        gauged.push([0, 1] * 30)
        made = frozen(gauged, 1, 40, key="monday")
        assert frozen(gauged, 1, 40, status=200, key="monday") == made
        frozen(gauged, 1, 41, status=409, key="monday")
        assert len(versions(gauged)) == 1

    def test_readings_excluded_since_leave_the_numbers_and_are_reported(self, gauged: Shop, server: Server) -> None:
        gauged.push([0, 1] * 12)
        made = frozen(gauged, 1, 24)
        viewer, path = Person(server, "viewer"), f"/characteristics/{gauged.characteristic}/control"
        assert "after it was frozen" not in viewer.open(path)
        for sequence in range(1, 25):
            gauged.call("POST", f"/readings/{gauged.characteristic}/{sequence}/exclude", reason="Wrong gauge")
        assert versions(gauged) == [made]
        assert "24 readings of its period were excluded from the statistics after it was frozen" in viewer.open(path)
        assert control(gauged, last="all")["count"] == 0
        assert "0 readings of the 20 that this takes" in preview(gauged, 422, last_sequence=24)["detail"]

    def test_operators_look_and_engineers_freeze(self, gauged: Shop, server: Server) -> None:
        gauged.push([0, 1] * 30)
        operator = server.client(server.key("operator"))
        path = f"/characteristics/{gauged.characteristic}/baselines"
        body = {"quantity": "deviation", "first_sequence": 1, "last_sequence": 40}
        gauged.call("POST", path, 403, operator, **body, reason="Mine")
        assert gauged.call("POST", f"{path}/preview", 200, operator, **body)["readings"] == 40
        assert versions(gauged) == []

    def test_live_pages_hear_of_it(self, gauged: Shop, server: Server) -> None:
        gauged.push([0, 1] * 30)
        frozen(gauged, 1, 40)
        from sqlalchemy import text

        with server.database.begin() as session:
            told = session.scalars(
                text("SELECT changes FROM event WHERE changes::text LIKE :it ORDER BY id DESC LIMIT 1"),
                {"it": f'%"{gauged.characteristic}"%'},
            ).one()
        assert told[0] | {"machine": ""} == {
            "kind": "baseline",
            "machine": "",
            "characteristic": gauged.characteristic,
            "version": 1,
            "in_force": True,
        }


class TestRefused:
    @pytest.mark.parametrize(
        ("body", "field"),
        [
            ({"first_sequence": 1, "last_sequence": 12}, "last_sequence"),
            ({"first_sequence": 40, "last_sequence": 1}, "first_sequence"),
            ({"first_sequence": 1, "last_sequence": 41}, "last_sequence"),
            ({"first_sequence": 1, "last_sequence": 2**62}, "first_sequence"),
            ({"excluded": [{"first": 1, "last": 40, "reason": "All"}]}, "last_sequence"),
            ({"excluded": [{"first": 9, "last": 2, "reason": "Backwards"}]}, "excluded[0].first"),
            ({"excluded": [{"first": 9, "last": 12, "reason": " "}]}, "excluded[0].reason"),
            ({"last_sequence": 30, "excluded": [{"first": 31, "last": 32, "reason": "Chip"}]}, "excluded[0].first"),
            ({"chart": "xbar_r"}, "grouping"),
            ({"chart": "xbar_r", "grouping": "consecutive"}, "group_size"),
            ({"chart": "xbar_s", "grouping": "pause"}, "group_pause"),
            ({"chart": "xbar_r", "grouping": "consecutive", "group_size": 5}, "last_sequence"),
            ({"chart": "individuals", "grouping": "part"}, "grouping"),
            ({"chart": "individuals", "pooled": True}, "pooled"),
            ({"chart": "xbar_r", "quantity": "differences", "grouping": "part"}, "chart"),
            ({"cusum_h": 4, "cusum_headstart": 4}, "cusum_headstart"),
            ({"ewma_lambda": 0}, "ewma_lambda"),
            ({"average_span": 1}, "average_span"),
            ({"quantity": "guess"}, "quantity"),
            ({"first_sequence": "NaN"}, "first_sequence"),
        ],
    )
    def test_in_words_with_the_field_and_nothing_kept(self, gauged: Shop, body: dict[str, Any], field: str) -> None:
        gauged.push([0, 1, 3] * 13 + [0])
        problem = preview(gauged, 422, **body)
        assert field in [error["field"] for error in problem["errors"]]
        assert problem["detail"]
        assert versions(gauged) == []

    def test_how_much_is_missing_is_said(self, gauged: Shop) -> None:
        problem = preview(gauged, 422, last_sequence=1)
        assert "there are 0 readings so far" in problem["errors"][0]["message"]
        gauged.push([0.0] * 12)
        assert "8 are missing" in preview(gauged, 422, last_sequence=12)["detail"]
        gauged.push([0.0] * 28)
        assert "All values are the same" in preview(gauged, 422)["detail"]

    def test_the_page_says_how_many_readings_are_missing(self, gauged: Shop, server: Server) -> None:
        viewer, path = Person(server, "viewer"), f"/characteristics/{gauged.characteristic}/control"
        gauged.push([0, 1] * 6)
        assert "12 readings of the 20 that this takes: 8 are missing" in viewer.open(path)
        gauged.push([0, 1] * 6)
        page = viewer.open(path)
        assert "No baseline is in force" in page
        assert "missing" not in page

    def test_parts_of_one_reading_are_no_subgroups(self, gauged: Shop) -> None:
        parts = [*(f"SN-{n}" for n in range(40)), *(f"SN-{n // 2}" for n in range(100, 120))]
        gauged.push([0, 1, 3] * 20, part=parts)
        problem = preview(gauged, 422, chart="xbar_s", grouping="part", last_sequence=60)
        assert "10 subgroups with two readings or more, of the 20 that this takes: 10 are missing" in problem["detail"]

    def test_a_chart_that_the_baseline_has_no_limits_for(self, gauged: Shop) -> None:
        gauged.push([0, 1] * 30)
        frozen(gauged, 1, 40)
        path = f"/characteristics/{gauged.characteristic}"
        assert "xbar" in gauged.call("GET", f"{path}/control?chart=xbar", 422)["detail"]
        gauged.call("GET", f"{path}/control?chart=pie", 422)
        gauged.call("GET", f"{path}/control?last=0", 422)
        gauged.call("GET", f"{path}/figures/baseline?excluded=1-2;drop", 422)

    def test_without_readings_there_is_an_empty_chart(self, gauged: Shop) -> None:
        shown = control(gauged)
        assert (shown["count"], shown["points"]["value"], shown["signals"]) == (0, [], [])
        path = f"/characteristics/{gauged.characteristic}/figures"
        assert gauged.call("GET", f"{path}/control")["data"] == []
        assert gauged.call("GET", f"{path}/baseline")["data"] == []
        gauged.push([0, 1] * 30)
        frozen(gauged, 1, 40)
        for kind in ("individuals", "moving_range", "ewma", "cusum", "moving_average"):
            assert control(gauged, chart=kind, first=900)["count"] == 0
            assert control(gauged, chart=kind, first=1, through=1)["count"] == (0 if kind == "moving_range" else 1)


class TestLeftOut:
    def test_readings_excluded_from_statistics_and_from_the_baseline(self, gauged: Shop) -> None:
        gauged.push([0, 1] * 10 + [500] + [0, 1] * 10 + [900])
        gauged.call("POST", f"/readings/{gauged.characteristic}/21/exclude", reason="False trigger")
        answer = preview(gauged, last_sequence=42, excluded=[{"first": 42, "last": 42, "reason": "Chip"}])
        assert answer["left_out"] == {"excluded": [21], "by_baseline": [42], "faults": [], "unknown": [], "count": 2}
        assert (answer["readings"], answer["centre"]) == (40, pytest.approx(0.0005))
        frozen(gauged, 1, 42, excluded=[{"first": 42, "last": 42, "reason": "Chip"}])
        assert control(gauged, last="all")["points"]["last"] == [*range(1, 21), *range(22, 42)]

    @pytest.mark.parametrize("quantity", ["deviation", "without_corrections", "differences"])
    def test_probe_faults_are_no_parts_and_are_named(self, gauged: Shop, quantity: str) -> None:
        gauged.push([0, 1] * 10 + [1500] + [0, 1] * 10 + [-1000, 2, 0.5])
        made = frozen(gauged, 1, 41, quantity=quantity)
        assert made["sigma"] < 0.002, "1500 µm would be seen"
        shown = control(gauged, last=24)
        assert shown["left_out"] == {"excluded": [], "by_baseline": [], "faults": [21, 42], "unknown": [], "count": 2}
        assert not {21, 42} & set(shown["points"]["last"])
        assert control(gauged, first=22, through=30)["left_out"]["count"] == 0

    def test_cautions(self, gauged: Shop) -> None:
        rng = Random(5)
        gauged.push([rng.gauss(0, 1) for _ in range(60)] + [12.0] + [rng.gauss(0, 1) for _ in range(60)])
        codes = {each["code"] for each in preview(gauged, last_sequence=121)["cautions"]}
        assert codes == {"signals", "not_normal"}
        assert preview(gauged, last_sequence=121)["signals"] == 1
        assert preview(gauged, last_sequence=60)["cautions"][0]["code"] == "provisional"
        quiet = preview(gauged, last_sequence=121, excluded=[{"first": 61, "last": 61, "reason": "Chip"}])
        assert quiet["cautions"] == []

    def test_subgroups_by_pause_and_by_part_of_any_size(self, gauged: Shop) -> None:
        rng = Random(3)
        sizes = [rng.randint(1, 4) for _ in range(80)]
        values, parts, moments = [], [], []
        for group, size in enumerate(sizes):
            for place in range(size):
                values.append(rng.gauss(0, 1))
                parts.append(f"SN-{group}")
                moments.append(f"2026-11-{1 + group // 20:02d}T{group % 20:02d}:{place:02d}:00Z")
        gauged.push(values, part=parts, measured_at=moments)
        for grouping in ({"grouping": "part"}, {"grouping": "pause", "group_pause": 30}):
            frozen(gauged, 1, sum(sizes[:60]), chart="xbar_s", **grouping)
            shown = control(gauged, last="all")
            assert shown["points"]["size"] == sizes[:-1], "the last one may still grow"
            assert shown["waiting"] == sizes[-1]
            assert control(gauged, last="all", chart="deviations")["points"]["size"] == [n for n in sizes[:-1] if n > 1]

    def test_subgroups_by_shift_and_by_nest(self, gauged: Shop) -> None:
        """A reading an hour: eight a shift. Spindles take turns by two and three; without a spindle each stands alone."""
        rng = Random(3)
        moments = [f"2026-10-{1 + hour // 24:02d}T{hour % 24:02d}:15:00Z" for hour in range(240)]
        nests = [1, 1, 2, 2, 2, None] * 40
        contexts = [{"nest": nest} if nest else {} for nest in nests]
        gauged.push([rng.gauss(0, 1) for _ in moments], measured_at=moments, context=contexts)
        frozen(gauged, 1, 230, chart="xbar_s", grouping="shift", pooled=True)
        assert set(control(gauged, last="all")["points"]["size"][1:-2]) == {8}
        frozen(gauged, 1, 240, chart="xbar_r", grouping="nest")
        assert control(gauged, last="all")["points"]["size"] == [2, 3, 1] * 40


class TestCompensated:
    def test_without_corrections_the_wear_shows_and_the_page_warns(self, turned: Shop) -> None:
        codes = [
            each["code"] for each in preview(turned, quantity="without_corrections", last_sequence=120)["cautions"]
        ]
        assert "wears" in codes
        codes = [each["code"] for each in preview(turned, last_sequence=120)["cautions"]]
        assert "corrected" in codes

    def test_residuals_find_the_wear_and_start_again_with_each_edge(self, turned: Shop) -> None:
        made = frozen(turned, 21, 120, quantity="wear_residuals")
        assert made["wear_per_reading"] * 1000 == pytest.approx(0.5, abs=0.01)
        assert made["sigma"] * 1000 == pytest.approx(0.4, rel=0.25)
        assert (made["centre"], made["settle"], made["factor"]) == (0.0, 20, -1.0)
        shown = control(turned, last="all")
        assert shown["settling"] == 40
        assert shown["points"]["last"] == [*range(21, 121), *range(141, 201)]
        assert shown["signal_count"] <= 2
        assert max(abs(value) for value in shown["points"]["value"]) < 0.0025
        assert control(turned, last=10)["points"]["value"] == pytest.approx(shown["points"]["value"][-10:], abs=1e-12)

    def test_differences_see_no_wear_and_no_tool_change(self, turned: Shop) -> None:
        made = frozen(turned, 1, 120, quantity="differences")
        assert made["centre"] * 1000 == pytest.approx(0.5, abs=0.05)
        assert made["sigma"] * 1000 == pytest.approx(0.4 * sqrt(2), rel=0.25)
        shown = control(turned, last="all")
        assert shown["points"]["last"] == [*range(2, 121), *range(122, 201)]
        turned.call("GET", f"/characteristics/{turned.characteristic}/control?chart=ewma", 422)
