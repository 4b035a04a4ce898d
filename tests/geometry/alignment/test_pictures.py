"""The picture of a part: it holds its touches, shows what moved as large as can be seen, and marks what does not fit."""

import json
from typing import Any

import numpy as np
import pytest

from app.charts import to_plotly
from app.core.geometry.frames import frame, from_angles
from app.geometry.alignment import figures, wording
from app.geometry.alignment.figures import MOST, DrawnPoint, enlargement

OUTWARD = [
    DrawnPoint([10.0, 10.0, 0.0], [0.0, 0.0, 1.0], 0.02),
    DrawnPoint([180.0, 15.0, 0.0], [0.0, 0.0, 1.0], 0.05),
    DrawnPoint([90.0, 120.0, 0.0], [0.0, 0.0, 1.0], 0.03),
    DrawnPoint([20.0, 0.0, -15.0], [0.0, -1.0, 0.0], 0.1),
    DrawnPoint([170.0, 0.0, -15.0], [0.0, -1.0, 0.0], -0.2, misfit=True),
    DrawnPoint([0.0, 60.0, -15.0], [-1.0, 0.0, 0.0], 0.05),
]
INWARD = [each._replace(normal=[-n for n in each.normal]) for each in OUTWARD]
MOVED = frame(from_angles(0.0, 0.0, 0.1), [0.05, -0.1, 0.02])


def test_a_touch_more_is_advised_only_where_it_helps() -> None:
    near = {"place": [0.0, 0.0, 0.0], "normal": [0.0, -1.0, 0.0]}
    assert "2.1 times as certain" in wording.advice(near | {"gain": 2.1})
    assert "No single additional point" in wording.advice(near | {"gain": 1.01})


def part_figure(motion: Any, touches: list[DrawnPoint], theme: Any = "light") -> dict[str, Any]:
    return to_plotly(figures.part_figure(motion, touches), theme)


def spans(figure: dict[str, Any], name: str) -> tuple[float, float, float, float]:
    xs, ys = (
        [
            each
            for trace in figure["data"]
            if str(trace.get("name", "")).startswith(name)
            for each in trace[axis]
            if each is not None
        ]
        for axis in ("x", "y")
    )
    return min(xs), max(xs), min(ys), max(ys)


@pytest.mark.parametrize("touches", [OUTWARD, INWARD])
def test_the_part_holds_its_touches_whichever_way_normals_point(touches: list[DrawnPoint]) -> None:
    figure = part_figure(MOVED, touches)
    left, right, low, high = spans(figure, "Nominal position")
    for name in ("Probed points", "Does not fit"):
        a, b, c, d = spans(figure, name)
        room = 0.15 * (right - left)
        assert left - room < a <= b < right + room
        assert low - room < c <= d < high + room


def test_what_does_not_fit_is_marked_by_shape_and_name() -> None:
    (trace,) = [each for each in part_figure(MOVED, OUTWARD)["data"] if each.get("name") == "Does not fit"]
    assert trace["marker"]["symbol"] == "x"
    assert trace["text"] == ["point 5: −200.0 µm along its face's normal"]


def test_displacements_are_enlarged_as_the_legend_says() -> None:
    names = [str(each.get("name")) for each in part_figure(MOVED, OUTWARD)["data"]]
    assert "Measured position, 50 ×" in names  # 0.4 mm at the far corner of 180, drawn 9 % of it at the most
    assert (enlargement(1e9), enlargement(1.5), enlargement(2.0)) == (MOST, 1, 2)


@pytest.mark.parametrize(
    "touches",
    [
        [DrawnPoint([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 0.0)],
        [DrawnPoint([5.0, 5.0, 5.0], [0.0, 0.0, 1.0], 0.1)] * 3,
        [DrawnPoint([0.0, 0.0, 5.0], [1.0, 0.0, 0.0], -5e4), DrawnPoint([0.0, 10.0, 5.0], [0.0, 0.6, 0.8], 1e5)],
    ],
)
def test_odd_touches_are_drawn_in_plain_numbers(touches: list[DrawnPoint]) -> None:
    json.dumps(part_figure(np.eye(4), touches, theme="dark"), allow_nan=False)
    two = [[0.0, 0.0], [100.0, 0.0]]
    json.dumps(to_plotly(figures.plane_figure(np.eye(4), two, two)), allow_nan=False)
