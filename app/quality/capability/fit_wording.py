"""The words of fitted distributions: which, why, how well."""

from app.core.spc.distributions import Family
from app.core.spc.fitting import FITS, Choice, Fit, Fitted, why
from app.language.formatting import fixed, in_percent, signed
from app.language.i18n import _


def name(family: Family) -> str:
    """The name of a distribution."""
    return {
        Family.HALF_NORMAL: _("half-normal distribution"),
        Family.FOLDED_NORMAL: _("folded normal distribution"),
        Family.RAYLEIGH: _("Rayleigh distribution"),
        Family.LOGNORMAL: _("lognormal distribution"),
        Family.WEIBULL: _("Weibull distribution"),
        Family.TWO_NORMALS: _("two normal distributions"),
    }[family]


def parameters(fit: Fit) -> str:
    """The parameters as one reads them, lengths in µm."""
    p = fit.named

    def um(key: str) -> str:
        return f"{p[key] * 1000:.2f}"

    match fit.family:
        case Family.HALF_NORMAL | Family.RAYLEIGH:
            return _("scale {scale} µm").format(scale=um("scale"))
        case Family.FOLDED_NORMAL:
            return _("mean {mean} µm, scale {scale} µm").format(mean=signed(p["mean"] * 1000, 2), scale=um("scale"))
        case Family.LOGNORMAL:
            return _("median {median} µm, s of the logarithm {s}").format(
                median=f"{p['median'] * 1000:.2f}", s=fixed(p["s"], 3)
            )
        case Family.WEIBULL:
            return _("shape {shape}, scale {scale} µm").format(shape=fixed(p["shape"], 2), scale=um("scale"))
        case Family.TWO_NORMALS:
            return _("{share} % at {first} ± {one} µm, {rest} % at {second} ± {other} µm").format(
                share=in_percent(p["share"]),
                rest=in_percent(1 - p["share"]),
                first=signed(p["first_mean"] * 1000, 2),
                second=signed(p["second_mean"] * 1000, 2),
                one=um("first_sigma"),
                other=um("second_sigma"),
            )


def goodness(fit: Fit) -> str:
    """Anderson-Darling of one distribution.

    >>> goodness(Fit(Family.RAYLEIGH, (1.0,), 0.4, 0.61, 10.0))
    'A² = 0.400, p = 0.61'
    """
    p = "p < 0.01" if fit.p_value < 0.01 else f"p = {fit.p_value:.2f}"
    return f"A² = {fit.statistic:.3f}, {p}"


def reason(found: Fitted) -> str:
    """The reason why this distribution was taken."""
    if len(found.tried) == 1:
        sentence = _(
            "The one that is tried without a natural limit; the readings do not contradict it (Anderson-Darling, p at least {level})."
        )
    elif why(found) is Choice.ALONE:
        sentence = _("The only one of {n} that the readings do not contradict (Anderson-Darling, p at least {level}).")
    else:
        sentence = _(
            "Of {n} that were tried, the best by the Bayesian information criterion among those that the readings do not contradict (Anderson-Darling, p at least {level})."
        )
    return sentence.format(n=len(found.tried), level=f"{FITS:g}")


def caution(found: Fitted) -> str:
    """Readings that are not normal, and what carries their index instead."""
    return _(
        "The readings are not normally distributed: the index is of the distribution that fits them, {name} ({goodness}); the ppm expected of a normal distribution are not valid."
    ).format(name=name(found.fit.family), goodness=goodness(found.fit))
