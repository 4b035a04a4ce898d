"""The position error of the signal path, against the figures of the cycles' manual (domain §4)."""

import pytest

from app.core.uncertainty import SignalPath, position_uncertainty, zero_range_floor


@pytest.mark.parametrize(
    ("feed", "delay", "expected"),
    [
        (150.0, 0.25, 0.000625),  # the manual's own: 0.6 µm
        (300.0, 0.25, 0.00125),
        (150.0, 0.0, 0.0),
        (60.0, 1.0, 0.001),  # 1 mm/s for 1 ms
    ],
)
def test_position_error_is_feed_times_delay(feed: float, delay: float, expected: float) -> None:
    assert position_uncertainty(feed, delay) == expected


def test_only_what_varies_is_a_floor_for_the_zero_range() -> None:
    assert zero_range_floor(SignalPath.DIRECT, 150.0, 0.25) == 0.0
    assert zero_range_floor(SignalPath.PLC, 150.0, 0.25) == 0.000625
    assert zero_range_floor(SignalPath.PLC, 150.0, 0.25, jitter=0.05) == 0.000125
    assert zero_range_floor(SignalPath.PLC, 150.0, 0.25, jitter=9.0) == 0.000625  # never more than the delay itself
