"""The words of gauge studies: kinds, verdicts by the published limits, and why R33 is suggested as it is."""

from collections.abc import Mapping
from math import isnan
from typing import Any, NamedTuple

from app.core.decision.limits import nanometres
from app.core.spc.gauge.crossed import POOLED_ABOVE, AnovaRow, Study
from app.core.spc.gauge.linearity import Linearity
from app.core.spc.gauge.single import Bias, TypeOne
from app.core.spc.refusal import Refused
from app.language.formatting import beside, decimals_beside, fixed, plain_um, probability, signed
from app.language.i18n import _, ngettext
from app.loop.summaries import wording as statistics
from app.quality.capability import wording as capabilities
from app.quality.gauge_studies.evaluation import Evaluation
from app.quality.gauge_studies.queries import Advice

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
    """Name of a kind of study."""
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
        ("grr", kind("grr"), _("How much variation comes from the probe, how much from the parts?"), _("10 parts, 2 or 3 operators or set-ups, 2 or 3 readings each")),
        ("bias", kind("bias"), _("Does the probe read too much or too little?"), _("one part of known size, 10 readings and more")),
        ("linearity", kind("linearity"), _("Is the measuring error the same at all sizes?"), _("5 parts of known sizes over the range, 10 readings each")),
    ]  # fmt: skip


def share(value: float) -> str:
    """A percentage."""
    return "–" if isnan(value) else f"{in_percent(value)}\N{NARROW NO-BREAK SPACE}%"


def in_percent(value: float) -> str:
    """The same without its unit: read beside the limits of AIAG."""
    return beside(value, 1, GOOD_SHARE, USABLE_SHARE)


def _end(length: float) -> str:
    """An end of an interval of a bias, µm: read beside 0."""
    return signed(length * 1000, decimals_beside(length * 1000, 2, 0.0))


def verdicts(found: Evaluation, tolerance: float | None) -> list[Verdict]:
    """Each number that has a published limit."""
    if isinstance(found.type_one, TypeOne):
        return _type_one(found.type_one)
    if isinstance(found.anova, Study):
        return _crossed(found.anova, tolerance)
    if isinstance(found.bias, Bias):
        return [_bias(found.bias)]
    return _linearity(found.linearity) if isinstance(found.linearity, Linearity) else []


def _type_one(found: TypeOne) -> list[Verdict]:
    verdicts = []
    limit = _("at least {limit} (VDA 5); {n} values, {share} of the tolerance against {spread} s").format(
        limit=LEAST_CG,
        n=found.bias.readings,
        share=f"{100 * found.share:g}\N{NO-BREAK SPACE}%",
        spread=f"{found.spread:g}",
    )
    for name, value in (("Cg", found.cg), ("Cgk", found.cgk)):
        good = value >= LEAST_CG and found.resolved
        verdicts.append(
            Verdict(
                name,
                beside(value, 2, LEAST_CG),
                _("capable") if good else _("not capable"),
                "steady" if good else "attention",
                limit,
            )
        )
    verdicts.append(_bias(found.bias))
    verdicts.append(
        Verdict(
            _("Resolution"),
            f"{found.resolution * 1000:.3g}\N{NO-BREAK SPACE}µm",
            _("fine enough") if found.resolved else _("too coarse"),
            "steady" if found.resolved else "attention",
            _("at most 5 % of the tolerance"),
        )
    )
    return verdicts


def _bias(found: Bias) -> Verdict:
    return Verdict(
        _("Bias"),
        f"{signed(found.bias * 1000, 2)}\N{NO-BREAK SPACE}µm",
        _("significant") if found.significant else _("not significant"),
        "waiting" if found.significant else "steady",
        _("95 % interval {low} to {high} µm").format(low=_end(found.low), high=_end(found.high)),
    )


def _crossed(found: Study, tolerance: float | None) -> list[Verdict]:
    verdicts = [_aiag(_("GRR of the variation"), found.percent(found.grr))]
    if tolerance:
        verdicts.append(_aiag(_("GRR of the tolerance"), found.percent_tolerance(found.grr, tolerance)))
    enough = found.ndc >= LEAST_CATEGORIES
    verdicts.append(
        Verdict(
            "ndc",
            str(found.ndc),
            _("enough") if enough else _("too few"),
            "steady" if enough else "attention",
            _("groups of parts it tells apart; at least {n} (AIAG)").format(n=LEAST_CATEGORIES),
        )
    )
    return verdicts


def _aiag(name: str, percent: float) -> Verdict:
    if percent < GOOD_SHARE:
        word, tone = _("good"), "steady"
    elif percent <= USABLE_SHARE:
        word, tone = _("usable with care"), "waiting"
    else:
        word, tone = _("not acceptable"), "attention"
    return Verdict(name, share(percent), word, tone, _("below 10 % good, up to 30 % usable (AIAG)"))


def _linearity(found: Linearity) -> list[Verdict]:
    """Against zero: the band about the line at every size, the average, slope and intercept (AIAG)."""
    low, high = found.average_interval
    biased = low > 0 or high < 0
    where = ", ".join(_("{size} mm").format(size=size(reference)) for reference in found.biased_at)
    return [
        Verdict(
            _("Linearity"),
            _("{slope} µm per mm").format(slope=signed(found.slope.value * 1000, 3)),
            _("error depends on size") if found.by_size else _("same error at all sizes"),
            "attention" if found.by_size else "steady",
            _("the biases do not lie on a line: read each, p {p}").format(p=probability(found.beside.p_value, "= "))
            if found.bent and found.beside is not None
            else _("slope of the bias, p {p}").format(p=probability(found.slope.p_value, "= ")),
        ),
        Verdict(
            _("Bias against zero"),
            _("none") if found.holds_zero else where or _("between the sizes"),
            _("zero lies in the band") if found.holds_zero else _("zero lies outside the band"),
            "steady" if found.holds_zero else "attention",
            _("the zero line must lie in the {level} % band of the line, at every size (AIAG)").format(
                level=f"{found.confidence * 100:g}"
            ),
        ),
        Verdict(
            _("Average bias"),
            f"{signed(found.average_bias * 1000, 2)}\N{NO-BREAK SPACE}µm",
            _("significant") if biased else _("not significant"),
            "attention" if biased else "steady",
            _("95 % interval {low} to {high} µm").format(low=_end(low), high=_end(high)),
        ),
        Verdict(
            _("Intercept"),
            f"{signed(found.intercept.value * 1000, 2)}\N{NO-BREAK SPACE}µm",
            _("significant") if found.intercept.p_value < 1 - found.confidence else _("not significant"),
            "attention" if found.intercept.p_value < 1 - found.confidence else "steady",
            _("bias of the line at size 0, p {p}").format(p=probability(found.intercept.p_value, "= ")),
        ),
        Verdict(
            _("Accepted"),
            _("yes") if found.acceptable else _("no"),
            _("no bias at any size") if found.acceptable else _("correct the bias first"),
            "steady" if found.acceptable else "attention",
            _("all of the above; R² {r} of the line").format(r=f"{found.r_squared:.3f}"),
        ),
    ]


def source(line: AnovaRow) -> str:
    """A line of the table of variance."""
    return {
        "part": _("Parts"),
        "operator": _("Operators"),
        "interaction": _("Parts × operators"),
        "repeatability": _("Repeatability"),
        "total": _("Total"),
    }[line.source]


def pooling(found: Study) -> str:
    """Treatment of the interaction."""
    tested = [line for line in found.table if line.source == "interaction"]
    if not tested:
        return _("One operator: reproducibility cannot be determined.")
    if isnan(tested[0].p_value):
        return ""
    if found.pooled:
        words = _(
            "The interaction is not seen (p = {p}, above the {limit} of AIAG): it is pooled with repeatability, and parts and operators are tested against both together."
        )
    else:
        words = _(
            "The interaction counts separately (p {p}, not above the {limit} of AIAG): operators differ by part. Parts and operators are tested against it."
        )
    p = tested[0].p_value
    return words.format(p=probability(p, "" if found.pooled else "= "), limit=POOLED_ABOVE)


def zeroed(found: Study) -> str:
    """Components that came out negative; empty if none did."""
    names = {"part": _("Parts"), "appraiser": _("Reproducibility"), "interaction": _("Interaction")}
    if not found.zeroed:
        return ""
    return _("{names}: the estimated variance was negative and counts as 0, as is usual.").format(
        names=", ".join(names[component] for component in found.zeroed)
    )


def refusal(refused: Refused) -> str:
    """Reason why a study has no result."""
    return statistics.refusal(refused)


def advice(found: Advice) -> list[str]:
    """Steps that lead to the suggestion."""
    s = found.suggestion
    steps = [
        _("One value repeats with {sigma} (one standard deviation).").format(sigma=plain_um(found.repeatability, 3))
        if found.repeats == 1
        else _("One touch repeats with {sigma}; the mean of R27 = {n} touches with {mean}.").format(
            sigma=plain_um(found.repeatability, 3), n=found.repeats, mean=plain_um(s.touching, 3)
        )
    ]
    if s.floor:
        steps.append(
            _("The error of the signal path is up to {floor}, which adds {sigma}; R33 is never below it.").format(
                floor=plain_um(s.floor, 3), sigma=plain_um(s.signal_path, 3)
            )
        )
    if s.process is not None:
        steps.append(
            _("From part to part the last {n} readings scatter by {sigma}, wear and corrections taken out.").format(
                n=found.looked_back, sigma=plain_um(s.process, 3)
            )
        )
    else:
        steps.append(_("Too few readings yet for the scatter from part to part: R33 may have to be larger."))
    steps.append(
        _("Three of {sigma} hold 99.73 % of what chance does: {governs} decides.").format(
            sigma=plain_um(s.sigma, 3), governs=statistics.governs(s.governs)
        )
    )
    p = found.current.parameters
    if (
        p.average_memory and p.weighting_factor > 1
    ):  # an EWMA of chance: its variance is lambda / (2 - lambda) of one value's
        averaged = s.sigma / (2 * p.weighting_factor - 1) ** 0.5
        steps.append(
            _(
                "With k = {k} chance moves the running average by {sigma} only: a smaller R33 may do, a replay shows it."
            ).format(k=f"{p.weighting_factor:g}", sigma=plain_um(averaged, 3))
        )
    if s.fits is False:
        steps.append(_("That is not below R34: reduce the scatter of the probe or the process first, or raise R34."))
    return steps


def compared(found: Advice) -> str:
    """Comparison of the suggestion with the value in force."""
    suggested, now = (nanometres(value) for value in (found.suggestion.zero_range, found.current.parameters.zero_range))
    if suggested > now:
        return _("R33 is too small: chance alone reaches beyond it, so the loop corrects scatter and adds to it.")
    if suggested < now:
        return _("R33 is larger than chance requires: real deviations within it are not corrected immediately.")
    return _("R33 is as large as chance asks for.")


def reason(number: int, found: Advice) -> str:
    """Default reason in the parameter form; the engineer may change it."""
    return _("Gauge study {n}: repeatability {sigma}").format(n=number, sigma=plain_um(found.repeatability, 3))


def taken_from(source: Mapping[str, Any], characteristic: str | None) -> str:
    """From which readings a study was taken."""
    words = (
        _("touches of readings {first} to {through} of {characteristic}")
        if source["take"] == "touches"
        else _("readings {first} to {through} of {characteristic}")
    )
    sentence = words.format(first=source["first"], through=source["through"], characteristic=characteristic or "–")
    missing = source.get("left_out")
    if missing:
        sentence += _(", without {readings}: excluded, or probe faults").format(readings=capabilities.named(missing))
    values = source.get("empirical_values")
    if values is None:  # a study from before the empirical value was taken off
        return sentence + _("; as the machine measured, the empirical value not taken off")
    return sentence + _("; less the empirical value {value}").format(
        value=", ".join(_signed(entry["value"]) for entry in values)
    )


def _signed(value: float) -> str:
    return f"{signed(value * 1000, 1)} µm"


def empirical_value_changed(settings: Mapping[str, Any]) -> str | None:
    """The caution of a study inside which the empirical value changed."""
    values = settings.get("source", {}).get("empirical_values", ())
    if len(values) < 2:
        return None
    changes = ", ".join(
        _("{value} from reading {n} on").format(value=_signed(entry["value"]), n=entry["from"]) for entry in values
    )
    return _(
        "The empirical value changed inside this study ({changes}): its scatter and its bias hold that change, not the gauge alone. Take the readings before it, or those after it."
    ).format(changes=changes)


def values(count: int) -> str:
    """Number of values."""
    return ngettext("%(num)d value", "%(num)d values", count) % {"num": count}


def size(value: float) -> str:
    """A value as it was entered, with four decimals at least."""
    return fixed(value, 4 if round(value, 4) == round(value, 7) else 6)
