"""The sentences about calibrations: how one came out, what its status means, what the pairs say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from app.core.calibration import Gauge, Outcome
from app.core.pairs import Comparison
from app.web.i18n import _, ngettext
from app.web.numbers import mm, um, um_limit

if TYPE_CHECKING:
    from app.calibration.queries import CalibrationRow, Place
    from app.calibration.tables import CalibrationRecord


def sentence(record: CalibrationRecord) -> str:
    """How a calibration came out, and what follows from that."""
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
        "offset": mm(record.proposed),
    }
    match record.outcome:
        case Outcome.WITHIN_ZERO_RANGE:
            text = _(
                "The machine reads {difference} too much. Less the empirical value {before} that is {left}, within the zero "
                "range {zero}: nothing is to be changed."
            )
        case Outcome.AVERAGE_KEPT:
            text = _(
                "The machine reads {difference} too much. Less the empirical value {before} that is {left}; the average "
                "{average} is within the zero range {zero}: nothing is to be changed yet."
            )
        case Outcome.AVERAGED_DIFFERENCE:
            text = _(
                "The machine reads {difference} too much. Less the empirical value {before} that is {left}; the average "
                "{average} is beyond the zero range {zero}: the empirical value becomes {proposed}."
            )
        case Outcome.FULL_DIFFERENCE:
            text = _(
                "The machine reads {difference} too much. Less the empirical value {before} that is {left}, beyond the "
                "averaging limit {limit}: the empirical value becomes {proposed}."
            )
        case Outcome.CENTRED if record.proposed is None:
            text = _("The probe stands in the middle of the spindle: its offset stays.")
        case Outcome.CENTRED:
            text = _("The probe stands {difference} beside the spindle: its X offset becomes {offset}.")
        case Outcome.PAIRED:
            text = _(
                "The machine reads {difference} more than the external gauge: the empirical value becomes {proposed}."
            )
        case _:
            return record.outcome
    return text.format(**values)


def deviation(record: CalibrationRecord) -> float | None:
    """What the empirical value in effect did not explain, mm."""
    return None if record.difference is None else round(record.difference - record.value_before, 9) + 0.0


def values_of(record: CalibrationRecord) -> dict[str, Any]:
    """What a refusal is worded from; an alarm keeps it as its data."""
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
    """Why a calibration was refused."""
    at, diameters = data.get("at"), data.get("diameters") or ()
    values = {
        "at": at,
        "window": mm(data.get("window"), 3),
        "left": um(data.get("deviation")),
        "limit": um_limit(data.get("limit") or 0.0),
        "smallest": mm(data.get("smallest")),
        "largest": mm(data.get("largest")),
        "diameter": mm(diameters[at - 1] if at and at <= len(diameters) else None),
    }
    match data.get("outcome"):
        case Outcome.WINDOW:
            text = _("Touch {at} lies further than ±{window} (R28) from the gauge.")
        case Outcome.PROBE_FAULT:
            text = _(
                "The difference {left} has reached the confidence interval {limit}: the probe or the program is wrong."
            )
        case Outcome.NOT_A_BORE:
            text = _("The first move along Z triggered: it is not a bore.")
        case _:
            text = _(
                "Section {at} measures {diameter}, the ring {smallest} to {largest}: the gauge is wrong, or probe and "
                "spindle centre are not at the same height."
            )
    return text.format(**values)


def status_word(status: str) -> str:
    """What became of a calibration."""
    return {
        "refused": _("Refused"),
        "unchanged": _("Confirmed"),
        "proposed": _("To be accepted"),
        "accepted": _("Accepted"),
        "overtaken": _("Overtaken"),
    }.get(status, status)


def state_word(state: str) -> str:
    """How a place stands."""
    return {
        "overdue": _("Overdue"),
        "refused": _("Refused"),
        "proposed": _("To be accepted"),
        "due_soon": _("Due soon"),
        "calibrated": _("Calibrated"),
        "never": _("Never calibrated"),
    }.get(state, state)


def kind_word(kind: str) -> str:
    """How it was calibrated."""
    return {"gauge": _("Gauge"), "ring": _("Ring"), "pairs": _("External gauge")}.get(kind, kind)


def outside(gauge: Gauge, repeats: int) -> list[str]:
    """Which values lie outside the ranges of the source's control; only a warning."""
    ranges = (
        ("R27", repeats, 1, 10),
        ("R28", gauge.path_factor, 1, 10),
        ("R29", gauge.weighting_factor, 1, 4),
        ("R33", gauge.zero_range, 0, 0.1),
        ("R34", gauge.averaging_limit, 0, 0.1),
        ("R36", gauge.confidence_limit, 1, 3),
    )
    return [
        _("{name} = {value} is outside the {low} to {high} of the control's own cycle.").format(
            name=name, value=f"{value:g}", low=f"{low:g}", high=f"{high:g}"
        )
        for name, value, low, high in ranges
        if not low <= value <= high
    ]


def cannot_accept(row: CalibrationRow) -> tuple[str, str]:
    """Why there is nothing to accept, and what to do instead."""
    number, acceptance = row.record.number, row.acceptance
    anew = _("Calibrate anew if in doubt.")
    if acceptance is not None:
        return (
            _("Calibration {number} was accepted by {who} on {at} already: {reason}").format(
                number=number,
                who=acceptance.actor,
                at=acceptance.at.isoformat(timespec="seconds"),
                reason=acceptance.reason,
            ),
            _("There is nothing left to do."),
        )
    sentences = {
        "refused": _("Calibration {number} was refused: it counts for nothing."),
        "unchanged": _("Calibration {number} has confirmed what is in effect: there is nothing to accept."),
        "overtaken": _("Since calibration {number} there has been a newer one, or the value was changed otherwise."),
    }
    return sentences.get(row.status, "{number}").format(number=number), anew


def what_pairs_say(found: Comparison, empirical_value: float) -> str:
    """What the pairs amount to, in one or two sentences."""
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
    said = _("The machine reads {mean} too much, with {confidence} certainty between {low} and {high}.").format(
        **values
    )
    if found.outlier is not None:
        said += " " + _("One pair stands out: look at it first.")
    if found.suggested is None:
        return said + " " + _("The empirical value {value} lies inside: the pairs agree with it.").format(**values)
    return said + " " + _("The empirical value {value} lies outside: {mean} is suggested.").format(**values)


def place_words(place: Place) -> str:
    """A place as it stands in a sentence."""
    if place.memory == "tool":
        return _("probe offset R10 = {location}").format(location=place.location)
    return _("empirical value R11 = {location}").format(location=place.location)


def missing_touch(expected: float, got: float | None) -> str:
    """The count of touches is not the one that was announced."""
    return _("{got} touches came, R27 says {expected}").format(got=got, expected=expected)


def no_such_page() -> str:
    """There is nothing at this address."""
    return _("There is nothing at this address.")


def go_to_overview() -> str:
    """Where to look instead."""
    return _("Go back to the calibrations.")
