"""Charts on paper: what the legend shows is what is drawn."""

from app.charts import Axis, Chart, Dots, Panel, Pen, Series, to_drawing
from app.charts.marks import Area
from app.charts.scales import Scale


def test_a_hollow_marker_is_seen_in_the_legend() -> None:
    dots = Dots("square", 9, "surface", "mended", 2)
    chart = Chart([Panel([Series([0, 90], [1, 2], Pen("mended"), dots, name="optimised")])])
    squares = [
        mark
        for group in to_drawing(chart, 400, 200).groups
        for mark in group.marks
        if isinstance(mark, Area) and mark.fill == "#ffffff" and len(mark.places) == 4
    ]
    edges = [(mark.edge, mark.width) for mark in squares if mark.edge is not None]
    assert edges == [("#1a7a3c", 2)] * 3  # two in the chart, one in its legend


def test_ticks_say_what_they_say_on_the_page() -> None:
    def said(axis: Axis, low: float, high: float) -> list[str]:
        return [text for _at, text in Scale(axis, low, high, 0, 400).ticks()]

    assert said(Axis(at=[-90.0, 0.0, 22.5]), -100, 100) == ["−90", "0", "22.5"]
    assert said(Axis(format="+.3~g", every=10), -10, 10) == ["−10", "+0", "+10"]
    assert said(Axis(every=10), -10, 10) == ["−10", "0", "10"]
