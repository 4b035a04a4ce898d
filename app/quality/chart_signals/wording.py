"""The words of signals: what a rule has found where, what it was, and the alarm that it raised."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any
from urllib.parse import urlencode

from app.core.spc.rules import RULES, RuleName, Run
from app.core.spc.shewhart import Chart
from app.language.i18n import _, ngettext
from app.loop.summaries import wording as statistics
from app.quality.chart_signals.tables import Signal

AROUND = 40  # readings shown before and after a signal


class Cause(StrEnum):
    """Cause of a signal."""

    TOOL = "tool"
    MATERIAL = "material"
    CLAMPING = "clamping"
    PROBE = "probe"
    OFFSET = "offset"
    MACHINE = "machine"
    LOOP = "loop"
    CHANCE = "chance"
    OTHER = "other"


def cause(which: Cause | str | None) -> str:
    """In words; what it was is said by a person."""
    return {
        Cause.TOOL: _("Tool: worn, broken or changed"),
        Cause.MATERIAL: _("Material or blank"),
        Cause.CLAMPING: _("Clamping"),
        Cause.PROBE: _("Probe or dirt"),
        Cause.OFFSET: _("Offset or program changed by hand"),
        Cause.MACHINE: _("Machine: heat, axis, spindle"),
        Cause.LOOP: _("The corrections themselves"),
        Cause.CHANCE: _("Looked for, nothing found"),
        Cause.OTHER: _("Something else"),
    }.get(Cause(which) if which else Cause.OTHER, "")


def state(name: str) -> str:
    """Name the state of a signal."""
    return {"open": _("open"), "explained": _("explained"), "withdrawn": _("withdrawn"), "all": _("all")}[name]


def data_of(signal: Signal) -> dict[str, Any]:
    """Values that the sentence of a signal is worded from."""
    return {
        "signal": signal.id,
        "chart": signal.chart,
        "rule": signal.rule,
        "side": signal.side,
        "first": signal.first_sequence,
        "last": signal.last_sequence,
        "points": signal.points,
    }


def sentence(data: Mapping[str, Any]) -> str:
    """A signal: the rule, the chart, the readings, and what the rule looks for."""
    chart = Chart(data["chart"])
    values = {"chart": statistics.chart(chart), "run": run(data), "what": what(data)}
    if chart not in {Chart.INDIVIDUALS, Chart.XBAR}:  # which know no rule but their limits
        return _("{chart}, {run}: {what}").format(**values)
    return _("{rule}, {chart}, {run}: {what}").format(rule=rule(chart, RuleName(data["rule"])), **values)


def rule(chart: Chart, name: RuleName) -> str:
    """The rule as it is known; on charts that know none but their limits, these."""
    return statistics.rule_name(name) if chart in {Chart.INDIVIDUALS, Chart.XBAR} else _("Limits")


def run(data: Mapping[str, Any]) -> str:
    """The readings it is made of."""
    if data["first"] == data["last"]:
        return _("reading {n}").format(n=data["first"])
    return _("readings {first} to {last}").format(first=data["first"], last=data["last"])


def what(data: Mapping[str, Any]) -> str:
    """Describe these points: their number, and their side."""
    chart, which, n = Chart(data["chart"]), RULES[RuleName(data["rule"])], data["points"]
    where = statistics.side(Run(which.name, data["side"], 0, 0, n), which)
    match which.name:
        case RuleName.NELSON_1:
            text = {
                Chart.INDIVIDUALS: ngettext(
                    "%(num)d point beyond the limit", "%(num)d points in a row beyond the limit", n
                ),
                Chart.XBAR: ngettext("%(num)d mean beyond the limit", "%(num)d means in a row beyond the limit", n),
                Chart.EWMA: ngettext(
                    "average beyond its limit at %(num)d point", "average beyond its limit at %(num)d points", n
                ),
                Chart.MOVING_AVERAGE: ngettext(
                    "average beyond its limit at %(num)d point", "average beyond its limit at %(num)d points", n
                ),
                Chart.CUSUM: ngettext("sum beyond h at %(num)d point", "sum beyond h at %(num)d points", n),
            }.get(chart, ngettext("%(num)d range beyond its limit", "%(num)d ranges in a row beyond their limit", n))
        case RuleName.NELSON_2 | RuleName.WESTERN_4:
            text = ngettext("%(num)d point on one side", "%(num)d points in a row on one side of the centre", n)
        case RuleName.NELSON_3:
            text = ngettext("%(num)d point in a row", "%(num)d points in a row", n)
        case RuleName.NELSON_4:
            text = ngettext("%(num)d point by turns", "%(num)d points in a row go up and down by turns", n)
        case RuleName.NELSON_5:
            text = ngettext("%(num)d point beyond 2 sigma", "%(num)d points close together beyond 2 sigma", n)
        case RuleName.NELSON_6:
            text = ngettext("%(num)d point beyond 1 sigma", "%(num)d points close together beyond 1 sigma", n)
        case RuleName.NELSON_7:
            text = ngettext("%(num)d point within 1 sigma", "%(num)d points in a row within 1 sigma", n)
        case RuleName.NELSON_8:
            text = ngettext("%(num)d point beyond 1 sigma", "%(num)d points in a row beyond 1 sigma, on either side", n)
    sentence = text % {"num": n}
    return _("{what}, {where}").format(what=sentence, where=where) if where else sentence


def alarm_sentence(data: Mapping[str, Any]) -> str:
    """Sentence of an alarm of kind signal, with each of its signals."""
    signals = data.get("signals") or []
    return " ".join(f"{one}." for one in map(_with_repeats, signals))


def _with_repeats(data: Mapping[str, Any]) -> str:
    runs = data.get("runs", 1)
    if runs == 1:
        return sentence(data)
    return _("{signal}, the last of {n} since").format(signal=sentence(data), n=runs)


def window(data: Mapping[str, Any]) -> dict[str, Any]:
    """The readings about a signal, as charts and pages are asked for them."""
    return {"first": max(1, data["first"] - AROUND), "through": data["last"] + AROUND}


def page_of(key: str, data: Mapping[str, Any]) -> str:
    """The control chart about a signal."""
    remembers = data["chart"] in {Chart.EWMA, Chart.MOVING_AVERAGE, Chart.CUSUM}
    query = ({"chart": data["chart"]} if remembers else {}) | window(data)
    return f"/characteristics/{key}/control?{urlencode(query)}"
