"""Pictures of capability where readings lie far from all others."""

from collections.abc import Callable

import numpy as np
import pytest

from app.charts.description import Chart, Note, Share
from app.core.spc.capability import Limits
from app.quality.capability.figures import CapabilityChart, histogram, probability


@pytest.mark.parametrize("draw", [histogram, probability])
def test_readings_beyond_are_named_inside_where_no_legend_can_meet_them(
    draw: Callable[[CapabilityChart], Chart],
) -> None:
    values = np.array([*np.random.default_rng(1).normal(0, 0.001, 100), 0.4])
    study = CapabilityChart(values, Limits(-0.008, 0.008), 0.004, 0.04, None, None, normal=False)
    notes = [
        mark
        for panel in draw(study).panels
        for mark in panel.marks
        if isinstance(mark, Note) and "1 reading beyond: +400.0 µm" in mark.text
    ]
    (note,) = notes
    assert isinstance(note.y, Share)
    assert note.y.inside
    assert 0 <= note.y.part <= 1
