"""The words of the load by alarms: what makes an alarm, where that is set, and what a quieter setting would have done."""

from app.access.callers import Caller
from app.core.alarm_load import LoadVerdict
from app.language.i18n import _
from app.views.alarm_load.queries import REPLAYED, Loud


def verdict_word(verdict: LoadVerdict) -> str:
    """The mean rate against the standard, in a word or two."""
    return {
        LoadVerdict.ACCEPTABLE: _("acceptable"),
        LoadVerdict.MANAGEABLE: _("manageable at most"),
        LoadVerdict.TOO_MANY: _("too many"),
    }[verdict]


SETTINGS = {
    "corrections_not_taken": "INBAND_CORRECTIONS_TAKEN_WITHIN",
    "bridge_silent": "INBAND_BRIDGE_SILENT_AFTER",
    "bridge_backing_up": "INBAND_BRIDGE_BACKLOG_AFTER",
}
"""Settings of the server by which alarms of a kind are raised."""


def made_by(kind: str, caller: Caller) -> str:
    """The rule or parameter by which alarms of a kind are raised; a setting by its name for who may change it."""
    if kind in SETTINGS and caller.may("admin"):
        return SETTINGS[kind]
    return {
        "oversize": _("tolerance R35, reached in spite of R33, R34 and k"),
        "undersize": _("tolerance R35, reached in spite of R33, R34 and k"),
        "tool_worn": _("wear limit R37"),
        "probe_fault": _("confidence limit R36, or the probe itself"),
        "implausible": _("largest plausible jump"),
        "acceptance": _("acceptance n of m"),
        "offset_limit": _("largest sum of corrections"),
        "offset_differs": _("offset that the control reports"),
        "opposite_effect": _("factor, or the offset register"),
        "strong_effect": _("factor, or the offset register"),
        "still_out": _("tolerance R35, reached again after each correction"),
        "early_effect": _("the machine's clock, or what it says is in effect"),
        "correction_in_doubt": _("what the machine says is in effect"),
        "unusual_gain": _("factor"),
        "characteristics_disagree": _("targets and empirical values of two characteristics"),
        "corrections_not_taken": _("time allowed for taking a correction; ask an administrator"),
        "tool_life": _("planned life of the edge"),
        "measurement_missed": _("control plan"),
        "context_missing": _("control plan"),
        "hunting": _("zero range R33 and k"),
        "signal": _("run rule"),
        "bridge_silent": _("time a bridge may be silent; ask an administrator"),
        "bridge_backing_up": _("time a reading may wait in a bridge; ask an administrator"),
        "bridge_quarantine": _("refusal of readings"),
        "readings_late": _("network of the machine"),
        "server_away": _("server or database"),
        "touch_count": _("points and repeats"),
        "machine_fault": _("report of the machine"),
        "calibration_overdue": _("calibration plan"),
        "calibration_refused": _("limits of calibration"),
        "fixture_shifted": _("limit of the fixture"),
        "kinematics_drift": _("limit of the axis"),
    }.get(kind, kind)


def quieter_words(loud: Loud) -> str:
    """The effect that a quieter setting would have had on these alarms; where it is not computed, that."""
    found, kind = loud.quieter, loud.cause.kind
    if found is None:
        if kind in {"oversize", "undersize", "hunting"} and loud.characteristic is not None:
            return _("not computed: replay other R33, R34 and k")
        return _("not computed")
    if kind in {"oversize", "undersize"}:
        text = (
            _("R33 halved: {left} out of tolerance in place of {n}, in a replay of the last {readings} readings")
            if found.left < found.alarms
            else _(
                "R33 halved does not help: {left} out of tolerance, {n} as it is, in a replay of the last {readings} readings"
            )
        )
        return text.format(left=found.left, n=found.alarms, readings=REPLAYED)
    left = _("{left} of {n} alarms left").format(left=found.left, n=found.alarms)
    match kind:
        case "signal":
            return _("rule without alarm: {left}; its signals stay on the list").format(left=left)
        case "bridge_silent":
            return _("silent after {factor:g} times as long: {left}").format(factor=found.factor or 1, left=left)
        case _:
            return _("R37 wider by {percent:.0f} %: {left}").format(percent=((found.factor or 1) - 1) * 100, left=left)
