"""The arithmetic of the decision on one reading, once: `decide` calls it, and `loops` compiles it over columns.

Everything here is written in the part of Python that Numba compiles: numbers and named tuples, no words. Zones, actions and
codes are places in `ZONES`, `ACTIONS` and `CODES`; the constants beside those tuples name them. Lengths are mm.
"""

from enum import StrEnum
from math import inf
from typing import NamedTuple

from app.core.decision.limits import (
    AVERAGE,
    FAULT,
    FULL,
    WEAR,
    ZERO,
    beyond_natural,
    nanometres,
    reaches,
    within,
    zone_of,
)

# Deviations and offsets carry no more than a picometre: it removes the noise of binary fractions
# (39.9981 - 39.992) and is a thousand times finer than any limit is compared.
DECIMALS = 9


class Action(StrEnum):
    """Request to the machine after this reading."""

    NONE = "none"
    CORRECT = "correct"
    HOLD = "hold"
    STOP = "stop"


ACTIONS = tuple(Action)
NONE, CORRECT, HOLD, STOP = range(len(ACTIONS))


class Code(StrEnum):
    """Reason of a decision, as a code. The sentence that goes with each is worded at the edge."""

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
    FIRST_MOVE_TRIGGERED = "first_move_triggered"
    TOUCH_FAULT = "touch_fault"
    OFFSET_BY_HAND = "offset_by_hand"
    BEYOND_NATURAL_LIMIT = "beyond_natural_limit"
    NOT_TAKEN = "not_taken"


CODES = tuple(Code)
WITHIN_ZERO_RANGE, AVERAGE_KEPT, AVERAGED_DEVIATION, FULL_DEVIATION, OUT_OF_TOLERANCE = range(5)
TOOL_WORN_HELD, TOOL_WORN_RELEASED, PROBE_FAULT, PAUSED, MEASURE_ONLY = range(5, 10)
BEFORE_TOOL_CHANGE, OFFSET_LIMIT, REJECTED, IMPLAUSIBLE, IMPORTED, FIRST_MOVE_TRIGGERED, TOUCH_FAULT = range(10, 17)
OFFSET_BY_HAND = 17
BEYOND_NATURAL_LIMIT = 18
NOT_TAKEN = 19
BELIEVED = -1


class Rules(NamedTuple):
    """The parameters that a step goes by: limits in nm as in `Limits`, lengths in mm, infinity for a bound that is not set.

    averages: there is a memory for the running average (R11). of_tool: the size is that of the tool itself, which no correction
    changes, and corrects its offset. natural: side of the natural limit, 0 for none. Loops hand over a row of an array with these
    fields.
    """

    zero_range: int  # R33
    averaging: int  # R34
    tolerance: int  # R35/2
    wear: int  # R37
    confidence: int  # R36
    weighting_factor: float  # R29
    factor: float
    max_step: float
    max_total: float
    averages: bool
    measures_only: bool
    holds_wear: bool
    rejected_may_correct: bool
    of_tool: bool = False
    natural: int = 0


class Step(NamedTuple):
    """The outcome for one reading, mm. zone, action, code: places.

    average: M after it. size_error, amount, clamped: of the correction that is made or held. jumped: it is implausible.
    """

    decided: float
    zone: int
    code: int
    average: float
    action: int
    size_error: float
    amount: float
    clamped: bool
    jumped: bool


def rounded(length: float) -> float:
    """Round to a picometre, -0.0 to 0.0."""
    return round(length, DECIMALS) + 0.0


def deviation_of(measured: float, target: float, empirical_value: float = 0.0) -> float:
    """D = measured - target - empirical value, mm; positive is too large, inside and outside alike.

    >>> deviation_of(39.9981, 39.992)
    0.0061
    """
    return rounded(measured - target - empirical_value)


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


def effect_of(amount: float, factor: float) -> float:
    """Return how much the size (mm) changes once an offset has changed by this amount.

    A correction of ``amount = factor * e`` removes the size error e, so the size changes by ``-amount / factor``.

    >>> effect_of(-0.0061, factor=-1), effect_of(0.003, factor=0.5)
    (-0.0061, -0.006)
    """
    return rounded(-amount / factor) if amount else 0.0


def not_in_size(rules: Rules, total: float, pending: float) -> float:
    """Return the sum of corrections that a measured size does not show, mm of offset.

    total: of all since the tool was changed, those that are pending included. Of a part it is what took effect too late for it.
    The size of the tool itself shows none, ever: each correction would be made again with every reading.
    """
    return total if rules.of_tool else pending


def judged_size(rules: Rules, deviation: float, decided: float) -> float:
    """Return the deviation that the tolerance holds for: of a part its own, of a tool what it is not corrected for."""
    return decided if rules.of_tool else deviation


def exceeds(total: float, amount: float, limit: float) -> bool:
    """Return whether a correction takes the sum beyond its limit. One that leads back towards zero never does."""
    if limit == inf:
        return False
    after = abs(nanometres(total + amount))
    return after > nanometres(limit) and after > abs(nanometres(total))


def uncorrected(rules: Rules, deviation: float, decided: float, zone: int) -> int:
    """Return the action where nothing may bring the size back: to stop for a part out of tolerance, for the next will be as well."""
    out = zone > FULL and not within(nanometres(judged_size(rules, deviation, decided)), rules.tolerance)
    return STOP if out and not rules.measures_only else NONE


def without_correction(
    decided: float, zone: int, code: int, average: float, action: int = NONE, jumped: bool = False
) -> Step:
    """Return an outcome without a correction."""
    return Step(decided, zone, code, average, action, 0.0, 0.0, False, jumped)


def step(
    rules: Rules,
    average: float,
    total: float,
    deviation: float,
    outstanding: float,
    paused: bool,
    previous_tool: bool,
    rejected: bool,
    jump: bool,
    fault: int,
    by_hand: bool = False,
    not_taken: bool = False,
) -> Step:
    """Decide one reading as `decide` explains. average: M before it; total: sum of the corrections of the tool.

    fault: the code why it cannot be believed whatever its size, else `BELIEVED`. not_taken: the machine takes no corrections.
    """
    before = average if rules.averages else 0.0
    decided = rounded(deviation + outstanding) if outstanding else deviation
    zone = zone_of(decided, rules)
    if rules.of_tool and zone < WEAR and reaches(nanometres(deviation), rules.wear):
        zone = WEAR  # corrected or not, the tool is as worn as it is
    if fault == BELIEVED and beyond_natural(nanometres(deviation), rules.natural, rules.zero_range):
        fault = BEYOND_NATURAL_LIMIT
    if fault != BELIEVED or reaches(nanometres(deviation), rules.confidence):
        zone = FAULT
    if zone == FAULT:
        return without_correction(decided, zone, PROBE_FAULT if fault == BELIEVED else fault, before, STOP)
    lost = NONE if by_hand else uncorrected(rules, deviation, decided, zone)
    if paused:
        return without_correction(decided, zone, PAUSED, before, NONE if previous_tool else lost)
    if previous_tool:
        return without_correction(decided, zone, BEFORE_TOOL_CHANGE, before)
    waits = not_taken and not (jump or by_hand or rules.measures_only)
    if waits and not within(nanometres(judged_size(rules, deviation, decided)), rules.tolerance):
        return without_correction(decided, zone, NOT_TAKEN, before, STOP)
    if rejected and not rules.rejected_may_correct:
        return without_correction(decided, zone, REJECTED, before)

    # A correction that is held in the wear zone asks the same already.
    jumped = jump and not (zone == WEAR and rules.holds_wear)
    if jumped and (zone == ZERO or rules.measures_only or by_hand):
        return without_correction(decided, zone, IMPLAUSIBLE, before, jumped=True)

    # What the zone asks for: the error to remove, what M becomes with and without a correction.
    updated = average_of(before, decided, rules.weighting_factor)
    kept = updated if rules.averages else 0.0
    if zone == ZERO:
        return without_correction(decided, zone, WITHIN_ZERO_RANGE, kept)
    if rules.measures_only or by_hand:
        code = OFFSET_BY_HAND if by_hand else MEASURE_ONLY
        return without_correction(decided, zone, code, before if zone == WEAR else kept)
    if rules.of_tool and within(nanometres(decided), rules.zero_range):
        return without_correction(decided, zone, WITHIN_ZERO_RANGE, before)  # worn out, and corrected for
    action, size_error, after, without = CORRECT, decided, 0.0, before
    if jumped:
        action, code, after = HOLD, IMPLAUSIBLE, before
    elif zone == AVERAGE:
        if within(nanometres(updated), rules.zero_range):
            return without_correction(decided, zone, AVERAGE_KEPT, kept)
        code, size_error, without = AVERAGED_DEVIATION, updated, kept
    elif zone == FULL:
        code = FULL_DEVIATION
    elif zone == WEAR:
        after = before
        if rules.holds_wear:
            action, code = HOLD, TOOL_WORN_HELD
        else:
            code = TOOL_WORN_RELEASED
    else:
        code = OUT_OF_TOLERANCE

    amount = rounded(rules.factor * size_error)
    clamped = abs(amount) > rules.max_step
    if clamped:
        amount = rules.max_step if amount > 0 else -rules.max_step
    if exceeds(total, amount, rules.max_total):
        return without_correction(decided, zone, OFFSET_LIMIT, without, lost, jumped)
    return Step(decided, zone, code, after, action, size_error, amount, clamped, jumped)
