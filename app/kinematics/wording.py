"""The sentences about rotary axes: what a run says, why it is refused, what to enter on the control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from app.core.kinematics.axis import AxisFault, NoAxis
from app.core.kinematics.results import MEASURED, OFFSETS, OPTIMISED, WIDTH, Damage, Flaw
from app.core.kinematics.sphere import NoSphere, SphereFault
from app.formats.rotary_protocol import Unread
from app.kinematics.values import AXIS_OF, UNITS
from app.web.i18n import _
from app.web.numbers import MINUS, NO_BREAK_SPACE, NOTHING, mm, signed, um, um_limit

if TYPE_CHECKING:
    from app.kinematics.drift import Drift
    from app.kinematics.outcome import Evaluated
    from app.kinematics.queries import RunRow
    from app.kinematics.tables import KinematicsRun


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
        return um_plain(value)
    return written(name, value)


def difference(name: str, value: float | None) -> str:
    """What lies between two values: in µm whatever it is of, or degrees."""
    return angle(value) if UNITS.get(name) == "°" else um(value)


def limit(name: str, value: float) -> str:
    """A limit of a value, both sides at once."""
    return f"±{value:g}{NO_BREAK_SPACE}°" if UNITS.get(name) == "°" else um_limit(value)


def name_words(name: str) -> str:
    """What a value is, in words."""
    axis = AXIS_OF.get(name, "")
    if name in MEASURED:
        return _("scatter of {axis} as measured").format(axis=axis)
    if name in OPTIMISED:
        return _("scatter of {axis} when optimised").format(axis=axis)
    if name in OFFSETS:
        return _("offset in {letter}").format(letter=OFFSETS[name])
    if name.startswith("E") and axis:
        if UNITS[name] == "°":
            return _("{axis} leans about {letter}").format(axis=axis, letter="XYZ"["ABC".index(name[1])])
        return _("{axis} stands off in {letter}").format(axis=axis, letter=name[1])
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
    """Why touches make no ball."""
    if fault.fault is SphereFault.TOO_FEW:
        return _("{got} touches came, a ball needs {needed} at least").format(got=fault.got, needed=fault.needed)
    return _("the touches lie in a plane or at one place, so the ball could lie on either side of them")


def no_axis(axis: str, fault: NoAxis) -> str:
    """Why positions make no axis."""
    values = {"axis": axis, "got": f"{fault.got:.4g}", "needed": f"{fault.needed:.4g}"}
    return {
        AxisFault.TOO_FEW: _("axis {axis} was measured at {got} different angles, {needed} are needed"),
        AxisFault.ONE_SIDED_ARC: _(
            "axis {axis} was measured on an arc of {got}° only, {needed}° are needed to tell the axis from the ball"
        ),
        AxisFault.ON_AXIS: _(
            "the ball lies {got} mm from axis {axis} and hardly moves when it turns; {needed} mm are needed"
        ),
        AxisFault.ELSEWHERE: _(
            "the centres lie {got} mm from where axis {axis} would bring the ball, {needed} mm at most could be an error"
        ),
        AxisFault.RANK: _("the positions of axis {axis} do not tell all errors apart (condition {got})"),
    }[fault.fault].format(**values)


def what_axis_needs(fault: NoAxis) -> str:
    """What to do about it."""
    if fault.fault is AxisFault.ELSEWHERE:
        return {
            "reversed": _("They fit an axis that counts the other way round: set `reversed`."),
            "head": _("They fit a ball that stays while the head turns: set `carries` to head."),
            "table": _("They fit a ball that turns with the table: set `carries` to table, or leave `reversed` out."),
        }.get(
            fault.fits,
            _("Check angles, nominal ball and the coordinates: `seen_from` machine takes them from `position`."),
        )
    if fault.fault is AxisFault.ON_AXIS:
        return _("Clamp the ball further out on the table.")
    return _("Measure at three angles or more, over as wide an arc as the axis permits.")


def flaw(found: Flaw) -> str:
    """What is wrong with a result parameter."""
    values = {"name": found.parameter, "n": found.number, "text": found.text[:60], "width": WIDTH}
    return {
        Damage.COUNT: _("{name}: four numbers are needed, {text} came; nobody can tell which, so none is taken"),
        Damage.LENGTH: _("{name}: number {n} “{text}” does not have {width} characters; digits may be lost"),
        Damage.CUT: _("{name}: number {n} “{text}” is cut short; too many digits are lost, so it is not taken"),
        Damage.SEPARATOR: _("{name}: the numbers are not separated by one space each"),
        Damage.COMMA: _("{name}: number {n} “{text}” has a decimal comma; it was read as a point"),
        Damage.NOT_A_NUMBER: _("{name}: number {n} “{text}” is not a number")
        if found.number
        else _("{name}: “{text}” is not a number"),
        Damage.TOO_LARGE: _("{name}: number {n} “{text}” is too large to be true")
        if found.number
        else _("{name}: “{text}” is too large to be true"),
        Damage.NEGATIVE: _("{name}: “{text}” is below 0, which no standard deviation is"),
        Damage.UNKNOWN: _("not understood: “{text}”"),
        Damage.TWICE: _("{name}: stands there twice; the first counts, not “{text}”"),
    }[found.damage].format(**values)


def not_understood(line: Unread) -> str:
    """A line of the protocol that was not understood."""
    if line.text == "<":
        return _("line {line}: the markup is broken and was skipped").format(line=line.line)
    return _("line {line} was not understood: “{text}”").format(line=line.line, text=line.text)


def moved_otherwise(axis: str, moved: Sequence[float], asked: Sequence[float]) -> str:
    """The places before and after do not lie as far apart as the corrections say."""
    return _("{axis}: from its place before to that after it is {moved}, but the corrections say {asked}").format(
        axis=axis, moved=" ".join(map(um, moved)), asked=" ".join(map(um, asked))
    )


def no_calibrated_radius() -> str:
    """There is nothing that maxDevCalBall could hold the ball against."""
    return _("maxDevCalBall could not be watched: neither the run nor the limits of the machine say the ball's radius")


# --- what a run says


def sentence(run: KinematicsRun | Evaluated) -> str:
    """How a run came out, in one sentence."""
    reason = run.reason
    if reason["code"] == "max_dev_cal_ball":
        text = _(
            "The ball measured {measured}, it was calibrated as {calibrated}: further off than {limit} (maxDevCalBall). The run "
            "counts for nothing."
        )
        return text.format(
            measured=mm(reason["measured"]), calibrated=mm(reason["calibrated"]), limit=um_limit(reason["limit"])
        )
    if reason["code"] == "max_modification":
        name = reason["name"]
        text = _("{name} = {value} is a larger change than the {limit} that are permitted (maxModification).")
        return text.format(name=name, value=written(name, reason["value"]), limit=limit(name, reason["limit"]))
    axes = run.results.get("axes") or []
    parts = [
        _("{axis}: scatter {before} → {after}").format(
            axis=axis["axis"], before=um_plain(axis["scatter_before"]), after=um_plain(axis["scatter_after"])
        )
        for axis in axes
        if axis["scatter_before"] is not None
    ]
    if parts:
        return "; ".join(parts) + "."
    if axes:
        return _("Position errors of {axes}.").format(axes=", ".join(axis["axis"] for axis in axes))
    return _("The ball alone: offset of the machine.")


def um_plain(length: float | None) -> str:
    r"""A scatter or range in µm: no sign, it has none.

    >>> um_plain(0.0134)
    '13.4\xa0µm'
    """
    return NOTHING if length is None else f"{length * 1000:.1f}{NO_BREAK_SPACE}µm".replace("-", MINUS)


def status_word(status: str) -> str:
    """How a run stands."""
    return {
        "refused": _("Refused"),
        "to_confirm": _("To be confirmed"),
        "confirmed": _("Confirmed"),
        "measured": _("Measured"),
        "entered": _("Entered"),
        "undone": _("Taken back"),
    }.get(status, status)


def form_word(form: str) -> str:
    """What a run was sent as."""
    return {
        "touches": _("Ball touches"),
        "centres": _("Ball centres"),
        "results": _("Result parameters"),
        "protocol": _("Protocol of the control"),
    }.get(form, form)


def approach_word(approach: int) -> str:
    """From where the axis came."""
    return {1: _("positive"), -1: _("negative")}.get(approach, "")


def alarm_sentence(data: Mapping[str, Any]) -> str:
    """What the alarm about a drift says."""
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
    """How fast a value moves, and whether that is more than scatter."""
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
        return _("{slope} {unit} a day, with 95 % certainty {low} to {high}: it drifts.").format(**values)
    return _("{slope} {unit} a day, with 95 % certainty {low} to {high}: no trend to be seen.").format(**values)


def a_day(drift: Drift) -> str:
    """The slope of the trend."""
    if drift.trend is None:
        return NOTHING
    if UNITS.get(drift.name) == "°":
        return angle(drift.trend.slope, 5)
    return um(drift.trend.slope, 2)


def cannot_confirm(row: RunRow) -> tuple[str, str]:
    """Why nothing is to be confirmed."""
    number, done = row.run.id, row.decisions.get("confirmed")
    if done is not None:
        text = _("Run {number} was confirmed by {who} on {at} already: {reason}")
        said = text.format(number=number, who=done.actor, at=done.at.isoformat(timespec="seconds"), reason=done.reason)
        return said, _("There is nothing left to do.")
    return (
        _("Run {number} asks for no confirmation.").format(number=number),
        _("Only a change larger than maxModification does."),
    )


def cannot_enter(row: RunRow) -> tuple[str, str]:
    """Why a run is not entered, and what to do."""
    number, done = row.run.id, row.decisions.get("entered")
    if done is not None:
        text = _("Run {number} was entered by {who} on {at} already: {reason}")
        said = text.format(number=number, who=done.actor, at=done.at.isoformat(timespec="seconds"), reason=done.reason)
        return said, _("There is nothing left to do.")
    if row.status == "refused":
        return _("Run {number} was refused: it counts for nothing.").format(number=number), _("Measure anew.")
    if row.status == "to_confirm":
        return f"{_('Run {number}').format(number=number)}: {sentence(row.run)}", _("Confirm it first, with a reason.")
    if row.overtaken:
        return (
            _("The kinematics has been changed since run {number} was measured.").format(number=number),
            _("Measure anew: what it found was beside the kinematics of then."),
        )
    return _("Run {number} found no position error.").format(number=number), _("There is nothing to enter.")
