"""The words of control charts: what is charted, and what a baseline should not be frozen without knowing."""

from collections.abc import Sequence
from enum import StrEnum

from app.core.spc.quantity import Quantity
from app.core.spc.shewhart import Chart
from app.language.i18n import _, ngettext
from app.loop.summaries import wording as statistics
from app.quality.baselines.series_queries import LeftOut
from app.quality.baselines.tables import Baseline


class Caution(StrEnum):
    """Caution to read before a baseline is frozen."""

    PROVISIONAL = "provisional"
    SIGNALS = "signals"
    BEYOND_GIVEN = "beyond_given"
    NOT_NORMAL = "not_normal"
    CORRELATED = "correlated"
    CORRECTED = "corrected"
    STEPS = "steps"
    WEARS = "wears"
    UNKNOWN = "unknown"


def caution(which: Caution, count: int = 0) -> str:
    """In words."""
    match which:
        case Caution.PROVISIONAL:
            return _("Fewer than 100 readings: the limits are provisional.")
        case Caution.SIGNALS:
            return ngettext(
                "%(num)d point of the period itself lies beyond its limits. Find out why, and leave it out with the reason, or choose a quieter period.",
                "%(num)d points of the period itself lie beyond its limits. Find out why, and leave them out with the reason, or choose a quieter period.",
                count,
            ) % {"num": count}
        case Caution.BEYOND_GIVEN:
            return ngettext(
                "%(num)d point of the period lies beyond the limits that were given: the process is not as they say.",
                "%(num)d points of the period lie beyond the limits that were given: the process is not as they say.",
                count,
            ) % {"num": count}
        case Caution.NOT_NORMAL:
            return _(
                "The values are not normally distributed: 3 sigma hold more or fewer of them than 99.7 %, and signals come more or less often than the rules promise."
            )
        case Caution.CORRELATED:
            return _(
                "Neighbours are alike (correlation {percent} %): sigma of neighbours is too small for the whole, and signals will come too often."
            ).format(percent=count)
        case Caution.CORRECTED:
            return ngettext(
                "%(num)d correction falls into this period: this is the process together with its loop. To see the process alone, chart it without corrections.",
                "%(num)d corrections fall into this period: this is the process together with its loop. To see the process alone, chart it without corrections.",
                count,
            ) % {"num": count}
        case Caution.STEPS:
            return ngettext(
                "Within the period the tool was changed, or what sizes are measured by became another, %(num)d time: single levels are mixed in this centre.",
                "Within the period the tool was changed, or what sizes are measured by became another, %(num)d times: single levels are mixed in this centre.",
                count,
            ) % {"num": count}
        case Caution.WEARS:
            return _(
                "The tool wears in this period, so the readings follow a slope and no centre. Chart the residuals about the wear line."
            )
        case Caution.UNKNOWN:
            return ngettext(
                "%(num)d reading is left out: the corrections of its part are not known.",
                "%(num)d readings are left out: the corrections of their parts are not known.",
                count,
            ) % {"num": count}


def quantity(which: Quantity) -> str:
    """Name of the quantity."""
    return {
        Quantity.DEVIATION: _("Deviation as measured"),
        Quantity.WITHOUT_CORRECTIONS: _("Without corrections"),
        Quantity.DIFFERENCES: _("Differences between neighbours"),
        Quantity.WEAR_RESIDUALS: _("Residuals about the wear line"),
    }[which]


def axis(which: Quantity) -> str:
    """As the title of an axis, with its unit."""
    return {
        Quantity.DEVIATION: _("Deviation, µm"),
        Quantity.WITHOUT_CORRECTIONS: _("Deviation without corrections, µm"),
        Quantity.DIFFERENCES: _("Difference from the part before, µm"),
        Quantity.WEAR_RESIDUALS: _("Residual about the wear line, µm"),
    }[which]


def quantity_meaning(which: Quantity) -> str:
    """Content and purpose of its chart."""
    return {
        Quantity.DEVIATION: _(
            "What the customer gets. Right for a characteristic that is only measured. Where a loop corrects, its corrections are on this chart too: they hide wear, and their steps fire run rules."
        ),
        Quantity.WITHOUT_CORRECTIONS: _(
            "The process rebuilt: each deviation less the corrections that were in effect. Right for a compensated characteristic that does not wear; wear makes it a saw-tooth by tools."
        ),
        Quantity.DIFFERENCES: _(
            "From one part to the next of the same tool, without corrections. Shows sudden steps and scatter, whatever the wear; lasting shifts show in one point only. Runs have no meaning on it."
        ),
        Quantity.WEAR_RESIDUALS: _(
            "Without corrections, and without the wear of the baseline. Right for a compensated characteristic whose tool wears: it shows scatter, steps, and an edge that wears faster or slower than those of the baseline. Each edge sets its own level when it has run in."
        ),
    }[which]


def suits(*, corrects: bool, wears: bool) -> Quantity:
    """Quantity that a careful engineer would chart."""
    if not corrects:
        return Quantity.DEVIATION
    return Quantity.WEAR_RESIDUALS if wears else Quantity.WITHOUT_CORRECTIONS


def why_it_suits(which: Quantity) -> str:
    """Reason for this characteristic."""
    return {
        Quantity.DEVIATION: _("Nothing is corrected here, so the deviation shows the process itself."),
        Quantity.WITHOUT_CORRECTIONS: _(
            "This characteristic is corrected. On the deviation as measured the loop itself would fire the rules: chart the process without corrections."
        ),
        Quantity.WEAR_RESIDUALS: _(
            "This characteristic is corrected and its tool wears. On the deviation as measured the loop itself would fire the rules, and without corrections wear alone would: chart the residuals about the wear line."
        ),
    }.get(which, "")


def baseline_chart(name: str) -> str:
    """The pair of charts that a baseline is for."""
    return {
        "individuals": _("Individuals and moving range"),
        "xbar_r": _("Subgroups, X̄ and R"),
        "xbar_s": _("Subgroups, X̄ and s"),
    }[name]


def grouping(baseline: Baseline) -> str:
    """Forming of subgroups; empty for single values."""
    match baseline.grouping:
        case "consecutive":
            return _("{n} readings one after the other").format(n=baseline.group_size)
        case "pause":
            return _("until a pause of {minutes} min").format(minutes=f"{baseline.group_pause:g}")
        case "part":
            return _("readings of the same part")
        case "shift":
            same = _("readings of the same shift")
            return f"{same} ({baseline.shifts})" if baseline.shifts else same
        case "nest":
            return _("neighbours of the same nest or spindle")
        case _:
            return ""


def chart_name(kind: Chart) -> str:
    """Name of a chart."""
    return statistics.chart(kind)


def readings(first: int, last: int) -> str:
    """A run of readings."""
    return (
        _("reading {n}").format(n=first)
        if first == last
        else _("readings {first} to {last}").format(first=first, last=last)
    )


def left_out(found: LeftOut | None) -> list[str]:
    """Readings that count for nothing, named, and why."""
    if found is None:
        return []
    sentences = [
        (found.excluded, _("excluded from the statistics: {which}")),
        (found.by_baseline, _("left out by the baseline: {which}")),
        (found.faults, _("probe faults (R36): {which}")),
        (found.unknown, _("corrections not known: {which}")),
    ]
    return [text.format(which=named(numbers.tolist())) for numbers, text in sentences if len(numbers)]


def named(numbers: Sequence[int], most: int = 6) -> str:
    """Numbers as runs; of many the first ones.

    >>> named([3, 4, 5, 9]), named(range(1, 40, 2), 3)
    ('3 – 5, 9', '1, 3, 5 and 17 more')
    """
    runs: list[tuple[int, int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], number)
        else:
            runs.append((number, number))
    text = ", ".join(str(low) if low == high else f"{low} – {high}" for low, high in runs[:most])
    rest = sum(high - low + 1 for low, high in runs[most:])
    return _("{some} and {n} more").format(some=text, n=rest) if rest else text


def period(baseline: Baseline) -> str:
    """The period of a baseline with what it leaves out."""
    text = _("Readings {first} to {last}").format(first=baseline.first_sequence, last=baseline.last_sequence)
    left: Sequence[str] = [readings(run["first"], run["last"]) for run in baseline.excluded]
    return (
        text
        if not left
        else _("{period}, without {left}").format(
            period=text, left=", ".join(left[:3]) + (" …" if len(left) > 3 else "")
        )
    )
