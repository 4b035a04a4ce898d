"""The sentences about rotary axes: what a run says, why it is refused, what to enter on the control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from app.core.rotary.axis import AxisFault, NoAxis
from app.core.rotary.drift import FEWEST
from app.core.rotary.results import MEASURED, OFFSETS, OPTIMISED, WIDTH, Damage, Flaw
from app.core.rotary.sphere import NoSphere, SphereFault
from app.core.warning import CodedWarning
from app.files.formats.rotary_protocol import Unread
from app.geometry.rotary_axes.result_values import AXIS_OF, UNITS
from app.language.formatting import NO_BREAK_SPACE, NOTHING, mm, plain_um, short, signed, um, um_limit
from app.language.i18n import _, ngettext
from app.language.times import in_sentence

if TYPE_CHECKING:
    from app.geometry.rotary_axes.drift import Drift
    from app.geometry.rotary_axes.outcome import Evaluated
    from app.geometry.rotary_axes.queries import RunRow
    from app.geometry.rotary_axes.tables import KinematicsRun

MOST_LABELS = 5


def angle(value: float | None, decimals: int = 4) -> str:
    r"""An angle in degrees with its sign.

    >>> angle(-0.0013), angle(None)
    ('−0.0013\xa0°', '–')
    """
    return NOTHING if value is None else f"{signed(value, decimals)}{NO_BREAK_SPACE}°"


def written(name: str, value: float | None) -> str:
    """A value with its unit as people read it: deviations in µm, angles in degrees, radii in mm."""
    if UNITS.get(name) == "°":
        return angle(value)
    return mm(value) if name.startswith("radius") else um(value)


def entered(name: str, value: float | None) -> str:
    """A position error as it is entered on the control: mm or degrees, with its sign."""
    if value is None or UNITS.get(name) == "°":
        return angle(value)
    return f"{signed(value, 4)}{NO_BREAK_SPACE}mm"


def plainly(name: str, value: float | None) -> str:
    """The same, without a sign where a value has none: scatter, greatest deviation, mean error."""
    if name in MEASURED or name in OPTIMISED or name.partition(".")[0] in ("greatest", "mean_error"):
        return plain_um(value)
    return written(name, value)


def difference(name: str, value: float | None) -> str:
    """Difference of two values, in words: in µm or degrees."""
    return angle(value) if UNITS.get(name) == "°" else um(value)


def limit(name: str, value: float) -> str:
    """A limit of a value, both sides at once."""
    return f"±{value:g}{NO_BREAK_SPACE}°" if UNITS.get(name) == "°" else um_limit(value)


def name_words(name: str) -> str:
    """Name of a value, in words."""
    axis = AXIS_OF.get(name, "")
    if name in MEASURED:
        return _("scatter of {axis} as measured").format(axis=axis)
    if name in OPTIMISED:
        return _("scatter of {axis} when optimised").format(axis=axis)
    if name in OFFSETS:
        return _("offset in {letter}").format(letter=OFFSETS[name])
    if name.startswith("E") and axis:
        if UNITS[name] == "°":
            return _("{axis} is tilted about {letter}").format(axis=axis, letter="XYZ"["ABC".index(name[1])])
        return _("{axis} is offset in {letter}").format(axis=axis, letter=name[1])
    words = {
        "backlash": _("backlash of {axis}"),
        "greatest": _("greatest deviation of {axis}"),
        "mean_error": _("mean positioning error of {axis}"),
        "angle_error": _("angle error of {axis}"),
        "radius": _("measuring circle of {axis}"),
    }
    return words.get(name.partition(".")[0], name).format(axis=axis)


# --- what cannot be used


def no_sphere(fault: NoSphere) -> str:
    """Reason for which points determine no sphere."""
    if fault.fault is SphereFault.TOO_FEW:
        return _("{got} points received; a sphere needs at least {needed}").format(got=fault.got, needed=fault.needed)
    return _("the points lie in a plane or at one place, so the sphere could lie on either side of them")


def no_axis(axis: str, fault: NoAxis) -> str:
    """Reason for which positions determine no axis."""
    values = {"axis": axis, "got": f"{fault.got:.4g}", "needed": f"{fault.needed:.4g}"}
    return {
        AxisFault.TOO_FEW: _("axis {axis} was measured at {got} different angles, {needed} are needed"),
        AxisFault.ONE_SIDED_ARC: _(
            "axis {axis} was measured on an arc of {got}° only, {needed}° are needed to separate the axis from the sphere"
        ),
        AxisFault.ON_AXIS: _(
            "the sphere lies {got} mm from axis {axis} and hardly moves when it turns; {needed} mm are needed"
        ),
        AxisFault.ELSEWHERE: _(
            "the centres lie {got} mm from the positions to which axis {axis} would turn the sphere; an error is {needed} mm at most"
        ),
        AxisFault.RANK: _("the positions of axis {axis} do not separate all errors (condition {got})"),
    }[fault.fault].format(**values)


def what_axis_needs(fault: NoAxis) -> str:
    """Remedy for positions that determine no axis."""
    if fault.fault is AxisFault.ELSEWHERE:
        return {
            "reversed": _("They fit an axis with reversed direction: set `reversed`."),
            "head": _("They fit a sphere that stays while the head turns: set `carries` to head."),
            "table": _("They fit a sphere that turns with the table: set `carries` to table, or leave `reversed` out."),
        }.get(
            fault.fits,
            _(
                "Check the angles, the nominal sphere and the coordinates: `seen_from` machine takes them from `position`."
            ),
        )
    if fault.fault is AxisFault.ON_AXIS:
        return _("Clamp the calibration sphere further out on the table.")
    return _("Measure at three angles or more, over as wide an arc as the axis permits.")


def flaw(fault: Flaw) -> str:
    """Sentence on a fault of a result parameter."""
    values = {"name": fault.parameter, "n": fault.number, "text": fault.text[:60], "width": WIDTH}
    return {
        Damage.COUNT: _(
            "{name}: four numbers are needed, {text} received; it is not clear which is missing, so none is used"
        ),
        Damage.LENGTH: _("{name}: number {n} “{text}” does not have {width} characters; digits may be lost"),
        Damage.CUT: _("{name}: number {n} “{text}” is cut short; too many digits are lost, so it is not used"),
        Damage.SEPARATOR: _("{name}: the numbers are not separated by one space each"),
        Damage.COMMA: _("{name}: number {n} “{text}” has a decimal comma; it was read as a point"),
        Damage.NOT_A_NUMBER: _("{name}: number {n} “{text}” is not a number")
        if fault.number
        else _("{name}: “{text}” is not a number"),
        Damage.TOO_LARGE: _("{name}: number {n} “{text}” is implausibly large")
        if fault.number
        else _("{name}: “{text}” is implausibly large"),
        Damage.NEGATIVE: _("{name}: “{text}” is below 0; a standard deviation cannot be negative"),
        Damage.UNKNOWN: _("not understood: “{text}”"),
        Damage.TWICE: _("{name} occurs twice; the first value is used, not “{text}”"),
    }[fault.damage].format(**values)


def not_understood(line: Unread) -> str:
    """A line of the protocol that was not understood."""
    if line.text == "<":
        return _("line {line}: the markup is broken and was skipped").format(line=line.line)
    return _("line {line} was not understood: “{text}”").format(line=line.line, text=line.text)


def labels_to_add(unread: Sequence[Unread]) -> str:
    """The labels that are not known and how to add them, behind other advice; nothing where there are none."""
    labels = [f"“{label}”" for label in dict.fromkeys(line.label for line in unread) if label][:MOST_LABELS]
    if not labels:
        return ""
    return " " + _(
        "Labels in other words or another language, here {labels}, are added with a file that INBAND_ROTARY_WORDS names: "
        "see Help, Rotary axes."
    ).format(labels=", ".join(labels))


def moved_otherwise(axis: str, moved: Sequence[float], correction_values: Sequence[float]) -> str:
    """The places before and after do not lie as far apart as the corrections say."""
    return _("{axis}: the positions before and after differ by {moved}, but the corrections are {asked}").format(
        axis=axis, moved=" ".join(map(um, moved)), asked=" ".join(map(um, correction_values))
    )


def no_calibrated_radius() -> str:
    """There is nothing that maxDevCalBall could hold the ball against."""
    return _(
        "maxDevCalBall could not be checked: neither the run nor the limits of the machine state the radius of the calibration sphere"
    )


# --- what a run says


def not_confirmed() -> str:
    """Sentence on a run that waits to be confirmed."""
    return _("Do not enter values of this run before it is confirmed.")


def sentence(run: KinematicsRun | Evaluated) -> str:
    """Result of a run, in one sentence."""
    reason = run.reason
    if reason["code"] == "max_dev_cal_ball":
        text = _(
            "The measured sphere radius is {measured}, the calibrated radius {calibrated}: the difference exceeds {limit} (maxDevCalBall). "
            "The run is not used."
        )
        return text.format(
            measured=mm(reason["measured"]), calibrated=mm(reason["calibrated"]), limit=um_limit(reason["limit"])
        )
    if reason["code"] == "max_modification":
        name = reason["name"]
        text = _("{name} = {value} is a larger change than the permitted {limit} (maxModification).")
        return text.format(name=name, value=written(name, reason["value"]), limit=limit(name, reason["limit"]))
    axes = run.results.get("axes") or []
    parts = [
        _("{axis}: scatter {before} → {after}").format(
            axis=axis["axis"], before=plain_um(axis["scatter_before"]), after=plain_um(axis["scatter_after"])
        )
        for axis in axes
        if axis["scatter_before"] is not None
    ]
    if parts:
        return "; ".join(parts) + "."
    if axes:
        return _("Position errors of {axes}.").format(axes=", ".join(axis["axis"] for axis in axes))
    return _("Calibration sphere only: offset of the machine.")


def warning(warned: CodedWarning) -> str:
    """A warning about a run in words."""
    name, value = str(warned.values["name"]), float(warned.values["value"])  # type: ignore[arg-type] # as the core made it
    text = {
        "axis_far_off": _(
            "{name} = {value}: implausibly far from the position in the kinematics; {limit} is plausible."
        ),
        "axis_leans_far": _("{name} = {value}: implausibly large tilt; {limit} is plausible."),
        "ball_far_off": _("{name} = {value}: the sphere is far from its nominal position; {limit} is plausible."),
        "scatter_large": _("{name} = {value}: implausibly large scatter; {limit} is plausible."),
    }[warned.code]
    unit = "°" if UNITS.get(name) == "°" else "mm"
    value_words = f"{short(value, 8)}{NO_BREAK_SPACE}{unit}"
    return text.format(name=name, value=value_words, limit=limit(name, float(warned.values["limit"])))  # type: ignore[arg-type]


def status_word(status: str) -> str:
    """Status of a run."""
    return {
        "refused": _("Refused"),
        "to_confirm": _("To be confirmed"),
        "confirmed": _("Confirmed"),
        "measured": _("Measured"),
        "entered": _("Entered"),
        "undone": _("Undone"),
    }.get(status, status)


def form_word(form: str) -> str:
    """Form in which a run was sent."""
    return {
        "touches": _("Probed points of the sphere"),
        "centres": _("Sphere centres"),
        "results": _("Result parameters"),
        "protocol": _("Protocol of the control"),
    }.get(form, form)


def approach_word(approach: int) -> str:
    """From where the axis came."""
    return {1: _("positive"), -1: _("negative")}.get(approach, "")


def alarm_sentence(data: Mapping[str, Any]) -> str:
    """Sentence of the alarm about a drift."""
    name = str(data.get("name") or data.get("location"))
    text = _("{what} ({name}) has drifted to {value}, beyond its limit {limit}; run {run}.")
    if head := str(data.get("head") or ""):
        text = _("{what} ({name}, head {head}) has drifted to {value}, beyond its limit {limit}; run {run}.")
    return text.format(
        what=name_words(name)[:1].upper() + name_words(name)[1:],
        name=name,
        head=head,
        value=written(name, data.get("value")),
        limit=limit(name, data.get("limit") or 0.0),
        run=data.get("run"),
    )


def trend_sentence(drift: Drift) -> str:
    """Rate of change of a value, and if that is more than scatter."""
    waiting = sum(point.waits for point in drift.points)
    if not waiting:
        return _rate_sentence(drift)
    return f"{_rate_sentence(drift)} " + ngettext(
        "A run that waits to be confirmed does not count in it.",
        "{n} runs that wait to be confirmed do not count in it.",
        waiting,
    ).format(n=waiting)


def _rate_sentence(drift: Drift) -> str:
    if drift.trend is None and sum(not point.waits for point in drift.points) >= FEWEST:
        return _(
            "No trend can be determined: these runs do not vary (their resolution is too coarse), or were made at the same time."
        )
    if drift.trend is None:
        return _("Three runs at different times are needed for a trend.")
    factor, unit = (1.0, "°") if UNITS.get(drift.name) == "°" else (1000.0, "µm")
    decimals = 5 if unit == "°" else 2
    values = {
        "slope": signed(drift.trend.slope * factor, decimals),
        "low": signed(drift.trend.low * factor, decimals),
        "high": signed(drift.trend.high * factor, decimals),
        "unit": unit,
    }
    if drift.trend.moves:
        return _("{slope} {unit} a day, with 95 % confidence {low} to {high}: it drifts.").format(**values)
    return _("{slope} {unit} a day, with 95 % confidence {low} to {high}: no trend to be seen.").format(**values)


def a_day(drift: Drift) -> str:
    """The slope of the trend."""
    if drift.trend is None:
        return NOTHING
    if UNITS.get(drift.name) == "°":
        return angle(drift.trend.slope, 5)
    return um(drift.trend.slope, 2)


def cannot_confirm(row: RunRow) -> tuple[str, str]:
    """Reason for which there is nothing to confirm."""
    number, done = row.run.id, row.decisions.get("confirmed")
    if done is not None:
        text = _("Run {number} was confirmed by {who} on {at} already: {reason}")
        sentence_on_decision = text.format(number=number, who=done.actor, at=in_sentence(done.at), reason=done.reason)
        return sentence_on_decision, _("There is nothing left to do.")
    return (
        _("Run {number} asks for no confirmation.").format(number=number),
        _("Only a change larger than maxModification does, or one with warnings."),
    )


def cannot_enter(row: RunRow) -> tuple[str, str]:
    """Reason for which a run is not entered, and the remedy."""
    number, done = row.run.id, row.decisions.get("entered")
    if done is not None:
        text = _("Run {number} was entered by {who} on {at} already: {reason}")
        sentence_on_decision = text.format(number=number, who=done.actor, at=in_sentence(done.at), reason=done.reason)
        return sentence_on_decision, _("There is nothing left to do.")
    if row.status == "refused":
        return _("Run {number} was refused and is not used.").format(number=number), _("Measure again.")
    if row.status == "to_confirm":
        warned = " ".join(warning(item) for item in row.warnings) or sentence(row.run)
        return _("Run {number}: {warnings}").format(number=number, warnings=warned), _(
            "Confirm it first, with a reason."
        )
    if row.overtaken:
        return (
            _("The kinematics has been changed since run {number} was measured.").format(number=number),
            _("Measure again: its values refer to an earlier kinematics."),
        )
    return _("Run {number} found no position error.").format(number=number), _("There is nothing to enter.")
