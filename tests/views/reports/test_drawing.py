"""Figures of the pages on paper: what the legend shows is what is drawn."""

from app.files.documents.drawing.axes import Axis
from app.files.documents.drawing.marks import Area
from app.files.documents.drawing.plot import drawing_of


def test_a_hollow_marker_is_seen_in_the_legend() -> None:
    marker = {"symbol": "square", "size": 9, "color": "#ffffff", "line": {"color": "#1a7a3c", "width": 2}}
    trace = {
        "type": "scatter",
        "mode": "lines+markers",
        "name": "optimised",
        "x": [0, 90],
        "y": [1, 2],
        "marker": marker,
    }
    drawn = drawing_of({"data": [trace], "layout": {"showlegend": True}}, 400, 200)
    squares = [
        mark
        for group in drawn.groups
        for mark in group.marks
        if isinstance(mark, Area) and mark.fill == "#ffffff" and len(mark.places) == 4
    ]
    edges = [(mark.edge, mark.width) for mark in squares if mark.edge is not None]
    assert edges == [("#1a7a3c", 2)] * 3  # two in the chart, one in its legend


def test_ticks_say_what_they_say_on_the_page() -> None:
    angles = {"tickvals": [-90.0, 0.0, 22.5], "range": [-100, 100]}
    assert [text for _at, text in Axis(-100, 100, 0, 400, angles).ticks()] == ["−90", "0", "22.5"]
    assert [text for _at, text in Axis(-10, 10, 0, 400, {"tickformat": "+.3~g", "dtick": 10}).ticks()] == [
        "−10",
        "+0",
        "+10",
    ]
    of_many_angles = Axis(-10, 10, 0, 400, {"tickvals": None, "dtick": 10})
    assert [text for _at, text in of_many_angles.ticks()] == ["−10", "0", "10"]
