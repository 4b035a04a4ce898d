"""Values of the wear chart."""

from typing import Any

import numpy as np
import pytest

from app.charts import to_plotly
from app.core.forecast import forecast
from app.core.wear import Fit, Towards, fit
from app.quality.wear.figures import Life, WearChart
from app.quality.wear.figures import wear_figure as chart_of

HALF = 0.008


def line(count: int = 60, slope: float = 0.0002) -> tuple[Life, Fit]:
    """A life that wears by 0.2 µm per part, corrected every ten parts."""
    worn = [slope * n + 0.0003 * (-1) ** n for n in range(count)]
    taken = [slope * (n // 10) * 10 for n in range(count)]
    found = fit(np.arange(1, count + 1), np.array(worn))
    assert found is not None
    return Life(list(range(1, count + 1)), worn, taken, [1] * count), found


def chart(**changes: Any) -> WearChart:
    life, found = line()
    limits = {Towards.WEAR: 0.3, Towards.TOLERANCE: 0.010 + HALF}
    given: dict[str, Any] = {
        "key": "shaft-d40",
        "now": life,
        "lives": [],
        "fit": found,
        "forecasts": {name: forecast(found, limit) for name, limit in limits.items()},
        "limits": limits,
        "half": HALF,
        "removed": 0.010,
        "corrects": True,
    }
    return WearChart(**(given | changes))


def wear_figure(given: WearChart, theme: Any = "light", width: int = 1240) -> dict[str, Any]:
    return to_plotly(chart_of(given, width=width), theme)


def traces(figure: dict[str, Any], meta: str) -> list[dict[str, Any]]:
    return [trace for trace in figure["data"] if trace["meta"] == meta]


def test_dots_steps_and_band_tell_deviation_and_tolerance() -> None:
    figure = wear_figure(chart())
    (worn,), (taken,) = traces(figure, "wear"), traces(figure, "taken")
    low, high = traces(figure, "tolerance")
    assert worn["y"][20] - taken["y"][20] == pytest.approx(0.3)  # µm: the deviation
    assert high["y"][20] - taken["y"][20] == pytest.approx(8)
    assert taken["y"][20] - low["y"][20] == pytest.approx(8)
    assert worn["customdata"][20] == "/characteristics/shaft-d40/readings/21"


def test_the_forecast_goes_on_from_the_line_and_reaches_the_tolerance_where_it_says() -> None:
    made = chart()
    figure = wear_figure(made)
    past, coming = traces(figure, "line")
    assert past["x"] == [1, 60]
    assert coming["x"][0] == 60
    assert coming["y"][0] == past["y"][1]
    parts = made.forecasts[Towards.TOLERANCE].parts
    assert coming["x"][1] >= 60 + parts
    slope = (coming["y"][1] - coming["y"][0]) / (coming["x"][1] - coming["x"][0])
    assert coming["y"][0] + slope * parts == pytest.approx(18, abs=0.01)
    low, high = traces(figure, "forecast")
    assert all(below < above for below, above in zip(low["y"], high["y"], strict=True))


def test_a_limit_far_away_does_not_squash_the_curve_and_a_near_one_is_drawn() -> None:
    far = wear_figure(chart())["layout"]
    assert far["yaxis"]["range"][1] < 40
    assert far["shapes"] == []
    _life, found = line()
    limits = {Towards.WEAR: 0.014}
    near = wear_figure(chart(limits=limits, forecasts={Towards.WEAR: forecast(found, 0.014)}))["layout"]
    assert [shape["y0"] for shape in near["shapes"]] == [pytest.approx(14)]
    assert "R37" in near["annotations"][0]["text"]


def test_a_broken_edge_is_drawn_on_the_rim_with_its_true_value_in_words() -> None:
    life, found = line()
    broken = Life([*life.sequence, 61], [*life.worn, 0.412], [*life.removed, life.removed[-1]], [1] * 61)
    (worn,) = traces(wear_figure(chart(now=broken)), "wear")
    assert worn["y"][-1] < 40
    assert worn["marker"]["symbol"][-1] == "triangle-up"
    assert "+412.0" in worn["text"][-1]
    assert found.last == 60


def test_edges_before_are_distinguished_by_a_line_and_a_word() -> None:
    life, _found = line()
    before = Life([-2, -1, 0], [0.001, 0.001, 0.001], [0, 0, 0], [1, 16, 16])
    figure = wear_figure(chart(lives=[before]))
    assert [trace["x"][0] for trace in traces(figure, "wear")] == [-2, 1]
    assert figure["layout"]["shapes"][0]["x0"] == 0.5
    assert "Tool changed" in str(figure["layout"]["annotations"])
    assert "16 readings" in traces(figure, "wear")[0]["text"][1]
    assert life.sequence[0] == 1


def test_a_tool_change_near_the_right_end_is_labelled_clear_of_the_forecast() -> None:
    young, found = line(12)
    old = Life(list(range(-400, 1)), [0.001] * 401, [0.0] * 401, [1] * 401)
    notes = wear_figure(chart(now=young, lives=[old], fit=found, forecasts={}))["layout"]["annotations"]
    (changed,) = [note for note in notes if note["text"] == "Tool changed"]
    assert changed["xanchor"] == "right"
    assert changed["xshift"] < 0


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1240])
def test_too_few_readings_and_none_at_all(theme: Any, width: int) -> None:
    few = Life([1, 2], [0.001, 0.002], [0, 0], [1, 1])
    nothing: dict[str, Any] = {"fit": None, "forecasts": {}}
    figure = wear_figure(chart(now=few, **nothing), theme=theme, width=width)
    assert traces(figure, "line") == traces(figure, "forecast") == []
    none = wear_figure(chart(now=Life([], [], [], []), **nothing), theme=theme, width=width)
    assert "No readings" in none["layout"]["annotations"][0]["text"]
