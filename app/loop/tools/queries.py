"""Tool memory, average memory and corrections as they are. Never writes. Lengths in mm."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.core.decision.limits import nanometres
from app.core.decision.step import rounded
from app.core.parameters import MOST_LOCATIONS
from app.errors import NotFound
from app.language.i18n import _
from app.loop.characteristics.correction_queries import open_corrections
from app.loop.characteristics.queries import characteristics
from app.loop.readings import queries as readings
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading, Stream
from app.loop.tables.tools import OPEN, AverageMemory, Correction, Tool, ToolEvent
from app.web.fields import LARGEST_SERIAL

OFFSET_TOLERANCE = 500  # nm between expected and reported offset: a control rounds what it shows


class ToolRow(NamedTuple):
    """One location of the tool memory (R10) and what uses it.

    parts: cut since the tool was changed, by the characteristic on it that has counted most, and by those that have left.
    last: the correction issued last, whatever has become of it. open: held, awaiting approval and pending ones.
    """

    tool: Tool
    parts: int
    characteristics: list[str]
    last: Correction | None
    open: list[Correction]

    @property
    def in_use(self) -> bool:
        """Tell if the location holds anything that a person would look for."""
        return bool(self.characteristics or self.last or self.tool.offset or self.tool.changed_at or self.tool.reset_at)


class AverageRow(NamedTuple):
    """One location of the average memory (R11) and the characteristics that share it."""

    memory: AverageMemory
    characteristics: list[str]


class CorrectionRow(NamedTuple):
    """A correction with what people and machines want to know beside it.

    expected: the offset that the control holds once the pending ones up to this one and this one are applied; None when
    it will not be applied any more, or has been. reason: code and sentence of the reading that asked for it. half: of the
    tolerance that it was judged by, mm.
    """

    correction: Correction
    machine: str
    characteristic: str
    expected: float | None
    reason: dict[str, Any] | None
    half: float | None


def tool(session: Session, machine: Machine, number: int) -> Tool:
    """One location of the tool memory. Raises `NotFound` for one that the machine does not have."""
    known = 1 <= number <= machine.tool_locations
    row = session.get(Tool, (machine.id, number), populate_existing=True) if known else None
    if row is None:
        raise NotFound(
            _("Machine {machine} has no tool memory location {number}: R10 goes from 1 to {last}.").format(
                machine=machine.key, number=number, last=machine.tool_locations
            ),
            _("R10 = 0 only measures and has no offset.") if number == 0 else _("Check the number of the location."),
        )
    return row


def average(session: Session, machine: Machine, location: int) -> AverageMemory:
    """One location of the average memory. Raises `NotFound` for one that the machine does not have."""
    known = 1 <= location <= machine.average_locations
    row = session.get(AverageMemory, (machine.id, location), populate_existing=True) if known else None
    if row is None:
        raise NotFound(
            _("Machine {machine} has no average memory location {number}: R11 goes from 1 to {last}.").format(
                machine=machine.key, number=location, last=machine.average_locations
            ),
            _("R11 = 0 means no memory: neither average nor empirical value.")
            if location == 0
            else _("Check the number of the location."),
        )
    return row


def correction(session: Session, machine: Machine, number: int) -> Correction:
    """One correction as it is now. Raises `NotFound`."""
    row = (
        session.get(Correction, (machine.id, number), populate_existing=True) if 1 <= number <= LARGEST_SERIAL else None
    )
    if row is None:
        raise NotFound(
            _("Machine {machine} has no correction {number}.").format(machine=machine.key, number=number),
            _(
                "Corrections are numbered 1, 2, 3 … per machine; GET /api/v1/machines/{machine}/corrections lists them."
            ).format(machine=machine.key),
        )
    return row


def tools(
    session: Session, machine: Machine, *, after: int = 0, limit: int = MOST_LOCATIONS, only: int | None = None
) -> list[ToolRow]:
    """Locations of the tool memory by number; ``only`` this one."""
    query = (
        select(Tool)
        .where(Tool.machine_id == machine.id, Tool.number.between(after + 1, machine.tool_locations))
        .order_by(Tool.number)
        .limit(limit)
    )
    if only is not None:
        query = query.where(Tool.number == only)
    rows = session.scalars(query.execution_options(populate_existing=True)).all()
    newest = (
        select(Correction.number)
        .where(Correction.machine_id == Tool.machine_id, Correction.tool_memory == Tool.number)
        .order_by(Correction.number.desc())
        .limit(1)
        .correlate(Tool)
        .scalar_subquery()
    )
    last = session.scalars(
        select(Correction)
        .join(Tool, (Tool.machine_id == Correction.machine_id) & (Correction.number == newest))
        .where(Tool.machine_id == machine.id, Tool.number.in_([row.number for row in rows]))
        .execution_options(populate_existing=True)
    )
    last_of = {correction.tool_memory: correction for correction in last}
    open_of = defaultdict(list)
    for correction in open_corrections(session, machine):
        open_of[correction.tool_memory].append(correction)
    on_it, parts = _streams(session, machine)
    return [
        ToolRow(
            row, row.parts_kept + parts[row.number], on_it[row.number], last_of.get(row.number), open_of[row.number]
        )
        for row in rows
    ]


def _streams(session: Session, machine: Machine) -> tuple[dict[int, list[str]], dict[int, int]]:
    on_it: dict[int, list[str]] = defaultdict(list)
    parts: dict[int, int] = defaultdict(int)
    for number, key, cut in session.execute(
        select(Stream.tool_memory, Characteristic.key, Stream.sequence - Stream.sequence_at_tool_change)
        .join(
            Characteristic,
            (Characteristic.machine_id == Stream.machine_id) & (Characteristic.id == Stream.characteristic_id),
        )
        .where(Stream.machine_id == machine.id)
        .order_by(Characteristic.key)
    ):
        on_it[number].append(key)
        parts[number] = max(parts[number], cut)
    return on_it, parts


def averages(
    session: Session, machine: Machine, *, after: int = 0, limit: int = MOST_LOCATIONS, only: int | None = None
) -> list[AverageRow]:
    """Locations of the average memory by number; ``only`` this one."""
    query = (
        select(AverageMemory)
        .where(
            AverageMemory.machine_id == machine.id,
            AverageMemory.location.between(after + 1, machine.average_locations),
        )
        .order_by(AverageMemory.location)
        .limit(limit)
    )
    if only is not None:
        query = query.where(AverageMemory.location == only)
    sharing = defaultdict(list)
    for location, key in session.execute(
        select(Stream.average_memory, Characteristic.key)
        .join(
            Characteristic,
            (Characteristic.machine_id == Stream.machine_id) & (Characteristic.id == Stream.characteristic_id),
        )
        .where(Stream.machine_id == machine.id)
        .order_by(Characteristic.key)
    ):
        sharing[location].append(key)
    rows = session.scalars(query.execution_options(populate_existing=True))
    return [AverageRow(row, sharing[row.location]) for row in rows]


def tightest_half(session: Session, machine: Machine, location: int) -> float | None:
    """The least distance from a target to its limits of the characteristics that use this location R11, mm; None without one."""
    halves = [
        each.parameters.half
        for each in characteristics(session, machine_id=machine.id)
        if each.parameters.average_memory == location
    ]
    return min(halves, default=None)


def counting_on(session: Session, machine: Machine, correction: Correction) -> list[int]:
    """Later open corrections of its tool that were computed as if this one came into effect."""
    if correction.status == "held":
        return []
    return [
        c.number for c in open_corrections(session, machine, correction.tool_memory) if c.number > correction.number
    ]


def open_counts(session: Session) -> dict[int, dict[str, int]]:
    """Number of open corrections of each machine (by id), by status."""
    counts: dict[int, dict[str, int]] = defaultdict(dict)
    for machine_id, status, count in session.execute(
        select(Correction.machine_id, Correction.status, func.count())
        .where(Correction.status.in_(OPEN))
        .group_by(Correction.machine_id, Correction.status)
    ):
        counts[machine_id][status] = count
    return counts


def corrections(
    session: Session,
    machine: Machine,
    *,
    statuses: Iterable[str] = (),
    tool_memory: int | None = None,
    after: int = 0,
    limit: int = 100,
) -> list[CorrectionRow]:
    """Corrections of one machine, oldest first."""
    query = (
        select(Correction)
        .where(Correction.machine_id == machine.id, Correction.number > after)
        .order_by(Correction.number)
        .limit(limit)
        .execution_options(populate_existing=True)
    )
    if statuses := list(statuses):
        query = query.where(Correction.status.in_(statuses))
    if tool_memory is not None:
        query = query.where(Correction.tool_memory == tool_memory)
    return rows_of(session, machine, session.scalars(query).all())


def row_of(session: Session, machine: Machine, correction: Correction) -> CorrectionRow:
    """This correction with what belongs beside it."""
    return rows_of(session, machine, [correction])[0]


def rows_of(session: Session, machine: Machine, corrections: Sequence[Correction]) -> list[CorrectionRow]:
    """These corrections with what belongs beside them."""
    if not corrections:
        return []
    names = {
        row.id: row.key
        for row in session.execute(
            select(Characteristic.id, Characteristic.key).where(
                Characteristic.machine_id == machine.id,
                Characteristic.id.in_({c.characteristic_id for c in corrections}),
            )
        )
    }
    why = readings.reasons(session, machine.id, [(c.characteristic_id, c.sequence, c.amount) for c in corrections])
    expected = _expected(session, machine) if any(c.status in OPEN for c in corrections) else {}
    return [
        CorrectionRow(
            c,
            machine.key,
            names[c.characteristic_id],
            expected.get(c.number),
            *why.get((c.characteristic_id, c.sequence), (None, None)),
        )
        for c in corrections
    ]


def _expected(session: Session, machine: Machine) -> dict[int, float]:
    """By number: the offset once the pending corrections up to it, and it itself, are applied."""
    running = {
        row.number: row.offset
        for row in session.execute(select(Tool.number, Tool.offset).where(Tool.machine_id == machine.id))
    }
    after = {}
    for c in open_corrections(session, machine):
        after[c.number] = rounded(running[c.tool_memory] + c.amount)
        if c.status == "pending":
            running[c.tool_memory] = after[c.number]
    return after


class OffsetChange(NamedTuple):
    """A step in the history of an offset. kind: `change`, `edit`, `correction`, or `reported` when the machine said that
    its offset is another than the correction makes it, or than is known. amount: of the correction, mm.
    """

    event: ToolEvent
    kind: str
    amount: float | None


def offset_history(
    session: Session, machine: Machine, number: int, *, before: int | None = None, limit: int = 100
) -> list[OffsetChange]:
    """The history of one tool's offset, newest first."""
    query = (
        select(ToolEvent, Correction.amount)
        .outerjoin(
            Correction,
            (Correction.machine_id == ToolEvent.machine_id) & (Correction.number == ToolEvent.correction),
        )
        .where(ToolEvent.machine_id == machine.id, ToolEvent.number == number)
    )
    if before is not None:
        query = query.where(ToolEvent.id < before)
    rows = session.execute(query.order_by(ToolEvent.id.desc()).limit(limit))
    return [OffsetChange(event, _kind(event, amount), amount) for event, amount in rows]


def _kind(event: ToolEvent, amount: float | None) -> str:
    if amount is None:  # who edits says why; a machine that reports an offset does not
        return "reported" if event.kind == "edit" and event.reason is None else event.kind
    differs = abs(nanometres(event.offset_after - event.offset_before - amount)) > OFFSET_TOLERANCE
    return "reported" if differs else event.kind


def named_when_asked(session: Session, correction: Correction) -> int | None:
    """The last correction in effect that the reading named which asked for this one; None where a bridge answers for the control."""
    carried = select(Connection.locations).where(Connection.machine_id == correction.machine_id)
    if any(place.get("corrected", True) for place in session.scalar(carried) or ()):
        return None
    asked = session.get(Reading, (correction.machine_id, correction.characteristic_id, correction.sequence))
    return None if asked is None else asked.correction_in_effect
