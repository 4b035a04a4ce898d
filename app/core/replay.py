"""Simulation: the process without corrections, rebuilt from readings, and another policy run in closed loop on it.

The offset corrections in effect when a part was cut are taken out of its deviation D (`plausibility.uncorrected`), with S
their sum, f the factor and e the share of a correction that takes effect::

    free = D + e S / f

On that course another loop decides each reading by the whole of domain §3 (`decision.decide`), and what it corrects
changes the parts that follow::

    D' = free - e S' / f,    a correction issued at part t is in effect from part t + delay + 1 on.

Everything else happens as it did: edges are changed at the same parts (S' begins where S did), offsets set by hand are
set to the same values, pauses, rejected and implausible readings are those of then. A correction held in the wear zone
waits until the one that was held then was released, if it was. The pipeline is of one length.

Assumed is that corrections act in full, e = 1; `app.core.measured_gain` measures e. Lengths are mm.
"""

from collections.abc import Callable, Sequence
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.control_plan import Plan
from app.core.decision.limits import nanometres
from app.core.decision.loops import (
    EVERY_PART,
    LANE,
    TALLY,
    Floats,
    Mark,
    ProcessTrace,
    ReplayResult,
    Rows,
    Whole,
    follow,
    follow_each,
)
from app.core.decision.step import DECIMALS
from app.core.parameters import Feature, Parameters

LONGEST_DELAY = 200  # parts
FEWEST_FOR_PPK = 20


class ReplayedCharacteristic(NamedTuple):
    """Readings that are decided by the same parameters.

    response: mm of size per mm of offset, -e / f of the machine, whatever factor the policy believes in. memory: index of
    the running average, -1 for none. counts: whether they are those that are asked about; others share the tool.
    """

    parameters: Parameters
    response: float
    memory: int = 0
    counts: bool = True

    @property
    def of_size(self) -> float:
        """The response of what is measured: that of a tool itself is what it is."""
        return 0.0 if self.parameters.feature is Feature.TOOL else self.response

    def row(self) -> tuple[Any, ...]:
        """Return it as a row of `LANE`."""
        rules = self.parameters.rules
        return (*rules, self.of_size, self.memory if rules.averages else -1, self.counts)


class Policy(NamedTuple):
    """Parameters of each lane of a trace, and the number of parts cut with the old offset after a correction is issued."""

    lanes: tuple[ReplayedCharacteristic, ...]
    delay: int = 0

    def with_(self, change: Callable[[Parameters], Parameters], delay: int | None = None) -> "Policy":
        """The same with other parameters where it counts."""
        lanes = tuple(lane._replace(parameters=change(lane.parameters)) if lane.counts else lane for lane in self.lanes)
        return Policy(lanes, self.delay if delay is None else delay)


class Figures(NamedTuple):
    """Figures of a replay, of the readings that count and are not left out; mm, None where there are too few.

    rejects: parts out of tolerance, probe faults apart; a tool that is measured itself is none. Mean, spread, Ppk and largest are of
    the `inner` readings, within R37: an operator decides about those beyond. mean_size: of the size errors that corrections removed.
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


class Sampled(NamedTuple):
    """A replay in which 1 in `every` parts is measured, and every part for a while after a fresh edge and after an alarm.

    figures: mean, spread, Ppk, largest and rejects are of all parts; corrections and alarms of those that were measured. escaped:
    rejects that were not measured.
    """

    every: int
    measured: int
    escaped: int
    figures: Figures


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
    parts, part = np.zeros(len(lane), np.int64), 0
    for place, (which, ended) in enumerate(zip(lane.tolist(), ends.tolist(), strict=True)):
        if seen and (ended or which in seen):
            part, seen = part + 1, set()
        seen.add(which)
        parts[place] = part
    return parts


def _after_long_pauses(lane: Whole, at: NDArray[np.datetime64]) -> NDArray[np.bool_]:
    """Readings that follow upon the lane before them after a pause twice as long as any other two lanes that are neighbours."""
    kind = lane[:-1] * (int(lane.max(initial=0)) + 1) + lane[1:]
    pauses = np.diff(at).astype(np.float64)
    usual = sorted(
        (float(np.median(pauses[kind == transition])), transition)
        for transition in np.unique(kind[lane[1:] != lane[:-1]])
    )
    after_pause = np.zeros(len(lane), np.bool_)
    if len(usual) > 1 and usual[-1][0] > 2 * usual[-2][0]:
        after_pause[1:] = kind == usual[-1][1]
    return after_pause


def without_events(free: Floats) -> ProcessTrace:
    """Return the trace of one characteristic and one edge on which nothing happens."""
    count = len(free)
    marks = np.zeros(count, np.int8)
    marks[:1] = Mark.BEGIN
    nothing = np.zeros(1)
    return ProcessTrace(free, np.zeros(count, np.int64), marks, np.arange(count), nothing, nothing, np.zeros((1, 1)))


def run(trace: ProcessTrace, policy: Policy) -> tuple[ReplayResult, Figures]:
    """Follow the loop, compiled: each reading, and what they amount to."""
    result = ReplayResult.room(len(trace.free))
    tally = np.zeros(1, TALLY)
    follow(trace, rows_of([policy])[0], policy.delay, EVERY_PART, result, tally[0])
    return result, _figures(tally[0], _counted(policy))


def figures_of(trace: ProcessTrace, policies: Sequence[Policy]) -> list[Figures]:
    """Figures of each of many policies; they have the delay of the first. Releases the interpreter lock while it works."""
    if not policies:
        return []
    tallies = np.zeros(len(policies), TALLY)
    samplings = np.tile(EVERY_PART, (len(policies), 1))
    follow_each(trace, rows_of(policies), policies[0].delay, samplings, ReplayResult.room(0), tallies)
    return [_figures(tally, _counted(policy)) for tally, policy in zip(tallies, policies, strict=True)]


def sampled(trace: ProcessTrace, policy: Policy, plans: Sequence[Plan]) -> list[Sampled]:
    """The same policy where 1 in N parts is measured, by each of these plans; the other lanes are measured as they were.

    Of a plan its parts count: minutes and shifts are not replayed. A fresh edge is each `Mark.BEGIN`.
    """
    if not plans:
        return []
    tallies = np.zeros(len(plans), TALLY)
    samplings = np.array([(plan.every or 1, plan.after_change, plan.after_alarm) for plan in plans], np.int64)
    follow_each(trace, rows_of([policy] * len(plans)), policy.delay, samplings, ReplayResult.room(0), tallies)
    counted = _counted(policy)
    return [
        Sampled(
            plan.every or 1,
            int(tally["measured"]),
            0 if counted.feature is Feature.TOOL else int(tally["escaped"]),
            _figures(tally, counted),
        )
        for plan, tally in zip(plans, tallies, strict=True)
    ]


def rows_of(policies: Sequence[Policy]) -> Rows:
    """Return the lanes of policies as the loops take them, a row a policy."""
    return np.array([[lane.row() for lane in policy.lanes] for policy in policies], LANE)


def _counted(policy: Policy) -> Parameters:
    """The parameters of the lane that counts last: the newest version."""
    return next(lane.parameters for lane in reversed(policy.lanes) if lane.counts)


def _figures(tally: Any, parameters: Parameters) -> Figures:
    number = dict(zip(TALLY.names or (), tally.item(), strict=True))
    if parameters.feature is Feature.TOOL:
        number["rejects"] = 0
    total, squares, largest, sizes = (number.pop(name) for name in ("sum", "squares", "largest", "sizes"))
    del number["measured"], number["escaped"]
    inner, corrections = number["inner"], number["corrections"]
    mean = total / inner if inner else None
    spread = ppk = None
    if mean is not None and inner > 1:
        spread = sqrt(max(0.0, (squares - inner * mean * mean) / (inner - 1)))
        if not nanometres(spread * 1000):  # of equal readings rounding alone is left
            spread = 0.0
        elif inner >= FEWEST_FOR_PPK:
            ppk = parameters.tolerance.room(mean) / (3 * spread)
    return Figures(
        **number,
        mean_size=sizes / corrections if corrections else None,
        mean=mean,
        spread=spread,
        ppk=ppk,
        largest=largest if inner else None,
    )


def agreement(mine: NDArray[np.float64], true: NDArray[np.float64]) -> tuple[float, float]:
    """Accuracy of a replay: root mean square of the difference from the real readings, and the share of readings that are the
    same to 0.1 µm. Of readings that both have; (nan, nan) of none.

    >>> agreement(np.array([0.001, 0.002, 0.003, 0.004]), np.array([0.001, 0.002, 0.003, 0.006]))
    (0.001, 0.75)
    """
    both = np.isfinite(mine) & np.isfinite(true)
    if not both.any():
        return float("nan"), float("nan")
    difference = mine[both] - true[both]
    return float(np.sqrt((difference**2).mean())), float((np.abs(difference) <= 0.0001).mean())
