"""The decision on one reading: the whole of domain §3, from deviation to tool offset. Zones: `limits`; arithmetic: `step`.

=================  =============  ==========================================  ====================
zone               \\|D\\|          correction                                  running average M
=================  =============  ==========================================  ====================
zero               <= R33         none                                        updated, kept
average            <= R34         by M_new if \\|M_new\\| > R33, else none      0 after a correction
full               <= R35/2       by D in full                                0
out of tolerance   < R37          by D in full, alarm                         0
wear               < R36          computed in full, held, alarm               unchanged
probe fault        >= R36         none, alarm, the decision is to stop        unchanged
=================  =============  ==========================================  ====================

**Where nothing may be corrected** - compensation is paused, or the sum of the corrections has come to its limit - or the machine does
not take corrections, a part out of tolerance is one of a series, for nothing brings the next one back: the decision is to stop.

``M_new = M_old - M_old/k + D/k`` from 0: an exponentially weighted average with lambda = 1/k (R29).

**No double correction.** Parts already cut when a correction is issued come out with the old
offset. `decide` therefore judges the deviation that the part would have had with every correction
issued so far (`outstanding`); the raw deviation is what is stored and charted. Two things are facts
about the part itself and are judged by the raw deviation whatever has been corrected since: that it is
out of tolerance, and that the probe cannot be believed (R36).

**A tool that is measured itself** shows no correction: its size is what it is. It is judged with all corrections since it was
changed counted in (`not_in_size`), so that their sum settles at factor x D however often it is measured, and whatever the machine
confirms. Worn (R37) it is by its raw deviation, corrected or not; out of tolerance by what is not corrected yet.
"""

from collections.abc import Iterable
from enum import StrEnum
from typing import NamedTuple

from app.core.decision.limits import FAULT, WEAR, ZONES, Zone, nanometres, within_tolerance
from app.core.decision.step import (
    ACTIONS,
    BELIEVED,
    BEYOND_NATURAL_LIMIT,
    CODES,
    CORRECT,
    HOLD,
    OFFSET_LIMIT,
    Action,
    Code,
    effect_of,
    judged_size,
    step,
)
from app.core.parameters import Mode, Parameters


class ReadingAlarm(StrEnum):
    """The alarm that a reading gives rise to."""

    OVERSIZE = "oversize"
    UNDERSIZE = "undersize"
    TOOL_WORN = "tool_worn"
    PROBE_FAULT = "probe_fault"
    ACCEPTANCE = "acceptance"
    OFFSET_LIMIT = "offset_limit"
    IMPLAUSIBLE = "implausible"


class LoopState(NamedTuple):
    """State that the decision needs besides the reading.

    average: M, the running average of this characteristic's memory location R11, mm.
    total: sum of the corrections of the tool since it was changed, issued ones included, in offset units (mm).
    paused: compensation is paused by an alarm that is not acknowledged yet: a probe fault, or an offset that differs.
    """

    average: float = 0.0
    total: float = 0.0
    paused: bool = False


class Decision(NamedTuple):
    """The verdict on one reading. Lengths in mm; `amount` is what the offset changes by.

    deviation: raw D = measured - target - empirical value.
    decided: D with the outstanding corrections taken into account; zone and action follow from it.
    size_error: the error that `amount` removes (D or M), None without a correction.
    clamped: `max_step` made the amount smaller.
    good: the part itself lies within its tolerance; of a tool, what is not corrected does.
    """

    deviation: float
    decided: float
    zone: Zone
    action: Action
    code: Code
    average_before: float
    average_after: float
    size_error: float | None
    amount: float | None
    clamped: bool
    good: bool
    alarms: tuple[ReadingAlarm, ...]


def outstanding_effect(amounts: Iterable[float], factor: float) -> float:
    """Return how much the size (mm) will change once these offset corrections are in effect."""
    return effect_of(sum(amounts), factor)


def decide(
    parameters: Parameters,
    state: LoopState,
    deviation: float,
    *,
    outstanding: float = 0.0,
    previous_tool: bool = False,
    accepted: bool = True,
    jump: bool = False,
    fault: Code | None = None,
    by_hand: bool = False,
    not_taken: bool = False,
) -> Decision:
    """Decide one reading (domain §3).

    deviation: raw D, mm, as `deviation_of` makes it.
    outstanding: size change still to come from corrections that this part was cut without, mm
        (`outstanding_effect`).
    previous_tool: the part was cut before the tool was changed or its offset edited by hand, so it
        says nothing about the offset of today.
    accepted: the n-of-m verdict over the part's sections (domain §6); a rejected part corrects
        nothing unless the characteristic allows it.
    jump: neither wear nor scatter explains it (`plausibility.is_jump`): what it asks for is computed in full and held, and
        it says nothing to the average. In the wear zone the alarm *tool worn* asks the same already.
    by_hand: the size is that of the tool itself, and a person has set its offset since it was changed: it is not known how much
        of it that offset has in it already, so nothing is corrected until the tool is changed.
    not_taken: the machine does not take the corrections of this tool, so what is counted in is not in the offset.
    fault: why the reading cannot be believed whatever D is: the probe triggered on its way to the surface (domain §5, *not a
        bore*), or a touch is missing or outside its window (domain §4). A probe fault, as is a value beyond a natural limit.

    >>> p = Parameters(target=10.0, tolerance_width=0.04, zero_range=0.004, averaging_limit=0.0133,
    ...                wear_limit=0.3, confidence_limit=1.0, weighting_factor=2, factor=-1, tool_memory=1, average_memory=1)
    >>> decide(p, LoopState(average=0.00325), 0.006).amount
    -0.004625
    """
    made = step(
        parameters.rules,
        state.average,
        state.total,
        deviation,
        outstanding,
        state.paused,
        previous_tool,
        not accepted,
        jump,
        BELIEVED if fault is None else CODES.index(fault),
        by_hand,
        not_taken,
    )
    size = judged_size(parameters.rules, deviation, made.decided)
    good = within_tolerance(size, parameters.limits) and fault is None and made.code != BEYOND_NATURAL_LIMIT
    alarms = []
    if made.zone == FAULT:
        alarms.append(ReadingAlarm.PROBE_FAULT)
    elif made.zone == WEAR and not previous_tool:
        alarms.append(ReadingAlarm.TOOL_WORN)
    elif not good:
        alarms.append(ReadingAlarm.OVERSIZE if size > 0 else ReadingAlarm.UNDERSIZE)
    if not accepted:
        alarms.append(ReadingAlarm.ACCEPTANCE)
    if made.jumped:
        alarms.append(ReadingAlarm.IMPLAUSIBLE)
    if made.code == OFFSET_LIMIT:
        alarms.append(ReadingAlarm.OFFSET_LIMIT)
    corrects = made.action in (CORRECT, HOLD)
    return Decision(
        deviation,
        made.decided,
        ZONES[made.zone],
        ACTIONS[made.action],
        CODES[made.code],
        state.average if parameters.average_memory else 0.0,
        made.average,
        made.size_error if corrects else None,
        made.amount if corrects else None,
        made.clamped,
        good,
        tuple(alarms),
    )


def voids_corrections(old: Parameters, new: Parameters) -> bool:
    """Tell if corrections that were computed under the old parameters, and are not in the offset yet, must stay out of it.

    They lead to another target, move another tool or the other way; or nothing is to be corrected any more, or only what
    a person has approved.
    """
    return (
        nanometres(old.target) != nanometres(new.target)
        or (old.factor, old.tool_memory) != (new.factor, new.tool_memory)
        or new.measures_only
        or (needs_approval(new) and not needs_approval(old))
    )


def needs_approval(parameters: Parameters) -> bool:
    """True if a person releases each correction of this characteristic."""
    return parameters.mode is Mode.APPROVAL
