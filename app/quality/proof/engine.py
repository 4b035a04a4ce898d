"""Computation of each kind of example by the live engine, from the values that the example gives."""

from collections.abc import Callable

import numpy as np

from app.core.decision.decide import LoopState, decide
from app.core.decision.step import Action, average_of
from app.core.fits import fit_of
from app.core.forecast import LOOKS, backtest, forecast
from app.core.parameters import mean_nominal, read
from app.core.spc import chance, constants, cusum, ewma, shewhart
from app.core.spc.capability import (
    Limits,
    capability,
    of_percentiles,
    order_statistics,
    percentile,
    ppk_of,
    spread_index,
    target_index,
)
from app.core.spc.counts import CountChart, counts_chart
from app.core.spc.distributions import Family, quantiles
from app.core.spc.fitting import fit_of_family, p_of_anderson_darling
from app.core.spc.in_time import brown_forsythe, decompose, successive
from app.core.spc.machine_performance import machine_performance
from app.core.spc.normality import anderson_darling, p_of, shapiro_wilk
from app.core.spc.rules import RULES, Rule, RuleName, signals, signals_of_cusum
from app.core.spc.spread import Estimator, Sigma, freedom_of_moving_ranges, from_ranges, subgroups, summary
from app.core.spc.tolerance_interval import fewest_for_extremes, k_by_howe, k_one_sided, k_two_sided
from app.core.uncertainty import position_uncertainty
from app.core.wear import fit
from app.quality.proof import engine_of_gauges as gauges
from app.quality.proof import geometry
from app.quality.proof.example_input import Given, Got, readings_of
from app.quality.proof.wear_lives import life, operation, steeper


def decision(given: Given) -> Got:
    """A run of deviations through the decision: the average reached, what was corrected, and by how much (µm)."""
    parameters, _warnings = read(given["parameters"])
    average = 0.0
    reached, corrected, amounts = [], [], []
    for deviation in given["deviations_um"]:
        decision = decide(parameters, LoopState(average), deviation / 1000)
        error = decision.average_after if decision.size_error is None else decision.size_error
        reached.append(error * 1000)
        corrected.append(decision.action is Action.CORRECT)
        amounts.append((decision.amount or 0.0) * 1000)
        average = decision.average_after
    return {"averages_um": reached, "corrected": corrected, "amounts_um": amounts}


def nominal(given: Given) -> Got:
    target, width = mean_nominal(given["nominal"], given["upper_deviation"], given["lower_deviation"])
    return {"target": target, "tolerance_width": width}


def fits(given: Given) -> Got:
    found = [fit_of(text) for text in given["sizes"]]
    deviations = [(fit.upper_deviation * 1000, fit.lower_deviation * 1000) for fit in found if fit is not None]
    return {"upper_um": [upper for upper, _lower in deviations], "lower_um": [lower for _upper, lower in deviations]}


def running_average(given: Given) -> Got:
    average, averages = given["start"], []
    for value in given["values"]:
        average = average_of(average, value, given["weighting_factor"])
        averages.append(average)
    return {"averages": averages}


def signal_path(given: Given) -> Got:
    return {"error_um": position_uncertainty(given["feed"], given["delay"]) * 1000}


def summed_up(given: Given) -> Got:
    result = summary(readings_of(given))
    return {
        "mean": result.mean,
        "standard_deviation": result.standard_deviation,
        "autocorrelation": result.autocorrelation,
    }


def factors(given: Given) -> Got:
    factors = [constants.factors(n) for n in given["sizes"]]
    return {name: [getattr(row, name) for row in factors] for name in constants.Factors.__slots__ if name != "n"}


def duncan(given: Given) -> Got:
    return {"d2_star": [constants.d2_star(n, groups) for n, groups in given["pairs"]]}


def individuals(given: Given) -> Got:
    values = readings_of(given)
    baseline = shewhart.individuals_baseline(values, minimum=len(values))
    chart, ranges = shewhart.individuals(baseline, values), shewhart.moving_ranges(baseline, values)
    return {"centre": chart.centre, "lower": chart.lower, "upper": chart.upper, "moving_range": ranges.centre}


def grouped(given: Given) -> Got:
    groups = subgroups(readings_of(given), given.get("sizes") or given["size"])
    baseline = shewhart.subgroup_baseline(groups, Estimator(given["estimator"]), minimum=len(groups))
    means, ranges = shewhart.means(baseline, groups), shewhart.ranges(baseline, groups)
    deviations = shewhart.deviations(baseline, groups)
    return {
        "centre": means.centre,
        "lower": means.lower,
        "upper": means.upper,
        "sigma": baseline.sigma.value,
        "mean_range": ranges.centre,
        "range_lower": ranges.lower,
        "range_upper": ranges.upper,
        "mean_deviation": deviations.centre,
        "deviation_lower": deviations.lower,
        "deviation_upper": deviations.upper,
    }


def weighted(given: Given) -> Got:
    baseline = shewhart.given(given["centre"], given["sigma"], given["width"])
    chart = ewma.ewma(baseline, given["values"], given["weight"], exact=given["exact"])
    lower, upper = np.atleast_1d(chart.lower), np.atleast_1d(chart.upper)
    return {
        "points": chart.points.tolist(),
        "first_upper": float(upper[0]),
        "first_lower": float(lower[0]),
        "second_upper": float(upper[min(1, len(upper) - 1)]),
        "last_upper": float(upper[-1]),
        "last_lower": float(lower[-1]),
    }


def moving(given: Given) -> Got:
    chart = ewma.moving_average(shewhart.given(given["centre"], given["sigma"]), given["values"], given["span"])
    return {"points": chart.points.tolist(), "upper": np.atleast_1d(chart.upper).tolist()}


def summed(given: Given) -> Got:
    chart = cusum.cusum(shewhart.given(given["centre"], given["sigma"]), given["values"], given["k"], given["h"])
    runs = list(signals_of_cusum(chart))
    first = runs[0].start
    return {
        "above": (chart.above.round(9)).tolist(),
        "below": (chart.below.round(9)).tolist(),
        "since_above": chart.since_above.tolist(),
        "first_signal": first + 1,
        "signalled": sorted({at + 1 for run in runs for at in range(run.start, run.end + 1)}),
        "new_mean": chart.new_mean(first),
    }


def rule_probability(given: Given) -> Got:
    return {"per_window": [chance.per_window(RULES[RuleName(name)]) for name in given["rules"]]}


def rule_run_length(given: Given) -> Got:
    sets = [[RULES[RuleName(name)] for name in names] for names in given["sets"]]
    return {"run_lengths": [chance.average_run_length(rules, given.get("shift", 0.0)) for rules in sets]}


def rules_on_data(given: Given) -> Got:
    """At which points, counted from 1, each rule fires while points in sigma come in one by one."""

    def fired(rule: Rule, points: list[float]) -> list[int]:
        return [n for n in range(1, len(points) + 1) if any(run.end == n - 1 for run in signals(points[:n], [rule]))]

    return {name: fired(RULES[RuleName(name)], points) for name, points in given["points"].items()}


def ewma_run_length(given: Given) -> Got:
    return {
        "run_lengths": [ewma.average_run_length(given["weight"], given["width"], shift) for shift in given["shifts"]]
    }


def cusum_run_length(given: Given) -> Got:
    lengths = [cusum.average_run_length(given["k"], given["h"], shift, given["headstart"]) for shift in given["shifts"]]
    return {"run_lengths": lengths}


def capable(given: Given) -> Got:
    limits = Limits(given.get("lower"), given.get("upper"), given.get("target"))
    result = capability(readings_of(given), limits, minimum=2)
    got: Got = {
        "ppk": result.ppk.value,
        "ppk_low": result.ppk.low,
        "ppk_high": result.ppk.high,
        "ppm": result.ppm_overall,
    }
    if result.pp and result.cpm:
        got |= {"pp": result.pp.value, "pp_low": result.pp.low, "pp_high": result.pp.high, "cpm": result.cpm.value}
    return got


def potential(given: Given) -> Got:
    """Cp and Cpk by the sigma inside subgroups."""
    values = readings_of(given)
    within = from_ranges(subgroups(values, given["size"]))
    result = capability(values, Limits(given["lower"], given["upper"]), within=within)
    return {"cp": result.cp and result.cp.value, "cpk": result.cpk.value, "sigma": result.within.value}


def intervals(given: Given) -> Got:
    """Indices with their intervals from a mean, a standard deviation and a count."""
    mean, deviation, n = given["mean"], given["standard_deviation"], given["count"]
    limits, confidence = Limits(given["lower"], given["upper"], given.get("target")), given.get("confidence", 0.95)
    sigma = Sigma(deviation, Estimator.OVERALL, n, 1, n - 1.0)
    indices = {
        "pp": spread_index(limits, sigma, confidence),
        "ppk": ppk_of(limits, mean, deviation, n, confidence),
        "cpm": target_index(limits, mean, sigma, n, confidence),
    }
    return {
        name + part: getattr(index, of)
        for name, index in indices.items()
        if index
        for part, of in (("", "value"), ("_low", "low"), ("_high", "high"))
    }


def machine(given: Given) -> Got:
    """Pm and Pmk of a run of parts, with the interval of Pm."""
    result = machine_performance(readings_of(given), Limits(given["lower"], given["upper"]))
    if result.pm is None or result.pmk is None:
        return {}
    return {
        "pm": result.pm.value,
        "pm_low": result.pm.low,
        "pm_high": result.pm.high,
        "pmk": result.pmk.value,
    }


def one_sided_bounds(given: Given) -> Got:
    """Of readings whose one limit lies k standard deviations off: 3 times the lower bound of Ppk."""
    bounds = [ppk_of(Limits(None, k), 0.0, 1.0, given["count"], given["confidence"]).low for k in given["k"]]
    return {"bounds": [3 * bound for bound in bounds if bound is not None]}


def anderson_p(given: Given) -> Got:
    return {"p_values": [p_of(statistic) for statistic in given["statistics"]]}


def freedom(given: Given) -> Got:
    """Degrees of freedom of a sigma from ranges, per subgroup, and from moving ranges, per reading."""
    per_group = [from_ranges(subgroups([0.0, *[1.0] * (n - 1)], n)).degrees_of_freedom for n in given["sizes"]]
    many = 10**7
    return {"per_subgroup": per_group, "per_moving_range": freedom_of_moving_ranges(many) / many}


def by_percentile(given: Given) -> Got:
    result = percentile(readings_of(given), Limits(given["lower"], given["upper"]))
    return {"low": result.low, "median": result.median, "high": result.high, "pp": result.pp, "ppk": result.ppk.value}


def distribution(given: Given) -> Got:
    """Parameters, A^2 and p of a distribution fitted to readings; percentiles where they are asked for."""
    family = Family(given["family"])
    fit = fit_of_family(family, np.sort(readings_of(given)))
    three = quantiles(family, np.array([fit.parameters]), np.array(given.get("shares", [0.5])))[0]
    return fit.named | {"statistic": fit.statistic, "p_value": fit.p_value, "quantiles": three.tolist()}


def critical_values(given: Given) -> Got:
    """Probabilities of the critical values of A^2 of a distribution whose parameters are estimated."""
    row = np.array([given["parameters"]])
    return {"p_values": [p_of_anderson_darling(a, Family(given["family"]), row) for a in given["statistics"]]}


def count_chart(given: Given) -> Got:
    """Centre, limits of the newest sample, sigma z, and how many samples are outside."""
    found = counts_chart(CountChart(given["chart"]), given["counts"], given.get("inspected"))
    return {name: float(getattr(found, name)[-1]) for name in ("centre", "lower", "upper")} | {
        "sigma_z": found.sigma_z,
        "outside": int(found.outside.sum()),
    }


def tolerance_factors(given: Given) -> Got:
    """Factors of tolerance intervals, by the number of readings."""
    factors = {"two_sided": k_two_sided, "one_sided": k_one_sided, "howe": k_by_howe}
    return {
        name: [factor(n, given["share"], given["confidence"]) for n in given["readings"]]
        for name, factor in factors.items()
    }


def tolerance_extremes(given: Given) -> Got:
    """Number of readings whose extremes hold a share."""
    return {
        name: [fewest_for_extremes(share, given["confidence"], sides=sides) for share in given["shares"]]
        for name, sides in (("both", 2), ("one", 1))
    }


def places(given: Given) -> Got:
    """Ordered readings, counted from 1, that bound a quantile; 0 where none does."""
    found = [order_statistics(given["share"], n, given["confidence"]) for n in given["readings"]]
    outer, inner = ([0 if place is None else place + 1 for place in side] for side in zip(*found, strict=True))
    return {"outer": outer, "inner": inner}


def indices_of_percentiles(given: Given) -> Got:
    limits = Limits(given.get("lower"), given.get("upper"))
    pp, ppk = of_percentiles(given["low"], given["median"], given["high"], limits)
    return {"ppk": ppk} if pp is None else {"pp": pp, "ppk": ppk}


def anderson(given: Given) -> Got:
    values = readings_of(given)
    return summed_up(given) | {"statistic": anderson_darling(values).statistic}


def shapiro(given: Given) -> Got:
    result = shapiro_wilk(given["values"])
    return {"statistic": result.statistic, "p_value": result.p_value}


def variance_in_time(given: Given) -> Got:
    result = decompose(given["groups"], given["at"])
    return {
        "between": result.between,
        "lack_of_fit": result.lack_of_fit,
        "within": result.within,
        "slope": result.slope,
        "f_between": result.means.statistic,
        "f_beside_line": result.beside_line.statistic,
    }


def scatter_in_time(given: Given) -> Got:
    return {"statistic": brown_forsythe(given["groups"]).statistic}


def following(given: Given) -> Got:
    return {"statistic": successive(given["values"]).statistic}


def parts_left(given: Given) -> Got:
    """Shares of the forecasts at each moment of a tool life that hold the parts that it really takes.

    Of each operation N edges that are over teach the width, then one that is left out of them is forecast.
    """
    rng = np.random.default_rng(given["seed"])
    held: dict[float, list[bool]] = {share: [] for share in LOOKS}
    for _operation in range(given["operations"]):
        of = steeper(rng, given["steep"]) if "steep" in given else operation(rng)
        over = [life(of, rng) for _edge in range(given["edges_before"])]
        widening = backtest([(np.arange(1, len(curve) + 1), curve) for curve in over]).widening
        curve = life(of, rng)
        for share in LOOKS:
            now = int(len(curve) * share)
            line = fit(np.arange(1, now + 1), curve[:now])
            ahead = None if line is None else forecast(line, 1.0, widening)
            if ahead is not None:
                held[share].append(ahead.low <= len(curve) - now <= ahead.high)
    return {f"held_at_{share:.0%}".rstrip("%"): float(np.mean(each)) for share, each in held.items()}


ENGINE: dict[str, Callable[[Given], Got]] = {
    "decision": decision,
    "mean_nominal": nominal,
    "fits": fits,
    "running_average": running_average,
    "signal_path": signal_path,
    "parts_left": parts_left,
    "summary": summed_up,
    "constants": factors,
    "d2_star": duncan,
    "individuals": individuals,
    "subgroups": grouped,
    "freedom": freedom,
    "ewma": weighted,
    "moving_average": moving,
    "cusum": summed,
    "count_chart": count_chart,
    "rule_probability": rule_probability,
    "rule_run_length": rule_run_length,
    "rules_on_data": rules_on_data,
    "ewma_run_length": ewma_run_length,
    "cusum_run_length": cusum_run_length,
    "capability": capable,
    "potential": potential,
    "intervals": intervals,
    "machine_performance": machine,
    "one_sided_bounds": one_sided_bounds,
    "percentile": by_percentile,
    "order_statistics": places,
    "distribution": distribution,
    "goodness_of_fit": critical_values,
    "tolerance_factors": tolerance_factors,
    "tolerance_extremes": tolerance_extremes,
    "percentile_indices": indices_of_percentiles,
    "anderson_darling": anderson,
    "anderson_p": anderson_p,
    "shapiro_wilk": shapiro,
    "variance_in_time": variance_in_time,
    "scatter_in_time": scatter_in_time,
    "following": following,
    "gauge_ranges": gauges.gauge_ranges,
    "gauge_anova": gauges.gauge_anova,
    "linearity": gauges.straight,
    "bias": gauges.biased,
    "type_one": gauges.first_type,
    "circle_fit": geometry.circle,
    "line_fit": geometry.line,
    "plane_fit": geometry.plane,
    "printed_straightness": geometry.printed_straightness,
}
"""By kind of example."""
