"""The words of gauge studies: kinds, verdicts by the published limits, and why R33 is suggested as it is."""

from collections.abc import Mapping
from math import isnan
from typing import Any, NamedTuple

from app.capability import wording as capabilities
from app.core.spc.gauge.crossed import POOLED_ABOVE, Line, Study
from app.core.spc.gauge.linearity import Linearity
from app.core.spc.gauge.single import Bias, TypeOne
from app.core.spc.refusal import Refused
from app.gauges.evaluating import Evaluated
from app.gauges.queries import Advice
from app.statistics import wording as statistics
from app.web.i18n import _, ngettext
from app.web.numbers import mm, signed

LEAST_CG = 1.33
GOOD_SHARE, USABLE_SHARE = 10.0, 30.0  # AIAG: percent of the variation, or of the tolerance
LEAST_CATEGORIES = 5


class Verdict(NamedTuple):
    """One number beside its published limit. tone: `steady` is good, `waiting` perhaps, `attention` not."""

    name: str
    value: str
    word: str
    tone: str
    limit: str


def kind(which: str) -> str:
    """What a study is called."""
    return {
        "type_one": _("Type 1 (Cg, Cgk)"),
        "bias": _("Bias"),
        "linearity": _("Linearity"),
        "grr": _("Gauge R&R"),
    }[which]


def kinds() -> list[tuple[str, str, str, str]]:
    """Kinds to choose from: key, name, what it answers, what it takes."""
    return [
        ("type_one", kind("type_one"), _("Does the probe repeat well enough for this tolerance?"), _("one part of known size, 25 to 50 readings of it")),
        ("grr", kind("grr"), _("How much of the scatter is the probe's own, how much the parts'?"), _("10 parts, 2 or 3 operators or set-ups, 2 or 3 readings each")),
        ("bias", kind("bias"), _("Does the probe read too much or too little?"), _("one part of known size, 10 readings and more")),
        ("linearity", kind("linearity"), _("Does it err alike at all sizes?"), _("5 parts of known sizes over the range, 10 readings each")),
    ]  # fmt: skip


def um(length: float, decimals: int = 2) -> str:
    """A standard deviation or a width in µm, without sign."""
    return f"{length * 1000:.{decimals}f}\N{NO-BREAK SPACE}µm"


def share(value: float) -> str:
    """A percentage."""
    return "–" if isnan(value) else f"{value:.1f}\N{NARROW NO-BREAK SPACE}%"


def p_value(p: float, equal: str = "") -> str:
    """A probability as one reads it.

    >>> p_value(0.0004), p_value(0.974), p_value(0.974, "= ")
    ('< 0.001', '0.974', '= 0.974')
    """
    return "< 0.001" if p < 0.001 else f"{equal}{p:.3f}"


def verdicts(found: Evaluated, tolerance: float | None) -> list[Verdict]:
    """Each number that has a published limit."""
    if isinstance(found.type_one, TypeOne):
        return _type_one(found.type_one)
    if isinstance(found.anova, Study):
        return _crossed(found.anova, tolerance)
    if isinstance(found.bias, Bias):
        return [_bias(found.bias)]
    return _linearity(found.linearity) if isinstance(found.linearity, Linearity) else []


def _type_one(found: TypeOne) -> list[Verdict]:
    made = []
    for name, value in (("Cg", found.cg), ("Cgk", found.cgk)):
        good = value >= LEAST_CG
        made.append(
            Verdict(
                name,
                f"{value:.2f}".replace("-", "\N{MINUS SIGN}"),
                _("capable") if good else _("not capable"),
                "steady" if good else "attention",
                _("at least {limit} (VDA 5)").format(limit=LEAST_CG),
            )
        )
    made.append(_bias(found.bias))
    if found.resolved is not None:
        made.append(
            Verdict(
                _("Resolution"),
                _("fine enough") if found.resolved else _("too coarse"),
                _("good") if found.resolved else _("not good"),
                "steady" if found.resolved else "attention",
                _("at most 5 % of the tolerance"),
            )
        )
    return made


def _bias(found: Bias) -> Verdict:
    return Verdict(
        _("Bias"),
        f"{signed(found.bias * 1000, 2)}\N{NO-BREAK SPACE}µm",
        _("significant") if found.significant else _("not to be seen"),
        "waiting" if found.significant else "steady",
        _("95 % interval {low} to {high} µm").format(
            low=signed(found.low * 1000, 2), high=signed(found.high * 1000, 2)
        ),
    )


def _crossed(found: Study, tolerance: float | None) -> list[Verdict]:
    made = [_aiag(_("GRR of the variation"), found.percent(found.grr))]
    if tolerance:
        made.append(_aiag(_("GRR of the tolerance"), found.percent_tolerance(found.grr, tolerance)))
    enough = found.ndc >= LEAST_CATEGORIES
    made.append(
        Verdict(
            "ndc",
            str(found.ndc),
            _("enough") if enough else _("too few"),
            "steady" if enough else "attention",
            _("groups of parts it tells apart; at least {n} (AIAG)").format(n=LEAST_CATEGORIES),
        )
    )
    return made


def _aiag(name: str, percent: float) -> Verdict:
    if percent < GOOD_SHARE:
        word, tone = _("good"), "steady"
    elif percent <= USABLE_SHARE:
        word, tone = _("usable with care"), "waiting"
    else:
        word, tone = _("not acceptable"), "attention"
    return Verdict(name, share(percent), word, tone, _("below 10 % good, up to 30 % usable (AIAG)"))


def _linearity(found: Linearity) -> list[Verdict]:
    moves = found.slope.p_value < 0.05
    return [
        Verdict(
            _("Linearity"),
            _("{slope} µm per mm").format(slope=signed(found.slope.value * 1000, 3)),
            _("errs by size") if moves else _("errs alike at all sizes"),
            "waiting" if moves else "steady",
            _("slope of the bias, p {p}").format(p=p_value(found.slope.p_value, "= ")),
        ),
        Verdict(
            _("Average bias"),
            f"{signed(found.average_bias * 1000, 2)}\N{NO-BREAK SPACE}µm",
            _("over all sizes"),
            "steady",
            _("R² {r} of the line").format(r=f"{found.r_squared:.3f}"),
        ),
    ]


def source(line: Line) -> str:
    """A line of the table of variance."""
    return {
        "part": _("Parts"),
        "operator": _("Operators"),
        "interaction": _("Parts × operators"),
        "repeatability": _("Repeatability"),
        "total": _("Total"),
    }[line.source]


def pooling(found: Study) -> str:
    """What became of the interaction."""
    tested = [line for line in found.table if line.source == "interaction"]
    if not tested:
        return _("One operator: nothing can be said of reproducibility.")
    if isnan(tested[0].p_value):
        return ""
    if found.pooled:
        words = _(
            "The interaction is not seen (p = {p}, above the {limit} of AIAG): it is pooled with repeatability, and parts and operators are tested against both together."
        )
    else:
        words = _(
            "The interaction counts by itself (p {p}, not above the {limit} of AIAG): operators differ by part. Parts and operators are tested against it."
        )
    p = tested[0].p_value
    return words.format(p=p_value(p, "" if found.pooled else "= "), limit=POOLED_ABOVE)


def zeroed(found: Study) -> str:
    """Which components came out negative; empty if none did."""
    names = {"part": _("Parts"), "appraiser": _("Reproducibility"), "interaction": _("Interaction")}
    if not found.zeroed:
        return ""
    return _("{names}: the estimated variance was negative and counts as 0, as is usual.").format(
        names=", ".join(names[each] for each in found.zeroed)
    )


def refusal(refused: Refused) -> str:
    """Why a study says nothing."""
    return statistics.refusal(refused)


def advice(found: Advice) -> list[str]:
    """How the suggestion came about, step by step."""
    s = found.suggestion
    said = [
        _("One value repeats with {sigma} (one standard deviation).").format(sigma=um(found.repeatability, 3))
        if found.repeats == 1
        else _("One touch repeats with {sigma}; the mean of R27 = {n} touches with {mean}.").format(
            sigma=um(found.repeatability, 3), n=found.repeats, mean=um(s.touching, 3)
        )
    ]
    if s.floor:
        said.append(
            _("The signal path errs by up to {floor}, which adds {sigma}; R33 is never below it.").format(
                floor=um(s.floor, 3), sigma=um(s.signal_path, 3)
            )
        )
    if s.process is not None:
        said.append(
            _("From part to part the last {n} readings scatter by {sigma}, wear and corrections taken out.").format(
                n=found.looked_back, sigma=um(s.process, 3)
            )
        )
    else:
        said.append(_("Too few readings tell of the scatter from part to part yet: it may ask for more."))
    said.append(
        _("Three of {sigma} hold 99.73 % of what chance does: {governs} decides.").format(
            sigma=um(s.sigma, 3), governs=statistics.governs(s.governs)
        )
    )
    p = found.standing.parameters
    if (
        p.average_memory and p.weighting_factor > 1
    ):  # an EWMA of chance: its variance is lambda / (2 - lambda) of one value's
        averaged = s.sigma / (2 * p.weighting_factor - 1) ** 0.5
        said.append(
            _(
                "With k = {k} chance moves the running average by {sigma} only: a smaller R33 may do, a replay shows it."
            ).format(k=f"{p.weighting_factor:g}", sigma=um(averaged, 3))
        )
    if s.fits is False:
        said.append(_("That is not below R34: first the probe or the process must scatter less, or R34 be raised."))
    return said


def compared(found: Advice) -> str:
    """What the suggestion means beside the value in force."""
    suggested, now = (round(each * 1e6) for each in (found.suggestion.zero_range, found.standing.parameters.zero_range))
    if suggested > now:
        return _("R33 is too small: chance alone reaches beyond it, so the loop corrects scatter and adds to it.")
    if suggested < now:
        return _("R33 is larger than chance asks for: deviations within it that are real are not corrected at once.")
    return _("R33 is as large as chance asks for.")


def reason(number: int, found: Advice) -> str:
    """What the parameter form is prefilled with; the engineer may say it otherwise."""
    return _("Gauge study {n}: repeatability {sigma}").format(n=number, sigma=um(found.repeatability, 3))


def taken_from(source: Mapping[str, Any], characteristic: str | None) -> str:
    """From which readings a study was taken."""
    words = (
        _("touches of readings {first} to {through} of {characteristic}")
        if source["take"] == "touches"
        else _("readings {first} to {through} of {characteristic}")
    )
    said = words.format(first=source["first"], through=source["through"], characteristic=characteristic or "–")
    missing = source.get("left_out")
    if missing:
        said += _(", without {readings}: excluded, or probe faults").format(readings=capabilities.named(missing))
    return said


def values(count: int) -> str:
    """How many."""
    return ngettext("%(num)d value", "%(num)d values", count) % {"num": count}


def size(value: float) -> str:
    """A value as it was entered, with four decimals at least."""
    return mm(value, 4 if round(value, 4) == round(value, 7) else 6)[:-3]
