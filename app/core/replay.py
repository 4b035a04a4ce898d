"""What if: the process without corrections, rebuilt from readings, and another policy run in closed loop on it.

The offset corrections in effect when a part was cut are taken out of its deviation D (`plausibility.uncorrected`), with S
their sum, f the factor and e the share of a correction that takes effect::

    free = D + e S / f

On that course another loop decides each reading by the whole of domain §3 (`compensation.decide`), and what it corrects
changes the parts that follow::

    D' = free - e S' / f,    a correction issued at part t is in effect from part t + delay + 1 on.

Everything else happens as it did: edges are changed at the same parts (S' begins where S did), offsets set by hand are
set to the same values, pauses, rejected and implausible readings are those of then. A correction held in the wear zone
waits until the one that was held then was released, if it was. The pipeline is of one length.

Assumed is that corrections act in full, e = 1; `app.core.effect` measures e. Lengths are mm.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.closed_loop import Count, Course, Floats, Mark, Total, Way, Whole, follow, follow_each
from app.core.compensation import DECIMALS, Action, State, decide, outstanding_effect
from app.core.parameters import Parameters, WearPolicy
from app.core.zones import nanometres

LONGEST_DELAY = 200  # parts
FEWEST_FOR_PPK = 20


class Lane(NamedTuple):
    """Readings that are decided by the same parameters.

    response: mm of size per mm of offset, -e / f of the machine, whatever factor the policy believes in. memory: index of
    the running average, -1 for none. counts: whether they are those that are asked about; others share the tool.
    """

    parameters: Parameters
    response: float
    memory: int = 0
    counts: bool = True


class Policy(NamedTuple):
    """How each lane of a way is decided, and how many parts come out with the old offset after a correction is issued."""

    lanes: tuple[Lane, ...]
    delay: int = 0

    def with_(self, change: Callable[[Parameters], Parameters], delay: int | None = None) -> "Policy":
        """The same with other parameters where it counts."""
        lanes = tuple(lane._replace(parameters=change(lane.parameters)) if lane.counts else lane for lane in self.lanes)
        return Policy(lanes, self.delay if delay is None else delay)


class Figures(NamedTuple):
    """What a replay amounts to, of the readings that count and are not left out; mm, None where there are too few to say.

    rejects: parts out of tolerance, probe faults apart. Mean, spread, Ppk and largest are of the `inner` readings, within
    R37: what lies beyond is an operator's business. mean_size: of the size errors that corrections removed.
    """

    readings: int
    rejects: int
    oversize: int
    undersize: int
    worn: int
    faults: int
    offset_limit: int
    corrections: int
    of_tool: int
    held: int
    mean_size: float | None
    inner: int
    mean: float | None
    spread: float | None
    ppk: float | None
    largest: float | None

    @property
    def alarms(self) -> int:
        """Readings that raise an alarm by their size."""
        return self.oversize + self.undersize + self.worn + self.faults + self.offset_limit


def rebuilt(deviation: Floats, compensated: Floats, factor: float | Floats, effect: float = 1.0) -> Floats:
    """The deviations that the parts would have had without any correction since the tool change. factor: of all, or of each.

    >>> rebuilt(np.array([0.002, 0.001]), np.array([0.0, -0.006]), factor=-1.0).tolist()
    [0.002, 0.007]
    """
    return np.asarray(np.round(deviation + effect * compensated / factor, DECIMALS) + 0.0)


def parts_of(lane: Whole, serial: Whole | None = None, at: NDArray[np.datetime64] | None = None) -> Whole:
    """Numbers of parts: a part ends where a lane comes again, where the serial number is another (-1: not known), and where the
    long pause between parts lies, which readings that begin amid a part would tell of by nothing else.

    >>> parts_of(np.array([0, 1, 0, 1, 0, 0])).tolist()
    [0, 0, 1, 1, 2, 3]
    >>> parts_of(np.array([1, 0, 1, 0, 1]), np.array([7, 8, 8, 9, 9])).tolist()
    [0, 1, 1, 2, 2]
    """
    if len(lane) and not (lane != lane[0]).any():
        return np.arange(len(lane))
    ends = np.zeros(len(lane), np.bool_) if at is None else _after_long_pauses(lane, at)
    if serial is not None:
        known = (serial[1:] >= 0) & (serial[:-1] >= 0)
        ends[1:] = np.where(known, serial[1:] != serial[:-1], ends[1:])
    seen: set[int] = set()
    found, part = np.zeros(len(lane), np.int64), 0
    for place, (which, ended) in enumerate(zip(lane.tolist(), ends.tolist(), strict=True)):
        if seen and (ended or which in seen):
            part, seen = part + 1, set()
        seen.add(which)
        found[place] = part
    return found


def _after_long_pauses(lane: Whole, at: NDArray[np.datetime64]) -> NDArray[np.bool_]:
    """Readings that follow upon the lane before them after a pause twice as long as any other two lanes that are neighbours."""
    kind = lane[:-1] * (int(lane.max(initial=0)) + 1) + lane[1:]
    pauses = np.diff(at).astype(np.float64)
    usual = sorted((float(np.median(pauses[kind == each])), each) for each in np.unique(kind[lane[1:] != lane[:-1]]))
    found = np.zeros(len(lane), np.bool_)
    if len(usual) > 1 and usual[-1][0] > 2 * usual[-2][0]:
        found[1:] = kind == usual[-1][1]
    return found


def followed(way: Way, policy: Policy) -> Iterator[tuple[float, float, float, float, float, str, str]]:
    """Each reading as it comes out and is decided, the columns of `Course`: what `run` compiles, in plain Python.

    The worked example of domain §3 up to its first correction:

    >>> p = Parameters(target=10, tolerance_width=0.04, zero_range=0.004, averaging_limit=0.0133, wear_limit=0.3,
    ...                confidence_limit=1.0, weighting_factor=2, factor=-1, tool_memory=1, average_memory=1)
    >>> way = undisturbed(np.array([0.003, 0.005, 0.006]))
    >>> [row[3] for row in followed(way, Policy((Lane(p, response=1.0),)))]
    [0.0, 0.0, -0.004625]
    """
    averages: list[float] = []
    waiting: deque[tuple[int, float]] = deque()
    offset = pending = total = 0.0
    held: float | None = None
    begun = 0
    columns = (way.free.tolist(), way.lane.tolist(), way.marks.tolist(), way.part.tolist())
    for free, which, mark, part in zip(*columns, strict=True):
        lane = policy.lanes[which]
        parameters = lane.parameters
        if mark & Mark.BEGIN:
            offset, pending = float(way.offset[begun]), float(way.pending[begun])
            averages = way.averages[begun].tolist()
            total, held = round(offset + pending, DECIMALS) + 0.0, None
            waiting.clear()
            if pending:
                waiting.append((part + policy.delay + 1, pending))
            begun += 1
        if mark & Mark.RESTART and lane.memory >= 0:
            averages[lane.memory] = 0.0
        if mark & Mark.RELEASED and held is not None:
            offset, total, held = round(offset + held, DECIMALS) + 0.0, round(total + held, DECIMALS) + 0.0, None
        while waiting and waiting[0][0] <= part:
            _due, amount = waiting.popleft()
            offset, pending = round(offset + amount, DECIMALS) + 0.0, round(pending - amount, DECIMALS) + 0.0
        decision = decide(
            parameters,
            State(averages[lane.memory] if lane.memory >= 0 else 0.0, total, bool(mark & Mark.PAUSED)),
            round(free + lane.response * offset, DECIMALS) + 0.0,
            outstanding=outstanding_effect((pending,), parameters.factor),
            accepted=not mark & Mark.REJECTED,
            jump=bool(mark & Mark.JUMP),
        )
        if lane.memory >= 0:
            averages[lane.memory] = decision.average_after
        if decision.amount is not None:
            held = decision.amount if decision.action is Action.HOLD else None
            if decision.action is Action.CORRECT:
                total = round(total + decision.amount, DECIMALS) + 0.0
                pending = round(pending + decision.amount, DECIMALS) + 0.0
                waiting.append((part + policy.delay + 1, decision.amount))
        yield (
            decision.deviation,
            decision.decided,
            decision.average_after,
            decision.amount or 0.0,
            offset,
            decision.zone,
            decision.code,
        )


def undisturbed(free: Floats) -> Way:
    """A way of one characteristic and one edge on which nothing happens."""
    count = len(free)
    marks = np.zeros(count, np.int8)
    marks[:1] = Mark.BEGIN
    nothing = np.zeros(1)
    return Way(free, np.zeros(count, np.int64), marks, np.arange(count), nothing, nothing, np.zeros((1, 1)))


def run(way: Way, policy: Policy) -> tuple[Course, Figures]:
    """Follow the loop, compiled: each reading, and what they amount to."""
    course = Course.room(len(way.free))
    counts, sums = np.zeros(len(Count), np.int64), np.zeros(len(Total))
    numbers, limits = _rows(policy)
    follow(way, numbers, limits, policy.delay, course, counts, sums)
    return course, _figures(counts, sums, _half(policy))


def figures_of(way: Way, policies: Sequence[Policy]) -> list[Figures]:
    """What each of many policies amounts to; they have the delay of the first. Lets the interpreter go while it works."""
    if not policies:
        return []
    rows = [_rows(policy) for policy in policies]
    numbers, limits = (np.stack(column) for column in zip(*rows, strict=True))
    counts, sums = np.zeros((len(rows), len(Count)), np.int64), np.zeros((len(rows), len(Total)))
    follow_each(way, numbers, limits, policies[0].delay, Course.room(0), counts, sums)
    return [_figures(counts[at], sums[at], _half(policy)) for at, policy in enumerate(policies)]


def _rows(policy: Policy) -> tuple[Floats, Whole]:
    numbers = [
        (p.weighting_factor, p.factor, lane.response, _or_inf(p.max_step), _or_inf(p.max_total))
        for lane in policy.lanes
        for p in (lane.parameters,)
    ]
    whole = [
        (
            p.limits.zero_range,
            p.limits.averaging,
            p.limits.tolerance,
            p.limits.wear,
            p.limits.confidence,
            p.measures_only,
            lane.memory if p.average_memory else -1,
            p.wear_policy is WearPolicy.HOLD,
            p.rejected_may_correct,
            lane.counts,
        )
        for lane in policy.lanes
        for p in (lane.parameters,)
    ]
    return np.array(numbers, np.float64), np.array(whole, np.int64)


def _or_inf(limit: float | None) -> float:
    return inf if limit is None else limit


def _half(policy: Policy) -> float:
    """R35/2 of the lane that counts last: the newest version."""
    return next(lane.parameters.tolerance_width for lane in reversed(policy.lanes) if lane.counts) / 2


def _figures(counts: Whole, sums: Floats, half: float) -> Figures:
    number = {place: int(counts[place]) for place in Count}
    inner, corrections = number[Count.INNER], number[Count.CORRECTIONS]
    mean = float(sums[Total.SUM]) / inner if inner else None
    spread = ppk = None
    if mean is not None and inner > 1:
        spread = sqrt(max(0.0, (float(sums[Total.SQUARES]) - inner * mean * mean) / (inner - 1)))
        if not nanometres(spread * 1000):  # of equal readings rounding alone is left
            spread = 0.0
        elif inner >= FEWEST_FOR_PPK:
            ppk = (half - abs(mean)) / (3 * spread)
    return Figures(
        readings=number[Count.READINGS],
        rejects=number[Count.REJECTS],
        oversize=number[Count.OVERSIZE],
        undersize=number[Count.UNDERSIZE],
        worn=number[Count.WORN],
        faults=number[Count.FAULTS],
        offset_limit=number[Count.LIMIT],
        corrections=corrections,
        of_tool=number[Count.OF_TOOL],
        held=number[Count.HELD],
        mean_size=float(sums[Total.SIZES]) / corrections if corrections else None,
        inner=inner,
        mean=mean,
        spread=spread,
        ppk=ppk,
        largest=float(sums[Total.LARGEST]) if inner else None,
    )


def agreement(mine: NDArray[np.float64], true: NDArray[np.float64]) -> tuple[float, float]:
    """How far a replay runs from what happened: root mean square of the difference, and the share of readings that are the
    same to 0.1 µm. Of readings that both have; (nan, nan) of none.

    >>> agreement(np.array([0.001, 0.002, 0.003, 0.004]), np.array([0.001, 0.002, 0.003, 0.006]))
    (0.001, 0.75)
    """
    both = np.isfinite(mine) & np.isfinite(true)
    if not both.any():
        return float("nan"), float("nan")
    difference = mine[both] - true[both]
    return float(np.sqrt((difference**2).mean())), float((np.abs(difference) <= 0.0001).mean())
