"""The words of statistics: numbers, rules, charts, why there is no number, and what a number should not be read without."""

from collections.abc import Mapping
from typing import NamedTuple

from app.core.context import Chosen, ContextField
from app.core.spc.capability import Caution
from app.core.spc.gauge.zero_range import Governs
from app.core.spc.refusal import Reason, Refused
from app.core.spc.rules import Rule, RuleKind, RuleName, Run
from app.core.spc.shewhart import Chart
from app.core.spc.spread import Estimator
from app.files.documents.content import Fact, count, deviation, share, width
from app.language.formatting import plain_um, um
from app.language.i18n import _, ngettext
from app.loop.readings.wording import field_word
from app.loop.summaries.queries import Numbers, Rejects, Unworn


def context_words(context: Chosen) -> str:
    """The values of a context in a line, empty where nothing is chosen."""
    return ", ".join(f"{field_word(field)} {value}" for field, value in context)


class ContextForm(NamedTuple):
    """A form that narrows readings to a context, or tells them apart by a field of it.

    fields: name, label, what is chosen, and the values to choose from. bys: fields to tell apart by; words: all that is chosen.
    """

    fields: list[tuple[str, str, str, list[str]]]
    bys: list[tuple[str, str]]
    by: str
    words: str


def context_form(
    offered: Mapping[ContextField, list[str]], context: Chosen, by: ContextField | None = None
) -> ContextForm | None:
    """The form for readings whose newest have these values; None where no reading has any and nothing is chosen."""
    chosen = dict(context)
    fields = [field for field in ContextField if field in offered or field in chosen or field is by]
    if not fields:
        return None
    words = [context_words(context), _("by {field}").format(field=field_word(by).lower()) if by else ""]
    return ContextForm(
        [
            (f"context.{field.value}", field_word(field), chosen.get(field, ""), offered.get(field, []))
            for field in fields
        ],
        [("", _("nothing")), *((field.value, field_word(field)) for field in fields)],
        by.value if by else "",
        " · ".join(filter(None, words)),
    )


def facts(
    numbers: Numbers,
    rejects: Rejects | None = None,
    of_tool: Rejects | None = None,
    unworn: Unworn | None = None,
) -> list[Fact]:
    """Count, mean, standard deviation, extremes, parts in tolerance, corrections.

    rejects: with acceptance n of m, of these readings. of_tool: the same of all parts since the tool was changed. unworn: the
    spread without parts of worn tools, where there are any.
    """
    about_mean = about_deviation = ""
    if unworn is not None and unworn.standard_deviation is not None:
        without = ngettext("without %(n)s of a worn tool", "without %(n)s of worn tools", unworn.worn) % {
            "n": unworn.worn
        }
        about_mean = f"{without} {um(unworn.mean, 2)}"
        about_deviation = f"{without} {plain_um(unworn.standard_deviation, 2)}"
    left_out = _("left out of the numbers below") if numbers.probe_faults else ""
    listed = [
        Fact("count", _("Readings"), count(numbers.count)),
        Fact("excluded", _("Excluded"), count(numbers.excluded)),
        Fact("probe_faults", _("Probe faults"), count(numbers.probe_faults), note=left_out),
        Fact("mean", _("Mean deviation"), deviation(numbers.mean, 2), note=about_mean),
        Fact("standard_deviation", _("Standard deviation"), width(numbers.standard_deviation), note=about_deviation),
        Fact("minimum", _("Smallest deviation"), deviation(numbers.minimum)),
        Fact("maximum", _("Largest deviation"), deviation(numbers.maximum)),
        Fact("in_tolerance", _("In tolerance"), count(numbers.in_tolerance)),
        Fact("share_in_tolerance", _("Share in tolerance"), share(numbers.share_in_tolerance)),
        Fact("outside", _("Out of tolerance"), count(numbers.outside)),
        Fact("corrections", _("Corrections"), count(numbers.corrections)),
    ]
    if rejects is not None:
        parts, sections = ("", "") if of_tool is None else map(_since_change, (of_tool.parts, of_tool.sections))
        listed += [
            Fact("rejected", _("Parts rejected"), count(rejects.parts), note=parts),
            Fact("sections_outside", _("Sections outside"), count(rejects.sections), "#513", sections),
        ]
    return listed


def _since_change(number: int) -> str:
    return _("this tool {number}").format(number=number)


def chart(kind: Chart) -> str:
    """Name of a chart."""
    return {
        Chart.INDIVIDUALS: _("Individuals"),
        Chart.MOVING_RANGE: _("Moving range"),
        Chart.XBAR: _("Subgroup means (X̄)"),
        Chart.RANGES: _("Subgroup ranges (R)"),
        Chart.DEVIATIONS: _("Subgroup standard deviations (s)"),
        Chart.EWMA: _("EWMA"),
        Chart.MOVING_AVERAGE: _("Moving average"),
        Chart.CUSUM: _("CUSUM"),
    }[kind]


def rule_name(name: RuleName) -> str:
    """By whom a rule is known, and as which."""
    if name is RuleName.WESTERN_4:
        return _("Western Electric 4")
    number = name.value.removeprefix("nelson_")
    western = {"1": "1", "5": "2", "6": "3"}.get(number)
    if western is None:
        return _("Nelson {number}").format(number=number)
    return _("Nelson {number}, Western Electric {western}").format(number=number, western=western)


def rule(which: Rule) -> str:
    """The pattern of a run rule, with its numbers."""
    limit = f"{which.limit:g}"
    match which.kind:
        case RuleKind.BEYOND if which.n == 1:
            return _("A point lies beyond {limit} sigma.").format(limit=limit)
        case RuleKind.BEYOND:
            return _("{k} of {n} points in a row lie beyond {limit} sigma on the same side.").format(
                k=which.k, n=which.n, limit=limit
            )
        case RuleKind.SIDE:
            return _("{n} points in a row lie on the same side of the centre.").format(n=which.n)
        case RuleKind.TREND:
            return _("{n} points in a row rise, or fall.").format(n=which.n)
        case RuleKind.ALTERNATING:
            return _("{n} points in a row go up and down by turns.").format(n=which.n)
        case RuleKind.WITHIN:
            return _("{n} points in a row lie within {limit} sigma of the centre.").format(n=which.n, limit=limit)
        case RuleKind.OUTSIDE:
            return _("{n} points in a row lie beyond {limit} sigma, on either side.").format(n=which.n, limit=limit)


def hint(name: RuleName) -> str:
    """Usual cause of a signal of this rule, on a machine that measures its own parts."""
    return {
        RuleName.NELSON_1: _("One part or one reading is unlike the others: a chip under the stylus, a wrong blank."),
        RuleName.NELSON_2: _("The mean has moved: a new edge, another batch of material, an offset edited by hand."),
        RuleName.NELSON_3: _("Something drifts: wear or heat."),
        RuleName.NELSON_4: _(
            "Two streams take turns, or each part is corrected by the scatter of the last (R33 too small)."
        ),
        RuleName.NELSON_5: _("The mean has moved by a good deal."),
        RuleName.NELSON_6: _("The mean has moved a little."),
        RuleName.NELSON_7: _(
            "Limits too wide for what is measured: several streams mixed, or a baseline of a worse time."
        ),
        RuleName.NELSON_8: _("Two streams are mixed: two spindles, two fixtures, two probes."),
        RuleName.WESTERN_4: _("The mean has moved."),
    }[name]


def side(run: Run, which: Rule) -> str:
    """On which side a signal lies; empty where its rule knows none."""
    if run.side == 0:
        return ""
    if which.kind is RuleKind.TREND:
        return _("rising") if run.side > 0 else _("falling")
    return _("above") if run.side > 0 else _("below")


def estimator(how: Estimator) -> str:
    """Estimator of the standard deviation."""
    return {
        Estimator.MOVING_RANGE: _("mean moving range / d2"),
        Estimator.RANGES: _("subgroup ranges / d2"),
        Estimator.STANDARD_DEVIATIONS: _("subgroup standard deviations / c4"),
        Estimator.POOLED: _("pooled variance inside subgroups"),
        Estimator.OVERALL: _("standard deviation of all readings"),
        Estimator.GIVEN: _("given by the customer"),
    }[how]


def refusal(refused: Refused) -> str:
    """The reason why there is no number, and the remedy."""
    missing = refused.missing
    match refused.reason:
        case Reason.TOO_FEW_READINGS:
            return ngettext(
                "%(have)d readings of the %(needed)d that this takes: %(num)d is missing.",
                "%(have)d readings of the %(needed)d that this takes: %(num)d are missing.",
                missing,
            ) % {"have": refused.have, "needed": refused.needed, "num": missing}
        case Reason.TOO_FEW_SUBGROUPS:
            return ngettext(
                "%(have)d subgroups with two readings or more, of the %(needed)d that this takes: %(num)d is missing.",
                "%(have)d subgroups with two readings or more, of the %(needed)d that this takes: %(num)d are missing.",
                missing,
            ) % {"have": refused.have, "needed": refused.needed, "num": missing}
        case Reason.NO_VARIATION if refused.what == "repeats":
            return _(
                "The repeats of every part are the same. That says that the gauge does not resolve them, not that it repeats without error."
            )
        case Reason.NO_VARIATION:
            return _(
                "All values are the same. That says that the gauge does not resolve them, not that they do not vary."
            )
        case Reason.UNRESOLVED:
            return ngettext(
                "The values are too coarse to show their scatter: %(num)d different value, or most of them the same. A finer resolution is needed.",
                "The values are too coarse to show their scatter: %(num)d different values, or most of them the same. A finer resolution is needed.",
                refused.have,
            ) % {"num": refused.have}
        case Reason.NOT_FINITE:
            return _("Some values are no numbers.")
        case Reason.NO_LIMITS:
            return _("Without a tolerance limit there is no capability.")
        case Reason.LIMITS_CROSSED:
            return _("The tolerance has no width: its lower limit must lie below its upper limit.")
        case Reason.INCOMPLETE_STUDY:
            return _("The study is incomplete: {have} {what} of at least {needed}.").format(
                have=refused.have, needed=refused.needed, what=_study_part(refused.what)
            )
        case Reason.NO_DISTRIBUTION:
            return _("None of the distributions that are known here fits the readings.")
        case Reason.BEYOND_RANGE:
            return _("This is beyond what can be computed here; ask for less at once.")


def _study_part(what: str) -> str:
    return {
        "parts": _("parts"),
        "operators": _("operators"),
        "trials": _("trials"),
        "readings": _("readings"),
        "references": _("references"),
    }.get(what, what)


def caution(which: Caution) -> str:
    """A caution that belongs to a number."""
    return {
        Caution.FEW_READINGS: _(
            "Fewer than 100 readings: the number is preliminary; report it with its interval only."
        ),
        Caution.NOT_IN_CONTROL: _(
            "More readings lie beyond 3 sigma than chance explains: the process is not in control, so this describes past parts only; do not use it to predict."
        ),
        Caution.NOT_NORMAL: _(
            "The readings are not normally distributed: take the percentile method; the expected ppm do not hold."
        ),
        Caution.FEW_FOR_PERCENTILES: _(
            "Fewer than 1000 readings: the outer percentiles are hardly more than the smallest and the largest reading, so an index by percentiles is preliminary."
        ),
        Caution.COARSE: _(
            "The readings are coarse: a step between two of them is larger than one sigma within or a tenth of the tolerance, so the spread holds rounding as well."
        ),
        Caution.COMPENSATED: _(
            "The process is corrected by this system: sigma within is the scatter between corrections, not that of a free process."
        ),
    }[which]


def governs(which: Governs) -> str:
    """The cause that governs the suggested R33."""
    return {
        Governs.REPEATABILITY: _("the repeatability of touching"),
        Governs.SIGNAL_PATH: _("the jitter of the signal path"),
        Governs.PROCESS: _("the scatter from part to part"),
    }[which]
