"""True history of a tool, as a replay needs it: readings, edges, pauses, and the parameters of then. Never writes.

A tool that several characteristics correct is replayed with all of them: each keeps deciding as it did, and only the
one that is asked about gets other settings. Readings whose corrections are not known (cut before a tool change,
imported, or from before that was kept) are left out, and counted. Where all that are known were imported, they are a process
that this loop never corrected, and are replayed as that.
"""

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.decision.limits import FAULT, in_nanometres, nanometres, reaches
from app.core.decision.loops import Mark, ProcessTrace
from app.core.decision.step import (
    FIRST_MOVE_TRIGGERED,
    IMPLAUSIBLE,
    IMPORTED,
    OFFSET_BY_HAND,
    REJECTED,
    TOOL_WORN_HELD,
    TOUCH_FAULT,
    rounded,
)
from app.core.parameters import Mode, Parameters
from app.core.period import Period
from app.core.replay import LONGEST_DELAY, Figures, Policy, ReplayedCharacteristic, parts_of, rebuilt
from app.core.spc.resolution import resolution_of
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import History, Window
from app.loop.tables.tools import ToolEvent
from app.quality.baselines import queries as baselines

LARGEST = 1_000_000  # readings in one replay
MOST_FOLLOWED = 2_000  # corrections that tell of the delay by the offset
BREAK = 5.0  # times the usual time between two parts
COLUMNS = (
    "measured",
    "deviation",
    "decided",
    "compensated",
    "average_before",
    "received_at",
    "measured_at",
    "machined_at",
    "parameters_version",
    "correction_in_effect",
    "correction",
    "paused",
    "zone",
    "code",
)
HELD = (TOOL_WORN_HELD, IMPLAUSIBLE)  # codes of corrections that wait for a person

Values = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Delays(NamedTuple):
    """Parts that came out with the old offset after a correction: the median, and from where to where nine of ten lie."""

    usual: int
    low: int
    high: int


@dataclass(frozen=True)
class ToolHistory:
    """The readings of a period. mine: those of `trace` that are of the characteristic, whose columns `history` holds.

    then: each version as it was in force. unknown: readings left out. others: characteristics that correct the same tool.
    delays: parts between a correction and its effect; None where no correction has taken effect.
    compensated: of every reading of `trace`, mm of offset; factors: what its characteristic turns mm of size into mm of offset by.
    imported: they come from files, and none of them was corrected by this loop.
    of_tool: corrections of the tool, those of the others included. baseline: version of the one in force, if it is one of deviations.
    """

    current: CurrentCharacteristic
    window: Window
    history: History
    mine: Flags
    trace: ProcessTrace
    then: Policy
    slots: dict[int, int]
    deviations: Values
    compensated: Values
    factors: Values
    of_tool: int
    unknown: int
    others: list[str]
    delays: Delays | None
    baseline: int | None
    imported: bool = False

    @property
    def delay(self) -> int | None:
        """As it was most often: the one that a replay takes for all corrections."""
        return self.delays.usual if self.delays else None

    def with_effect(self, effect: float) -> ProcessTrace:
        """The trace, had corrections acted by this share."""
        free = rebuilt(self.deviations, self.compensated, self.factors, effect)
        return self.trace._replace(free=free)

    def policy(self, parameters: Parameters, delay: int, effect: float = 1.0) -> Policy:
        """These parameters throughout; the others as they were."""
        slot = self.slots.get(parameters.average_memory, -1)
        lanes = tuple(
            replace_lane(lane, effect, parameters if lane.counts else lane.parameters, slot if lane.counts else None)
            for lane in self.then.lanes
        )
        return Policy(lanes, delay)

    def as_then(self, delay: int, effect: float = 1.0) -> Policy:
        """As it was set then; of imported readings, which nobody corrected, nothing but measured."""
        lanes = tuple(replace_lane(lane, effect, lane.parameters, None) for lane in self.then.lanes)
        if self.imported:
            lanes = tuple(lane._replace(parameters=replace(lane.parameters, mode=Mode.MEASURE_ONLY)) for lane in lanes)
        return Policy(lanes, delay)

    def inner(self, deviations: Values) -> Flags:
        """Tell which deviations (mm) lie within R37 of today."""
        return ~reaches(in_nanometres(deviations), self.current.parameters.limits.wear)

    @cached_property
    def resolved(self) -> bool:
        """Tell whether the readings as measured are fine enough to carry an index; of none there is nothing to refuse."""
        deviation = self.history["deviation"]
        inner = deviation[self.inner(deviation) & ~self.history.excluded]
        return not len(inner) or resolution_of(inner, self.current.parameters.half).enough

    def carried(self, figures: Figures) -> Figures:
        """Figures of a replay without a Ppk, where the readings are too coarse for one: shifted steps only look finer."""
        return figures if self.resolved else figures._replace(ppk=None)

    @cached_property
    def steady(self) -> tuple[Flags, Flags]:
        """Readings of the characteristic by which the effect of corrections can be found, and those of them that continue nothing.

        Left out are readings from R37 on, and after a break, in which the machine cools down, the parts that had been cut
        before it: the course begins again behind them.
        """
        history, count = self.history, len(self.history)
        own = np.cumsum(self.trace.marks & Mark.BEGIN > 0)[self.mine]
        begins = np.concatenate((np.ones(min(1, count), np.bool_), np.diff(own) > 0))
        usable = self.inner(history["deviation"])
        pauses = np.diff(history["measured_at"]).astype(np.float64)
        after = np.flatnonzero(pauses > BREAK * np.median(pauses)) + 1 if len(pauses) else np.zeros(0, np.int64)
        for late in range(2 * (self.delay or 0) + 2):
            usable[np.minimum(after + late, count - 1)] = False
        gaps = np.concatenate((np.zeros(min(1, count), np.bool_), ~usable[:-1]))
        return usable, (begins | gaps)[usable]

    def named(self) -> dict[str, list[int]]:
        """Readings that count for nothing, and those that count for neither mean nor spread, by their numbers.

        excluded: a person took them out; faults: of the probe; worn: in the wear zone, which is an operator's business.
        """
        history = self.history
        fault, counted = history["zone"] == FAULT, ~history.excluded
        worn = ~self.inner(history["deviation"]) & ~fault
        groups = {"excluded": history.excluded, "faults": fault & counted, "worn": worn & counted}
        return {name: history["sequence"][which].tolist() for name, which in groups.items()}

    @property
    def versions(self) -> list[int]:
        """Versions of the parameters that these readings were judged by."""
        return [int(number) for number in np.unique(self.history["parameters_version"])]


def replace_lane(
    lane: ReplayedCharacteristic, effect: float, parameters: Parameters, slot: int | None
) -> ReplayedCharacteristic:
    """The lane with other parameters, on a machine where corrections act by this share."""
    return ReplayedCharacteristic(
        parameters, lane.response * effect, lane.memory if slot is None else slot, lane.counts
    )


def past_of(session: Session, current: CurrentCharacteristic, window: Window) -> ToolHistory:
    """Load it. Raises `Invalid` for more than a million readings."""
    if window.count > LARGEST:
        raise Invalid(
            _("These are {count} readings; at most {most} can be replayed at once.").format(
                count=window.count, most=LARGEST
            ),
            _("Choose a shorter period, or fewer readings."),
        )
    others = _others(session, current)
    columns = (*COLUMNS, "part") if others else COLUMNS
    whole = statistics.history_of(session, current.characteristic, window, columns)
    own = whole.only(np.isfinite(whole["compensated"]))
    if not len(own) and len(imported := whole.only(whole["code"] == IMPORTED)):
        found = _joined(session, current, window, [(current, _uncorrected(imported))], len(whole) - len(imported))
        return replace(found, imported=True)
    histories = [(current, own)]
    if len(own):
        began, ended = (_moment(moment) for moment in (own["measured_at"].min(), own["measured_at"].max()))
        for other in others:
            span = statistics.window_of(session, other.characteristic, period=Period.through(began, ended))
            if span.count > LARGEST:
                continue
            history = statistics.history_of(session, other.characteristic, span, columns)
            histories.append((other, history.only(np.isfinite(history["compensated"]))))
    return _joined(session, current, window, histories, len(whole) - len(own))


def _uncorrected(imported: History) -> History:
    """Readings of files in the order in which they were measured, with no correction in any of them."""
    ordered = imported.only(np.argsort(imported["measured_at"], kind="stable"))
    known = {"compensated": np.zeros(len(ordered)), "received_at": ordered["measured_at"]}
    return History(ordered.columns | known, ordered.excluded)


def _others(session: Session, current: CurrentCharacteristic) -> list[CurrentCharacteristic]:
    """Characteristics that correct the same tool."""
    number = current.parameters.tool_memory
    if not number:
        return []
    return [
        other
        for other in characteristics.characteristics(session, machine_id=current.machine.id)
        if other.characteristic.id != current.characteristic.id
        and other.parameters.tool_memory == number
        and not other.parameters.measures_only
    ]


def _joined(
    session: Session,
    current: CurrentCharacteristic,
    window: Window,
    histories: list[tuple[CurrentCharacteristic, History]],
    unknown: int,
) -> ToolHistory:
    lanes: list[ReplayedCharacteristic] = []
    slots: dict[int, int] = {}
    columns: dict[str, list[NDArray[Any]]] = {}
    for at, (owner, history) in enumerate(histories):
        lane = np.zeros(len(history), np.int64)
        for version in np.unique(history["parameters_version"]).tolist():
            parameters = _version(session, owner, version)
            slots.setdefault(parameters.average_memory, len(slots))
            lane[history["parameters_version"] == version] = len(lanes)
            lanes.append(
                ReplayedCharacteristic(
                    parameters, -1 / owner.parameters.factor, slots[parameters.average_memory], at == 0
                )
            )
        targets = np.array([known.parameters.target for known in lanes])[lane] if len(lane) else np.zeros(0)
        empirical = history["measured"] - history["deviation"] - targets
        for name, values in {
            "lane": lane,
            "whose": np.full(len(history), at),
            "restart": _changed(targets) | _changed(empirical),
            "excluded": history.excluded,
            "factor": np.full(len(history), owner.parameters.factor),
            "place": np.arange(len(history)),
            **history.columns,
        }.items():
            columns.setdefault(name, []).append(values)
    slots.setdefault(current.parameters.average_memory, len(slots))
    joined = {name: np.concatenate(values) for name, values in columns.items()}
    order = np.lexsort((joined["whose"], joined["place"], joined["measured_at"], joined["received_at"]))
    joined = {name: values[order] for name, values in joined.items()}
    trace = _trace(session, current, joined, len(slots), [known.memory for known in lanes])
    if not lanes:
        lanes.append(
            ReplayedCharacteristic(
                current.parameters, -1 / current.parameters.factor, slots[current.parameters.average_memory]
            )
        )
    return ToolHistory(
        current=current,
        window=window,
        history=histories[0][1],
        mine=joined["whose"] == 0,
        trace=trace,
        then=Policy(tuple(lanes)),
        slots=slots,
        deviations=joined["deviation"],
        compensated=joined["compensated"],
        factors=joined["factor"],
        of_tool=int(((joined["correction"] >= 0) & ~np.isin(joined["code"], HELD) & ~joined["excluded"]).sum()),
        unknown=unknown,
        others=[owner.characteristic.key for owner, _history in histories[1:]],
        delays=_delays(joined, trace.part),
        baseline=_baseline(session, current),
    )


def _baseline(session: Session, current: CurrentCharacteristic) -> int | None:
    baseline = baselines.baseline_in_force(session, current.characteristic)
    return baseline.version if baseline is not None and baseline.quantity == "deviation" else None


def _version(session: Session, current: CurrentCharacteristic, version: int) -> Parameters:
    return characteristics.parameters_of(session, current.machine.id, current.characteristic.id, version)


def _changed(values: Values) -> Flags:
    """Mask of values that differ from the one before, by a nanometre at least."""
    return np.concatenate((np.zeros(min(1, len(values)), np.bool_), in_nanometres(np.diff(values)) != 0))


def _trace(
    session: Session, current: CurrentCharacteristic, joined: dict[str, NDArray[Any]], slots: int, memories: list[int]
) -> ProcessTrace:
    """The readings with what happened at each."""
    parameters, compensated = current.parameters, joined["compensated"]
    begins = _beginnings(session, current, joined["received_at"])
    # A held correction that was let go shows as a step that no reading may ask for by itself.
    held = parameters.wear_limit if parameters.plausible_jump is None else parameters.plausible_jump
    step = np.abs(np.diff(compensated, prepend=compensated[:1])) / abs(parameters.factor)
    # Their sizes say nothing, so no replay may decide on them.
    unplanned = np.isin(joined["code"], (FIRST_MOVE_TRIGGERED, TOUCH_FAULT))
    marks = (
        begins * Mark.BEGIN
        + joined["restart"] * Mark.RESTART
        + (joined["paused"] | unplanned | (joined["code"] == OFFSET_BY_HAND)) * Mark.PAUSED
        + (joined["code"] == REJECTED) * Mark.REJECTED
        + (joined["code"] == IMPLAUSIBLE) * Mark.JUMP
        + ((step >= held) & ~begins) * Mark.RELEASED
        + (joined["excluded"] | unplanned) * Mark.LEFT_OUT
    ).astype(np.int8)
    offset = compensated[begins]
    pending, averages = np.zeros(len(offset)), np.zeros((len(offset), slots))
    if len(compensated):
        pending[0] = rounded(-(joined["decided"][0] - joined["deviation"][0]) * joined["factor"][0])
        lanes, first = np.unique(joined["lane"], return_index=True)
        for at in np.argsort(-first):  # of lanes that share a memory the earliest tells what it held
            averages[0, memories[lanes[at]]] = joined["average_before"][first[at]]
    free = rebuilt(joined["deviation"], compensated, joined["factor"])
    part = parts_of(joined["whose"], joined.get("part"), joined["measured_at"])
    return ProcessTrace(free, joined["lane"], marks, part, offset, pending, averages)


def _beginnings(session: Session, current: CurrentCharacteristic, received_at: NDArray[np.datetime64]) -> Flags:
    """The first reading, and the first after each tool change and each offset set by hand."""
    begins = np.zeros(len(received_at), np.bool_)
    if not len(begins):
        return begins
    begins[0] = True
    rows = session.scalars(
        select(ToolEvent.at).where(
            ToolEvent.machine_id == current.machine.id,
            ToolEvent.number == current.parameters.tool_memory,
            ToolEvent.kind != "correction",
            ToolEvent.at >= _moment(received_at[0]),
        )
    ).all()
    moments = np.array([moment.astimezone(UTC).replace(tzinfo=None) for moment in rows], "datetime64[us]")
    at = np.searchsorted(received_at, moments, side="right")
    begins[at[at < len(begins)]] = True
    return begins


def _moment(moment: np.datetime64) -> datetime:
    naive: datetime = moment.astype("datetime64[us]").item()
    return naive.replace(tzinfo=UTC)


def _delays(joined: dict[str, NDArray[Any]], part: NDArray[np.int64]) -> Delays | None:
    """Parts that came out with the old offset after a correction of the tool was issued, where machines tell.

    They tell by number; until they do (by time, or by confirming) by the offset with which a part was known to be cut.
    """
    issued = np.flatnonzero(joined["correction"] >= 0)
    if not len(issued):
        return None
    in_effect = np.maximum.accumulate(joined["correction_in_effect"])
    by_number = issued[in_effect[issued] >= 0]
    if len(by_number):
        issued = by_number
        seen = np.searchsorted(in_effect, joined["correction"][issued])
    else:
        issued = issued[-MOST_FOLLOWED:]
        seen = _with_its_offset(joined, issued)
    known = seen < len(part)
    between = part[seen[known]] - part[issued[known]] - 1
    between = between[between >= 0]
    if not len(between):
        return None
    low, usual, high = np.quantile(between, (0.05, 0.5, 0.95)).astype(np.int64).tolist()
    return Delays(min(LONGEST_DELAY, usual), low, high)


def _with_its_offset(joined: dict[str, NDArray[Any]], issued: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each correction the first reading cut with all up to it in effect and none behind it; the end where there is none."""
    compensated, end = joined["compensated"], len(joined["compensated"])
    # What is not in effect yet is the difference between the deviation and the one that decided.
    pending = compensated - (joined["decided"] - joined["deviation"]) * joined["factor"]
    seen = np.full(len(issued), end)
    for place, at in enumerate(issued.tolist()):
        if at + 1 < end and nanometres(pending[at + 1] - pending[at]):
            ahead = in_nanometres(compensated[at + 1 : at + 2 + LONGEST_DELAY] - pending[at + 1]) == 0
            seen[place] = at + 1 + int(ahead.argmax()) if ahead.any() else end
    return seen
