"""Events above charts: which are drawn, where, and how they make room for each other."""

import ast
import itertools
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import app
from app.charts import Axis, Chart, Panel, Series, svg, time_axis, to_drawing, to_plotly
from app.loop.timeline.figures import CALIBRATION, PARAMETERS, TOOL_CHANGE, Event, with_lane
from tests.loop.readings.importing.test_history import run, table
from tests.shop import Shop

GAUGE: dict[str, Any] = {
    "average_memory": 5,
    "gauge_size": 199.852,
    "touches": [199.870, 199.874, 199.872],
    "zero_range": 0.001,
    "averaging_limit": 0.01,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
}
START = datetime(2026, 11, 2, 6, tzinfo=UTC)


def readings(count: int) -> Chart:
    x = list(range(1, count + 1))
    return Chart([Panel([Series(x, [0.0] * count, meta="points")])], Axis(reach=(0, count + 1)))


def events_of(figure: dict[str, Any]) -> dict[str, Any]:
    (trace,) = (trace for trace in figure["data"] if trace.get("meta") == "events")
    return dict(trace)


def said(events: dict[str, Any]) -> list[str]:
    """What each mark says when it is pointed at."""
    return list(events["text"])


class TestTheLane:
    def test_each_kind_has_a_shape_that_the_legend_names(self) -> None:
        events = [
            Event(10, TOOL_CHANGE, "T3 changed"),
            Event(40, CALIBRATION, "Calibration 2"),
            Event(70, PARAMETERS, "Parameters version 2"),
            Event(90, "oversize", "Oversize", active=True),
        ]
        figure = to_plotly(with_lane(readings(100), events, 1200))
        assert events_of(figure)["x"] == [10, 40, 70, 90]
        assert len(set(events_of(figure)["marker"]["symbol"])) == 4
        names = {trace["name"] for trace in figure["data"] if trace.get("showlegend")}
        assert names == {"Tool change", "Calibration", "Parameter version", "Alarm"}

    def test_what_would_overprint_is_one_mark_that_names_all(self) -> None:
        events = [Event(n, TOOL_CHANGE, f"T{n} changed") for n in range(500, 512)]
        events.append(Event(511, "probe_fault", "Probe fault", "/alarms/9"))
        found = events_of(to_plotly(with_lane(readings(2000), events, 1200)))
        assert len(found["x"]) == 1
        assert found["customdata"] == ["/alarms/9"]  # what matters most
        hover = said(found)[0]
        assert "5 more before" in hover
        assert "Probe fault" in hover

    def test_marks_keep_apart_however_many_there_are(self) -> None:
        events = [Event(n, TOOL_CHANGE, "T3 changed") for n in range(1, 5001)]
        width = 1200
        chart = with_lane(readings(5000), events, width)
        x = events_of(to_plotly(chart))["x"]
        pixels = (width - chart.room.left - chart.room.right) / 5001
        assert min(after - before for before, after in itertools.pairwise(x)) * pixels >= 15

    def test_no_word_reaches_beyond_the_chart(self) -> None:
        def side(*at: int) -> dict[str, str]:
            events = [Event(n, TOOL_CHANGE, f"T3 changed at {n}") for n in at]
            notes = to_plotly(with_lane(readings(1000), events, 600))["layout"]["annotations"]
            return {note["text"]: note["xanchor"] for note in notes}

        assert side(100) == {"T3 changed at 100": "left"}, "its left end lies at the mark"
        assert side(990) == {"T3 changed at 990": "right"}, "no room on the right"
        assert side(930, 965, 999) == {"T3 changed at 930": "right", "T3 changed at 965": "right"}, (
            "two rows, then none"
        )

    def test_a_chart_without_events_stays_as_it_is(self) -> None:
        chart = readings(10)
        assert with_lane(chart, [Event(99, TOOL_CHANGE, "later")], 1200) is chart

    def test_along_time_and_on_paper(self) -> None:
        moments = [START + timedelta(hours=n) for n in range(5)]
        chart = Chart([Panel([Series(moments, [0.0] * 5)])], time_axis(moments))
        chart = with_lane(chart, [Event(moments[2], CALIBRATION, "Calibration 7")], 900)
        picture = svg(to_drawing(chart, 900, 300), "a chart", "c")
        assert "Calibration 7" in picture
        assert "Calibration" in {series["name"] for series in to_plotly(chart)["data"] if series.get("name")}


def test_all_kinds_stand_on_the_charts_of_a_characteristic(shop: Shop) -> None:
    for _ in range(3):
        shop.read(0.1)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="new insert")
    shop.read(0.2)
    shop.call("POST", f"/machines/{shop.machine}/calibrations", 201, **GAUGE)
    shop.read(0.3)
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters={"zero_range": 0.0015}, reason="scatter")
    shop.read(12.5)
    for name in ("zones", "control", "run", "wear?last=all"):
        figure = shop.call("GET", f"/characteristics/{shop.characteristic}/figures/{name}")
        words = " ".join(said(events_of(figure)))
        for event in ("T3 changed", "Calibration 1", "Parameters version 2", "Oversize"):
            assert event in words, name


def test_a_machines_charts_over_time_show_its_alarms(shop: Shop) -> None:
    calibrations = f"/machines/{shop.machine}/calibrations"
    shop.call("POST", calibrations, 201, **GAUGE)
    shop.read(12.5)
    shop.call("POST", calibrations, 201, **GAUGE)
    events = events_of(shop.call("GET", f"/machines/{shop.machine}/averages/5/calibration-figure"))
    words = " ".join(said(events))
    assert "Oversize" in words
    assert "Calibration" not in words  # the chart draws them itself


def test_an_alarm_of_another_location_stands_on_its_own_chart_only(shop: Shop) -> None:
    """A key calibrates two locations; the second is refused by a touch far outside the window."""
    calibrations = f"/machines/{shop.machine}/calibrations"
    shop.call("POST", calibrations, 201, **GAUGE)
    shop.call("POST", calibrations, 201, **GAUGE | {"average_memory": 6})
    shop.read(0.1)
    shop.call("POST", calibrations, 201, **GAUGE | {"average_memory": 6, "touches": [209.0]})
    shop.read(12.5)
    shop.call("POST", calibrations, 201, **GAUGE)
    shop.call("POST", calibrations, 201, **GAUGE | {"average_memory": 6})

    def words(path: str) -> str:
        return " ".join(said(events_of(shop.call("GET", path))))

    own, other = (f"/machines/{shop.machine}/averages/{location}/calibration-figure" for location in (6, 5))
    assert "refused" in words(own)
    assert "refused" not in words(other)
    assert "Oversize" in words(other)
    assert "refused" not in words(f"/characteristics/{shop.characteristic}/figures/zones"), "its R11 is 5"


def test_events_of_readings_that_came_late_stand_at_their_reading(shop: Shop) -> None:
    """A bridge was offline: three weeks later it sends what was measured then, and the server knows of all of it today."""
    measured = [(START + timedelta(hours=at)).isoformat() for at in range(4)]
    shop.read(0.1, measured_at=measured[0])
    shop.read(12.5, measured_at=measured[1])
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="new insert")
    shop.read(0.2, measured_at=measured[2])
    shop.read(0.3, measured_at=measured[3])
    events = events_of(shop.call("GET", f"/characteristics/{shop.characteristic}/figures/run"))
    placed = {words: datetime.fromisoformat(at) for at, words in zip(events["x"], said(events), strict=True)}
    assert [at for words, at in placed.items() if "Oversize" in words] == [START + timedelta(hours=1)]
    assert [at for words, at in placed.items() if "T3 changed" in words] == [START + timedelta(hours=2)]


def test_an_event_of_today_is_none_of_a_past_that_is_imported_later(shop: Shop, tmp_path: Path) -> None:
    shop.read(0.1)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="new insert")
    run(shop.server.database, table(tmp_path / "a.csv", [40.0, 40.001]), shop.characteristic)
    figure = shop.call("GET", f"/characteristics/{shop.characteristic}/figures/run")
    (change,) = (at for at, words in zip(events_of(figure)["x"], said(events_of(figure)), strict=True) if "T3" in words)
    assert datetime.fromisoformat(change) > START, "not in March, when the parts of the file were measured"


def test_every_chart_of_a_page_says_how_wide_it_is() -> None:
    """Or words of a wide chart are written over each other on a narrow one."""
    calls = [
        (path.name, node)
        for path in Path(app.__path__[0]).rglob("*api.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2].startswith("with_events")
    ]
    assert len(calls) > 10
    assert [name for name, call in calls if "width" not in map(ast.unparse, call.args)] == []
