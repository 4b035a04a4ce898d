"""What one reading says of a clock for certain: never of one that is right, always of one that is behind by more than the part waited."""

from hypothesis import given
from hypothesis import strategies as st

from app.core.clock import DIFFER, behind_by

DAYS = 1e7
times = st.floats(0.0, DAYS)


@given(issued=times, applied=times, cut=times, received=times, scatter=st.floats(-DIFFER, DIFFER))
def test_no_buffer_outage_or_history_looks_like_it(
    issued: float, applied: float, cut: float, received: float, scatter: float
) -> None:
    """Whenever a part is cut with a correction, and however long it waits: that came first. A clock may go wrong by some seconds."""
    issued, applied, cut, received = sorted((issued, applied, cut, received))
    assert behind_by(cut + scatter * (1 - 1e-6), issued) is None


@given(issued=times, waited=st.floats(0.0, DAYS), beyond=st.floats(1e-3, DAYS))
def test_a_clock_that_is_behind_by_more_than_it_took_to_cut_with_it_is_found(
    issued: float, waited: float, beyond: float
) -> None:
    """And never by more than it is."""
    behind = waited + DIFFER + beyond
    least = behind_by(issued + waited - behind, issued)
    assert least is not None
    assert least <= behind + 1e-6
