"""From stored readings to the series that is charted, and its subgroups. Never writes.

Readings taken out of the statistics are left out, and with them what a baseline excludes within its own period, and probe
faults, which are no measurement of a part. Of the rebuilt quantities so are readings that do not say with which corrections
their part was cut.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.core import wear
from app.core.decision.limits import FAULT, in_nanometres
from app.core.spc.quantity import Quantity, Series
from app.language.times import begins_of_shifts
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.tables.readings import Reading, ReadingContext
from app.loop.tables.tools import ToolEvent

Whole = NDArray[np.int64]
Moments = NDArray[np.datetime64]


class Plan(Protocol):
    """Rules of a baseline for turning readings into points; of a frozen one, or one that is being tried."""

    quantity: str
    grouping: str | None
    group_size: int | None
    group_pause: float | None
    shifts: str | None
    first_sequence: int
    last_sequence: int
    excluded: list[Any]
    factor: float


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Readings that count for nothing, by their sequences, each once.

    excluded: from all statistics. by_baseline: from its own period. faults: of the probe (R36). unknown: it is not known with
    which corrections their part was cut.
    """

    excluded: Whole
    by_baseline: Whole
    faults: Whole
    unknown: Whole

    def within(self, first: int, last: int) -> "LeftOut":
        """Those of a window."""
        return LeftOut(*(numbers[(numbers >= first) & (numbers <= last)] for numbers in self._each))

    def among(self, sequence: Whole) -> "LeftOut":
        """Those of these readings."""
        return LeftOut(*(numbers[np.isin(numbers, sequence)] for numbers in self._each))

    @property
    def _each(self) -> tuple[Whole, Whole, Whole, Whole]:
        return self.excluded, self.by_baseline, self.faults, self.unknown

    def __len__(self) -> int:
        """Number of readings."""
        return len(self.excluded) + len(self.by_baseline) + len(self.faults) + len(self.unknown)


@dataclass(frozen=True, slots=True)
class ReadingSeries:
    """Readings as a series: D, or w where a rebuilt quantity is wanted. mm; moments in UTC.

    labels: a number for the part, shift or nest of each reading, by what forms the subgroups; 0 where it names none.
    """

    series: Series
    measured_at: Moments
    labels: Whole
    left_out: LeftOut


def read(session: Session, current: CurrentCharacteristic, plan: Plan, window: Window) -> ReadingSeries:
    """The readings of the window as the plan's quantity is made of."""
    rebuilt = plan.quantity != Quantity.DEVIATION
    columns = ["deviation", "measured", "measured_at", "received_at", "zone"]
    history = statistics.history_of(
        session, current.characteristic, window, [*columns, "compensated"] if rebuilt else columns
    )
    sequence, values = history["sequence"], history["deviation"]
    by_plan = excluded_by(plan, sequence) & ~history.excluded
    faults = (history["zone"] == FAULT) & ~history.excluded & ~by_plan
    keep = ~(history.excluded | by_plan | faults)
    unknown = np.zeros_like(keep)
    if rebuilt:
        unknown = np.isnan(history["compensated"]) & keep
        keep &= ~unknown
        values = wear.wear(values, history["compensated"], plan.factor)
    begins = _begins(session, current, history["received_at"], history["measured"] - history["deviation"])
    labels = labels_of(session, current, window, sequence, history["measured_at"], plan.grouping, plan.shifts)
    left_out = LeftOut(sequence[history.excluded], sequence[by_plan], sequence[faults], sequence[unknown])
    return ReadingSeries(
        Series(sequence, values, begins).only(keep), history["measured_at"][keep], labels[keep], left_out
    )


def excluded_by(plan: Plan, sequence: Whole) -> NDArray[np.bool_]:
    """Mask of the readings that the baseline leaves out of its own period."""
    out = np.zeros(len(sequence), np.bool_)
    for run in plan.excluded:
        out |= (sequence >= run["first"]) & (sequence <= run["last"])
    return out & (sequence >= plan.first_sequence) & (sequence <= plan.last_sequence)


def _begins(
    session: Session, current: CurrentCharacteristic, received_at: Moments, reference: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Mask of the readings after a tool change, an offset edited by hand, or a change of target plus empirical value."""
    begins = np.ones(len(reference), np.bool_)
    begins[1:] = in_nanometres(np.diff(reference)) != 0
    number = current.parameters.tool_memory
    if not number or not len(reference):
        return begins
    for moment in session.scalars(
        select(ToolEvent.at).where(
            ToolEvent.machine_id == current.machine.id, ToolEvent.number == number, ToolEvent.kind != "correction"
        )
    ):
        at = int(np.searchsorted(received_at, _naive(moment), side="right"))
        if at < len(begins):
            begins[at] = True
    return begins


def _naive(moment: datetime) -> np.datetime64:
    return np.datetime64(moment.replace(tzinfo=None), "us")


def labels_of(
    session: Session,
    current: CurrentCharacteristic,
    window: Window,
    sequence: Whole,
    measured_at: Moments,
    by: str | None,
    shifts: str | None = None,
) -> Whole:
    """A number for the part, shift or nest of each of these readings of the window; 0 where it names none, and for other groupings."""
    if by == "shift":
        return _shifts(measured_at, shifts)
    return _labels(session, current, window, sequence, by) if by in ("part", "nest") else np.zeros_like(sequence)


def begin_of_runs(labels: Whole) -> NDArray[np.bool_]:
    """Mask of the readings with another label than the one before; one without a label stands alone.

    >>> begin_of_runs(np.array([1, 1, 2, 0, 0])).tolist()
    [True, False, True, True, True]
    """
    new = np.ones(len(labels), np.bool_)
    new[1:] = (np.diff(labels) != 0) | (labels[1:] == 0)
    return new


def _shifts(measured_at: Moments, kept: str | None) -> Whole:
    """Shifts in which these moments lie, as the baseline kept them (of old: the plant's), as numbers from 1 that grow."""
    if not len(measured_at):
        return np.zeros(0, np.int64)
    first, last = (
        moment.astype("datetime64[us]").item().replace(tzinfo=UTC) for moment in (measured_at.min(), measured_at.max())
    )
    begins = [_naive(begin.astimezone(UTC)) for begin in begins_of_shifts(first, last, kept)]
    return np.searchsorted(np.array(begins), measured_at, side="right").astype(np.int64)


def _labels(session: Session, current: CurrentCharacteristic, window: Window, sequence: Whole, by: str) -> Whole:
    """Changes of the part, or nest, that readings name, as numbers that grow; 0 where none is named."""
    name = Reading.part if by == "part" else ReadingContext.context["nest"].astext
    before = func.lag(name).over(order_by=Reading.sequence)
    named = (
        select(Reading.sequence, name.label("name"), before.label("before"))
        .outerjoin(
            ReadingContext,
            (ReadingContext.machine_id == Reading.machine_id)
            & (ReadingContext.characteristic_id == Reading.characteristic_id)
            & (ReadingContext.sequence == Reading.sequence),
        )
        .where(
            Reading.machine_id == current.machine.id,
            Reading.characteristic_id == current.characteristic.id,
            Reading.sequence.between(window.first, window.last),
        )
        .subquery()
    )
    rows = session.execute(
        select(named.c.sequence, named.c.name.is_not(None))
        .where(named.c.name.is_distinct_from(named.c.before))
        .order_by(named.c.sequence)
    ).all()
    starts: Sequence[int] = [row[0] for row in rows]
    ids = np.array([0, *(place + 1 if row[1] else 0 for place, row in enumerate(rows))], np.int64)
    return ids[np.searchsorted(np.array(starts, np.int64), sequence, side="right")]


def groups_of(plan: Plan, series: ReadingSeries, window: Window) -> tuple[Whole, int]:
    """To which subgroup each value belongs (numbers that grow), -1 for those of the last one that is not complete.

    Subgroups of n readings are counted from the first reading of the baseline's period, and again from the first one after
    it; so the same readings make the same subgroup whichever of them are looked at. What was excluded makes its subgroup
    smaller. window: what was read, to its end. The second number: how many readings the newest subgroup has so far.
    """
    sequence = series.series.sequence
    if not len(sequence):
        return sequence, 0
    after = sequence > plan.last_sequence
    if plan.grouping == "consecutive":
        size = plan.group_size or 1
        start = np.where(after, plan.last_sequence + 1, plan.first_sequence)
        block = (sequence - start) // size
        ends = start + (block + 1) * size - 1
        complete = ends <= np.where(after, window.last, min(window.last, plan.last_sequence))
    else:
        complete = np.ones(len(sequence), np.bool_)
        block = _parted(plan, series)
        if after[-1] or window.last < plan.last_sequence:
            complete[(block == block[-1]) & (after == after[-1])] = False  # it may still grow
    changes = np.ones(len(sequence), np.bool_)
    changes[1:] = (np.diff(block) != 0) | (np.diff(after.astype(np.int8)) != 0)
    number = np.cumsum(changes) - 1
    grows = window.last == window.newest and after[-1]
    waiting = int((~complete & (number == number[-1])).sum()) if grows else 0
    return np.where(complete, number, -1), waiting


def _parted(plan: Plan, series: ReadingSeries) -> Whole:
    if plan.grouping != "pause":
        return np.cumsum(begin_of_runs(series.labels))
    new = np.ones(len(series.labels), np.bool_)
    new[1:] = np.diff(series.measured_at) > np.timedelta64(round((plan.group_pause or 0) * 60e6), "us")
    return np.cumsum(new)
