"""Pictures of a characteristic with a natural limit: one side, from the limit outward, and a short strip of what cannot be."""

from types import SimpleNamespace

import pytest

from app.charts import Ground, Note, Rule
from app.core.natural_limit import NaturalLimit
from app.views.characteristic.figures.distribution import histogram_counts, histogram_edges, histogram_figure
from app.views.characteristic.figures.scale import ScaleName, TrueScale, ZoneScale, bands, ends_of
from app.views.characteristic.figures.zones import Point, zone_chart
from app.views.characteristic.glance import band_picture, sparkline

RUN_OUT = SimpleNamespace(
    zero_range=0.001, averaging_limit=0.004, tolerance_width=0.0127, wear_limit=0.3, confidence_limit=1.0,
    natural_limit=NaturalLimit.LOWER,
)  # fmt: skip
UPSIDE_DOWN = SimpleNamespace(**vars(RUN_OUT) | {"natural_limit": NaturalLimit.UPPER})


@pytest.mark.parametrize("zero_range", [0.001, 0.0])
@pytest.mark.parametrize("limits", [RUN_OUT, UPSIDE_DOWN], ids=["lower", "upper"])
def test_the_scale_rises_on_both_sides_and_is_short_beyond_the_limit(
    limits: SimpleNamespace, zero_range: float
) -> None:
    scale = ZoneScale.of(SimpleNamespace(**vars(limits) | {"zero_range": zero_range}))
    deviations = [
        -50.0,
        -0.5,
        -0.02,
        -0.005,
        -0.0011,
        -0.001,
        -0.0004,
        0.0,
        0.0004,
        0.001,
        0.0011,
        0.005,
        0.02,
        0.5,
        50.0,
    ]
    places = [scale.position(deviation) for deviation in deviations]
    assert places == sorted(set(places))
    assert [scale.deviation(place) for place in places] == pytest.approx(deviations)
    low, high = ends_of(scale)
    assert low < places[0]
    assert places[-1] < high
    assert min(-low, high) < 2.5 < max(-low, high)


def test_the_zone_chart_names_one_limit_and_the_natural_one() -> None:
    points = [Point(1, 0.002, "average"), Point(2, 0.014, "oversize"), Point(3, -0.002, "probe_fault")]
    scales: tuple[ScaleName, ...] = ("zones", "true")
    for scale in scales:
        panel = zone_chart(points, RUN_OUT, scale=scale).panels[0]
        words = " | ".join(mark.text for mark in panel.marks if isinstance(mark, Note))
        assert "R35  +12.7" in words
        assert "natural limit" in words
        assert "cannot be" in words
        assert "−12.7" not in words
        assert "undersize" not in words
        low, high = ends_of((ZoneScale if scale == "zones" else TrueScale).of(RUN_OUT))
        assert panel.y.reach == (low, high)
        assert -low < high / 2
        rules = [mark.y for mark in panel.marks if isinstance(mark, Rule)]
        assert sum(y < 0 for y in rules if isinstance(y, float)) == 1  # R33, where the scatter of measuring ends
        assert all(low <= edge <= high for mark in panel.marks if isinstance(mark, Ground) for edge in mark.y or ())


def test_two_sided_pictures_stay_symmetric() -> None:
    shaft = SimpleNamespace(**vars(RUN_OUT) | {"natural_limit": NaturalLimit.NONE})
    assert ends_of(ZoneScale.of(shaft)) == (-6.0, 6.0)
    low, high = ends_of(TrueScale.of(shaft))
    assert low == -high
    assert "R35/2" in {name for band in bands(shaft) for name in band.limits}


def test_the_histogram_begins_at_the_limit() -> None:
    edges = histogram_edges(RUN_OUT)
    assert edges[0] == pytest.approx(-0.00254)
    assert edges[3] == 0
    counts = histogram_counts([0.0, 0.0001, 0.0127, 0.0128], RUN_OUT)
    assert sum(counts) == 4
    at = [round(edge, 7) for edge in edges].index(0.0127)
    assert (counts[at], counts[at + 1]) == (1, 1)  # a value on the limit is good
    axis = histogram_figure(counts, RUN_OUT).panels[0].y
    assert axis.words == ["0", "+12.7"]


def test_small_pictures() -> None:
    assert band_picture(0.002, RUN_OUT).count('class="tolerance"') == 2  # the limit, and the natural one
    assert "NaN" not in band_picture(-0.002, UPSIDE_DOWN)
    assert sparkline([0.001, 0.002], RUN_OUT).split('class="edge" d="')[1].split('"')[0].count("M") == 1
