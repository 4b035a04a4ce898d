"""Runs that the control has reckoned itself: its result parameters and its protocol, read as far as they go."""

from collections.abc import Mapping
from typing import Any

from app.core.kinematics.axis import AXES, ERRORS, AxisName
from app.core.kinematics.results import MEASURED, OFFSETS, OPTIMISED, SCALARS, STRINGS, Results, read_results
from app.core.programs.lines import written
from app.errors import FieldError, Invalid
from app.formats.rotary_protocol import AxisProtocol, Protocol, read_protocol
from app.kinematics import wording
from app.kinematics.outcome import LETTERS, Evaluated, correction
from app.web.i18n import _

MOST_NOTES = 200
SAME_PLACE = 0.0002  # mm; a protocol states places with four decimals


def results_of(given: Mapping[str, float | str]) -> Results:
    """Parameters that came as fields. Raises `Invalid` for names that there are not, and text where a number belongs."""
    errors = []
    lines = []
    for name, value in given.items():
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
    made = Evaluated("results")
    made.results["notes"] = [wording.flaw(each) for each in read.flaws[:MOST_NOTES]]
    _fill_in(made, read, {})
    if not made.results["axes"] and made.results["offsets"] is None:
        notes = "; ".join(made.results["notes"][:3])
        wrong = _("no result parameter can be read: {notes}").format(notes=notes or _("no axis was measured"))
        raise Invalid(
            f"{came_as}: {wrong}.",
            _('Write a line for each, like Q143 = 0.0134 or QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345".'),
            errors=[FieldError(came_as, wrong)],
        )
    return made


def _fill_in(made: Evaluated, read: Results, axes: Mapping[AxisName, AxisProtocol]) -> None:
    """Results that nothing is to be computed of: as they stand in parameters and protocol."""
    for axis in AXES:
        said = axes.get(axis)
        errors: dict[str, float | None] = (
            dict(read.errors.get(axis) or {}) if said is None else {**said.errors, **(read.errors.get(axis) or {})}
        )
        before = read.scalars.get(next(name for name, owner in MEASURED.items() if owner == axis))
        after = read.scalars.get(next(name for name, owner in OPTIMISED.items() if owner == axis))
        if said is None and before is None and after is None and not any(v is not None for v in errors.values()):
            continue
        made.results["axes"].append(_said_axis(axis, errors, before, after, said or AxisProtocol()))
    offsets = {letter: read.scalars[name] for name, letter in OFFSETS.items() if name in read.scalars}
    if offsets:
        made.results["offsets"] = {letter: offsets.get(letter) for letter in LETTERS}


def _said_axis(
    axis: AxisName, errors: Mapping[str, float | None], before: float | None, after: float | None, said: AxisProtocol
) -> dict[str, Any]:
    numbers, vectors = said.numbers, said.vectors
    moved = _moved(said)
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
        "angles": list(said.angles) or sorted({each.angle for each in said.deviations}),
        "ball": None,
        "shift": None,
        "correction": list(place) if place is not None else _asked(axis, known),
        "position_before": list(vectors["before"]) if "before" in vectors else None,
        "position_after": list(vectors["after"]) if "after" in vectors else None,
        "positions": [
            {
                "angle": each.angle,
                "approach": each.approach,
                "measured": list(each.measured),
                "optimised": list(each.optimised),
            }
            for each in said.deviations
        ],
        "arc": None,
        "condition": None,
        "freedom": None,
        "noise": None,
    }


def _asked(axis: AxisName, known: Mapping[str, float | None]) -> list[float] | None:
    """Where the axis has to go; None where nothing was said of where it stands: that is no correction by zero."""
    return None if all(known[name] is None for name in ERRORS[axis][:2]) else correction(axis, known)


def _moved(said: AxisProtocol) -> tuple[float, float, float] | None:
    """How far the kinematics has moved the axis, as its places before and after tell."""
    if not {"before", "after"} <= set(said.vectors):
        return None
    x, y, z = (
        round(after - before, 9) + 0.0
        for before, after in zip(said.vectors["before"], said.vectors["after"], strict=True)
    )
    return x, y, z


# --- the control's protocol


def of_protocol(text: str) -> Evaluated:
    protocol: Protocol = read_protocol(text)
    made = Evaluated("protocol", head=protocol.head)
    read = read_results("\n".join(protocol.parameters))
    made.results["notes"] = [
        *(wording.not_understood(each) for each in protocol.unread[:MOST_NOTES]),
        *(wording.flaw(each) for each in read.flaws[:MOST_NOTES]),
    ]
    if protocol.ball_radius is not None:
        made.head["ball_radius"] = f"{protocol.ball_radius:g}"
    for axis, said in protocol.axes.items():
        moved, asked = _moved(said), said.vectors.get("correction")
        if moved and asked and max(abs(a - b) for a, b in zip(moved, asked, strict=True)) > SAME_PLACE:
            made.results["notes"].append(wording.moved_otherwise(axis, moved, asked))
    _fill_in(made, read, protocol.axes)
    for axis in made.results["axes"]:
        if axis["incidence"] is None:
            axis["incidence"] = protocol.incidence
    if not made.results["axes"] and made.results["offsets"] is None:
        notes = "; ".join(made.results["notes"][:3])
        wrong = _("nothing of a rotary axis can be read in it: {notes}").format(notes=notes or _("it is empty"))
        raise Invalid(
            f"protocol: {wrong}.",
            _("Send TCHPRAUTO.html as the control has written it, in German, English or Slovene."),
            errors=[FieldError("protocol", wrong)],
        )
    return made
