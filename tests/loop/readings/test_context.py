"""Readings told apart by their context: filters, charts, capability, comparison and replay count what belongs to an order or a nest."""

import csv
import io
from typing import Any

import numpy as np
import pytest

from app.core.context import ContextField
from app.loop.characteristics.queries import characteristic_named
from app.loop.summaries.queries import chart_data, window_of
from tests.forked import inband
from tests.servers import Server
from tests.shop import Person, Shop

COUNT = 600


class Told:
    """A characteristic with readings of two nests in turn and three orders one after the other; nest 2 lies 3 µm higher."""

    def __init__(self, server: Server) -> None:
        self.shop = shop = Shop(server)
        at = np.arange(COUNT)
        self.nest = 1 + at % 2
        self.order = [f"A-{each}" for each in at // 200]
        self.deviation = np.round(np.random.default_rng(2).normal(0, 0.8, COUNT) + 3 * (self.nest == 2), 3)
        self.key = shop.another("seat", mode="measure_only")
        context = [
            {"nest": int(nest), "order": order, "operator": "Milica"}
            for nest, order in zip(self.nest, self.order, strict=True)
        ]
        shop.push(self.deviation.tolist(), self.key, context=context)
        shop.push([0.5, 0.25], self.key)  # of nothing known
        self.path = f"/characteristics/{self.key}"

    def get(self, path: str, **query: Any) -> Any:
        answer = self.shop.admin.get(f"/api/v1{path}", params=query)
        assert answer.status_code == 200, answer.text
        return answer.json()


@pytest.fixture(scope="module")
def told(server: Server) -> Told:
    return Told(server)


@pytest.fixture(scope="module")
def viewer(server: Server) -> Person:
    return Person(server, "viewer")


def traces(figure: Any, meta: str) -> list[Any]:
    return [trace for trace in figure["data"] if trace.get("meta") == meta]


def test_the_list_holds_those_of_an_order_and_a_nest(told: Told) -> None:
    items = told.get("/readings", characteristic=told.key, limit=1000, **{"context.order": "A-1", "context.nest": "2"})[
        "items"
    ]
    wanted = [n + 1 for n in range(COUNT) if told.order[n] == "A-1" and told.nest[n] == 2]
    assert [item["sequence"] for item in items] == wanted
    everywhere = told.get("/readings", machine=told.shop.machine, limit=5, **{"context.order": "A-2"})["items"]
    assert [item["sequence"] for item in everywhere] == [401, 402, 403, 404, 405]
    assert told.get("/readings", characteristic=told.key, **{"context.order": "A-9"})["items"] == []


def test_the_command_line_exports_those_of_an_order(told: Told) -> None:
    def exported(*more: str) -> list[int]:
        about = {"INBAND_DATABASE_URL": told.shop.server.database.dsn}
        done = inband("export", "--characteristic", told.key, *more, **about)
        assert done.returncode == 0, done.stderr
        return [int(row["sequence"]) for row in csv.DictReader(io.StringIO(done.stdout))]

    wanted = [n + 1 for n in range(COUNT) if told.order[n] == "A-1" and told.nest[n] == 2]
    assert exported("--context", "order=A-1", "--context", "nest=2") == wanted
    assert exported("--context", "order=A-0", "--last", "3") == [198, 199, 200], "counted among them"
    refused = inband(
        "export", "--characteristic", told.key, "--context", "order=A-1", "--format", "dfq", "-o", "x.dfq",
        INBAND_DATABASE_URL=told.shop.server.database.dsn,
    )  # fmt: skip
    assert (refused.returncode, "AQDEF is written of all readings" in refused.stderr) == (2, True)


def test_what_no_context_can_hold_is_refused(told: Told) -> None:
    for query in ("context.order=a%00b", "context.nest=two", "context.colour=red"):
        assert told.shop.admin.get(f"/api/v1/readings?{query}").status_code == 422, query


def test_capability_is_that_of_the_readings_with_the_context_and_the_last_n_are_counted_among_them(told: Told) -> None:
    found = told.get(f"{told.path}/capability", last="all", **{"context.nest": "2"})
    mine = told.deviation[told.nest == 2] / 1000
    assert (found["readings"], found["mean"]) == (300, pytest.approx(mine.mean()))
    assert found["sigma_overall"] == pytest.approx(mine.std(ddof=1))
    assert "only Nest 2" in found["quoted"]["window"]
    last = told.get(f"{told.path}/capability", last="100", **{"context.order": "A-0"})
    assert (last["readings"], last["first_sequence"], last["last_sequence"]) == (100, 101, 200)


def test_nests_in_turn_differ_and_each_has_its_numbers(told: Told) -> None:
    found = told.get(f"{told.path}/strata", by="nest", last="all")
    assert [(each["name"], each["readings"]) for each in found["strata"]] == [("2", 300), ("1", 300)]
    for each in found["strata"]:
        mine = told.deviation[told.nest == int(each["name"])] / 1000
        assert (each["mean"], each["standard_deviation"]) == (
            pytest.approx(mine.mean()),
            pytest.approx(mine.std(ddof=1)),
        )
        ppk = (0.008 - abs(mine.mean())) / 3 / mine.std(ddof=1)
        assert each["ppk"]["value"] == pytest.approx(ppk)
        assert each["ppk"]["low"] < ppk < each["ppk"]["high"]
    assert found["difference"]["significant"]
    assert found["difference"]["apart"] == pytest.approx(0.003, abs=0.0004)
    assert (found["without"], found["older"]) == (2, 0)


def test_of_orders_one_after_the_other_nobody_says_that_they_differ(told: Told) -> None:
    found = told.get(f"{told.path}/strata", by="order", last="all")
    assert [each["name"] for each in found["strata"]] == ["A-2", "A-1", "A-0"]
    assert found["difference"] is None
    assert "one after the other" in found["text"]
    assert "There are no two" in told.get(f"{told.path}/strata", by="fixture")["text"]


def test_numbers_and_spread_of_the_page_are_of_the_context(told: Told, viewer: Person) -> None:
    figure = told.get(f"{told.path}/figures/histogram", last="all", **{"context.nest": "1"})
    assert sum(traces(figure, "histogram")[0]["x"]) == 300
    page = viewer.open(f"{told.path}?last=all&context.nest=1")
    assert "Nest 1" in page
    assert 'name="context.order"' in page
    assert ">300<" in page
    assert 'name="context.order"' not in viewer.open(f"/characteristics/{told.shop.characteristic}"), "none has any"


def test_points_of_a_chart_are_distinguished(told: Told) -> None:
    figure = told.get(f"{told.path}/figures/zones", last="50", by="nest")
    assert [trace["name"] for trace in traces(figure, "stratum")] == ["Nest 2", "Nest 1"]
    (readings,) = traces(figure, "readings")
    symbols = readings["marker"]["symbol"]
    assert len(set(symbols[:48:2])) == len(set(symbols[1:48:2])) == 1
    assert symbols[0] != symbols[1]
    (run,) = traces(told.get(f"{told.path}/figures/run", last="50", by="nest"), "run")
    assert len(set(run["marker"]["symbol"][:40])) == 2
    (points,) = traces(told.get(f"{told.path}/figures/control", last="50", by="nest"), "points")
    assert len(set(points["marker"]["symbol"])) >= 2


def test_a_chart_of_one_context_has_all_of_it(told: Told) -> None:
    figure = told.get(f"{told.path}/figures/zones", last="all", **{"context.nest": "1"})
    (readings,) = traces(figure, "readings")
    assert len(readings["x"]) == 300
    assert all(number % 2 for number in readings["x"])
    assert "only Nest 1" in str(figure["layout"])


def test_of_more_than_can_be_drawn_no_extreme_is_thinned_away(told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chart_data, "MOST_READINGS", 100)
    monkeypatch.setattr(chart_data, "MOST_BLOCKS", 40)
    with told.shop.server.database.begin() as session:
        characteristic = characteristic_named(session, told.key).characteristic
        window = window_of(session, characteristic, context=((ContextField.NEST, "2"),))
        found = chart_data.chart_data_of(session, characteristic, window)
    mine = told.deviation[told.nest == 2] / 1000
    assert (found.readings, len(found.blocks)) == ([], 38)
    assert sum(block.count for block in found.blocks) == len(mine)
    assert max(block.maximum for block in found.blocks) == pytest.approx(mine.max())
    assert min(block.minimum for block in found.blocks) == pytest.approx(mine.min())
    means = [mean.value * block.count for block, mean in zip(found.blocks, found.means, strict=True) if mean.value]
    assert sum(means) / len(mine) == pytest.approx(mine.mean())


def test_a_control_chart_shows_points_of_the_context_and_judges_them_among_all(told: Told) -> None:
    whole = told.get(f"{told.path}/control", last="100")
    shown = told.get(f"{told.path}/control", last="49", **{"context.nest": "2"})
    values = dict(zip(whole["points"]["last"], whole["points"]["value"], strict=True))
    points = zip(shown["points"]["last"], shown["points"]["value"], strict=True)
    assert len(shown["points"]["last"]) == 49
    assert all(not last % 2 and values[last] == value for last, value in points)


def test_nests_are_compared_side_by_side(told: Told, viewer: Person) -> None:
    page = viewer.open(f"/compare?of={told.key}&by=nest&last=200")
    assert page.count("nest 1") >= 1
    assert page.count("nest 2") >= 1
    figure = told.get("/compare/figure", of=told.key, by="order", last="all")
    assert len([trace for trace in figure["data"] if trace.get("meta") == "readings"]) == 3


def test_a_replay_says_what_it_would_have_done_for_each_nest(told: Told, viewer: Person) -> None:
    answer = told.shop.call("POST", f"{told.path}/what-if", by="nest", last=500, weighting_factor=3)
    found = {each["name"]: each for each in answer["strata"]}
    mine, nest = told.deviation[-498:], told.nest[-498:]
    for name, each in found.items():
        of = mine[nest == int(name)] / 1000
        assert (each["readings"], each["truly"]["mean"]) == (len(of), pytest.approx(of.mean()))
        assert each["truly"]["outside"] == int((np.abs(of) > 0.008).sum())
    assert "replayed with all readings" in viewer.open(f"{told.path}/what-if?by=nest")


def test_the_capability_page_has_a_table_of_strata(told: Told, viewer: Person) -> None:
    page = viewer.open(f"{told.path}/capability?last=all&by=nest")
    assert "They differ: side by side" in page
    assert "context.nest=2" in page
    assert "only Order A-1" in viewer.open(f"{told.path}/capability?last=all&context.order=A-1")
