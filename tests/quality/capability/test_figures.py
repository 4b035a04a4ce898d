"""Pictures of capability where readings lie far from all others."""

import numpy as np

from app.charts.description import Chart, Note, Share
from app.core.spc.capability import Limits
from app.quality.capability.figures import BELOW, CapabilityChart, histogram, probability, small


def said(chart: Chart) -> Note:
    """The note of the readings beyond."""
    notes = [mark for panel in chart.panels for mark in panel.marks if isinstance(mark, Note)]
    (note,) = [note for note in notes if "1 reading beyond: +400.0 µm" in note.text]
    return note


def test_readings_beyond_are_named_where_no_legend_can_meet_them() -> None:
    values = np.array([*np.random.default_rng(1).normal(0, 0.001, 100), 0.4])
    limits = Limits(-0.008, 0.008)
    plain = CapabilityChart(values, limits, 0.004, 0.04, None, None, normal=False)
    with_curve = CapabilityChart(values, limits, 0.004, 0.04, None, None, normal=True)
    for legend in (histogram(with_curve), probability(plain)):
        assert isinstance(said(legend).y, Share)
        assert said(legend).y.inside  # type: ignore[union-attr]
    for none in (histogram(plain), small(histogram(with_curve)), small(probability(plain))):
        assert said(none).y == BELOW
    assert small(probability(plain)).x.title == "", "in place of the axis below"
