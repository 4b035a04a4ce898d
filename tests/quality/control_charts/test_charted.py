"""Points are what they are, however they are asked for; and a chart of very many points shows every extreme."""

from collections.abc import Iterator
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy.orm import Session

from app.charts import to_plotly
from app.core.spc.quantity import Quantity
from app.core.spc.rules import RULES, RuleName, signals
from app.core.spc.shewhart import Chart
from app.loop.characteristics.queries import CurrentCharacteristic, characteristic_named
from app.loop.summaries.queries import Window
from app.quality.baselines.queries import Charted, baseline_in_force, charted
from app.quality.baselines.tables import Baseline
from app.quality.control_charts import charts, figures
from app.quality.control_charts.downsampling import MOST_POINTS, STRETCHES, thinned
from app.quality.control_charts.view import View
from tests.chance import examples
from tests.quality.baselines.rows import frozen
from tests.shop import Shop

BASELINES: list[dict[str, Any]] = [
    {"quantity": "deviation"},
    {"quantity": "without_corrections"},
    {"quantity": "differences"},
    {"quantity": "wear_residuals", "settle": 20},
    {"chart": "xbar_r", "grouping": "consecutive", "group_size": 3},
    {"chart": "xbar_s", "grouping": "pause", "group_pause": 10},
    {"chart": "xbar_r", "grouping": "part", "quantity": "wear_residuals"},
]
NAMES = [" ".join(map(str, each.values())) for each in BASELINES]


@pytest.fixture(scope="module")
def history(common_shop: Shop) -> Shop:
    """400 readings of a loop, in parts of one to three and with pauses, a tool change after 250, some excluded."""
    rng = Random(4)
    values = [rng.gauss(0, 2) + 0.02 * (n % 250) for n in range(400)]
    parts, moments, part = [], [], 0
    for n in range(400):
        part += rng.random() < 0.4
        parts.append(f"SN-{part}")
        moments.append(f"2026-11-{1 + part // 60:02d}T{part % 60 // 3:02d}:{part % 3 * 20:02d}:{n % 60:02d}Z")
    for low, high in ((0, 250), (250, 400)):
        common_shop.push(values[low:high], part=parts[low:high], measured_at=moments[low:high])
        if high == 250:
            common_shop.call("POST", f"/machines/{common_shop.machine}/tools/3/change", offset=0.0, reason="Worn")
    for sequence in (3, 130, 131, 132, 290, 399):
        common_shop.call("POST", f"/readings/{common_shop.characteristic}/{sequence}/exclude", reason="False trigger")
    return common_shop


class By(NamedTuple):
    """A baseline in force, and all that it charts."""

    session: Session
    current: CurrentCharacteristic
    baseline: Baseline
    points: Charted
    views: dict[Chart, View]


FEW = examples(10)  # of each baseline, and each reads the database


@pytest.fixture(params=BASELINES, ids=NAMES, scope="module")
def by(request: pytest.FixtureRequest, history: Shop) -> Iterator[By]:
    body = {"quantity": "deviation"} | request.param
    frozen(history, 11, 200, excluded=[{"first": 60, "last": 64, "reason": "Chip"}], **body)
    with history.server.database.begin() as session:
        current = characteristic_named(session, history.characteristic)
        baseline = baseline_in_force(session, current.characteristic)
        assert baseline is not None
        kinds = charts.kinds(baseline)
        views = {kind: charts.view(session, current, baseline, Window(11, 400, 400), kind) for kind in kinds}
        yield By(session, current, baseline, charted(session, current, baseline, Window(1, 400, 400)), views)


@FEW
@given(cuts=st.lists(st.integers(1, 400), max_size=6))
def test_streaming_equals_batch(by: By, cuts: list[int]) -> None:
    session, current, baseline, whole, _views = by
    assert whole.chart is not None
    pointed, pieces = 0, []
    for high in sorted({*cuts, 400}):
        piece = charted(session, current, baseline, Window(pointed + 1, high, high))
        if piece.chart is not None:
            pieces.append(piece)
            pointed = int(piece.last[-1])
    assert np.concatenate([each.last for each in pieces]).tolist() == whole.last.tolist()
    assert np.concatenate([each.sizes for each in pieces]).tolist() == whole.sizes.tolist()
    z = np.concatenate([each.chart.z for each in pieces if each.chart is not None])
    assert z == pytest.approx(whole.chart.z, abs=1e-9)


@FEW
@given(first=st.integers(1, 400), last=st.integers(1, 400))
def test_every_chart_is_the_same_through_any_window(by: By, first: int, last: int) -> None:
    session, current, baseline, _points, views = by
    first, last = sorted((first, last))
    for kind, whole in views.items():
        part = charts.view(session, current, baseline, Window(max(first, 11), last, 400), kind)
        inside = (whole.last >= max(first, 11)) & (whole.last <= last)
        assert part.last.tolist() == whole.last[inside].tolist(), kind
        assert part.points == pytest.approx(whole.points[inside], abs=1e-12), kind
        for limit in ("lower", "upper"):
            mine, other = getattr(part, limit), getattr(whole, limit)
            if mine is not None and len(part):
                wanted = np.broadcast_to(other, len(whole))[inside]
                assert np.broadcast_to(mine, len(part)) == pytest.approx(wanted, abs=1e-12), kind


def test_what_is_excluded_is_no_point_and_a_tool_begins_again(history: Shop) -> None:
    frozen(history, 11, 200, excluded=[{"first": 60, "last": 64, "reason": "Chip"}], quantity="without_corrections")
    with history.server.database.begin() as session:
        current = characteristic_named(session, history.characteristic)
        baseline = baseline_in_force(session, current.characteristic)
        assert baseline is not None
        points = charted(session, current, baseline, Window(1, 400, 400))
        ranges = charts.view(session, current, baseline, Window(1, 400, 400), Chart.MOVING_RANGE)
    gone = {3, 130, 131, 132, 290, 399, *range(60, 65)}
    assert points.last.tolist() == [n for n in range(1, 401) if n not in gone]
    assert points.last[points.begins].tolist() == [1, 251]
    assert 251 not in ranges.last.tolist()
    assert 133 in ranges.last.tolist(), "the range bridges what was excluded"


# --- drawing


def seen(values: list[float] | np.ndarray[Any, Any], *, upper: float = 3.0) -> View:
    points = np.asarray(values, np.float64)
    count = len(points)
    numbers = np.arange(1, count + 1)
    found = signals(points, [RULES[RuleName.NELSON_1], RULES[RuleName.NELSON_2]])
    return View(
        Chart.INDIVIDUALS,
        Quantity.DEVIATION,
        numbers,
        numbers,
        np.ones(count, np.int64),
        points / 1000,
        np.zeros(count, np.bool_),
        centre=0.0,
        lower=-upper / 1000,
        upper=upper / 1000,
        signals=found,
    )


def control_figure(view: View, **more: Any) -> dict[str, Any]:
    return to_plotly(figures.control_figure(view, **more))


def traces(figure: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {trace["meta"]: trace for trace in figure["data"]}


def test_of_a_million_points_every_extreme_and_every_stretch_with_a_signal_is_drawn() -> None:
    values = np.random.default_rng(1).normal(0, 0.5, 1_000_000)
    outliers = {17: 9.0, 400_000: -8.0, 999_999: 7.0}
    for at, value in outliers.items():
        values[at] = value
    drawn = traces(control_figure(seen(values), key="shaft"))
    assert len(drawn["points"]["x"]) <= 2 * MOST_POINTS
    assert {at + 1 for at in outliers} <= set(drawn["signals"]["x"])
    assert {9.0, -8.0, 7.0} <= set(drawn["points"]["y"])


@given(seed=st.integers(0, 10**6), more=st.integers(1, 5_000), place=st.floats(0, 1))
def test_thinning_keeps_the_ends_and_the_extremes(seed: int, more: int, place: float) -> None:
    values = np.random.default_rng(seed).normal(size=MOST_POINTS + more)
    wanted = np.zeros(len(values), np.bool_)
    only = int(place * (len(values) - 1))
    wanted[only] = True
    kept = thinned(values, wanted)
    assert {0, len(values) - 1, only, values.argmin(), values.argmax()} <= set(kept.tolist())
    assert len(kept) <= 2 * MOST_POINTS


@given(seed=st.integers(0, 10**6), more=st.integers(1, 3_000), decimals=st.integers(0, 3))
def test_thinning_keeps_the_extremes_of_every_stretch_and_of_its_signals(seed: int, more: int, decimals: int) -> None:
    made = np.random.default_rng(seed)
    values = made.normal(size=MOST_POINTS + more).round(decimals)
    wanted = made.random(len(values)) < 0.1
    stretch = np.arange(len(values)) * STRETCHES // len(values)
    kept = np.zeros(len(values), np.bool_)
    kept[thinned(values, wanted)] = True
    for number in range(0, STRETCHES, 50):
        for some in (stretch == number, (stretch == number) & wanted):
            inside = values[some]
            assert len(inside) == 0 or {inside.min(), inside.max()} <= set(values[some & kept].tolist())
    assert kept.sum() <= 2 * MOST_POINTS


def test_signals_differ_by_shape_and_colour_and_limits_are_named() -> None:
    figure = control_figure(seen([0.0, 4.0, 0.0, -4.0, 0.0]), key="shaft")
    drawn = traces(figure)
    assert drawn["signals"]["marker"]["symbol"] == ["triangle-up", "triangle-down"]
    assert drawn["signals"]["marker"]["color"] != drawn["points"]["marker"]["color"]
    assert drawn["points"]["customdata"][1] == "/characteristics/shaft/readings/2"
    assert [each["text"] for each in figure["layout"]["annotations"]] == ["centre +0.00", "lower −3.00", "upper +3.00"]
    narrow = control_figure(seen([0.0, 4.0]), key="shaft", width=360)
    assert narrow["layout"]["annotations"] == []


def test_where_one_picks_a_point_says_its_number_and_dragging_selects() -> None:
    figure = control_figure(seen([0.0, 4.0]), key="shaft", picks=True)
    assert traces(figure)["points"]["customdata"] == [1, 2]
    assert (figure["layout"]["dragmode"], figure["layout"]["selectdirection"]) == ("select", "h")


def test_a_broken_insert_does_not_press_the_limits_into_a_line() -> None:
    values = [*([0.5, -0.5] * 20), 400.0, *([0.5, -0.5] * 20), -300.0]
    figure = control_figure(seen(values), key="shaft")
    low, high = figure["layout"]["yaxis"]["range"]
    assert -8 < low < -3 < 3 < high < 8
    beyond = traces(figure)["beyond"]
    assert (beyond["x"], beyond["hovertext"]) == ([41, 82], ["Reading 41<br>+400 µm", "Reading 82<br>−300 µm"])
    assert [label.strip() for label in beyond["text"]] == ["+400 µm", "−300 µm"]
    assert beyond["marker"]["symbol"] == ["triangle-up-open", "triangle-down-open"]
    assert all(low < y < high for y in beyond["y"])
    assert beyond["customdata"][0] == "/characteristics/shaft/readings/41"
    assert {400.0, -300.0} <= set(traces(figure)["points"]["y"]), "a wider axis shows them where they are"
    assert "beyond" not in traces(control_figure(seen([0.5, -0.5] * 20), key="shaft"))


def test_an_insert_that_broke_for_three_parts_twice_in_two_hundred_presses_nothing_either() -> None:
    values = [*([0.5, -0.5] * 48), 410.0, 405.0, 400.0, *([0.5, -0.5] * 48), 410.0, 405.0, 400.0]
    low, high = control_figure(seen(values), key="shaft")["layout"]["yaxis"]["range"]
    assert high - low < 20


def test_of_points_beyond_that_are_neighbours_the_farthest_is_labelled() -> None:
    values = [*([0.5, -0.5] * 50), 390.0, 400.0, 395.0, -380.0, *([0.5, -0.5] * 50)]
    beyond = traces(control_figure(seen(values), key="shaft"))["beyond"]
    assert [label.strip() for label in beyond["text"]] == ["", "", "+400 µm", "−380 µm"]


def test_a_point_beyond_the_other_edge_between_two_neighbours_keeps_them_one_label() -> None:
    values = [0.5, -0.5] * 50
    values[80:85] = [-400, 0.5, 390, 0.5, -380]
    beyond = traces(control_figure(seen(values), key="shaft", width=400))["beyond"]
    assert [label.strip() for label in beyond["text"]] == ["−400 µm", "+390 µm", ""]


def test_a_label_behind_its_point_does_not_meet_the_one_before_late_points() -> None:
    """The one that is farthest out has the room between them."""
    values = [0.5, -0.5] * 50
    for at, value in ((35, -400), (53, -380), (65, -370), (95, -390)):
        values[at] = value
    beyond = traces(control_figure(seen(values), key="shaft", width=620, inner=326))["beyond"]
    assert [label.strip() for label in beyond["text"]] == ["", "", "−400 µm", ""]
    assert beyond["textposition"][2] == "middle right"


def test_labels_beyond_do_not_meet_in_a_narrow_chart() -> None:
    values = [0.5, -0.5] * 50
    values[20], values[32] = -400, -380
    labelled = {
        width: [
            label.strip() for label in traces(control_figure(seen(values), key="shaft", width=width))["beyond"]["text"]
        ]
        for width in (1240, 620)
    }
    assert labelled == {1240: ["−400 µm", "−380 µm"], 620: ["", "−400 µm"]}


def test_the_label_of_a_point_beyond_the_axis_stays_inside_the_chart() -> None:
    beyond = traces(control_figure(seen([*([0.5, -0.5] * 100), 390.0, 400.0, 395.0]), key="shaft"))["beyond"]
    assert [label.strip() for label in beyond["text"]] == ["+400 µm", "", ""], "before the first of them"
    assert beyond["textposition"][0] == "middle left"


def test_limits_that_lie_close_together_are_named_in_one_line() -> None:
    figure = control_figure(seen(np.linspace(-90.0, 90.0, 50)), key="shaft")
    assert [each["text"] for each in figure["layout"]["annotations"]] == ["−3.0 to +3.0"]
