"""Decide readings one after the other against the snapshot, in memory, and note what to write.

`decide_reading` decides one reading with `app.core` on what the readings before it have left in `PendingWrites`, moves that
along for the next one, and collects the rows to write. It does no I/O, so that single readings, batches and `inband replay`
are decided by the same lines. A reading that is refused moves nothing.
"""

from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime

from app.core.decision.decide import Decision, LoopState, ReadingAlarm, decide, needs_approval, outstanding_effect
from app.core.decision.limits import Zone
from app.core.decision.step import DECIMALS, Action, Code, deviation_of
from app.core.natural_limit import NaturalLimit
from app.core.parameters import Parameters
from app.core.plausibility import is_jump, moved, uncorrected
from app.core.probing import Measured, TouchError, measured_value, unmeasured
from app.core.variants import Results, results_of
from app.errors import Conflict, FieldError, InbandError, Invalid
from app.language.i18n import _
from app.loop.readings.miscounted import TooManyTouches
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.correction_guards import guard_correction, name_correction, part_of, remember
from app.loop.readings.writer.corrections_in_effect import confirm, corrections_in_effect, issued_total
from app.loop.readings.writer.doubts import doubt
from app.loop.readings.writer.pending import (
    PendingAlarm,
    PendingCorrection,
    PendingStream,
    PendingTool,
    PendingWrites,
    Stored,
    Verdict,
)
from app.loop.readings.writer.slow_clock import ask_of_clock, behind, lag_with, name_clock, time_decides
from app.loop.readings.writer.snapshot import Arrival


def decide_one_by_one(
    pending: PendingWrites, readings: Sequence[tuple[Entry, ReadingIn]], now: datetime
) -> list[Verdict | Stored | InbandError]:
    """Decide readings in their order; a refusal is in the place of its reading."""
    outcomes: list[Verdict | Stored | InbandError] = []
    for entry, reading in readings:
        try:
            outcome = decide_reading(pending, entry, reading, now)
        except InbandError as refusal:
            outcomes.append(refusal)
            continue
        outcomes.append(outcome)
        if isinstance(outcome, Verdict) and outcome.reading is reading:  # not one that the batch has had before
            _decide_forms(pending, outcome, now)
    return outcomes


def _decide_forms(pending: PendingWrites, verdict: Verdict, now: datetime) -> None:
    """Decide the results of a reading that are characteristics of their own, as readings of the same part with the same key.

    A key that a person has given another size there before keeps that size: the reading itself is not refused for it.
    """
    reading = verdict.reading
    for entry, form in verdict.stream.start.forms:
        value = None if verdict.results is None else verdict.results.form(form)
        if value is None:
            continue
        of_form = ReadingIn(
            entry.characteristic,
            measured=value,
            key=reading.key,
            part=reading.part,
            measured_at=verdict.measured_at,
            context=reading.context,
        )
        with suppress(Conflict):
            decide_reading(pending, entry, of_form, now)


def decide_reading(pending: PendingWrites, entry: Entry, reading: ReadingIn, now: datetime) -> Verdict | Stored:
    """Decide one reading and move the pending state along.

    Raises `Invalid` or `Conflict` when the reading cannot be taken; nothing has changed then.
    """
    stream = pending.stream(entry.characteristic_id)
    parameters = stream.parameters
    if reading.key is not None and (first := _first_with_key(pending, entry, reading.key, reading)):
        return first
    measured, points, fault = _measured(entry, parameters, reading)
    tool, in_effect = stream.tool, reading.correction_in_effect
    _refuse_unissued(pending, entry, in_effect)
    sequence = stream.sequence + 1
    measured_at = now if reading.measured_at is None else reading.measured_at.astimezone(UTC)
    confirm(pending, stream, tool, in_effect, min(now, reading.machined_at or measured_at))
    previous_tool, outstanding, amounts, compensated = corrections_in_effect(pending, tool, reading, parameters)
    average = stream.average
    empirical_value = average.empirical_value if average and not reading.is_by_hand else 0.0
    results = results_of(parameters, reading.touches or (), points, empirical_value) if points else None
    deviation = deviation_of(measured, parameters.target, empirical_value)
    course, jump = _course(stream, deviation, compensated)
    paused_by = stream.paused_by if tool is None or stream.paused_by is not None else tool.paused_by
    timed = time_decides(stream, reading, compensated, previous_tool=previous_tool)
    lag = lag_with(pending, stream, reading, Arrival(sequence, now, measured_at, reading.machined_at), timed=timed)
    total = issued_total(pending, tool) if parameters.max_total is not None else 0.0

    def judged(*, paused: bool) -> Decision:
        as_it_is = paused and lag is not None  # a part that is out is not taken for one on the way
        return decide(
            parameters,
            LoopState(average.average if average else 0.0, total, paused),
            deviation,
            outstanding=outstanding_effect(amounts, parameters.factor) if amounts and not as_it_is else 0.0,
            previous_tool=previous_tool and not as_it_is,
            accepted=results is None or not results.rejected,
            jump=jump,
            not_taken=tool is not None and tool.not_taken is not None,
            by_hand=parameters.rules.of_tool and tool is not None and tool.set_by_hand,
            fault=Code.FIRST_MOVE_TRIGGERED if reading.first_move_triggered else Code.TOUCH_FAULT if fault else None,
        )

    decision = judged(paused=paused_by is not None)
    late = stream.last_measured_at is not None and measured_at < stream.last_measured_at
    newest = None if compensated is None or late or jump or fault else part_of(sequence, decision, compensated)
    asking = newest if decision.amount is not None else None
    pausing = guard_correction(pending, stream, asking, reading, now)
    if pausing is None and paused_by is None:
        pausing = behind(pending, stream, decision, lag, previous_tool=previous_tool)
    if pausing is not None:
        paused_by, decision = pausing, judged(paused=True)
    if paused_by is not None and lag is not None:
        outstanding = ()
    alarms = [_signal(pending, stream, signal, sequence, decision, results, fault) for signal in decision.alarms]
    name_correction(alarms, stream, newest)
    name_clock(alarms if timed else (), reading, now)
    asked = doubt(pending, stream, reading, sequence) or ask_of_clock(pending, stream, reading, decision, timed=timed)
    alarms += [alarm for alarm in (pausing, asked) if alarm is not None]
    correction = (
        _issue(pending, stream, tool, sequence, decision, now) if tool and decision.amount is not None else None
    )
    verdict = Verdict(
        stream=stream,
        reading=reading,
        sequence=sequence,
        parameters=parameters,
        measured=measured,
        measured_at=measured_at,
        received_at=now,
        late=late,
        decision=decision,
        outstanding=outstanding,
        correction=correction,
        paused_by=tool.not_taken if tool and decision.code is Code.NOT_TAKEN else paused_by,
        alarms=alarms,
        compensated=compensated,
        results=results,
    )
    _move_along(verdict, course, jump=jump)
    _note(pending, verdict)
    return verdict


def _note(pending: PendingWrites, verdict: Verdict) -> None:
    """Keep a decided reading for the writes of its transaction, and for those behind it that have its key."""
    number, key = verdict.stream.entry.characteristic_id, verdict.reading.key
    if pending.snapshot.plans:
        verdict.measure_next = pending.measure_next(verdict)
    pending.touched[number] = verdict.stream
    pending.verdicts.append(verdict)
    if key is not None:
        pending.by_key[number, key] = verdict


def _course(stream: PendingStream, deviation: float, compensated: float | None) -> tuple[float | None, bool]:
    """Return the deviation without corrections, where jumps are looked for, and if it is one; mm."""
    parameters = stream.parameters
    if parameters.plausible_jump is None or compensated is None:
        return None, False
    course = uncorrected(deviation, compensated, parameters.factor)
    return course, is_jump(course, stream.level, parameters.plausible_jump)


def _move_along(verdict: Verdict, course: float | None, *, jump: bool) -> None:
    """Count the reading, keep the running average, pause after a probe fault; one in time is what the next are compared with."""
    stream, decision = verdict.stream, verdict.decision
    stream.sequence, stream.last = verdict.sequence, verdict
    average = stream.average
    if average is not None and average.average != decision.average_after:
        average.average = decision.average_after
        average.changed = True
    stops = decision.zone is Zone.PROBE_FAULT
    if stops and stream.paused_by is None:
        stream.paused_by = next(alarm for alarm in verdict.alarms if alarm.kind == ReadingAlarm.PROBE_FAULT.value)
    if verdict.late:
        return
    stream.last_measured_at = min(verdict.measured_at, verdict.received_at)  # a fast clock makes no later reading late
    if not jump:
        remember(stream, verdict.sequence, decision, verdict.compensated)
        if course is not None and not stops:
            stream.level, stream.level_sequence, stream.level_moved = (
                moved(stream.level, course),
                verdict.sequence,
                True,
            )


def _refuse_unissued(pending: PendingWrites, entry: Entry, in_effect: int | None) -> None:
    last = pending.last_number(entry.machine_id)
    if in_effect is not None and in_effect > last:
        raise Invalid(
            _("Machine %(machine)s has no correction %(number)s; its last one is %(last)s.")
            % {"machine": entry.machine, "number": in_effect, "last": last},
            _("Send the number of the last correction that the machine had applied when it cut this part."),
            errors=[FieldError("correction_in_effect", _("There is no such correction yet."))],
        )


def _measured(entry: Entry, parameters: Parameters, reading: ReadingIn) -> Measured:
    """Return the value, with the mean at each probed point if it came as points that can be believed."""
    if reading.touches is None:
        if reading.first_move_triggered and reading.measured is None:
            return Measured(unmeasured(parameters, first_move=True), ())
        if parameters.accept_m > 1 and not reading.first_move_triggered:
            raise Invalid(
                _("This characteristic is accepted by %(n)s of %(m)s sections, so it needs touches.")
                % {"n": parameters.accept_n, "m": parameters.accept_m},
                _("Send touches with one list per section in place of measured."),
                errors=[FieldError("touches", _("Send one list of touches per section."))],
            )
        return Measured(float(reading.measured or 0.0), ())
    try:
        value = measured_value(parameters, reading.touches)
    except TouchError as error:
        raise TooManyTouches(entry, error) from None
    return Measured(value.value, ()) if reading.first_move_triggered else value


def _first_with_key(pending: PendingWrites, entry: Entry, key: str, reading: ReadingIn) -> Verdict | Stored | None:
    """Return the first reading with this key, here or in the record; the same key with another value or probe fault is refused.

    Points are made into a value as they were then, whatever the characteristic expects by now.
    """
    at = (entry.characteristic_id, key)
    here = pending.by_key.get(at)
    first = here or pending.snapshot.stored_keys.get(at)
    if first is None:
        return None
    sequence, value = first.sequence, first.measured
    if reading.first_move_triggered is not first.first_move_triggered:
        if first.first_move_triggered:
            words = _(
                "Key {key} belongs to a reading of {characteristic} for which the probe triggered on its first move."
            )
        else:
            words = _(
                "Key {key} belongs to a reading of {characteristic} for which the probe did not trigger on its first move."
            )
        raise Conflict(
            words.format(key=key, characteristic=entry.characteristic),
            _("A key names one reading for ever. Give the new reading a key of its own."),
            errors=[FieldError("key", _("This key is taken by a reading that differs in first_move_triggered."))],
        )
    measured = _measured(entry, first.parameters, reading).value
    if round(value - measured, DECIMALS) != 0:
        if here is not None:
            words = _("Key {key} of {characteristic} comes twice: with {first} mm and with {now} mm.")
            raise Conflict(
                words.format(key=key, characteristic=entry.characteristic, first=value, now=measured),
                _("A key names one reading for ever. Give each reading a key of its own."),
                errors=[FieldError("key", _("This key is taken by another value."))],
            )
        raise Conflict(
            _(
                "Key %(key)s belongs to reading %(sequence)s of %(characteristic)s, which measured %(first)s mm, not %(now)s mm."
            )
            % {
                "key": key,
                "sequence": sequence,
                "characteristic": entry.characteristic,
                "first": value,
                "now": measured,
            },
            _("A key names one reading for ever. Give the new reading a key of its own."),
            errors=[FieldError("key", _("This key is taken by another value."))],
        )
    return here or Stored(entry, sequence)


def _issue(
    pending: PendingWrites, stream: PendingStream, tool: PendingTool, sequence: int, decision: Decision, now: datetime
) -> PendingCorrection:
    """Number the correction; whatever is held for this tool is superseded by it, so that they never add up."""
    number = pending.last_number(tool.machine_id) + 1
    pending.last_correction[tool.machine_id] = number
    pending.touched_machines.add(tool.machine_id)
    for place in range(tool.none_held, len(tool.corrections)):
        if tool.corrections[place].status == "held":
            earlier = tool.changing(place)
            earlier.status, earlier.superseded_by = "superseded", number
    tool.none_held = len(tool.corrections)
    if decision.action is Action.HOLD:
        status = "held"
    elif needs_approval(stream.parameters):
        status = "awaiting_approval"
    else:
        status = "pending"
    correction = PendingCorrection(
        machine_id=tool.machine_id,
        number=number,
        tool_memory=tool.number,
        amount=decision.amount or 0.0,
        status=status,
        characteristic_id=stream.entry.characteristic_id,
        sequence=sequence,
        size_error=decision.size_error or 0.0,
        issued_at=now,
        new=True,
    )
    tool.corrections.append(correction)
    pending.issued.append(correction)
    return correction


LIMIT_OF = {
    ReadingAlarm.TOOL_WORN: "wear_limit",
    ReadingAlarm.PROBE_FAULT: "confidence_limit",
    ReadingAlarm.IMPLAUSIBLE: "plausible_jump",
}


def _signal(
    pending: PendingWrites,
    stream: PendingStream,
    signal: ReadingAlarm,
    sequence: int,
    decision: Decision,
    results: Results | None,
    fault: TouchError | None,
) -> PendingAlarm:
    """Raise the alarm, or add to the one that is active for the same trouble."""
    entry, parameters = stream.entry, stream.parameters
    of_tool = signal is ReadingAlarm.OFFSET_LIMIT and stream.tool is not None
    if of_tool:
        active = pending.tool_alarms.get((entry.machine_id, parameters.tool_memory, signal.value))
    else:
        active = stream.alarms.get(signal.value)
    if active is None:
        active = PendingAlarm(
            machine_id=entry.machine_id,
            characteristic_id=None if of_tool else entry.characteristic_id,
            tool_memory=parameters.tool_memory or None,
            kind=signal.value,
            sequence=sequence,
        )
        pending.raised.append(active)
        if of_tool:
            pending.tool_alarms[entry.machine_id, parameters.tool_memory, signal.value] = active
        else:
            stream.alarms[signal.value] = active
    limit = parameters.max_total if of_tool else getattr(parameters, LIMIT_OF.get(signal, ""), None)
    active.data = {
        "characteristic": entry.characteristic,
        "deviation": decision.deviation,
        "decided": decision.decided,
        "limit": parameters.half if limit is None else limit,
    }
    if parameters.natural_limit is not NaturalLimit.NONE and not of_tool:
        active.data["natural_limit"] = parameters.natural_limit.value
    if decision.code is Code.BEYOND_NATURAL_LIMIT:
        active.data["beyond_natural_limit"] = True
    if decision.code is Code.FIRST_MOVE_TRIGGERED:
        active.data |= {"first_move_triggered": True, "feature": parameters.feature.value}
    elif fault is not None:
        active.data["touch"] = fault.as_dict()
    if signal is ReadingAlarm.ACCEPTANCE and results is not None:
        active.data |= {
            "m": parameters.accept_m,
            "least": parameters.accept_m - parameters.accept_n + 1,  # that many outside, and it is rejected
            "outside": results.sections_outside,
            "target": parameters.target,
        }
    active.count += 1
    active.last_sequence = sequence
    return active
