"""The sentences about readings: why it was decided so, and what is wrong with touches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from app.core.context import ContextField
from app.core.decision.limits import Zone, nanometres, within_tolerance
from app.core.decision.step import Action, Code, average_of
from app.core.parameters import Feature, Parameters
from app.core.plausibility import looks_like_inches, looks_like_micrometres
from app.core.probing import TouchError, Touches, measured_value
from app.language.formatting import age, decimals_beside, deserved, fixed, signed
from app.language.i18n import _, ngettext
from app.loop.readings.records import MOST_OUTSTANDING, Record

NAMED_AT_MOST = 3
LONG_BEFORE = 900  # s between cutting and receipt, of which the machine's clock may be the cause
UNBELIEVABLE = (Code.PROBE_FAULT, Code.TOUCH_FAULT, Code.BEYOND_NATURAL_LIMIT)


def um(length: float) -> str:
    """A length in µm as it is read in a sentence, e.g. ``6.1 µm``; never finer than 1 nm."""
    value = round(length * 1000, 3) + 0.0
    text = f"{value:.1f}" if value == round(value, 1) else f"{value:.3f}".rstrip("0")
    return f"{text} µm".replace("-", "\N{MINUS SIGN}")


def reason(
    record: Record, parameters: Parameters, amount: float | None = None, touches: Touches | None = None
) -> dict[str, Any]:
    """Code, sentence and notes on one decision.

    amount: of the correction it led to, if any, mm. touches: of a touch fault, which names the one that it is about.
    """
    notes = [code for code, applies in _notes(record, parameters, amount) if applies]
    return {"code": record.code, "text": _text(_Values(record, parameters), notes, touches), "notes": notes}


def as_read(record: Record, parameters: Parameters, amount: float | None = None, touches: Touches | None = None) -> str:
    """Return the sentence of `reason` as a page shows it: with the decimals that the tolerance deserves."""
    notes = [code for code, applies in _notes(record, parameters, amount) if applies]
    return _text(_ReadValues(record, parameters), notes, touches)


def _text(values: _Values, notes: Sequence[str], touches: Touches | None) -> str:
    fault = values.record.code == Code.TOUCH_FAULT
    about = _touch_fault(values.parameters, touches) if fault else _sentence(values)
    return " ".join([about, *(_note(code, values) for code in notes)])


def _notes(record: Record, parameters: Parameters, amount: float | None) -> tuple[tuple[str, bool], ...]:
    in_full = record.zone != Zone.AVERAGE or record.code == Code.IMPLAUSIBLE
    size_error = record.decided if in_full else _averaged(record, parameters)
    return (
        ("outstanding", record.outstanding is not None),
        ("corrections_of_tool", parameters.rules.of_tool and nanometres(record.decided - record.deviation) != 0),
        (
            "part_out_of_tolerance",
            not parameters.rules.of_tool
            and record.zone in (Zone.ZERO, Zone.AVERAGE, Zone.FULL)
            and not within_tolerance(record.deviation, parameters.limits),
        ),
        ("stops", record.action == Action.STOP and record.zone != Zone.PROBE_FAULT),
        ("clamped", amount is not None and nanometres(abs(amount)) < nanometres(abs(parameters.factor * size_error))),
        ("empirical_value", nanometres(empirical_value(record, parameters)) != 0),
        ("late", record.late),
        ("inches", record.code in UNBELIEVABLE and looks_like_inches(record.measured, parameters.target)),
        (
            "target_in_inches",
            record.code in UNBELIEVABLE and looks_like_inches(parameters.target, record.measured),
        ),
        ("micrometres", record.code in UNBELIEVABLE and looks_like_micrometres(record.measured, parameters.target)),
    )


def empirical_value(record: Record, parameters: Parameters) -> float:
    """Return what was taken off the measurement, mm; it can be found from what is stored: D = measured - target - EV."""
    return record.measured - parameters.target - record.deviation


def _averaged(record: Record, parameters: Parameters) -> float:
    return average_of(record.average_before, record.decided, parameters.weighting_factor)


class _Values(dict[str, str]):
    """Values that a sentence may name, worded when it does: every reading is answered with one, and most name two values."""

    def __init__(self, record: Record, parameters: Parameters) -> None:
        super().__init__()
        self.record, self.parameters = record, parameters

    def __missing__(self, name: str) -> str:
        value = _WORDED[name](self.record, self.parameters)
        return self.length(name, value) if isinstance(value, float) else str(value)

    def length(self, _name: str, length: float) -> str:
        return um(length)


class _ReadValues(_Values):
    """The same with the decimals that the tolerance deserves; no deviation is rounded across a limit that decides."""

    def length(self, name: str, length: float) -> str:
        p = self.parameters
        usual, value = deserved(p.half), round(length * 1000, 6)
        if name in _MEASURED:
            limits = (p.zero_range, p.averaging_limit, p.half, p.wear_limit, p.confidence_limit, p.plausible_jump)
            decimals = decimals_beside(
                value,
                usual,
                *(round(side * limit * 1000, 6) for limit in limits if limit is not None for side in (1, -1)),
            )
            decimals = max(decimals, 1) if round(value, decimals) == 0 != value else decimals
        else:
            decimals = usual if round(value, usual) == value else usual + 1
        return f"{signed(value, decimals) if name in _SIGNED else fixed(value, decimals)} µm"


def _of_reading(name: str) -> Callable[[Record, Parameters], Any]:
    return lambda record, _parameters: getattr(record, name)


def _of_parameters(name: str) -> Callable[[Record, Parameters], Any]:
    return lambda _record, parameters: getattr(parameters, name)


_WORDED: dict[str, Callable[[Record, Parameters], float | int | None]] = {
    "deviation": _of_reading("decided"),
    "raw": _of_reading("deviation"),
    "worn": lambda record, parameters: record.deviation if parameters.rules.of_tool else record.decided,
    "average": _of_reading("average_after"),
    "averaged": _averaged,
    "number": _of_reading("correction"),
    "alarm": _of_reading("paused_by"),
    "zero": _of_parameters("zero_range"),
    "averaging": _of_parameters("averaging_limit"),
    "tolerance": lambda _record, parameters: parameters.half,
    "wear": _of_parameters("wear_limit"),
    "confidence": _of_parameters("confidence_limit"),
    "total": _of_parameters("max_total"),
    "jump": _of_parameters("plausible_jump"),
    "n": _of_parameters("accept_n"),
    "m": _of_parameters("accept_m"),
    "step": lambda _record, parameters: parameters.max_step or 0.0,
    "value": empirical_value,
    "decided": _of_reading("decided"),
    "location": _of_parameters("average_memory"),
}
_MEASURED = ("deviation", "raw", "worn", "average", "averaged", "decided")
_SIGNED = (*_MEASURED, "value")


def first_move_sentence(feature: str | None) -> str:
    """Sentence on a probe that triggered on its first move; alarms from before the feature was kept with them have none."""
    match feature:
        case Feature.OUTSIDE:
            return _(
                "The first move of the probe triggered beside the part: a chip, a clamp or the wrong part is in its way."
            )
        case Feature.TOOL:
            return _(
                "The first move of the probe triggered before it came to the tool: a chip or the wrong tool is in its way."
            )
        case _:
            return _("The first move of the probe triggered: there is no bore here, or a chip, or the wrong part.")


_SENTENCES: dict[str, Callable[[], str]] = {
    Code.WITHIN_ZERO_RANGE: lambda: _(
        "Deviation %(deviation)s is within the zero range %(zero)s: no correction, the average is kept."
    ),
    Code.AVERAGE_KEPT: lambda: _(
        "Deviation %(deviation)s is within the averaging limit %(averaging)s and the running average %(average)s "
        "within the zero range %(zero)s: no correction, the average is kept."
    ),
    Code.AVERAGED_DEVIATION: lambda: _(
        "The running average %(averaged)s is beyond the zero range %(zero)s: corrected by the average."
    ),
    Code.FULL_DEVIATION: lambda: _(
        "Deviation %(deviation)s is beyond the averaging limit %(averaging)s: corrected in full."
    ),
    Code.OUT_OF_TOLERANCE: lambda: _(
        "Deviation %(deviation)s is beyond the tolerance ±%(tolerance)s: corrected in full."
    ),
    Code.TOOL_WORN_HELD: lambda: _(
        "Deviation %(worn)s has reached the wear limit %(wear)s: the tool is worn. "
        "Correction %(number)s is held until it is decided."
    ),
    Code.TOOL_WORN_RELEASED: lambda: _(
        "Deviation %(worn)s has reached the wear limit %(wear)s: the tool is worn. "
        "Corrected in full, as this characteristic is set to release."
    ),
    Code.PROBE_FAULT: lambda: _(
        "Deviation %(raw)s has reached the confidence limit %(confidence)s: the probe or the program is wrong. "
        "The decision is to stop, and compensation pauses until the alarm is acknowledged."
    ),
    Code.PAUSED: lambda: _(
        "Deviation %(deviation)s: compensation is paused by alarm %(alarm)s. Stored and judged, nothing is corrected."
    ),
    Code.NOT_TAKEN: lambda: _(
        "Deviation %(raw)s: the machine does not take the corrections of this tool (alarm %(alarm)s), so this part corrects "
        "nothing more."
    ),
    Code.MEASURE_ONLY: lambda: _(
        "Deviation %(deviation)s: this characteristic is only measured, nothing is corrected."
    ),
    Code.OFFSET_BY_HAND: lambda: _(
        "Deviation %(deviation)s: the offset of this tool was set by hand since it was changed, and it is not known how much "
        "of the size of the tool is in it. Nothing is corrected until the tool change is reported."
    ),
    Code.IMPORTED: lambda: _(
        "Deviation %(deviation)s: imported from a file. Judged like any other, it corrects nothing."
    ),
    Code.BEFORE_TOOL_CHANGE: lambda: _(
        "Deviation %(deviation)s: the part was cut before the tool was changed or its offset edited, "
        "so it says nothing about the offset of now. Nothing is corrected."
    ),
    Code.OFFSET_LIMIT: lambda: _(
        "Deviation %(deviation)s corrects nothing: the corrections of this tool would exceed %(total)s in all. "
        "Nothing is corrected until the tool is changed, or the largest sum is raised."
    ),
    Code.IMPLAUSIBLE: lambda: _(
        "Deviation %(deviation)s lies more than the plausible %(jump)s from the level of the readings before: neither "
        "wear nor scatter explains it. Correction %(number)s is held until it is decided."
    ),
    Code.REJECTED: lambda: _(
        "Fewer than %(n)s of %(m)s sections are within the tolerance: the part is rejected and corrects nothing."
    ),
    Code.BEYOND_NATURAL_LIMIT: lambda: _(
        "Deviation %(raw)s lies beyond the natural limit, where no part can be, by more than the zero range %(zero)s: the "
        "probe, the zero or the sign is wrong."
    ),
}


def _sentence(values: _Values) -> str:
    code = values.record.code
    if code == Code.FIRST_MOVE_TRIGGERED:
        text = first_move_sentence(values.parameters.feature)
    elif code == Code.IMPLAUSIBLE and values.record.correction is None:
        text = _(
            "Deviation %(deviation)s lies more than the plausible %(jump)s from the level of the readings before: neither "
            "wear nor scatter explains it. It is marked, and the average is left as it was."
        )
    else:
        text = _SENTENCES[code]() if code in _SENTENCES else code
    if code in (Code.BEYOND_NATURAL_LIMIT, Code.FIRST_MOVE_TRIGGERED):
        text = f"{text} {_stopped()}"
    return text % values


def _stopped() -> str:
    return _("The decision is to stop, and compensation pauses until the alarm is acknowledged.")


def _touch_fault(parameters: Parameters, touches: Touches | None) -> str:
    fault = None if touches is None else measured_value(parameters, touches).fault
    about = _("A touch is missing, or outside its window.") if fault is None else touch_problem(fault)
    return f"{about} {_stopped()}"


def _lag(record: Record) -> str:
    """Return the sentence on the time between cutting and receipt, where a clock alone says what the part was cut without."""
    lag = 0.0 if record.machined_at is None else (record.received_at - record.machined_at).total_seconds()
    if record.correction_in_effect is not None or lag < LONG_BEFORE:
        return ""
    return " " + _(
        "By the time of cutting that the machine sends, it was cut %(age)s before it came in: if the machine's clock is behind, corrections that were applied "
        "since then were in effect."
    ) % {"age": age(lag)}


def _note(code: str, values: _Values) -> str:
    match code:
        case "outstanding":
            outstanding = values.record.outstanding or ()
            numbers = _listed(outstanding)
            text = ngettext(
                "The part was cut before correction %(numbers)s took effect: its deviation of %(raw)s counts as %(decided)s.",
                "The part was cut before corrections %(numbers)s took effect: its deviation of %(raw)s counts as %(decided)s.",
                len(outstanding),
            )
            return text % {"numbers": numbers, "raw": values["raw"], "decided": values["decided"]} + _lag(values.record)
        case "corrections_of_tool":
            return (
                _(
                    "The size of the tool is off by %(raw)s; with its corrections since it was changed that counts as %(decided)s."
                )
                % values
            )
        case "part_out_of_tolerance":
            return _("The part itself is out of tolerance by its deviation of %(raw)s.") % values
        case "stops":
            return _("The part is out of tolerance, and nothing brings the next one back: the decision is to stop.")
        case "clamped":
            return _("The correction is limited to the largest step %(step)s.") % values
        case "inches":
            return _("As inches the value would fit: readings are sent in mm.")
        case "micrometres":
            return _("As µm the value would fit: readings are sent in mm.")
        case "target_in_inches":
            return _("The target would fit as inches: parameters are in mm.")
        case "empirical_value":
            return _("The empirical value %(value)s (R11 = %(location)s) is taken off.") % values
        case _:
            return _("It came late: a later measurement had arrived before it.")


def _listed(numbers: Sequence[int]) -> str:
    """The numbers as a sentence lists them; of many only the first, for the reading itself lists more of them."""
    named = ", ".join(map(str, numbers[:NAMED_AT_MOST]))
    more = len(numbers) - NAMED_AT_MOST
    if len(numbers) >= MOST_OUTSTANDING:
        return _("%(numbers)s and at least %(n)s more") % {"numbers": named, "n": more}
    return _("%(numbers)s and %(n)s more") % {"numbers": named, "n": more} if more > 0 else named


def touch_problem(error: TouchError) -> str:
    """Return the sentence on points that cannot be used, naming point and repeat."""
    values = {"point": error.point, "repeat": error.repeat, "expected": error.expected, "got": error.got}
    few = (error.got or 0) < error.expected
    match error.code:
        case "points" if few:
            text = _("Points received: %(got)s, expected: %(expected)s. Point %(point)s is missing.")
        case "points":
            text = _("Points received: %(got)s, expected: %(expected)s. Point %(point)s is one too many.")
        case "repeats" if few:
            text = _(
                "Point %(point)s: touches received %(got)s, expected %(expected)s (R27). Repeat %(repeat)s is missing."
            )
        case "repeats":
            text = _(
                "Point %(point)s: touches received %(got)s, expected %(expected)s (R27). Repeat %(repeat)s is one too many."
            )
        case "missing":
            text = _("Point %(point)s, repeat %(repeat)s: the touch is missing, the probe did not trigger.")
        case "distance":
            text = _(
                "Point %(point)s, repeat %(repeat)s: its distance of %(got)s mm from the point before lies more than "
                "%(expected)s mm (R28) from the programmed dimension."
            )
        case _:
            text = _(
                "Point %(point)s, repeat %(repeat)s: the touch at %(got)s mm lies more than %(expected)s mm (R28) "
                "from the programmed dimension."
            )
    return text % values


def field_word(field: str) -> str:
    """A field of the context in a word."""
    return {
        ContextField.ORDER: _("Order"),
        ContextField.BATCH: _("Batch"),
        ContextField.NEST: _("Nest"),
        ContextField.SPINDLE: _("Spindle"),
        ContextField.FIXTURE: _("Fixture"),
        ContextField.OPERATOR: _("Operator"),
        ContextField.PROGRAM: _("Program"),
        ContextField.GAUGE: _("Gauge"),
    }[ContextField(field)]
