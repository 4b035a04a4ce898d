"""Charts in the browser: what is described stands in the figure, in the colours of the theme."""

from datetime import UTC, datetime
from typing import Any

import pytest

from app.charts import PALETTES, Axis, Chart, Dots, Faded, Panel, Pen, Rule, Series, nothing, time_axis, to_plotly

COURSE = Series([1, 2], [3.0, 4.0], Pen("correction"), meta="course", name="Course", hover="%{y}", links=["/a", "/b"])


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_role_is_its_colour_in_the_theme(theme: Any) -> None:
    veil = Series([1], [1], dots=Dots(colour=["stop"]), fill=Faded("wear", 0.5))
    course, dots = to_plotly(Chart([Panel([COURSE, veil])]), theme)["data"]
    assert course["line"]["color"] == PALETTES[theme]["correction"]
    assert dots["marker"]["color"] == [PALETTES[theme]["stop"]]
    assert dots["fillcolor"].endswith(",0.5)")


def test_the_legend_names_what_has_a_name() -> None:
    unnamed = Series([1], [1], Pen("ink"))
    figure = to_plotly(Chart([Panel([COURSE, unnamed])]))
    assert [trace["showlegend"] for trace in figure["data"]] == [True, False]
    assert figure["layout"]["showlegend"]
    assert figure["layout"]["margin"]["t"] > to_plotly(Chart([Panel([unnamed])]))["layout"]["margin"]["t"]


def test_each_panel_has_its_axis_and_the_lowest_carries_that_of_all() -> None:
    rule = Rule(Pen("ink"), 1.0, words="one")
    figure = to_plotly(Chart([Panel([COURSE], share=(0.5, 1)), Panel([COURSE, rule], share=(0, 0.4))]))
    layout = figure["layout"]
    assert [trace.get("yaxis", "y") for trace in figure["data"]] == ["y", "y2"]
    assert (layout["yaxis"]["domain"], layout["yaxis2"]["domain"], layout["xaxis"]["anchor"]) == (
        [0.5, 1],
        [0, 0.4],
        "y2",
    )
    assert (layout["shapes"][0]["yref"], layout["annotations"][0]["yref"]) == ("y2", "y2")


def test_panels_beside_each_other_have_two_axes_each() -> None:
    panels = [
        Panel([COURSE], x=Axis("left"), across=(0, 0.4)),
        Panel([COURSE], x=Axis("right"), across=(0.6, 1), equal=True),
    ]
    layout = to_plotly(Chart(panels))["layout"]
    assert (layout["xaxis"]["title"]["text"], layout["xaxis2"]["title"]["text"]) == ("left", "right")
    assert (layout["xaxis2"]["anchor"], layout["yaxis2"]["anchor"], layout["yaxis2"]["scaleanchor"]) == (
        "y2",
        "x2",
        "x2",
    )


def test_a_point_is_described_in_its_own_words_or_in_those_of_all() -> None:
    from_list = to_plotly(Chart([Panel([Series([1], [1], dots=Dots(), hover=["first"])])]))["data"][0]
    assert (from_list["text"], from_list["hovertemplate"]) == (["first"], "%{text}<extra></extra>")
    assert to_plotly(Chart([Panel([COURSE])]))["data"][0]["hovertemplate"] == "%{y}<extra></extra>"


def test_moments_are_written_with_the_offset_of_the_plant() -> None:
    at = datetime(2026, 11, 22, 9, 30, tzinfo=UTC)
    figure = to_plotly(Chart([Panel([Series([at], [1.0], dots=Dots()), Rule(Pen("ink"), x=at)])], time_axis([at])))
    assert figure["data"][0]["x"] == [figure["layout"]["shapes"][0]["x0"]] == [at.isoformat()]
    assert figure["layout"]["xaxis"]["type"] == "date"


def test_an_empty_chart_says_why_and_has_axes_only_where_it_shows_them() -> None:
    assert to_plotly(nothing("No readings yet"))["data"] == []
    assert "No readings yet" in to_plotly(nothing("No readings yet"))["layout"]["annotations"][0]["text"]
    assert len(to_plotly(Chart([Panel([])]))["data"]) == 1
