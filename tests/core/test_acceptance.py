"""n of m sections in tolerance; the lathe line as printed is in tests/core/test_lathe_line.py."""

from dataclasses import replace

from app.core.acceptance import accepted
from tests.core.conftest import SEAT


def test_a_single_value_is_left_to_the_zones() -> None:
    out = SEAT.target + SEAT.tolerance_width
    assert accepted(replace(SEAT, accept_n=1, accept_m=1), [out])
    assert not accepted(replace(SEAT, accept_n=1, accept_m=2), [out, out])
