"""Computation of examples of gauge studies by the live engine."""

import numpy as np

from app.core.spc.gauge.crossed import Study, by_anova, by_average_and_range
from app.core.spc.gauge.linearity import linearity
from app.core.spc.gauge.single import bias, type_one
from app.core.spc.refusal import Floats
from app.quality.proof.example_input import Given, Got, readings_of


def _block(given: Given) -> Floats:
    """Rows of operator and trial, one entry per part, as a block of parts, operators, trials."""
    rows = np.array(given["readings"], dtype=np.float64)
    return rows.reshape(given["operators"], given["trials"], -1).transpose(2, 0, 1)


def _shares(study: Study, tolerance: float | None = None) -> Got:
    return {
        "ev": study.equipment,
        "av": study.appraiser,
        "interaction": study.interaction,
        "grr": study.grr,
        "pv": study.part,
        "tv": study.total,
        "percent_ev": study.percent(study.equipment),
        "percent_av": study.percent(study.appraiser),
        "percent_grr": study.percent(study.grr),
        "percent_pv": study.percent(study.part),
        "ndc": study.ndc,
    } | (
        {
            "tolerance_grr": study.percent_tolerance(study.grr, tolerance),
            "tolerance_ev": study.percent_tolerance(study.equipment, tolerance),
            "tolerance_av": study.percent_tolerance(study.appraiser, tolerance),
            "tolerance_pv": study.percent_tolerance(study.part, tolerance),
            "tolerance_tv": study.percent_tolerance(study.total, tolerance),
        }
        if tolerance
        else {}
    )


def gauge_ranges(given: Given) -> Got:
    return _shares(by_average_and_range(_block(given)))


def gauge_anova(given: Given) -> Got:
    study = by_anova(_block(given))
    table = {line.source: line for line in study.table}
    squares = {f"ss_{source}": line.squares for source, line in table.items()}
    return (
        _shares(study, given.get("tolerance"))
        | squares
        | {"f_interaction": table["interaction"].f, "pooled": study.pooled}
    )


def straight(given: Given) -> Got:
    result = linearity(dict(zip(given["references"], given["readings"], strict=True)))
    return {
        "biases": list(result.biases.values()),
        "slope": result.slope.value,
        "intercept": result.intercept.value,
        "r_squared": result.r_squared,
        "s": result.s,
        "t_slope": abs(result.slope.t),
        "t_intercept": abs(result.intercept.t),
    }


def biased(given: Given) -> Got:
    result = bias(readings_of(given), given["reference"])
    return {name: getattr(result, name) for name in ("mean", "repeatability", "standard_error", "t", "low", "high")}


def first_type(given: Given) -> Got:
    result = type_one(readings_of(given), given["reference"], given["tolerance"])
    return {"cg": result.cg, "cgk": result.cgk}
