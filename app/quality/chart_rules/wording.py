"""The words of rules: where they watch, what they look for there, how often they fire, by themselves and by chance."""

from typing import Any

from app.core.spc.false_alarms import LONGEST, FalseAlarms
from app.core.spc.rules import RULES, RuleName
from app.core.spc.shewhart import Chart
from app.language.formatting import grouped
from app.language.i18n import _, ngettext
from app.loop.summaries import wording as statistics
from app.quality.chart_rules.places import Do, Place, Rules
from app.quality.chart_rules.queries import RuleTrial


def looks_for(name: RuleName, chart: Chart) -> str:
    """Pattern that a rule looks for on a chart, in a sentence."""
    if name is not RuleName.NELSON_1 or chart in {Chart.INDIVIDUALS, Chart.XBAR}:
        return statistics.rule(RULES[name])
    return {
        Chart.MOVING_RANGE: _("Two neighbours lie further apart than the limit allows."),
        Chart.RANGES: _("The range within a subgroup is beyond its limits."),
        Chart.DEVIATIONS: _("The standard deviation within a subgroup is beyond its limits."),
        Chart.EWMA: _("The weighted average is beyond its limits."),
        Chart.MOVING_AVERAGE: _("The moving average is beyond its limits."),
        Chart.CUSUM: _("One of the two cumulative sums is beyond h."),
    }[chart]


def causes(name: RuleName, chart: Chart) -> str:
    """Usual causes on a machine tool."""
    if name is not RuleName.NELSON_1 or chart in {Chart.INDIVIDUALS, Chart.XBAR}:
        return statistics.hint(name)
    if chart in {Chart.MOVING_RANGE, Chart.RANGES, Chart.DEVIATIONS}:
        return _(
            "The scatter has grown, or there was a step: a part clamped badly, a loose insert, chips, a worn probe."
        )
    return _(
        "The mean has moved a little, and stays there: wear, heat, a new batch of material. Seen sooner than by runs."
    )


def name_of(name: RuleName, chart: Chart) -> str:
    """The rule as it is known; on charts that know none but their limits, these."""
    return statistics.rule_name(name) if chart in {Chart.INDIVIDUALS, Chart.XBAR} else _("Limits")


def why_not(place: Place) -> str:
    """Give the reason why only the limits are offered."""
    if place is Place.MAIN:
        return _("neighbouring differences share a reading, so runs come by themselves; only the limits have a meaning")
    if place is Place.SCATTER:
        return _("ranges scatter unevenly about their centre, so zones and runs have no meaning; only the limits have")
    return _("its points share readings, so runs come by themselves; only the limits have a meaning")


def does(do: Do | None) -> str:
    """Action that follows from a signal."""
    return {None: _("off"), Do.WATCH: _("watch"), Do.ALARM: _("alarm")}[do]


def every(chance: FalseAlarms) -> str:
    """False-alarm rate of a rule."""
    if chance.every == float("inf"):
        return _("never")
    if chance.rarely:
        return _("less than 1 in {points} points").format(points=grouped(round(LONGEST)))
    text = _("1 in {points} points").format(points=grouped(round(chance.every)))
    return text if chance.exact else _("about {text}").format(text=text)


def fired(tried: RuleTrial) -> str:
    """Number of signals that a rule would have given."""
    if not tried.points:
        return _("no points")
    if not tried.signals:
        return _("never")
    return ngettext("%(n)s time", "%(n)s times", tried.signals) % {"n": grouped(tried.signals)}


def expected(tried: RuleTrial) -> str:
    """Number of signals that chance alone would have given on as many points.

    >>> from app.core.spc.false_alarms import FalseAlarms
    >>> expected(RuleTrial(14, 1000, 90, FalseAlarms(370.4)))
    '2.7'
    """
    number = tried.expected
    if number >= 9.5:
        return grouped(round(number))
    return f"{number:.1f}" if number >= 0.05 else _("less than 0.1") if number else "0"


def verdict(tried: RuleTrial) -> str:
    """Tell if that is more than chance explains."""
    if not tried.points:
        return ""
    if tried.more_than_chance:
        return _("more than chance explains")
    return _("no more than by chance")


def compared(tried: RuleTrial) -> str:
    """Both in a line."""
    if not tried.points:
        return fired(tried)
    return _("{fired}, by chance {expected}: {verdict}").format(
        fired=fired(tried), expected=expected(tried), verdict=verdict(tried)
    )


def summary(everything: RuleTrial) -> str:
    """Effect of switching these rules on together, in plain words."""
    if not everything.points:
        return _("There is no reading to try the rules on.")
    if everything.chance.every == float("inf"):
        return _("No rule is on: nothing is kept and nothing raises an alarm.")
    return _(
        "Together, the rules that are on would have given {signals} on these {points} points. Of a process in which nothing "
        "happens, chance alone gives {expected}: {every}, on independent readings that are distributed normally."
    ).format(
        signals=signals(everything.signals),
        points=grouped(everything.points),
        expected=expected(everything),
        every=every(everything.chance),
    )


def signals(number: int) -> str:
    """The number of signals in words."""
    return ngettext("%(n)s signal", "%(n)s signals", number) % {"n": grouped(number)}


def why_more() -> str:
    """Possible reasons why rules fire more often than by chance."""
    return _(
        "More signals than chance explains: the readings are not independent, or not about one centre. The process has "
        "changed since the baseline, or its corrections, wear or a mixture of streams are in what is charted."
    )


def listed(rules: Rules) -> str:
    """Rules that are on, in a line."""
    lines = [
        _("{place}: {rules}").format(
            place=at(place),
            rules=", ".join(
                (statistics.rule_name(name) if place is Place.MAIN else _("limits"))
                + (f" ({does(setting.do)})" if setting.do is Do.ALARM else "")
                for name, setting in named.items()
            ),
        )
        for place, named in rules.items()
        if named
    ]
    return "; ".join(lines) or _("none")


def at(place: Place) -> str:
    """A chart by its place, whichever kind it is."""
    return {
        Place.MAIN: _("individuals or means"),
        Place.SCATTER: _("scatter"),
        Place.EWMA: statistics.chart(Chart.EWMA),
        Place.MOVING_AVERAGE: statistics.chart(Chart.MOVING_AVERAGE),
        Place.CUSUM: statistics.chart(Chart.CUSUM),
    }[place]


def as_recorded(rules: Rules) -> dict[str, Any]:
    """Rules as they are in the record of changes."""
    return {place.value: {name.value: setting.do.value for name, setting in rules[place].items()} for place in rules}
