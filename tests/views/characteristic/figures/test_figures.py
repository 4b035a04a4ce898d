import itertools
import json
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.charts import to_plotly
from app.core.decision.limits import Limits, classify
from app.loop.timeline.figures import Event
from app.views.characteristic import figures
from app.views.characteristic.figures import (
    Block,
    Point,
    SizeAxis,
    Step,
    TrueScale,
    ZoneScale,
    bands,
    histogram_counts,
    histogram_edges,
)
from app.views.characteristic.glance import band_picture, sparkline

SHAFT = SimpleNamespace(
    zero_range=0.001, averaging_limit=0.0053, tolerance_width=0.016, wear_limit=0.3, confidence_limit=1.0
)
# The bore of the line without an operator: no zero range, the tolerance is the averaging limit.
BORE = SimpleNamespace(zero_range=0, averaging_limit=0.02, tolerance_width=0.04, wear_limit=0.3, confidence_limit=0.3)

limits = st.lists(st.integers(1, 3_000_000), min_size=5, max_size=5).map(sorted).map(
    lambda nm: SimpleNamespace(
        zero_range=nm[0] / 1e6, averaging_limit=nm[1] / 1e6, tolerance_width=2 * nm[2] / 1e6,
        wear_limit=nm[3] / 1e6, confidence_limit=nm[4] / 1e6,
    )
)  # fmt: skip
deviations = st.floats(-10, 10, allow_nan=False)


def zone_chart(*what: Any, theme: Any = "light", **more: Any) -> dict[str, Any]:
    return to_plotly(figures.zone_chart(*what, **more), theme)


def histogram_figure(*what: Any, **more: Any) -> dict[str, Any]:
    return to_plotly(figures.histogram_figure(*what, **more))


def traces(figure: dict[str, Any], meta: str) -> list[dict[str, Any]]:
    return [trace for trace in figure["data"] if trace.get("meta") == meta]


def texts(figure: dict[str, Any]) -> str:
    return "\n".join(note["text"] for note in figure["layout"]["annotations"]).replace("\xa0", " ")


def point(sequence: int, deviation: float, **more: Any) -> Point:
    return Point(sequence, deviation, classify(deviation, Limits.of(SHAFT)), **more)


class TestZoneScale:
    @given(limits, deviations, deviations)
    def test_never_falls(self, some: Any, one: float, other: float) -> None:
        scale = ZoneScale.of(some)
        low, high = sorted((one, other))
        assert scale.position(low) <= scale.position(high)

    @given(limits, deviations)
    def test_is_symmetric_and_stays_on_the_chart(self, some: Any, deviation: float) -> None:
        scale = ZoneScale.of(some)
        assert scale.position(-deviation) == -scale.position(deviation)
        assert abs(scale.position(deviation)) < scale.extent

    @given(limits, deviations)
    def test_can_be_undone(self, some: Any, deviation: float) -> None:
        scale = ZoneScale.of(some)
        assert scale.deviation(scale.position(deviation)) == pytest.approx(deviation, rel=1e-6, abs=1e-9)

    def test_every_band_is_equally_tall(self) -> None:
        scale = ZoneScale.of(SHAFT)
        assert [scale.position(limit) for limit in (0, 0.001, 0.0053, 0.008, 0.3, 1.0)] == [0, 1, 2, 3, 4, 5]
        assert scale.extent == 6

    def test_a_band_without_width_is_left_out_and_its_limit_named_with_the_next(self) -> None:
        assert [band.name for band in bands(BORE)] == ["average", "out_of_tolerance", "probe_fault"]
        assert [band.limits for band in bands(BORE)] == [("R33",), ("R34", "R35/2"), ("R37", "R36")]
        assert ZoneScale.of(BORE).position(0.02) == 1


class TestTrueScale:
    def test_reaches_a_little_beyond_the_tolerance(self) -> None:
        assert TrueScale.of(SHAFT).extent == pytest.approx(1.35 * 8)

    def test_makes_room_for_a_reading_not_far_out_but_not_for_a_probe_fault(self) -> None:
        assert TrueScale.of(SHAFT, [0.014, 1.7]).extent == pytest.approx(1.1 * 14)

    def test_draws_what_lies_further_out_at_its_edge(self) -> None:
        scale = TrueScale.of(SHAFT)
        assert scale.position(-1.7) == -scale.extent
        assert not scale.fits(-1.7)


@pytest.mark.parametrize("scale", ["zones", "true"])
class TestZoneChart:
    def test_every_reading_is_on_it(self, scale: Any) -> None:
        values = [0.0, 0.003, -0.006, 0.011, -0.009, 0.4, -1.7]
        figure = zone_chart([point(n, d, link=f"/r/{n}") for n, d in enumerate(values, 1)], SHAFT, scale=scale)
        (readings,) = traces(figure, "readings")
        assert readings["x"] == [1, 2, 3, 4, 5, 6, 7]
        assert readings["customdata"] == [f"/r/{n}" for n in range(1, 8)]
        assert readings["marker"]["symbol"] == [
            "circle", "diamond", "square", "triangle-up", "triangle-down", "hexagon2", "x",
        ]  # fmt: skip
        low, high = figure["layout"]["yaxis"]["range"]
        assert all(low <= y <= high for y in readings["y"])
        assert [y > 0 for y in readings["y"]] == [d > 0 for d in values]

    def test_an_excluded_reading_is_hollow(self, scale: Any) -> None:
        (readings,) = traces(zone_chart([point(1, 0.003, excluded=True)], SHAFT, scale=scale), "readings")
        assert readings["marker"]["symbol"] == ["diamond-open"]

    def test_the_extremes_of_thinned_readings_are_on_it(self, scale: Any) -> None:
        blocks = [Block(1, 4096, -0.0004, 0.0031, 0.001), Block(4097, 8192, -0.5, 1.2, 0.002)]
        figure = zone_chart([], SHAFT, blocks=blocks, scale=scale)
        ruler = ZoneScale.of(SHAFT) if scale == "zones" else TrueScale.of(SHAFT, [0.0031])
        assert traces(figure, "minimum")[0]["y"] == [ruler.position(-0.0004), ruler.position(-0.5)]
        assert traces(figure, "maximum")[0]["y"] == [ruler.position(0.0031), ruler.position(1.2)]
        assert traces(figure, "extremes")[0]["marker"]["symbol"] == ["hexagon2", "x"]

    def test_a_block_of_nothing_but_probe_faults_has_extremes_and_no_mean(self, scale: Any) -> None:
        blocks = [Block(1, 32, -0.0004, 0.0031, 0.001), Block(33, 64, 1.1, 1.2, None, left_out=32)]
        (mean,) = traces(zone_chart([], SHAFT, blocks=blocks, scale=scale), "mean")
        assert [y is None for y in mean["y"]] == [False, True]
        assert "mean" not in mean["text"][1]
        assert "without 32 that are probe faults or excluded" in mean["text"][1]

    def test_the_average_has_a_gap_where_there_is_no_memory(self, scale: Any) -> None:
        points = [point(1, 0.003, average=0.001), point(2, 0.003), point(3, 0.003, average=0.0)]
        (average,) = traces(zone_chart(points, SHAFT, scale=scale), "average")
        assert average["y"][1] is None
        assert average["y"][2] == 0

    def test_corrections_sum_up_and_start_again_with_a_new_tool(self, scale: Any) -> None:
        steps = [Step(2, 1, -0.006, "applied"), Step(3, 2, -0.4, "held"), Step(5, 3, 0.002, "pending")]
        events = [Event(4, "tool_change", "Tool T3 changed")]
        points = [point(n, 0.0) for n in range(1, 6)]
        figure = zone_chart(points, SHAFT, steps=steps, events=events, scale=scale, total_before=-0.001)
        (offset,) = traces(figure, "offset")
        assert offset["y"] == [-1, -7, -7, 0, 2, 2]
        (corrections,) = traces(figure, "corrections")
        assert corrections["marker"]["symbol"] == ["circle", "hexagon2-open", "circle-open"]

    def test_what_happened_before_the_first_reading_shown_only_counts(self, scale: Any) -> None:
        steps = [Step(2, 1, -0.006, "applied"), Step(101, 2, -0.002, "applied")]
        events = [Event(1, "tool_change", "Tool T3 changed"), Event(3, "oversize", "Oversize")]
        figure = zone_chart([point(100, 0.0), point(102, 0.0)], SHAFT, steps=steps, events=events, scale=scale)
        (offset,) = traces(figure, "offset")
        assert offset["y"] == [-6, -8, -8]
        assert not traces(figure, "events")

    @pytest.mark.parametrize("last", [1, 4, 30, 200])
    def test_a_tool_change_after_the_last_reading_is_on_it(self, last: int, scale: Any) -> None:
        figure = zone_chart(
            [point(n, 0.0) for n in range(1, last + 1)],
            SHAFT,
            events=[Event(last + 1, "tool_change", "T3 changed")],
            scale=scale,
        )
        assert [event["x"] for event in traces(figure, "events")] == [[last + 1]]
        assert figure["layout"]["xaxis"]["range"][1] > last + 1

    def test_alarms_and_tool_changes_are_shapes_with_words(self, scale: Any) -> None:
        happened = [Event(10, "oversize", "Oversize", "/alarms/1"), Event(50, "tool_change", "Tool T3 changed")]
        figure = zone_chart([point(1, 0.0), point(100, 0.0)], SHAFT, events=happened, scale=scale)
        (events,) = traces(figure, "events")
        assert events["marker"]["symbol"] == ["triangle-up", "triangle-down-open"]
        assert "Oversize" in texts(figure)
        assert "Tool T3 changed" in texts(figure)
        assert any(shape["type"] == "line" and shape["x0"] == shape["x1"] == 50 for shape in figure["layout"]["shapes"])

    def test_without_readings_it_says_so(self, scale: Any) -> None:
        assert "No readings yet" in texts(zone_chart([], SHAFT, scale=scale))

    @pytest.mark.parametrize("theme", ["light", "dark"])
    def test_is_plain_json(self, scale: Any, theme: Any) -> None:
        figure = zone_chart([point(1, 0.003)], SHAFT, scale=scale, theme=theme, sizes=SizeAxis(39.992))
        assert json.loads(json.dumps(figure)) == figure


class TestLabels:
    def test_every_limit_and_what_happens_in_every_band_stands_above_and_below(self) -> None:
        words = texts(zone_chart([], SHAFT))
        for limit in ("R33  +1 µm", "R33  −1 µm", "R34  +5.3 µm", "R35/2  −8 µm", "R37  +300 µm", "R36  −1 mm"):
            assert limit in words
        assert words.count("<b>Good</b>, averaging is stored (zero compensation)") == 1
        for both in (
            "averaging and correction",
            "→ Probe fault (safe area)",
            "→ Tool worn (dimensional difference)",
            "wear limit",
            "confidence limit",
        ):
            assert words.count(both) == 2
        assert words.count("corrected in full") == 4
        assert words.count("→ Oversize") == words.count("→ Undersize") == 1

    @pytest.mark.parametrize("scale", ["zones", "true"])
    def test_a_phone_has_names_and_values_and_most_of_its_width_for_the_readings(self, scale: Any) -> None:
        steps = [Step(1, 7, -0.001, "applied")]
        layout = zone_chart([point(1, 0.0)], SHAFT, steps=steps, scale=scale, width=360)["layout"]
        assert layout["margin"]["l"] + layout["margin"]["r"] < 360 / 2
        words = [note["text"] for note in layout["annotations"] if note.get("x") == 1]
        assert "<b>R35/2  +8\u00a0µm</b>" in words
        assert "<b>Σ −1.0\u00a0µm</b>" in words
        assert max(map(len, words)) < len("<b>R35/2 = R37  +8.1234\u00a0µm</b>")

    def test_oversize_is_above(self) -> None:
        notes = {note["text"]: note["y"] for note in zone_chart([], SHAFT)["layout"]["annotations"]}
        assert next(y for text, y in notes.items() if "→ Oversize" in text) == 3.5
        assert next(y for text, y in notes.items() if "→ Undersize" in text) == -3.5

    def test_the_left_axis_has_the_sizes(self) -> None:
        axis = zone_chart([], SHAFT, sizes=SizeAxis(39.992))["layout"]["yaxis"]
        sizes = dict(zip(axis["tickvals"], axis["ticktext"], strict=True))
        assert sizes[0] == "<b>39.9920</b>"
        assert sizes[3] == "<b>40.0000</b>"
        assert sizes[-5] == "38.9920"

    @pytest.mark.parametrize(
        ("averaging_limit", "share"),
        [(0.016 / 3, "⅔"), (0.0053, "66.2 %"), (0.002, "25 %"), (0.008 - 1e-6, "100 %")],
    )
    def test_r34_says_its_true_share_of_the_half_tolerance(self, averaging_limit: float, share: str) -> None:
        some = SimpleNamespace(**vars(SHAFT) | {"averaging_limit": averaging_limit})
        titles = [text for text in texts(zone_chart([], some)).split("\n") if "averaging limit" in text]
        assert all(text.endswith(f"  averaging limit ({share})") for text in titles)
        assert len(titles) == 2

    @pytest.mark.parametrize("scale", ["zones", "true"])
    def test_a_zero_range_of_nothing_is_named_once_on_the_target(self, scale: Any) -> None:
        some = SimpleNamespace(**vars(SHAFT) | {"zero_range": 0.0})
        figure = zone_chart([], some, scale=scale, sizes=SizeAxis(39.992))
        notes = [note for note in figure["layout"]["annotations"] if "R33" in note["text"]]
        assert [note["y"] for note in notes] == [0]
        assert "averaging is stored" not in texts(figure)
        places = [note["y"] for note in figure["layout"]["annotations"] if note.get("x") == 1]
        assert len(places) == len(set(places))
        assert figure["layout"]["yaxis"]["ticktext"].count("<b>39.9920</b>") == 1

    @given(limits)
    def test_labels_of_the_linear_scale_never_write_over_each_other(self, some: Any) -> None:
        notes = zone_chart([point(1, 0.0)], some, scale="true")["layout"]["annotations"]
        high = TrueScale.of(some, [0.0]).extent
        places = sorted(note["y"] for note in notes if note.get("xref") == "paper" and note.get("yref") == "y")
        assert all(b - a > 0.03 * 2 * high for a, b in itertools.pairwise(places))


def test_on_a_phone_the_words_of_events_are_in_one_row() -> None:
    """Two rows of the low lane lie closer than letters are high: words of neighbours would cover each other."""
    happened = [Event(at, "oversize", "Oversize") for at in (40, 60, 80, 95)]
    points = [point(1, 0.0), point(100, 0.0)]
    (wide,), (phone,) = (
        traces(zone_chart(points, SHAFT, events=happened, width=width), "events") for width in (1200, 360)
    )
    assert (len(set(wide["y"])), set(phone["y"])) == (1, {0.0})
    near = [Event(at, "oversize", "Oversize") for at in (80, 90)]
    (wide,) = traces(zone_chart(points, SHAFT, events=near, width=800), "events")
    assert len(set(wide["y"])) == 2


def test_of_many_readings_the_envelope_leads_the_eye() -> None:
    few = zone_chart([point(n, 0.001, average=0.0) for n in range(1, 301)], SHAFT)
    assert not traces(few, "maximum")
    assert traces(few, "average")
    points = [point(n, 0.004 if n == 7 else 0.001, average=0.0) for n in range(1, 451)]
    many = zone_chart([*points, point(451, 1.7)], SHAFT, scale="true")
    assert not traces(many, "average")
    (highest,) = traces(many, "maximum")
    assert max(highest["y"]) == pytest.approx(4.0), "a probe fault measures no part"
    (readings,) = traces(many, "readings")
    assert len(readings["x"]) == 451, "each is drawn all the same"


def test_what_is_not_drawn_is_counted_below() -> None:
    title = zone_chart([point(1, 0.0)], SHAFT, left_out=["220 of 5378 corrections"])["layout"]["xaxis"]["title"]["text"]
    assert title == "Reading number · 220 of 5378 corrections"
    axis = histogram_figure(histogram_counts([0.0], SHAFT), SHAFT, of=9_000_000)["layout"]["xaxis"]
    assert axis["title"]["text"] == "Newest 1 of 9\u202f000\u202f000 readings"


class TestHistogram:
    def test_a_value_on_the_tolerance_limit_counts_inside(self) -> None:
        edges = histogram_edges(SHAFT)
        good = [0.008, 0.0080004, -0.008, -0.0080004]  # in whole nanometres, as every limit is compared
        counts = histogram_counts([*good, 0.0080006, -0.0080006, 5.0, -5.0], SHAFT)
        upper, lower = edges.index(0.008), edges.index(-0.008)
        assert counts[upper : upper + 2] == [2, 1]
        assert counts[lower : lower + 2] == [1, 2]
        assert (counts[0], counts[-1], sum(counts)) == (1, 1, 8)

    @pytest.mark.parametrize(("readings", "ticks"), [(0, {"dtick": 1}), (1, {"dtick": 1}), (40, {"nticks": 4})])
    def test_few_readings_are_counted_by_ones(self, readings: int, ticks: dict[str, int]) -> None:
        axis = histogram_figure(histogram_counts([0.003] * readings, SHAFT), SHAFT)["layout"]["xaxis"]
        assert {name: axis[name] for name in ("dtick", "nticks") if name in axis} == ticks

    def test_bars_outside_the_tolerance_are_marked(self) -> None:
        counts = histogram_counts([0.003] * 5 + [0.009], SHAFT)
        (bars,) = histogram_figure(counts, SHAFT)["data"]
        colours = dict(zip(bars["y"], bars["marker"]["color"], strict=True))
        assert {c for y, c in colours.items() if abs(y) > 8}.isdisjoint({c for y, c in colours.items() if abs(y) < 8})


class TestSmallPictures:
    def test_the_band_picture_says_in_words_what_it_shows(self) -> None:
        picture = band_picture(0.0112, SHAFT, average=-0.0005)
        assert "Last deviation +11.2\xa0µm, zone Oversize; running average −0.5\xa0µm" in picture
        assert 'data-tone="attention"' in picture

    def test_too_large_lies_to_the_right(self) -> None:
        def place(deviation: float) -> float:
            return float(band_picture(deviation, SHAFT).split("translate(")[1].split()[0])

        assert place(-1.7) < place(-0.003) < place(0.0) < place(0.003) < place(1.7)

    def test_there_may_be_no_reading(self) -> None:
        assert "No reading yet" in band_picture(None, SHAFT)
        assert "No reading yet" in sparkline([], SHAFT)

    def test_the_sparkline_marks_what_is_outside_the_tolerance(self) -> None:
        assert sparkline([0.001, 0.008, -0.008], SHAFT).count('class="outside"') == 0
        assert sparkline([0.001, 0.0081, -1.7], SHAFT).count('class="outside"') == 2
