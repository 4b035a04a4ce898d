"""Measuring plans in words: what may go wrong with one, and what the manual asks for."""

from app.core.warning import CodedWarning
from app.language.i18n import _


def sentence(warning: CodedWarning) -> str:
    """One warning or refusal."""
    values = {name: f"{value:g}" if isinstance(value, int | float) else value for name, value in warning.values.items()}
    return {
        "no_axis": _("No axis is measured: the cycle finds the drift of the sphere alone"),
        "feed_zero": _("Q253 is 0: the axes would not move. Say a feed, or FMAX, FAUTO or PREDEF"),
        "only_451": _("{q} = {value} is left out: cycle 452 has no such parameter, cycle 451 has"),
        "few_positions": _(
            "Axis {axis} is measured at {got} different angles; Inband computes an axis from {needed} on"
        ),
        "narrow_arc": _("Axis {axis} is measured over {arc}° only; below {needed}° Inband computes no axis"),
        "measured_twice": _("Axis {axis} is measured at one angle twice; end it before the full turn"),
        "moved_to_teeth": _("Axis {axis}: the control moves positions by up to {moved}° to the nearest Hirth tooth"),
        "travel_unknown": _(
            "Axis {axis} has no position encoder of its own: leave {needed}° between every position and the limit "
            "switches, which are not stated here"
        ),
        "near_limit_switch": _(
            "Axis {axis} has no position encoder of its own and comes within {room}° of a limit switch; it needs {needed}°"
        ),
        "hirth_no_retract": _("must be above 0: axis {axis} has Hirth teeth, and the control refuses Q408 = 0"),
        "beyond_travel": _("axis {axis} cannot go to {angle}°: its limit switches are at {low}° and {high}°"),
    }[warning.code].format(**values)


def asked_for() -> list[str]:
    """Requirements of the cycle's manual before it is run."""
    return [
        _("The calibration sphere is clamped, and the preset lies in its centre and is active."),
        _("The mode is FUNCTION MODE MILL; M128 and FUNCTION TCPM are off; every tilted plane is reset."),
        _("The basic rotation is off. Preset and basic rotation are set again afterwards."),
        _(
            "Towards the sphere the smaller of Q253 and FMAX of the probe table counts. Rotary axes move with Q253, and the "
            "probe is not monitored meanwhile."
        ),
        _("With Q408 = 0 the control goes to the first position with A, then B, then C."),
        _("The backlash angle Q432 must be much larger than the backlash itself."),
        _("Cycle 450 saves the kinematics before: if the cycle is broken off, it may be another one."),
    ]
