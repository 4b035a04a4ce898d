"""Runs that the control has reckoned itself: its result parameters and its protocol, read as far as they go."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from app.core.decision.step import rounded
from app.core.programs.lines import written
from app.core.rotary.axis import AXES, ERRORS, AxisName
from app.core.rotary.results import MEASURED, OFFSETS, OPTIMISED, SCALARS, STRINGS, Results, read_results
from app.errors import FieldError, Invalid
from app.files.apart import apart
from app.files.formats.delimited import Unusable
from app.files.formats.rotary_protocol import AxisProtocol, Protocol, read_protocol
from app.files.formats.rotary_words import known_words
from app.geometry.rotary_axes import wording
from app.geometry.rotary_axes.outcome import LETTERS, Evaluated, correction
from app.language.i18n import _

MOST_NOTES = 200
SAME_PLACE = 0.0002  # mm; a protocol states places with four decimals


def results_of(values: Mapping[str, float | str]) -> Results:
    """Parameters that came as fields. Raises `Invalid` for names that there are not, and text where a number belongs."""
    errors = []
    lines = []
    for name, value in values.items():
        known = name.upper() if name.isascii() else name
        if known not in {*SCALARS, *STRINGS}:
            errors.append(FieldError("results", _("there is no result {name}").format(name=repr(name[:20]))))
        elif (known in STRINGS) is not isinstance(value, str):
            wrong = _("four numbers of ten characters, as text") if known in STRINGS else _("must be a number")
            errors.append(FieldError(f"results.{known}", wrong))
        else:
            lines.append(f'{known} = "{value}"' if isinstance(value, str) else f"{known} = {written(value)}")
    if errors:
        raise Invalid(
            f"{errors[0].field}: {errors[0].message}.", _("There are Q141 to Q149 and QS144 to QS146."), errors=errors
        )
    return read_results("\n".join(lines))


def of_parameters(read: Results, came_as: str) -> Evaluated:
    evaluated = Evaluated("results")
    evaluated.results["notes"] = [wording.flaw(flaw) for flaw in read.flaws[:MOST_NOTES]]
    _fill_in(evaluated, read, {})
    if not evaluated.results["axes"] and evaluated.results["offsets"] is None:
        notes = "; ".join(evaluated.results["notes"][:3])
        raise Invalid.at(
            came_as,
            _("no result parameter can be read: {notes}").format(notes=notes or _("no axis was measured")),
            do=_('Write a line for each, like Q143 = 0.0134 or QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345".'),
        )
    return evaluated


def _fill_in(evaluated: Evaluated, read: Results, axes: Mapping[AxisName, AxisProtocol]) -> None:
    """Results that nothing is to be computed of: as they are in parameters and protocol."""
    for axis in AXES:
        axis_protocol = axes.get(axis)
        errors: dict[str, float | None] = (
            dict(read.errors.get(axis) or {})
            if axis_protocol is None
            else {**axis_protocol.errors, **(read.errors.get(axis) or {})}
        )
        before = read.scalars.get(next(name for name, owner in MEASURED.items() if owner == axis))
        after = read.scalars.get(next(name for name, owner in OPTIMISED.items() if owner == axis))
        if (
            axis_protocol is None
            and before is None
            and after is None
            and not any(v is not None for v in errors.values())
        ):
            continue
        evaluated.results["axes"].append(_said_axis(axis, errors, before, after, axis_protocol or AxisProtocol()))
    offsets = {letter: read.scalars[name] for name, letter in OFFSETS.items() if name in read.scalars}
    if offsets:
        evaluated.results["offsets"] = {letter: offsets.get(letter) for letter in LETTERS}


def _said_axis(
    axis: AxisName,
    errors: Mapping[str, float | None],
    before: float | None,
    after: float | None,
    axis_protocol: AxisProtocol,
) -> dict[str, Any]:
    numbers, vectors = axis_protocol.numbers, axis_protocol.vectors
    moved = _moved(axis_protocol)
    place = vectors.get("correction", moved)
    known = {name: errors.get(name) for name in ERRORS[axis]}
    if place is not None:  # a protocol that says where the axis has to go, and not in the words of a string
        for letter, value in zip(LETTERS, moved or place, strict=True):
            name = f"E{letter}0{axis}"
            if name in known and known[name] is None:
                known[name] = value
    points = numbers.get("points")
    backlash = numbers.get("backlash")
    return {
        "axis": axis,
        "carries": None,
        "errors": {name: {"value": value, "deviation": None} for name, value in known.items() if value is not None},
        "backlash": None if backlash is None else {"value": backlash, "deviation": None},
        "scatter_before": before if before is not None else numbers.get("scatter_before"),
        "scatter_after": after if after is not None else numbers.get("scatter_after"),
        "greatest_before": numbers.get("greatest"),
        "greatest_after": None,
        "mean_error": numbers.get("mean_error"),
        "angle_error": numbers.get("angle_error"),
        "radius": numbers.get("radius"),
        "start_angle": numbers.get("start_angle"),
        "end_angle": numbers.get("end_angle"),
        "points": None if points is None else int(points),
        "incidence": numbers.get("incidence"),
        "angles": list(axis_protocol.angles) or sorted({deviation.angle for deviation in axis_protocol.deviations}),
        "ball": None,
        "shift": None,
        "correction": list(place) if place is not None else _asked(axis, known),
        "position_before": list(vectors["before"]) if "before" in vectors else None,
        "position_after": list(vectors["after"]) if "after" in vectors else None,
        "positions": [
            {
                "angle": deviation.angle,
                "approach": deviation.approach,
                "measured": list(deviation.measured),
                "optimised": list(deviation.optimised),
            }
            for deviation in axis_protocol.deviations
        ],
        "arc": None,
        "condition": None,
        "freedom": None,
        "noise": None,
    }


def _asked(axis: AxisName, known: Mapping[str, float | None]) -> list[float] | None:
    """Correction of the axis' position; None where its place was not stated: that is no correction by zero."""
    return None if all(known[name] is None for name in ERRORS[axis][:2]) else correction(axis, known)


def _moved(axis_protocol: AxisProtocol) -> tuple[float, float, float] | None:
    """Shift of the axis in the kinematics, from its places before and after."""
    if not {"before", "after"} <= set(axis_protocol.vectors):
        return None
    x, y, z = (
        rounded(after - before)
        for before, after in zip(axis_protocol.vectors["before"], axis_protocol.vectors["after"], strict=True)
    )
    return x, y, z


# --- the control's protocol


def protocol_apart(text: str | None, words: Path | None = None) -> Protocol | None:
    """The control's protocol, read in a process of its own: no transaction should be open meanwhile. Raises `Invalid`.

    words: the plant's own file of words.
    """
    if text is None:
        return None
    try:
        return apart(read_protocol, text, known_words(words))
    except Unusable as error:
        raise Invalid.at("protocol", str(error).removesuffix(".")) from None


def of_protocol(text: str, protocol: Protocol | None = None) -> Evaluated:
    """Evaluate a protocol. protocol: the same, where it is read already. Raises `Invalid`."""
    protocol = protocol or read_protocol(text)
    if protocol.is_foreign:
        raise Invalid.at(
            "protocol",
            _("this is no protocol of a run: {unread} of {rows} lines were not understood").format(
                unread=len(protocol.unread), rows=protocol.rows
            ),
            do=_("Send TCHPRAUTO.html as the control has written it, or the result parameters as `results`.")
            + wording.labels_to_add(protocol.unread),
        )
    evaluated = Evaluated("protocol", head=protocol.head)
    read = read_results("\n".join(protocol.parameters))
    evaluated.results["notes"] = [
        *(wording.not_understood(item) for item in protocol.unread[:MOST_NOTES]),
        *(wording.flaw(item) for item in read.flaws[:MOST_NOTES]),
    ]
    if protocol.ball_radius is not None:
        evaluated.head["ball_radius"] = f"{protocol.ball_radius:g}"
    for axis, axis_protocol in protocol.axes.items():
        moved, correction_stated = _moved(axis_protocol), axis_protocol.vectors.get("correction")
        if (
            moved
            and correction_stated
            and max(abs(a - b) for a, b in zip(moved, correction_stated, strict=True)) > SAME_PLACE
        ):
            evaluated.results["notes"].append(wording.moved_otherwise(axis, moved, correction_stated))
    _fill_in(evaluated, read, protocol.axes)
    for axis in evaluated.results["axes"]:
        if axis["incidence"] is None:
            axis["incidence"] = protocol.incidence
    if not evaluated.results["axes"] and evaluated.results["offsets"] is None:
        notes = "; ".join(evaluated.results["notes"][:3])
        raise Invalid.at(
            "protocol",
            _("nothing of a rotary axis can be read in it: {notes}").format(notes=notes or _("it is empty")),
            do=_("Send TCHPRAUTO.html as the control has written it.") + wording.labels_to_add(protocol.unread),
        )
    return evaluated
