"""Charts of counts: limits by hand, what belongs together, Laney's width."""

import numpy as np
import pytest

from app.core.spc.counts import CountChart, counts_chart
from app.core.spc.refusal import Refused


def test_each_sample_has_limits_of_its_own_size() -> None:
    found = counts_chart(CountChart.P, [4, 1, 6], [100, 25, 400])
    centre = 11 / 525
    reach = 3 * np.sqrt(centre * (1 - centre) / np.array([100, 25, 400]))
    assert found.centre == pytest.approx(centre)
    assert found.upper == pytest.approx(centre + reach)
    assert found.lower == pytest.approx(np.maximum(0, centre - reach))
    assert found.provisional
    assert not found.outside.any()


JUICE = [12, 15, 8, 10, 4, 7, 16, 9, 14, 10, 5, 6, 17, 12, 22, 8, 10, 5, 13, 11, 20, 18, 24, 15, 9, 12, 7, 13, 9, 6]
WAFERS = [16, 14, 28, 16, 12, 20, 10, 12, 10, 17, 19, 17, 14, 16, 15, 13, 14, 16, 11, 20, 11, 19, 16, 31, 13]
COMPUTERS = [10, 12, 8, 14, 10, 16, 11, 7, 10, 15, 9, 5, 7, 11, 12, 6, 8, 10, 7, 5]


@pytest.mark.parametrize(
    ("chart", "counts", "inspected", "published", "outside"),
    [
        (CountChart.P, JUICE, 50, (0.0524, 0.2313, 0.4102), [15, 23]),
        (CountChart.NP, JUICE, 50, (2.62, 11.57, 20.51), [15, 23]),
        (CountChart.C, WAFERS, None, (4, 16, 28), [24]),
        (CountChart.U, COMPUTERS, 5, (0.07, 1.93, 3.79), []),
    ],
)
def test_published_charts(
    chart: CountChart, counts: list[int], inspected: int | None, published: tuple[float, ...], outside: list[int]
) -> None:
    """Montgomery, chapter 7: orange juice (also NIST 6.3.3.2), personal computers; NIST/SEMATECH 6.3.3.1: wafers."""
    found = counts_chart(chart, counts, inspected)
    places = [len(str(each).partition(".")[2]) for each in published]
    limits = [float(each[0]) for each in (found.lower, found.centre, found.upper)]
    assert [round(each, at) for each, at in zip(limits, places, strict=True)] == list(published)
    assert (np.flatnonzero(found.outside) + 1).tolist() == outside


def test_np_and_c_are_p_and_u_times_the_sample() -> None:
    counts = [3, 5, 2, 9, 4, 0, 6]
    p, np_ = (counts_chart(chart, counts, 50) for chart in (CountChart.P, CountChart.NP))
    c, u = counts_chart(CountChart.C, counts), counts_chart(CountChart.U, counts, 2.5)
    for large, small, scale in ((np_, p, 50), (c, u, 2.5)):
        for name in ("points", "centre", "lower", "upper"):
            assert getattr(large, name) == pytest.approx(scale * getattr(small, name))


def test_the_first_samples_may_judge_all_and_a_rate_may_be_given() -> None:
    counts = [4, 5, 3, 4, 6, 2, 5, 4, 3, 4, 30]
    assert counts_chart(CountChart.U, counts, 1, baseline=10).outside.tolist() == [False] * 10 + [True]
    assert counts_chart(CountChart.U, counts, 1, centre=4.0).centre[0] == 4.0


def test_large_samples_that_scatter_more_than_chance_are_seen_and_laneys_limits_fit_them() -> None:
    rng = np.random.default_rng(2)
    rates = np.clip(rng.normal(0.1, 0.01, 60), 0.01, 1)
    counts = rng.binomial(20_000, rates)
    p = counts_chart(CountChart.P, counts, 20_000)
    assert p.overdispersed
    assert p.outside.mean() > 0.3
    laney = counts_chart(CountChart.P_PRIME, counts, 20_000)
    assert laney.sigma_z == p.sigma_z
    assert laney.upper - laney.centre == pytest.approx((p.upper - p.centre) * p.sigma_z)
    assert laney.outside.mean() < 0.05
    even = counts_chart(CountChart.P, rng.binomial(20_000, 0.1, 200), 20_000)
    assert even.sigma_z == pytest.approx(1.0, abs=0.12)
    assert not even.overdispersed


@pytest.mark.parametrize(
    ("chart", "counts", "inspected"),
    [
        (CountChart.P, [1], [50]),
        (CountChart.P, [51, 1], [50, 50]),
        (CountChart.P, [1, -1], 50),
        (CountChart.P, [1, 2], [50, 0]),
        (CountChart.P, [0, 0, 0], 50),
        (CountChart.P, [50, 50], 50),
        (CountChart.NP, [1, 2], [50, 60]),
        (CountChart.C, [1, 2], [1, 2]),
        (CountChart.U_PRIME, [3, 3, 3], 1),
        (CountChart.U, [float("nan"), 1], 1),
    ],
)
def test_what_does_not_belong_together_is_refused(chart: CountChart, counts: list[float], inspected: object) -> None:
    with pytest.raises(Refused):
        counts_chart(chart, counts, inspected)  # type: ignore[arg-type]
