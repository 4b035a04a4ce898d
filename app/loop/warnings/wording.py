"""The sentences of warnings: what may be wrong, and what it usually is."""

from collections.abc import Sequence
from typing import Any

from app.core.warning import CodedWarning
from app.language.formatting import PLUS_MINUS, mm, signed, um
from app.language.i18n import _


def sentence(warning: CodedWarning) -> str:
    """A warning in words."""
    values: dict[str, Any] = dict(warning.values)
    text = _TEXTS.get(warning.code)
    return warning.code if text is None else text(values)


def _at(touches: Sequence[int]) -> str:
    return ", ".join(map(str, touches))


def _degrees(value: float) -> str:
    return f"{value:.4g}°"


def _length(value: float) -> str:
    return mm(value, 4 if abs(value) < 1 else 2 if value % 1 else 0)


def _turned_far(values: dict[str, Any]) -> str:
    return _(
        "The part would be turned by {turn}; on this machine more than {limit} is not plausible. "
        "Check the touches for a wrong number and for points exchanged."
    ).format(turn=_degrees(values["turn"]), limit=_degrees(values["limit"]))


def _shifted_far(values: dict[str, Any]) -> str:
    return _(
        "The part would lie {shift} beside its place; on this machine more than {limit} is not plausible. "
        "Check the touches for a wrong number, and the unit."
    ).format(shift=_length(values["shift"]), limit=_length(values["limit"]))


def _touch_far_off(values: dict[str, Any]) -> str:
    return _(
        "Touch {n} lies {off} from its nominal place; up to {limit} is plausible there. Is it a typing error?"
    ).format(n=_at(values["touches"]), off=_length(values["off"]), limit=_length(values["limit"]))


def _points_exchanged(values: dict[str, Any]) -> str:
    return _("Touches {n} fit in each other's place: are they exchanged?").format(n=_at(values["touches"]))


def _looks_like_inches(values: dict[str, Any]) -> str:
    if values.get("which") == "nominal":
        return _("The nominal places fit 25.4 times better as inches. All lengths are sent in mm.")
    if values.get("which") == "size":
        return _("{size} looks like {expected} in inches. All lengths are in mm: send the size in mm.").format(
            size=mm(values["size"]), expected=mm(values["expected"])
        )
    return _("The measured places fit 25.4 times better as inches. All lengths are sent in mm.")


def _touch_does_not_fit(values: dict[str, Any]) -> str:
    if len(values["touches"]) == 1:
        text = _("Touch {n} does not fit the others: {residual} are left. A chip, a burr, or a wrong number?")
    else:
        text = _("One of the touches {n} does not fit, {residual} are left; which of them, the others cannot tell.")
    return text.format(n=_at(values["touches"]), residual=um(values["residual"]).lstrip("+"))


def _holes_apart(values: dict[str, Any]) -> str:
    return _(
        "The distance of the holes differs by {off} from the nominal one; up to {limit} is plausible. Are these the right holes?"
    ).format(off=f"{signed(values['off'], 3)} mm", limit=_length(values["limit"]))


def _not_square(values: dict[str, Any]) -> str:
    return _("The sides of the corner are {angle} off a right angle. X follows the side along X.").format(
        angle=f"{signed(values['angle'], 3)}°"
    )


def _feeler_unusual(values: dict[str, Any]) -> str:
    return _("A feeler gauge of {feeler} is unusual: between 0 and {limit} is expected.").format(
        feeler=_length(values["feeler"]), limit=_length(values["limit"])
    )


def _of_warned(values: dict[str, Any]) -> str:
    return _("Alignment {number}, which this one is composed of, has warnings that are not acknowledged.").format(
        number=int(values["number"])
    )


def _offset_step(values: dict[str, Any]) -> str:
    return _(
        "The offset was {before} and is {after} now, more than {limit} away. Offsets are sent in mm: is it µm?"
    ).format(before=mm(values["before"]), after=mm(values["after"]), limit=_length(values["limit"]))


def _empirical_value_large(values: dict[str, Any]) -> str:
    return _("An empirical value of {value} is more than {limit}: no probe measures so far off. Is it µm?").format(
        value=mm(values["value"]), limit=_length(values["limit"])
    )


def _empirical_value_step(values: dict[str, Any]) -> str:
    return _(
        "The empirical value was {before} and is {after} now: every size reads {change} from before, more than a tolerance of "
        "{pm} {limit} there, and the next reading asks for that. Is it µm?"
    ).format(
        before=mm(values["before"]),
        after=mm(values["after"]),
        change=um(values["before"] - values["after"]),
        pm=PLUS_MINUS,
        limit=mm(values["limit"]),
    )


def _pair_apart(values: dict[str, Any]) -> str:
    return _("Machine and gauge differ by {off}; up to {limit} is plausible. Is it the same part?").format(
        off=mm(values["off"]), limit=_length(values["limit"])
    )


_TEXTS = {
    "pair_apart": _pair_apart,
    "offset_step": _offset_step,
    "empirical_value_large": _empirical_value_large,
    "empirical_value_step": _empirical_value_step,
    "turned_far": _turned_far,
    "shifted_far": _shifted_far,
    "touch_far_off": _touch_far_off,
    "points_exchanged": _points_exchanged,
    "looks_like_inches": _looks_like_inches,
    "touch_does_not_fit": _touch_does_not_fit,
    "holes_apart": _holes_apart,
    "not_square": _not_square,
    "feeler_unusual": _feeler_unusual,
    "composed_of_warned": _of_warned,
}
