"""Limits to begin with."""

from app.core.suggested import suggested_limits


def test_r33_is_no_less_than_the_uncertainty_of_the_signal_path_and_leaves_room_for_r34() -> None:
    assert suggested_limits(0.008, floor=0.0015).zero_range == 0.0015
    assert suggested_limits(0.009, floor=0.02).zero_range == 0.003
