"""Tolerance intervals and machine performance: what they hold, and when they are refused."""

from math import exp, lgamma, log, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.stats import nct, norm

from app.core.spc.capability import Limits
from app.core.spc.distributions import Family
from app.core.spc.machine_performance import RUN, machine_performance, newest_run
from app.core.spc.refusal import Reason, Refused
from app.core.spc.tolerance_interval import Method, fewest_for_extremes, k_one_sided, k_two_sided, tolerance_interval


@pytest.mark.parametrize("n", [2, 5, 30, 300])
def test_the_one_sided_factor_is_that_of_the_non_central_t(n: int) -> None:
    for share, confidence in ((0.9, 0.95), (0.9973, 0.9), (0.4, 0.2)):
        exact = nct.ppf(confidence, n - 1, norm.ppf(share) * n**0.5) / n**0.5
        assert k_one_sided(n, share, confidence) == pytest.approx(exact, rel=1e-6)


def test_the_two_sided_interval_holds_its_share_as_often_as_it_says() -> None:
    rng, held = np.random.default_rng(3), 0
    k = k_two_sided(20, 0.95, 0.9)
    for _ in range(4000):
        x = rng.normal(size=20)
        reach = k * x.std(ddof=1)
        held += norm.cdf(x.mean() + reach) - norm.cdf(x.mean() - reach) >= 0.95
    assert held / 4000 == pytest.approx(0.9, abs=0.015)


def test_without_a_shape_it_takes_the_extremes_or_says_how_many_it_takes() -> None:
    values = np.random.default_rng(4).exponential(size=93)
    found = tolerance_interval(values, 0.95, 0.95, normal=False)
    assert (found.method, found.low, found.high, found.k) == (Method.EXTREMES, values.min(), values.max(), None)
    assert found.reached >= 0.95
    with pytest.raises(Refused) as refused:
        tolerance_interval(values[1:], 0.95, 0.95, normal=False)
    assert (refused.value.reason, refused.value.have, refused.value.needed) == (Reason.TOO_FEW_READINGS, 92, 93)
    assert fewest_for_extremes(0.9973, 0.95, sides=2) == 1756
    upper = tolerance_interval(values, 0.95, 0.95, lower=False, normal=False)
    assert (upper.low, upper.high) == (None, values.max())


def test_a_run_of_a_machine_has_the_indices_of_all_its_parts() -> None:
    values = np.random.default_rng(5).normal(1, 1.5, RUN)
    found = machine_performance(values, Limits(-10, 10))
    s = values.std(ddof=1)
    assert found.pm
    assert found.pmk
    assert found.pm.value == pytest.approx(20 / (6 * s))
    assert found.pmk.value == pytest.approx((10 - values.mean()) / (3 * s))
    with pytest.raises(Refused):
        machine_performance(values[1:], Limits(-10, 10))
    chip = values.copy()
    chip[7] = 400.0
    far = machine_performance(chip, Limits(-10, 10))
    assert (far.far, far.pm, far.pmk) == ((7,), None, None)


def test_pm_pmk_and_their_intervals_by_numerical_integration() -> None:
    """No published case could be found, so by another way: quantiles and probabilities integrated from densities.

    Pm = (U - L)/(X99.865 - X0.135) with quantiles where the integral of the density reaches 0.135 % and 99.865 %, which are 3 s
    from the mean to 1e-5. The ends of the interval of Pm are those at which a deviation as small (as large) as s has the
    probability 2.5 %, by the integral of the density of chi-square with 49 degrees of freedom.
    """
    values = np.random.default_rng(5).normal(1, 2, 50)
    found = machine_performance(values, Limits(-10, 10))
    assert found.pm
    assert found.pmk
    assert found.pm.low is not None
    assert found.pm.high is not None
    mean = sum(values) / 50
    s = sqrt(sum((value - mean) ** 2 for value in values) / 49)

    def density(z: float) -> float:
        return exp(-z * z / 2) / sqrt(2 * pi)

    def reach(share: float) -> float:
        return float(brentq(lambda z: 0.5 + quad(density, 0, z)[0] - share, -6, 6))

    low, high = mean + s * reach(0.00135), mean + s * reach(0.99865)
    assert found.pm.value == pytest.approx(20 / (high - low), rel=1e-4)
    assert found.pmk.value == pytest.approx(min((10 - mean) / (high - mean), (mean + 10) / (mean - low)), rel=1e-4)

    def chi_square(x: float) -> float:
        return exp(23.5 * log(x) - x / 2 - 24.5 * log(2) - lgamma(24.5))

    for end, share in ((found.pm.low, 0.025), (found.pm.high, 0.975)):
        true_s = 20 / (6 * end)
        assert quad(chi_square, 0, 49 * (s / true_s) ** 2)[0] == pytest.approx(share, abs=1e-6)


def test_a_run_of_form_is_by_the_distribution_that_begins_at_its_natural_limit() -> None:
    run = machine_performance(np.random.default_rng(6).rayleigh(1, 100), Limits(None, 8.0), side=-1)
    assert run.by_fit
    assert run.by_fit.fit.family is Family.RAYLEIGH
    assert run.pm is None
    assert run.pmk
    assert run.pmk.value == pytest.approx((8 - 1.177) / (3.635 - 1.177), rel=0.2)


def test_the_newest_run_that_nothing_was_changed_in() -> None:
    changed = np.zeros(200, np.bool_)
    changed[[0, 60, 130, 170]] = True
    assert newest_run(changed, 50) == slice(80, 130)
    assert newest_run(changed, 70) == slice(60, 130)
    with pytest.raises(Refused) as refused:
        newest_run(changed, 71)
    assert (refused.value.have, refused.value.needed) == (70, 71)
    with pytest.raises(Refused):
        newest_run(np.zeros(0, np.bool_), 50)
