"""The decision on one reading: the whole of domain §3, from deviation to tool offset.

=================  =============  ==========================================  ====================
zone               \\|D\\|          correction                                  running average M
=================  =============  ==========================================  ====================
zero               <= R33         none                                        updated, kept
average            <= R34         by M_new if \\|M_new\\| > R33, else none      0 after a correction
full               <= R35/2       by D in full                                0
out of tolerance   < R37          by D in full, alarm                         0
wear               < R36          computed in full, held, alarm               unchanged
probe fault        >= R36         none, alarm, machine told to stop           unchanged
=================  =============  ==========================================  ====================

``M_new = M_old - M_old/k + D/k`` from 0: an exponentially weighted average with lambda = 1/k (R29).

**No double correction.** Parts already cut when a correction is issued come out with the old
offset. `decide` therefore judges the deviation that the part would have had with every correction
issued so far (`outstanding`); the raw deviation is what is stored and charted. Two things are facts
about the part itself and are told by the raw deviation whatever has been corrected since: that it is
out of tolerance, and that the probe cannot be believed (R36).
"""

from collections.abc import Iterable
from enum import StrEnum
from typing import NamedTuple

from app.core.parameters import Mode, Parameters, WearPolicy
from app.core.zones import Zone, classify, nanometres, within_tolerance

# Deviations and offsets carry no more than a picometre: it removes the noise of binary fractions
# (39.9981 - 39.992) and is a thousand times finer than any limit is compared.
DECIMALS = 9


class Action(StrEnum):
    """What the machine is asked to do after this reading."""

    NONE = "none"
    CORRECT = "correct"
    HOLD = "hold"
    STOP = "stop"


class Signal(StrEnum):
    """The alarm that a reading gives rise to."""

    OVERSIZE = "oversize"
    UNDERSIZE = "undersize"
    TOOL_WORN = "tool_worn"
    PROBE_FAULT = "probe_fault"
    ACCEPTANCE = "acceptance"
    OFFSET_LIMIT = "offset_limit"
    IMPLAUSIBLE = "implausible"


class Code(StrEnum):
    """Why it was decided so. The sentence that goes with each is worded at the edge."""

    WITHIN_ZERO_RANGE = "within_zero_range"
    AVERAGE_KEPT = "average_kept"
    AVERAGED_DEVIATION = "averaged_deviation"
    FULL_DEVIATION = "full_deviation"
    OUT_OF_TOLERANCE = "out_of_tolerance"
    TOOL_WORN_HELD = "tool_worn_held"
    TOOL_WORN_RELEASED = "tool_worn_released"
    PROBE_FAULT = "probe_fault"
    PAUSED = "paused"
    MEASURE_ONLY = "measure_only"
    BEFORE_TOOL_CHANGE = "before_tool_change"
    OFFSET_LIMIT = "offset_limit"
    REJECTED = "rejected"
    IMPLAUSIBLE = "implausible"
    IMPORTED = "imported"


class State(NamedTuple):
    """What the decision needs to know besides the reading.

    average: M, the running average of this characteristic's memory location R11, mm.
    total: sum of the corrections of the tool since it was changed, issued ones included, in offset units (mm).
    paused: compensation is paused by an alarm that nobody has acknowledged yet: a probe fault, or an offset that differs.
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
    good: the part itself lies within its tolerance.
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
    signals: tuple[Signal, ...]


def deviation_of(measured: float, target: float, empirical_value: float = 0.0) -> float:
    """D = measured - target - empirical value, mm; positive is too large, inside and outside alike.

    >>> deviation_of(39.9981, 39.992)
    0.0061
    """
    return round(measured - target - empirical_value, DECIMALS) + 0.0


def average_of(previous: float, deviation: float, weighting_factor: float) -> float:
    """M_new = M_old - M_old/k + D/k (R29), kept inside [M_old, D] against rounding.

    >>> average_of(3.25, 6.0, 2.0)
    4.625
    """
    if weighting_factor == 1:
        return deviation
    average = previous - previous / weighting_factor + deviation / weighting_factor
    if previous < deviation:
        return min(max(average, previous), deviation)
    return min(max(average, deviation), previous)


def outstanding_effect(amounts: Iterable[float], factor: float) -> float:
    """How much the size (mm) will change once these offset corrections are in effect.

    A correction of ``amount = factor * e`` removes the size error e, so the size changes by
    ``-amount / factor``.

    >>> outstanding_effect([-0.0061], factor=-1)
    -0.0061
    >>> outstanding_effect([0.003], factor=0.5)
    -0.006
    """
    total = sum(amounts)
    return round(-total / factor, DECIMALS) + 0.0 if total else 0.0


def decide(
    parameters: Parameters,
    state: State,
    deviation: float,
    *,
    outstanding: float = 0.0,
    previous_tool: bool = False,
    accepted: bool = True,
    jump: bool = False,
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

    >>> p = Parameters(target=10.0, tolerance_width=0.04, zero_range=0.004, averaging_limit=0.0133,
    ...                wear_limit=0.3, confidence_limit=1.0, weighting_factor=2, factor=-1, tool_memory=1, average_memory=1)
    >>> decide(p, State(average=0.00325), 0.006).amount
    -0.004625
    """
    limits = parameters.limits
    before = state.average if parameters.average_memory else 0.0
    decided = round(deviation + outstanding, DECIMALS) + 0.0 if outstanding else deviation
    good = within_tolerance(deviation, limits)
    fault = abs(nanometres(deviation)) >= limits.confidence
    zone = Zone.PROBE_FAULT if fault else classify(decided, limits)

    signals: list[Signal] = []
    if zone is Zone.PROBE_FAULT:
        signals.append(Signal.PROBE_FAULT)
    elif zone is Zone.WEAR and not previous_tool:
        signals.append(Signal.TOOL_WORN)
    elif not good:
        signals.append(Signal.OVERSIZE if deviation > 0 else Signal.UNDERSIZE)
    if not accepted:
        signals.append(Signal.ACCEPTANCE)

    def verdict(
        action: Action,
        code: Code,
        after: float = before,
        size_error: float | None = None,
        amount: float | None = None,
        clamped: bool = False,
    ) -> Decision:
        kept = after if parameters.average_memory else 0.0
        return Decision(
            deviation, decided, zone, action, code, before, kept, size_error, amount, clamped, good, tuple(signals)
        )

    if zone is Zone.PROBE_FAULT:
        return verdict(Action.STOP, Code.PROBE_FAULT)
    if state.paused:
        return verdict(Action.NONE, Code.PAUSED)
    if previous_tool:
        return verdict(Action.NONE, Code.BEFORE_TOOL_CHANGE)
    if not accepted and not parameters.rejected_may_correct:
        return verdict(Action.NONE, Code.REJECTED)

    held = parameters.wear_policy is WearPolicy.HOLD
    if jump and not (zone is Zone.WEAR and held):
        signals.append(Signal.IMPLAUSIBLE)
        if zone is Zone.ZERO or parameters.measures_only:
            return verdict(Action.NONE, Code.IMPLAUSIBLE)

    # What the zone asks for: the error to remove, what M becomes with and without a correction.
    updated = average_of(before, decided, parameters.weighting_factor)
    if zone is Zone.ZERO:
        return verdict(Action.NONE, Code.WITHIN_ZERO_RANGE, updated)
    if parameters.measures_only:
        return verdict(Action.NONE, Code.MEASURE_ONLY, before if zone is Zone.WEAR else updated)
    if Signal.IMPLAUSIBLE in signals:
        size_error, code, after, without = decided, Code.IMPLAUSIBLE, before, before
    elif zone is Zone.AVERAGE:
        if abs(nanometres(updated)) <= limits.zero_range:
            return verdict(Action.NONE, Code.AVERAGE_KEPT, updated)
        size_error, code, after, without = updated, Code.AVERAGED_DEVIATION, 0.0, updated
    elif zone is Zone.FULL:
        size_error, code, after, without = decided, Code.FULL_DEVIATION, 0.0, before
    elif zone is Zone.WEAR:
        code = Code.TOOL_WORN_HELD if held else Code.TOOL_WORN_RELEASED
        size_error, after, without = decided, before, before
    else:
        size_error, code, after, without = decided, Code.OUT_OF_TOLERANCE, 0.0, before

    amount = round(parameters.factor * size_error, DECIMALS) + 0.0
    clamped = parameters.max_step is not None and abs(amount) > parameters.max_step
    if clamped and parameters.max_step is not None:
        amount = parameters.max_step if amount > 0 else -parameters.max_step
    if parameters.max_total is not None and _exceeds(state.total, amount, parameters.max_total):
        signals.append(Signal.OFFSET_LIMIT)
        return verdict(Action.NONE, Code.OFFSET_LIMIT, without)
    action = Action.HOLD if code in {Code.TOOL_WORN_HELD, Code.IMPLAUSIBLE} else Action.CORRECT
    return verdict(action, code, after, size_error, amount, clamped)


def _exceeds(total: float, amount: float, limit: float) -> bool:
    """Whether a correction takes the sum beyond its limit. One that leads back towards zero never does."""
    after = abs(nanometres(total + amount))
    return after > nanometres(limit) and after > abs(nanometres(total))


def needs_approval(parameters: Parameters) -> bool:
    """Whether a person releases each correction of this characteristic."""
    return parameters.mode is Mode.APPROVAL
