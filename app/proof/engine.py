"""How each kind of example is computed: given what an example gives, what the live engine makes of it."""

from collections.abc import Callable
from typing import Any

import numpy as np

from app.core.compensation import Action, State, average_of, decide
from app.core.parameters import mean_nominal, read
from app.core.spc import chance, constants, cusum, ewma, shewhart
from app.core.spc.capability import Limits, capability, percentile
from app.core.spc.gauge.crossed import Study, by_anova, by_average_and_range
from app.core.spc.gauge.linearity import linearity
from app.core.spc.gauge.single import bias, type_one
from app.core.spc.in_time import brown_forsythe, decompose, successive
from app.core.spc.normality import anderson_darling, shapiro_wilk
from app.core.spc.refusal import Floats
from app.core.spc.rules import RULES, RuleName, signals_of_cusum
from app.core.spc.spread import Estimator, subgroups, summary
from app.core.uncertainty import position_uncertainty
from app.proof import geometry

Given = dict[str, Any]
Got = dict[str, Any]


def decision(given: Given) -> Got:
    """A run of deviations through the decision: the average reached, what was corrected, and by how much (µm)."""
    parameters, _warnings = read(given["parameters"])
    average = 0.0
    reached, corrected, amounts = [], [], []
    for deviation in given["deviations_um"]:
        found = decide(parameters, State(average), deviation / 1000)
        error = found.average_after if found.size_error is None else found.size_error
        reached.append(error * 1000)
        corrected.append(found.action is Action.CORRECT)
        amounts.append((found.amount or 0.0) * 1000)
        average = found.average_after
    return {"averages_um": reached, "corrected": corrected, "amounts_um": amounts}


def nominal(given: Given) -> Got:
    target, width = mean_nominal(given["nominal"], given["upper_deviation"], given["lower_deviation"])
    return {"target": target, "tolerance_width": width}


def running_average(given: Given) -> Got:
    average, averages = given["start"], []
    for value in given["values"]:
        average = average_of(average, value, given["weighting_factor"])
        averages.append(average)
    return {"averages": averages}


def signal_path(given: Given) -> Got:
    return {"error_um": position_uncertainty(given["feed"], given["delay"]) * 1000}


def readings_of(given: Given) -> Floats:
    """The readings of an example: written out, alternating, in steps of one, or made to have a mean and an s."""
    if "alternating" in given:
        return np.array([given["first"], *(given["alternating"] * given["times"])], dtype=np.float64)
    if "count" in given:
        steps: Floats = np.linspace(-1.0, 1.0, given["count"])
        return float(given["mean"]) + steps * float(given["standard_deviation"]) / float(steps.std(ddof=1))
    if "last" in given:
        return np.arange(given["first"], given["last"] + 1, dtype=np.float64)
    return np.array(given["values"], dtype=np.float64)


def summed_up(given: Given) -> Got:
    found = summary(readings_of(given))
    return {
        "mean": found.mean,
        "standard_deviation": found.standard_deviation,
        "autocorrelation": found.autocorrelation,
    }


def factors(given: Given) -> Got:
    found = [constants.factors(n) for n in given["sizes"]]
    return {name: [getattr(each, name) for each in found] for name in constants.Factors.__slots__ if name != "n"}


def duncan(given: Given) -> Got:
    return {"d2_star": [constants.d2_star(n, groups) for n, groups in given["pairs"]]}


def individuals(given: Given) -> Got:
    values = readings_of(given)
    baseline = shewhart.individuals_baseline(values, minimum=len(values))
    chart, ranges = shewhart.individuals(baseline, values), shewhart.moving_ranges(baseline, values)
    return {"centre": chart.centre, "lower": chart.lower, "upper": chart.upper, "moving_range": ranges.centre}


def grouped(given: Given) -> Got:
    groups = subgroups(readings_of(given), given["size"])
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
    first = next(iter(signals_of_cusum(chart))).start
    return {
        "above": (chart.above.round(9)).tolist(),
        "below": (chart.below.round(9)).tolist(),
        "since_above": chart.since_above.tolist(),
        "first_signal": first + 1,
        "new_mean": chart.new_mean(first),
    }


def rule_probability(given: Given) -> Got:
    return {"per_window": [chance.per_window(RULES[RuleName(name)]) for name in given["rules"]]}


def rule_run_length(given: Given) -> Got:
    sets = [[RULES[RuleName(name)] for name in names] for names in given["sets"]]
    return {"run_lengths": [chance.average_run_length(rules) for rules in sets]}


def ewma_run_length(given: Given) -> Got:
    return {
        "run_lengths": [ewma.average_run_length(given["weight"], given["width"], shift) for shift in given["shifts"]]
    }


def cusum_run_length(given: Given) -> Got:
    lengths = [cusum.average_run_length(given["k"], given["h"], shift, given["headstart"]) for shift in given["shifts"]]
    return {"run_lengths": lengths}


def capable(given: Given) -> Got:
    limits = Limits(given.get("lower"), given.get("upper"), given.get("target"))
    found = capability(readings_of(given), limits)
    got: Got = {"ppk": found.ppk.value, "ppm": found.ppm_overall}
    if found.pp and found.cpm:
        got |= {"pp": found.pp.value, "pp_low": found.pp.low, "pp_high": found.pp.high, "cpm": found.cpm.value}
    return got


def by_percentile(given: Given) -> Got:
    found = percentile(readings_of(given), Limits(given["lower"], given["upper"]))
    return {"low": found.low, "median": found.median, "high": found.high, "pp": found.pp, "ppk": found.ppk}


def anderson(given: Given) -> Got:
    values = readings_of(given)
    return summed_up(given) | {"statistic": anderson_darling(values).statistic}


def shapiro(given: Given) -> Got:
    found = shapiro_wilk(given["values"])
    return {"statistic": found.statistic, "p_value": found.p_value}


def variance_in_time(given: Given) -> Got:
    found = decompose(given["groups"], given["at"])
    return {
        "between": found.between,
        "lack_of_fit": found.lack_of_fit,
        "within": found.within,
        "slope": found.slope,
        "f_between": found.means.statistic,
        "f_beside_line": found.beside_line.statistic,
    }


def scatter_in_time(given: Given) -> Got:
    return {"statistic": brown_forsythe(given["groups"]).statistic}


def following(given: Given) -> Got:
    return {"statistic": successive(given["values"]).statistic}


def _block(given: Given) -> Floats:
    """Rows of operator and trial, one entry per part, as a block of parts, operators, trials."""
    rows = np.array(given["readings"], dtype=np.float64)
    return rows.reshape(given["operators"], given["trials"], -1).transpose(2, 0, 1)


def _shares(study: Study) -> Got:
    return {
        "ev": study.equipment,
        "av": study.appraiser,
        "grr": study.grr,
        "pv": study.part,
        "tv": study.total,
        "percent_ev": study.percent(study.equipment),
        "percent_av": study.percent(study.appraiser),
        "percent_grr": study.percent(study.grr),
        "percent_pv": study.percent(study.part),
        "ndc": study.ndc,
    }


def gauge_ranges(given: Given) -> Got:
    return _shares(by_average_and_range(_block(given)))


def gauge_anova(given: Given) -> Got:
    study = by_anova(_block(given))
    table = {line.source: line for line in study.table}
    squares = {f"ss_{source}": line.squares for source, line in table.items()}
    return _shares(study) | squares | {"f_interaction": table["interaction"].f, "pooled": study.pooled}


def straight(given: Given) -> Got:
    found = linearity(dict(zip(given["references"], given["readings"], strict=True)))
    return {
        "biases": list(found.biases.values()),
        "slope": found.slope.value,
        "intercept": found.intercept.value,
        "r_squared": found.r_squared,
        "s": found.s,
        "t_slope": abs(found.slope.t),
        "t_intercept": abs(found.intercept.t),
    }


def biased(given: Given) -> Got:
    found = bias(given["values"], given["reference"])
    return {name: getattr(found, name) for name in ("mean", "repeatability", "standard_error", "t", "low", "high")}


def first_type(given: Given) -> Got:
    found = type_one(readings_of(given), given["reference"], given["tolerance"])
    return {"cg": found.cg, "cgk": found.cgk}


ENGINE: dict[str, Callable[[Given], Got]] = {
    "decision": decision,
    "mean_nominal": nominal,
    "running_average": running_average,
    "signal_path": signal_path,
    "summary": summed_up,
    "constants": factors,
    "d2_star": duncan,
    "individuals": individuals,
    "subgroups": grouped,
    "ewma": weighted,
    "moving_average": moving,
    "cusum": summed,
    "rule_probability": rule_probability,
    "rule_run_length": rule_run_length,
    "ewma_run_length": ewma_run_length,
    "cusum_run_length": cusum_run_length,
    "capability": capable,
    "percentile": by_percentile,
    "anderson_darling": anderson,
    "shapiro_wilk": shapiro,
    "variance_in_time": variance_in_time,
    "scatter_in_time": scatter_in_time,
    "following": following,
    "gauge_ranges": gauge_ranges,
    "gauge_anova": gauge_anova,
    "linearity": straight,
    "bias": biased,
    "type_one": first_type,
    "circle_fit": geometry.circle,
    "line_fit": geometry.line,
    "plane_fit": geometry.plane,
    "printed_straightness": geometry.printed_straightness,
}
"""By kind of example."""
