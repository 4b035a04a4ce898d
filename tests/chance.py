"""Chance in tests: `make test` tries the same each time, `make test-long` more and something else each time.

What a test of `make test-long` did is repeated with the seed of its run, which pytest prints: ``--long --randomly-seed=N``.
"""

import random
from math import sqrt

import pytest
from hypothesis import HealthCheck, settings

USUAL = 100
"""Examples of Hypothesis in `make test`, if a test names no other number."""
MORE = 10
"""Times as many of them in `make test-long`."""

# A computer that is busy is no fault of what is tested: no deadline.
settings.register_profile(
    "short",
    max_examples=USUAL,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "long", settings.get_profile("short"), max_examples=USUAL * MORE, derandomize=False, print_blob=True
)


def load(*, long: bool) -> None:
    """Choose what all tests of this run do."""
    settings.load_profile("long" if long else "short")


def _long() -> bool:
    return settings.get_current_profile_name() == "long"


def examples(number: int) -> settings:
    """So many examples of Hypothesis in `make test`, ten times as many in `make test-long`."""
    return settings(max_examples=number * MORE if _long() else number)


def runs(few: int, many: int) -> pytest.MarkDecorator:
    """Parametrise a test by how often it tries: seldom in `make test`, often in `make test-long`."""
    return pytest.mark.parametrize("runs", [few, pytest.param(many, marks=pytest.mark.long)])


def by_chance(share: float, runs: int) -> float:
    """By how much a share may seem to differ after so many runs: three standard deviations, five where the seed is fresh."""
    return (5 if _long() else 3) * sqrt(share * (1 - share) / runs)


def seed(number: int) -> int:
    """This number in `make test`; in `make test-long` one that depends on the run. For the body of a test only."""
    return random.getrandbits(32) if _long() else number
