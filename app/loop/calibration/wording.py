"""The sentences about calibrations: how one came out, what its status means, what the pairs say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from app.core.calibration import Outcome
from app.core.decision.step import rounded
from app.core.pairs import Comparison
from app.core.warning import CodedWarning, of_stored
from app.language.formatting import mm, signed_mm, um, um_limit
from app.language.i18n import _, ngettext
from app.language.times import in_sentence
from app.loop.warnings.wording import sentence as coded

if TYPE_CHECKING:
    from app.loop.calibration.queries import CalibrationRow, Place
    from app.loop.tables.calibration import CalibrationRecord


def sentence(record: CalibrationRecord) -> str:
    """The outcome of a calibration and its consequence."""
    if record.refused:
        return refusal(values_of(record))
    values = {
        "difference": um(record.difference),
        "left": um(deviation(record)),
        "average": um(record.average),
        "zero": um_limit(record.settings.get("zero_range", 0.0)),
        "limit": um_limit(record.settings.get("averaging_limit", 0.0)),
        "before": um(record.value_before),
        "proposed": um(record.proposed),
        "apart": signed_mm(record.difference),  # beside an offset, which is read in mm
        "offset": signed_mm(record.proposed),
    }
    match record.outcome:
        case Outcome.WITHIN_ZERO_RANGE:
            text = _(
                "Measuring error {difference}; {before} is already compensated, {left} remains, within the zero "
                "range {zero}: nothing needs to be changed."
            )
        case Outcome.AVERAGE_KEPT:
            text = _(
                "Measuring error {difference}; {before} is already compensated, {left} remains; the average "
                "{average} is within the zero range {zero}: nothing needs to be changed yet."
            )
        case Outcome.AVERAGED_DIFFERENCE:
            text = _(
                "Measuring error {difference}; {before} is already compensated, {left} remains; the average "
                "{average} is beyond the zero range {zero}: the empirical value becomes {proposed}."
            )
        case Outcome.FULL_DIFFERENCE:
            text = _(
                "Measuring error {difference}; {before} is already compensated, {left} remains, beyond the "
                "averaging limit {limit}: the empirical value becomes {proposed}."
            )
        case Outcome.CENTRED if record.proposed is None:
            text = _("The probe is in the middle of the spindle: its offset stays.")
        case Outcome.CENTRED:
            text = _("The probe is {apart} off the spindle axis: its X offset becomes {offset}.")
        case Outcome.PAIRED:
            text = _(
                "The machine reads {difference} more than the external gauge: the empirical value becomes {proposed}."
            )
        case _:
            return record.outcome
    return text.format(**values)


def deviation(record: CalibrationRecord) -> float | None:
    """Measuring error that the empirical value in effect does not compensate, mm."""
    return None if record.difference is None else rounded(record.difference - record.value_before)


def values_of(record: CalibrationRecord) -> dict[str, Any]:
    """The values in the sentence of a refusal; an alarm keeps them as its data."""
    settings = record.settings
    return {
        "outcome": record.outcome,
        "difference": record.difference,
        "deviation": deviation(record),
        "at": settings.get("at"),
        "window": settings.get("path_factor"),
        "limit": settings.get("confidence_limit"),
        "smallest": settings.get("smallest"),
        "largest": settings.get("largest"),
        "diameters": settings.get("diameters"),
    }


def refusal(data: Mapping[str, Any]) -> str:
    """The reason for the refusal of a calibration."""
    at, diameters, limit = data.get("at"), data.get("diameters"), data.get("limit") or 0.0
    values = {
        "at": at,
        "window": mm(data.get("window"), 3),
        "left": signed_mm(data.get("deviation")) if limit >= 1 else um(data.get("deviation")),
        "limit": um_limit(limit),
        "smallest": mm(data.get("smallest")),
        "largest": mm(data.get("largest")),
        "diameter": mm(diameters[at - 1] if at and diameters and at <= len(diameters) else None),
    }
    match data.get("outcome"):
        case Outcome.WINDOW:
            text = _("Touch {at} lies further than ±{window} (R28) from the gauge.")
        case Outcome.PROBE_FAULT:
            text = _(
                "The difference {left} has reached the confidence limit {limit}: the probe or the program is wrong."
            )
        case Outcome.NO_TOUCH if diameters is None:
            text = _("Touch {at} is missing: the probe did not trigger.")
        case Outcome.NO_TOUCH:
            text = _("Section {at} was not touched on both sides: the probe did not trigger.")
        case Outcome.NOT_A_BORE:
            text = _("The first move along Z triggered: it is not a bore.")
        case _:
            text = _(
                "Section {at} measures {diameter}, the ring {smallest} to {largest}: the gauge is wrong, or probe and "
                "spindle centre are not at the same height."
            )
    return text.format(**values)


def status_word(status: str) -> str:
    """Status of a calibration."""
    return {
        "refused": _("Refused"),
        "unchanged": _("Confirmed"),
        "proposed": _("To be accepted"),
        "accepted": _("Accepted"),
        "overtaken": _("Overtaken"),
    }.get(status, status)


def state_word(state: str) -> str:
    """State of a place."""
    return {
        "overdue": _("Overdue"),
        "refused": _("Refused"),
        "proposed": _("To be accepted"),
        "due_soon": _("Due soon"),
        "calibrated": _("Calibrated"),
        "never": _("Never calibrated"),
    }.get(state, state)


def kind_word(kind: str) -> str:
    """Method of a calibration."""
    return {"gauge": _("Gauge"), "ring": _("Ring"), "pairs": _("External gauge")}.get(kind, kind)


RANGES = (
    ("R27", "repeats", 1, 10),
    ("R28", "path_factor", 1, 10),
    ("R29", "weighting_factor", 1, 4),
    ("R33", "zero_range", 0, 0.1),
    ("R34", "averaging_limit", 0, 0.1),
    ("R36", "confidence_limit", 1, 3),
)
"""The ranges of the source's L92: R number, setting, lowest and highest value."""


def warnings(record: CalibrationRecord) -> list[CodedWarning]:
    """Return what may be wrong with a calibration: inches first, then values outside the ranges of the source's control."""
    return of_stored(record.settings.get("warnings", ())) + [
        CodedWarning("outside_range", {"name": name, "value": value, "low": low, "high": high}, setting)
        for name, setting, low, high in RANGES
        if record.kind == "gauge" and (value := record.settings.get(setting)) is not None and not low <= value <= high
    ]


def warning_sentence(warning: CodedWarning) -> str:
    """Return a warning of `warnings` in words."""
    if warning.code != "outside_range":
        return coded(warning)
    return _("{name} = {value} is outside the {low} to {high} of the control's own cycle.").format(
        **{name: f"{value:g}" if isinstance(value, int | float) else value for name, value in warning.values.items()}
    )


def cannot_accept(row: CalibrationRow) -> tuple[str, str]:
    """The reason why there is nothing to accept, and what to do instead."""
    number, acceptance = row.record.number, row.acceptance
    again = _("Calibrate again if in doubt.")
    if acceptance is not None:
        return (
            _("Calibration {number} was accepted by {who} on {at} already: {reason}").format(
                number=number,
                who=acceptance.actor,
                at=in_sentence(acceptance.at),
                reason=acceptance.reason,
            ),
            _("There is nothing left to do."),
        )
    sentences = {
        "refused": _("Calibration {number} was refused: it counts for nothing."),
        "unchanged": _("Calibration {number} has confirmed what is in effect: there is nothing to accept."),
        "overtaken": _("Since calibration {number} there has been a newer one, or the value was changed otherwise."),
    }
    return sentences.get(row.status, "{number}").format(number=number), again


def what_pairs_say(found: Comparison, empirical_value: float) -> str:
    """The comparison of the pairs, in one or two sentences."""
    if found.pairs == 0:
        return ngettext(
            "No pair in this series yet; {n} is needed.", "No pair in this series yet; {n} are needed.", found.missing
        ).format(n=found.missing)
    values = {
        "mean": um(found.mean),
        "low": um(found.low),
        "high": um(found.high),
        "confidence": f"{found.confidence * 100:g} %",
        "value": um(empirical_value),
    }
    if found.missing:
        return ngettext(
            "The machine reads {mean} too much on the mean. {n} more pair is needed before that says anything.",
            "The machine reads {mean} too much on the mean. {n} more pairs are needed before that says anything.",
            found.missing,
        ).format(n=found.missing, **values)
    if found.equal:
        return _(
            "The machine reads {mean} too much in every one of {n} pairs: where nothing varies it is unknown how well that is known, and nothing is suggested. Read the gauge with one more decimal, or measure other parts. Who knows the value all the same sets the empirical value by hand, with the reason."
        ).format(n=found.pairs, **values)
    text = _("The machine reads {mean} too much, with {confidence} confidence between {low} and {high}.").format(
        **values
    )
    if found.step is not None:
        text += " " + _("The differences go in steps of {step}, so the mean is known to half a step at best.").format(
            step=um(found.step)
        )
    if found.outlier is not None:
        text += " " + _("One pair stands out: check it first.")
    if found.suggested is None:
        return text + " " + _("The empirical value {value} lies inside: the pairs agree with it.").format(**values)
    return text + " " + _("The empirical value {value} lies outside: {mean} is suggested.").format(**values)


def place_words(place: Place) -> str:
    """A place as it is in a sentence."""
    if place.memory == "tool":
        return _("probe offset R10 = {location}").format(location=place.location)
    return _("empirical value R11 = {location}").format(location=place.location)


def missing_touch(expected: float, got: float | None) -> str:
    """Sentence for a number of probed points that differs from R27."""
    return _("{got} points received, R27 asks for {expected}").format(got=got, expected=expected)


def no_such_page() -> str:
    """There is nothing at this address."""
    return _("There is nothing at this address.")


def go_to_overview() -> str:
    """The right place to calibrate it."""
    return _("Go back to the calibrations.")
