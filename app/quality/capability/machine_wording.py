"""The words of machine performance and of tolerance intervals."""

from app.core.spc.capability import VERY_CAPABLE
from app.core.spc.refusal import Refused
from app.core.spc.tolerance_interval import Method, ToleranceInterval
from app.language.formatting import fixed, signed
from app.language.i18n import _
from app.loop.summaries import wording as statistics
from app.quality.capability import fit_wording
from app.quality.capability.machine_queries import LOOKED_AT, Run


def no_run(refused: Refused) -> str:
    """The reason why there is no run, and how long the longest is."""
    return _(
        "Among the readings looked at, at most {looked_at}, no {needed} parts follow each other without a correction, a tool change or a setting; the longest run has {have}. Cut {needed} parts with the corrections paused."
    ).format(looked_at=LOOKED_AT, needed=refused.needed, have=refused.have)


def why_none(run: Run) -> str | None:
    """The reason why a run carries no index; None if it does."""
    if isinstance(run.result, Refused):
        return statistics.refusal(run.result)
    if run.result.far:
        return _("A reading lies far from all others: {which}.").format(
            which=", ".join(str(int(run.sequence[at])) for at in run.result.far)
        )
    return None


def verdict(run: Run) -> str:
    """Pmk against the usual requirement, and the distribution that it is by."""
    assert not isinstance(run.result, Refused)
    assert run.result.pmk is not None
    met = run.result.pmk.value >= VERY_CAPABLE
    sentence = (
        _("It reaches the 1.67 that is usually asked of a machine.")
        if met
        else _("It is below the 1.67 that is usually asked of a machine.")
    )
    if run.result.by_fit is not None:
        sentence += " " + _("By the distribution that fits: {name}.").format(
            name=fit_wording.name(run.result.by_fit.fit.family)
        )
    return sentence


def run_of(run: Run) -> str:
    """The run in words."""
    return _("{n} parts, readings {first} to {last}, with no correction, tool change or setting in between").format(
        n=len(run.values), first=int(run.sequence[0]), last=int(run.sequence[-1])
    )


def tolerance(found: ToleranceInterval | Refused) -> str:
    """The interval in words, µm from the target.

    >>> tolerance(ToleranceInterval(50, 0.9973, 0.95, Method.NORMAL, -0.0051, 0.0049, 3.643, 0.95))
    'With 95 % confidence at least 99.73 % of all parts lie between −5.1 µm and +4.9 µm (k = 3.643).'
    """
    if isinstance(found, Refused):
        return _("No tolerance interval: {why}").format(why=statistics.refusal(found))
    ends = {"low": signed((found.low or 0.0) * 1000, 1), "high": signed((found.high or 0.0) * 1000, 1)}
    if found.low is None:
        where = _("below {high} µm").format(**ends)
    elif found.high is None:
        where = _("above {low} µm").format(**ends)
    else:
        where = _("between {low} µm and {high} µm").format(**ends)
    by = (
        _("the extremes: the readings are not normal")
        if found.method is Method.EXTREMES
        else f"k = {fixed(found.k, 3)}"
    )
    return _("With {confidence} % confidence at least {share} % of all parts lie {where} ({by}).").format(
        confidence=f"{found.confidence * 100:g}", share=f"{found.share * 100:g}", where=where, by=by
    )
