"""Charts on paper: what is described is drawn, and the legend shows it."""

from app.charts import PALETTES, Axis, Chart, Dots, Labels, Note, Panel, Pen, Rule, Series, Share, Spread, to_drawing
from app.charts.marks import Area, Dot, Line, Words
from app.charts.scales import Scale


def test_a_hollow_marker_is_seen_in_the_legend() -> None:
    dots = Dots("square", 9, "surface", "corrected", 2)
    chart = Chart([Panel([Series([0, 90], [1, 2], Pen("corrected"), dots, name="optimised")])])
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


def test_a_chart_in_two_panels_is_drawn_with_its_words_and_spreads() -> None:
    upper = Series([1, 2], [4.0, 6.0], dots=Dots(), labels=Labels(["four", ""]), spread=Spread([1.0, 2.0]))
    chart = Chart(
        [
            Panel([upper, Rule(Pen("ink"), 5.0, words="limit")], share=(0.5, 1)),
            Panel([Series([1, 2], [0, 1], Pen("wear"))]),
        ],
        Axis("Reading"),
    )
    drawing = to_drawing(chart, 400, 300)
    marks = [mark for group in drawing.groups for mark in group.marks]
    assert {"four", "limit", "Reading"} <= {mark.text for mark in marks if isinstance(mark, Words)}
    (limit,) = [mark for mark in marks if isinstance(mark, Line) and mark.colour == PALETTES["light"]["ink"]]
    dots = sorted(mark.at[1] for mark in marks if isinstance(mark, Dot))
    assert dots[0] < limit.places[0][1] < dots[1], "6 lies above the rule at 5, and 4 below it"
    upright = [m for m in marks if isinstance(m, Line) and m.width == 1.2 and m.places[0][0] == m.places[1][0]]
    assert len(upright) == 2


def test_words_that_are_details_are_given_up_where_they_would_lie_over_others() -> None:
    notes = [
        Note("R34", Share(1), 2.0),
        Note("corrected in full", Share(1), 1.5, detail=True),
        Note("R33", Share(1), 1.0),
    ]
    chart = Chart([Panel([Series([1, 2], [0.0, 3.0], Pen("ink")), *notes])])

    def said(height: int) -> set[str]:
        return {
            mark.text
            for group in to_drawing(chart, 400, height).groups
            for mark in group.marks
            if isinstance(mark, Words)
        }

    assert {"R34", "corrected in full", "R33"} <= said(400)
    assert {"R34", "R33"} <= said(120)
    assert "corrected in full" not in said(120)
