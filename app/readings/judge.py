"""Decide readings one after the other against what the database holds, in memory, and note what to write.

`Ground` is what was loaded under the machines' locks. `judge` decides one reading on it with `app.core`, moves the
ground along for the next one, and collects the rows to write. It does no I/O, so that single readings, batches and
`inband replay` are decided by the same lines. A reading that is refused leaves the ground as it was.
"""

from datetime import UTC, datetime

from app.core.compensation import (
    DECIMALS,
    Action,
    Decision,
    Signal,
    State,
    decide,
    deviation_of,
    needs_approval,
    outstanding_effect,
)
from app.core.parameters import Parameters
from app.core.plausibility import is_jump, moved, uncorrected
from app.core.probing import TouchError, measured_value
from app.core.variants import Results, results_of
from app.errors import Conflict, FieldError, Invalid
from app.offsets.tables import OUTSTANDING
from app.readings.ground import (
    Ground,
    IssuedCorrection,
    Named,
    OpenAlarm,
    Step,
    Stored,
    StreamState,
    ToolState,
    Verdict,
)
from app.readings.records import Entry
from app.readings.schemas import ReadingIn
from app.readings.wording import touch_problem
from app.web.i18n import _


def judge(ground: Ground, entry: Entry, reading: ReadingIn, now: datetime) -> Verdict | Stored:
    """Decide one reading and move the ground along.

    Raises `Invalid` or `Conflict` when the reading cannot be taken; nothing has changed then.
    """
    stream = ground.streams[entry.characteristic_id]
    parameters = stream.parameters
    if reading.key is not None and (known := _known(ground, entry, reading.key, reading)):
        return known
    measured, points = _measured(parameters, reading)
    tool = stream.tool
    in_effect = reading.correction_in_effect
    if in_effect is not None and in_effect > ground.last_correction[entry.machine_id]:
        raise Invalid(
            _("Machine %(machine)s has no correction %(number)s; its last one is %(last)s.")
            % {"machine": entry.machine, "number": in_effect, "last": ground.last_correction[entry.machine_id]},
            _("Send the number of the last correction that the machine had applied when it cut this part."),
            errors=[FieldError("correction_in_effect", _("There is no such correction yet."))],
        )

    sequence = stream.sequence + 1
    measured_at = now if reading.measured_at is None else reading.measured_at.astimezone(UTC)
    if tool is not None and tool.corrections and in_effect is not None:
        _confirm(ground, stream, tool, in_effect, min(now, reading.machined_at or measured_at))
    previous_tool, outstanding, compensated = cut_with(ground, tool, reading)
    average = stream.average
    empirical_value = average.empirical_value if average else 0.0
    results = results_of(parameters, reading.touches or (), points, empirical_value) if points else None
    deviation = deviation_of(measured, parameters.target, empirical_value)
    course = None
    if parameters.plausible_jump is not None and compensated is not None:
        course = uncorrected(deviation, compensated, parameters.factor)
    jump = course is not None and is_jump(course, stream.level, parameters.plausible_jump or 0.0)
    paused_by = stream.paused_by if tool is None or stream.paused_by is not None else tool.paused_by
    decision = decide(
        parameters,
        State(
            average.average if average else 0.0,
            _issued_total(tool) if parameters.max_total is not None else 0.0,
            paused_by is not None,
        ),
        deviation,
        outstanding=outstanding_effect((c.amount for c in outstanding), parameters.factor) if outstanding else 0.0,
        previous_tool=previous_tool,
        accepted=results is None or not results.rejected,
        jump=jump,
    )
    alarms = [_signal(ground, stream, signal, sequence, decision, results) for signal in decision.signals]
    correction = None
    if decision.amount is not None and tool is not None:
        correction = _issue(ground, stream, tool, sequence, decision)

    stream.sequence = sequence
    if average is not None and average.average != decision.average_after:
        average.average = decision.average_after
        average.changed = True
    if decision.action is Action.STOP and stream.paused_by is None:
        stream.paused_by = next(alarm for alarm in alarms if alarm.kind == Signal.PROBE_FAULT.value)
    last = stream.last_measured_at
    late = last is not None and measured_at < last
    if not late:
        stream.last_measured_at = measured_at
        if course is not None and not jump and decision.action is not Action.STOP:
            stream.level, stream.level_sequence, stream.level_moved = moved(stream.level, course), sequence, True
    verdict = Verdict(
        stream,
        reading,
        sequence,
        stream.version,
        parameters,
        measured,
        measured_at,
        now,
        late,
        decision,
        [c.number for c in outstanding],
        correction,
        paused_by,
        alarms,
        compensated,
        results=results,
    )
    stream.last = verdict
    ground.verdicts.append(verdict)
    if reading.key is not None:
        ground.by_key[entry.characteristic_id, reading.key] = verdict
    return verdict


def _measured(parameters: Parameters, reading: ReadingIn) -> tuple[float, tuple[float, ...]]:
    """The value, and the mean at each point if it came as touches."""
    if reading.touches is None:
        if parameters.accept_m > 1:
            raise Invalid(
                _("This characteristic is accepted by %(n)s of %(m)s sections, so it needs touches.")
                % {"n": parameters.accept_n, "m": parameters.accept_m},
                _("Send touches with one list per section in place of measured."),
                errors=[FieldError("touches", _("Send one list of touches per section."))],
            )
        return float(reading.measured or 0.0), ()
    try:
        value = measured_value(parameters, reading.touches)
    except TouchError as error:
        message = touch_problem(error)
        raise Invalid(
            message,
            _("Nothing was stored. Measure again, or correct points, repeats or path factor of the characteristic."),
            errors=[FieldError("touches", message)],
        ) from None
    return value.value, value.points


def _known(ground: Ground, entry: Entry, key: str, reading: ReadingIn) -> Verdict | Stored | None:
    """The first reading with this key, here or in the record; the same key with another value is refused.

    Touches are made into a value as they were then, whatever the characteristic expects by now.
    """
    at = (entry.characteristic_id, key)
    here = ground.by_key.get(at)
    first = here or ground.stored_keys.get(at)
    if first is None:
        return None
    sequence, value = first.sequence, first.measured
    measured, _sections = _measured(first.parameters, reading)
    if round(value - measured, DECIMALS) != 0:
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


def _confirm(ground: Ground, stream: StreamState, tool: ToolState, in_effect: int, at: datetime) -> None:
    """The machine says it cut with correction `in_effect`: this tool's pending ones up to it are applied."""
    last = ground.named.get((tool.machine_id, in_effect))
    for correction in tool.corrections:
        if correction.status != "pending" or not _had(correction, in_effect, last):
            continue
        before = tool.offset
        tool.offset = round(before + correction.amount, DECIMALS)
        tool.total = round(tool.total + correction.amount, DECIMALS)
        tool.changed = True
        actor = f"reading {stream.entry.characteristic} {stream.sequence + 1}"
        correction.status, correction.applied_at, correction.applied_by = "applied", at, actor
        correction.offset_after, correction.changed = tool.offset, True
        if last is not None and correction.number == in_effect:
            last.applied_at = at
        ground.steps.append(Step(tool.machine_id, tool.number, at, before, tool.offset, correction.number, actor))
        ground.touched_machines.add(tool.machine_id)


def confirms(ground: Ground, tool: ToolState | None, in_effect: int | None) -> bool:
    """Whether a reading that names this correction confirms one that is pending."""
    if tool is None or in_effect is None:
        return False
    last = ground.named.get((tool.machine_id, in_effect))
    return any(c.status == "pending" and _had(c, in_effect, last) for c in tool.corrections)


def cut_with(
    ground: Ground, tool: ToolState | None, reading: ReadingIn
) -> tuple[bool, list[IssuedCorrection], float | None]:
    """What the part of a reading was cut with.

    Whether with an offset from before a tool change or an edit by hand; the corrections it was cut without; and the sum
    (mm) of those of this tool's life that it was cut with, None in the first case.
    """
    if tool is None:
        return False, [], 0.0
    in_effect = reading.correction_in_effect
    last = None if in_effect is None else ground.named.get((tool.machine_id, in_effect))
    previous_tool = _cut_before_reset(tool, reading, last)
    outstanding = [c for c in tool.corrections if _not_in_effect(c, tool, reading, last)]
    return previous_tool, outstanding, None if previous_tool else _compensated(tool, outstanding)


def _had(correction: IssuedCorrection, in_effect: int, last: Named | None) -> bool:
    """Whether a machine whose last applied correction was `in_effect` had applied this one too.

    Corrections take effect in the order of their numbers, but one that waited for a person may have been overtaken: by
    those that were applied, or fetched as program text, before it was let go.
    """
    if correction.number == in_effect:
        return True
    if correction.number < in_effect:
        since = (last.fetched_at or last.applied_at) if last is not None else None
        return correction.decided_at is None or since is None or correction.decided_at <= since
    since = correction.fetched_at or correction.applied_at
    if last is None or last.decided_at is None or since is None:
        return False
    return since < last.decided_at


def _cut_before_reset(tool: ToolState, reading: ReadingIn, last: Named | None) -> bool:
    """Whether the part was cut before the tool was changed or its offset edited by hand.

    Told by `machined_at`, or by a correction that was applied before that moment and was not yet in effect.
    """
    if tool.reset_at is None:
        return False
    if reading.machined_at is not None:
        return reading.machined_at < tool.reset_at
    if reading.correction_in_effect is None:
        return False
    return any(
        c.status == "applied"
        and not _had(c, reading.correction_in_effect, last)
        and c.applied_at is not None
        and c.applied_at <= tool.reset_at
        for c in tool.corrections
    )


def _not_in_effect(correction: IssuedCorrection, tool: ToolState, reading: ReadingIn, last: Named | None) -> bool:
    """Whether the part of this reading was cut without that correction, which has been issued since."""
    if correction.status == "awaiting_approval":
        return True
    if correction.status not in OUTSTANDING and correction.status != "applied":
        return False
    applied_at = correction.applied_at
    if applied_at is not None and tool.reset_at is not None and applied_at <= tool.reset_at:
        return False  # it went out with the tool, or was written over by hand
    if reading.correction_in_effect is not None:
        return not _had(correction, reading.correction_in_effect, last)
    if reading.machined_at is not None:
        return applied_at is None or applied_at > reading.machined_at
    return applied_at is None


def _compensated(tool: ToolState, outstanding: list[IssuedCorrection]) -> float:
    """The corrections of this tool's life that were in effect when the part was cut, summed, mm; what it wore lies behind them."""
    total = tool.total
    for correction in outstanding:
        if correction.status == "applied":
            total -= correction.amount
    return round(total, DECIMALS) + 0.0


def _issued_total(tool: ToolState | None) -> float:
    """Corrections of the tool since it was changed, those not yet applied included, mm."""
    if tool is None:
        return 0.0
    return tool.total + sum(c.amount for c in tool.corrections if c.status in OUTSTANDING)


def _issue(ground: Ground, stream: StreamState, tool: ToolState, sequence: int, decision: Decision) -> IssuedCorrection:
    """Number the correction; whatever is held for this tool is superseded by it, so that they never add up."""
    number = ground.last_correction[tool.machine_id] + 1
    ground.last_correction[tool.machine_id] = number
    ground.touched_machines.add(tool.machine_id)
    for earlier in tool.corrections:
        if earlier.status == "held":
            earlier.status, earlier.superseded_by, earlier.changed = "superseded", number, True
    if decision.action is Action.HOLD:
        status = "held"
    elif needs_approval(stream.parameters):
        status = "awaiting_approval"
    else:
        status = "pending"
    correction = IssuedCorrection(
        tool.machine_id,
        number,
        tool.number,
        decision.amount or 0.0,
        status,
        stream.entry.characteristic_id,
        sequence,
        decision.size_error or 0.0,
        new=True,
    )
    tool.corrections.append(correction)
    ground.issued.append(correction)
    return correction


LIMIT_OF = {
    Signal.TOOL_WORN: "wear_limit",
    Signal.PROBE_FAULT: "confidence_limit",
    Signal.IMPLAUSIBLE: "plausible_jump",
}


def _signal(
    ground: Ground, stream: StreamState, signal: Signal, sequence: int, decision: Decision, results: Results | None
) -> OpenAlarm:
    """Raise the alarm, or add to the one that is active for the same trouble."""
    entry, parameters = stream.entry, stream.parameters
    of_tool = signal is Signal.OFFSET_LIMIT and stream.tool is not None
    if of_tool:
        active = ground.tool_alarms.get((entry.machine_id, parameters.tool_memory, signal.value))
    else:
        active = stream.alarms.get(signal.value)
    if active is None:
        active = OpenAlarm(
            entry.machine_id,
            None if of_tool else entry.characteristic_id,
            parameters.tool_memory or None,
            signal.value,
            sequence=sequence,
        )
        ground.raised.append(active)
        if of_tool:
            ground.tool_alarms[entry.machine_id, parameters.tool_memory, signal.value] = active
        else:
            stream.alarms[signal.value] = active
    limit = parameters.max_total if of_tool else getattr(parameters, LIMIT_OF.get(signal, ""), None)
    active.data = {
        "characteristic": entry.characteristic,
        "deviation": decision.deviation,
        "decided": decision.decided,
        "limit": parameters.tolerance_width / 2 if limit is None else limit,
    }
    if signal is Signal.ACCEPTANCE and results is not None:
        active.data |= {
            "m": parameters.accept_m,
            "least": parameters.accept_m - parameters.accept_n + 1,  # so many outside, and it is rejected
            "outside": results.sections_outside,
            "target": parameters.target,
        }
    active.count += 1
    active.last_sequence = sequence
    return active
