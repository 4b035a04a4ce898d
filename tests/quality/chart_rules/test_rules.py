"""Rules: which are offered where, what they would have said, how often by chance; switched on by whom and when."""

from random import Random
from typing import Any

import numpy as np
import pytest

from app.core.spc.points import ChartSettings, Piece
from app.core.spc.rules import RULES, RuleKind, RuleName, signals
from app.core.spc.shewhart import Chart
from app.core.spc.watch import Watch
from app.quality.chart_rules.pictures import OF_CHARTS, PATTERNS, picture
from app.quality.chart_rules.places import Place, Setting, read_rules, stored_rules
from tests.quality.chart_signals.line import Line
from tests.shop import Person, Shop


def get(line: Line, more: str = "") -> Any:
    return line.shop.call("GET", f"/characteristics/{line.key}/rules{more}")


def offered(found: dict[str, Any]) -> dict[str, list[str]]:
    return {chart["chart"]: [rule["rule"] for rule in chart["rules"]] for chart in found["charts"]}


class TestSettings:
    def test_rules_are_offered_where_they_have_a_sense(self, shop: Shop) -> None:
        every, limits = [name.value for name in RuleName], ["nelson_1"]
        remembering = {"ewma": limits, "moving_average": limits, "cusum": limits}
        assert offered(get(Line(shop, "a"))) == {"individuals": every, "moving_range": limits} | remembering
        subgroups = Line(shop, "b", chart="xbar_s", grouping="consecutive", group_size=3)
        assert offered(get(subgroups)) == {"xbar": every, "deviations": limits} | remembering
        differences = Line(shop, "c", quantity="differences")
        assert offered(get(differences)) == {"individuals": limits}
        wrong: dict[str, Any] = {"rules": {"main": {"nelson_1": "watch", "nelson_2": "watch"}}, "reason": "why"}
        refused = shop.call("PUT", f"/characteristics/{differences.key}/rules", 422, **wrong)
        assert [each["field"] for each in refused["errors"]] == ["rules.main.nelson_2"]
        wrong = {"rules": {"ewma": {"nelson_3": "watch"}}, "reason": "why"}
        refused = shop.call("PUT", f"/characteristics/{Line(shop, 'd', baseline=False).key}/rules", 422, **wrong)
        assert [each["field"] for each in refused["errors"]] == ["rules.ewma.nelson_3"]

    def test_the_default_watches_the_limits_and_a_change_is_a_version_on_record(self, shop: Shop) -> None:
        line = Line(shop)
        default = get(line)
        assert (default["version"], default["baseline"], default["actor"]) == (0, 1, None)
        on = {
            (chart["chart"], rule["rule"]): rule for chart in default["charts"] for rule in chart["rules"] if rule["do"]
        }
        assert {key: rule["do"] for key, rule in on.items()} == {("individuals", "nelson_1"): "watch"}
        line.push([0.0] * 5)
        line.rules(main={"nelson_1": "alarm", "nelson_3": "watch"})
        found = get(line)
        rules = {rule["rule"]: rule for rule in found["charts"][0]["rules"]}
        assert found["version"] == 1
        assert (rules["nelson_1"]["do"], rules["nelson_1"]["since"]) == ("alarm", None)
        assert (rules["nelson_3"]["do"], rules["nelson_3"]["since"]) == ("watch", 65)
        assert rules["nelson_2"]["do"] is None
        line.rules(main={"nelson_1": "alarm", "nelson_3": "watch"})
        assert get(line)["version"] == 1
        (entry,) = shop.call("GET", f"/audit?subject=characteristic/{line.key}&limit=1")["items"][-1:]
        assert entry["action"] in {"rules changed", "baseline frozen", "characteristic added"}
        changes = [
            each
            for each in shop.call("GET", f"/audit?subject=characteristic/{line.key}&limit=100")["items"]
            if each["action"] == "rules changed"
        ]
        assert [(each["before"], each["after"], each["why"]) for each in changes] == [
            ({"main": {"nelson_1": "watch"}}, {"main": {"nelson_1": "alarm", "nelson_3": "watch"}}, "tried")
        ]

    def test_who_changes_what_somebody_else_has_changed_learns_so(self, shop: Shop) -> None:
        line = Line(shop)
        line.rules(main={})
        body: dict[str, Any] = {"rules": {"main": {"nelson_2": "watch"}}, "reason": "why"}
        path = f"/characteristics/{line.key}/rules"
        shop.call("PUT", path, 409, **body, seen_version=0)
        shop.call("PUT", path, 200, **body, seen_version=1)
        operator = shop.server.client(shop.server.key("operator"))
        shop.call("PUT", path, 403, operator, **body)
        assert shop.call("GET", path, 200, operator)["version"] == 2

    def test_what_is_stored_is_what_is_read(self) -> None:
        rules = {
            "main": {
                "nelson_1": {"do": "alarm", "since": 0, "back": 3},
                "western_4": {"do": "watch", "since": 7, "back": None},
            },
            "cusum": {"nelson_1": {"do": "watch", "since": 812, "back": None}},
        }
        assert stored_rules(read_rules(rules)) == rules
        assert read_rules({"main": {}}) == {}
        assert isinstance(read_rules(rules)[Place.CUSUM][RuleName.NELSON_1], Setting)


class TestPreview:
    def test_it_counts_what_the_rules_would_have_found_and_keeps_nothing(self, shop: Shop) -> None:
        line = Line(shop)
        line.push([0.5] * 9 + [-0.5] * 3 + [9.0, 0.0])
        found = get(line, "/preview?last=14")
        rules = {(each["chart"], each["rule"]): each for each in found["rules"]}
        assert (found["first_sequence"], found["last_sequence"], found["baseline"]) == (61, 74, 1)
        assert {key: each["signals"] for key, each in rules.items() if key[0] == "individuals" and each["signals"]} == {
            ("individuals", "nelson_1"): 1,
            ("individuals", "nelson_2"): 1,
            ("individuals", "western_4"): 1,
        }
        nelson_2 = rules["individuals", "nelson_2"]
        assert (nelson_2["points"], nelson_2["points_inside"], nelson_2["do"]) == (14, 9, None)
        assert nelson_2["every"] == pytest.approx(511)
        assert nelson_2["per_1000"] == pytest.approx(1000 / 511)
        assert nelson_2["expected"] == pytest.approx(14 / 511)
        assert nelson_2["text"] == "1 time, by chance less than 0.1: no more than by chance"
        assert found["together"]["signals"] == 1
        assert found["together"]["every"] == pytest.approx(370.4, abs=0.05)
        assert shop.call("GET", f"/signals?characteristic={line.key}")["items"] == []

    def test_of_all_readings_it_says_what_watching_them_would_have_found(self, shop: Shop) -> None:
        line = Line(shop)
        rng = Random(6)
        values = [rng.gauss(1, 3) for _ in range(150)]
        line.rules(main=dict.fromkeys([name.value for name in RuleName], "watch"), scatter={"nelson_1": "watch"})
        line.push(values)
        line.look()
        tried = get(line, f"/preview?last={len(values)}")["rules"]
        kept = [(chart, rule) for chart, rule, *_ in line.runs()]
        assert len(kept) > 10
        for each in tried:
            if each["place"] == "main":
                assert each["signals"] == kept.count((each["chart"], each["rule"])), each["rule"]

    def test_more_than_chance_is_said_to_be_more(self, shop: Shop) -> None:
        line = Line(shop)
        line.push([9.0, 0.0, 0.0] * 10)
        found = get(line, "/preview?last=30")
        first = next(each for each in found["rules"] if each["rule"] == "nelson_1" and each["place"] == "main")
        assert first["more_than_chance"]
        assert first["text"] == "10 times, by chance 0.1: more than chance explains"

    def test_without_a_baseline_nothing_can_be_tried(self, shop: Shop) -> None:
        line = Line(shop, baseline=False)
        found = get(line, "/preview")
        assert (found["baseline"], found["rules"], found["together"]) == (None, [], None)
        line.rules(main={"nelson_5": "watch"})
        line.push([5.0, 5.0])
        line.look()
        assert line.signals() == []

    @pytest.mark.parametrize("query", ["last=0", "last=-1", "last=x", "last=NaN", "last=99999999999999999999"])
    def test_bad_numbers_are_refused(self, shop: Shop, query: str) -> None:
        shop.call("GET", f"/characteristics/{shop.characteristic}/rules/preview?{query}", 422)


class TestPictures:
    @pytest.mark.parametrize("name", RuleName)
    def test_a_picture_shows_exactly_what_its_rule_finds(self, name: RuleName) -> None:
        z, hits = PATTERNS[name]
        (run,) = signals(z, [rule := RULES[name]])
        inside = range(run.start, run.end + 1)
        members = [at for at in inside if rule.kind is not RuleKind.BEYOND or run.side * z[at] > rule.limit]
        assert members == list(hits)
        drawn = picture(name, Chart.INDIVIDUALS)
        assert len(drawn.hits) == len(list(hits))
        assert len(drawn.points) + len(drawn.hits) == len(z)

    @pytest.mark.parametrize("chart", Chart)
    def test_every_chart_has_one_that_leaves_its_limits_once(self, chart: Chart) -> None:
        assert len(picture(RuleName.NELSON_1, chart).hits) == 1
        for z, hits in OF_CHARTS.values():
            at = np.arange(len(z))
            found = Watch(ChartSettings(Chart.INDIVIDUALS), {RuleName.NELSON_1: -1}).feed(
                Piece([np.array(z)], at, at, at < 0)
            )
            assert [(each.first, each.last) for each in found] == [(hits[0], hits[-1])]


class TestPage:
    def test_trying_changes_nothing_and_switching_on_takes_a_reason(self, shop: Shop, engineer: Person) -> None:
        line = Line(shop)
        line.push([0.5] * 10)
        path = f"/characteristics/{line.key}/rules"
        page = engineer.open(path)
        assert "No rules chosen" in page
        assert "by chance alone" in page.lower()
        chosen: dict[str, Any] = {
            "main.nelson_1": "watch",
            "main.nelson_2": "alarm",
            "ewma.nelson_1": "off",
            "seen_version": "0",
        }
        tried = engineer.send(path, step="try", **chosen)
        assert "tried, not switched on" in tried
        assert get(line)["version"] == 0
        refused = engineer.send(path, 422, step="save", **chosen)
        assert "Nelson 2" in refused
        assert get(line)["version"] == 0
        engineer.send(path, step="save", reason="None by chance", look_back="true", **chosen)
        found = get(line)
        assert (found["version"], found["reason"], found["actor"]) == (1, "None by chance", engineer.name)
        assert {rule["rule"]: rule["do"] for rule in found["charts"][0]["rules"] if rule["do"]} == {
            "nelson_1": "watch",
            "nelson_2": "alarm",
        }
        line.look()
        assert [each["rule"] for each in line.signals()] == ["nelson_2"]
        assert line.alarms() == []
        late = engineer.send(path, 409, step="save", reason="again", **chosen)
        assert "Another person has changed the rules" in late
        broken = engineer.send(path, 422, step="save", reason="x", **{"main.nelson_99": "watch", "main": "watch"})
        assert "corrected" in broken

    def test_who_may_only_look_finds_no_form(self, shop: Shop, viewer: Person) -> None:
        line = Line(shop)
        page = viewer.open(f"/characteristics/{line.key}/rules?set=western&last=all")
        assert 'type="radio"' not in page
        assert "Western Electric" in page
        viewer.send(f"/characteristics/{line.key}/rules", 403, step="save", reason="x")
        viewer.open(f"/characteristics/{line.key}/rules?last=5", 422)

    def test_without_a_baseline_it_leads_to_the_editor(self, shop: Shop, engineer: Person) -> None:
        line = Line(shop, baseline=False)
        page = engineer.open(f"/characteristics/{line.key}/rules")
        assert f"/characteristics/{line.key}/control/freeze" in page
        assert "1 in 370 points" in page
