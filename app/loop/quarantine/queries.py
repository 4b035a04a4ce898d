"""Affected parts of an alarm as they are now, and quarantines as they were made. Never writes."""

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Literal, NamedTuple

from sqlalchemy import ColumnElement, Integer, Select, exists, func, select
from sqlalchemy.orm import Session

from app.core.affected import AffectedPart, Stretch, names_between, stretches
from app.core.parameters import Feature
from app.errors import Invalid, NotFound
from app.language.i18n import _
from app.loop.alarm_response import queries as alarms
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.wording import concerns_parts
from app.loop.characteristics.queries import CurrentCharacteristic, characteristics
from app.loop.quarantine.history import Doubt, History, Known, history_of
from app.loop.quarantine.tables import Quarantine, QuarantinedPart
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading
from app.loop.tables.tools import ToolEvent
from app.web.fields import LARGEST_ID

MOST_OTHERS = 2_000  # readings of other characteristics that name parts
State = Literal["open", "closed", "all"]
Found = Literal["bad", "unknown", "good", "not_measured"]


class Listed(NamedTuple):
    """A row of the list. sequence: None where the part was not measured; part_to, many: of a row of several parts."""

    characteristic: Characteristic
    part: str | None
    found: str
    known: Known | None = None
    order: str | None = None
    part_to: str | None = None
    many: int = 1
    offset: float | None = None
    again: int | None = None

    @property
    def sequence(self) -> int | None:
        """The reading of the part, the last of several."""
        return self.known.sequence if self.known else None


class Between(NamedTuple):
    """A stretch of the list: the two readings that are certainly good, None where there is none; open: the edge goes on cutting.

    unnumbered: parts may have been cut between that no name and no reading tells of; cut_short: earlier readings were not looked at.
    """

    characteristic: Characteristic
    since: Known | None
    until: Known | None
    rows: tuple[Listed, ...]
    open: bool
    unnumbered: bool
    cut_short: bool


class Affected(NamedTuple):
    """The affected parts of an alarm."""

    alarm: AlarmRow
    doubt: Doubt
    between: list[Between]

    @property
    def rows(self) -> list[Listed]:
        """All rows, in the order of cutting of each characteristic."""
        return [row for each in self.between for row in each.rows]

    @property
    def parts(self) -> int:
        """Number of parts."""
        return sum(row.many for row in self.rows)


def affected(session: Session, number: int, doubt: Doubt) -> Affected:
    """The affected parts of an alarm. Raises `NotFound`; `Invalid` for an alarm that concerns no parts."""
    row = alarms.alarm(session, number)
    if not concerns_parts(row):
        raise Invalid.at(
            "alarm",
            _("alarm {number} is about no parts").format(number=number),
            do=_("Parts are set aside by alarms about sizes, tools, corrections and the probe."),
        )
    found = [
        between
        for characteristic in _concerned(session, row)
        for between in _between(session, row, characteristic, doubt)
    ]
    return Affected(row, doubt, found)


def _concerned(session: Session, row: AlarmRow) -> list[Characteristic]:
    """The characteristic of the alarm; at an alarm of a tool those that it cuts, or has cut."""
    if row.characteristic is not None:
        return [row.characteristic]
    cut = (
        select(ParametersVersion.characteristic_id)
        .where(
            ParametersVersion.machine_id == row.machine.id,
            ParametersVersion.parameters["tool_memory"].astext.cast(Integer) == row.alarm.tool_memory,
        )
        .distinct()
    )
    ids = set(session.scalars(cut))
    return [
        each.characteristic
        for each in characteristics(session, machine_id=row.machine.id)
        if each.characteristic.id in ids and not _is_tool(each)
    ]


def _is_tool(current: CurrentCharacteristic) -> bool:
    return current.parameters.feature is Feature.TOOL


def _between(session: Session, row: AlarmRow, characteristic: Characteristic, doubt: Doubt) -> Iterator[Between]:
    history = history_of(session, row.alarm, characteristic.id, doubt)
    named = {known.part for known in history.known.values()}
    first = min(history.known, default=0)
    for stretch in stretches(history.cuts):
        rows, unnumbered = _listed(session, row, characteristic, history, stretch, named)
        is_open = stretch.until is None and _is_last(session, row, stretch)
        cut_short = history.cut_short and stretch.since is None and any(first in part.numbers for part in stretch.parts)
        if rows or is_open:
            known = history.known
            since, until = (known[end] if end is not None else None for end in (stretch.since, stretch.until))
            yield Between(characteristic, since, until, rows, is_open, unnumbered, cut_short)


def _is_last(session: Session, row: AlarmRow, stretch: Stretch) -> bool:
    """Tell if the edge of a stretch is in the machine still."""
    if stretch.life is None:
        return True
    assert isinstance(stretch.life, tuple)
    number, edge = stretch.life
    changes = select(func.count()).where(
        ToolEvent.machine_id == row.machine.id, ToolEvent.number == number, ToolEvent.kind == "change"
    )
    return bool(session.scalar(changes) == edge)


def _listed(
    session: Session,
    row: AlarmRow,
    characteristic: Characteristic,
    history: History,
    stretch: Stretch,
    named: set[str | None],
) -> tuple[tuple[Listed, ...], bool]:
    """The rows of a stretch, those without a reading among them, and whether names leave it open how many there are.

    named: parts that are listed or measured already; those of these rows are added.
    """
    before, after = _neighbours(history, stretch)
    others = _others(session, row, characteristic, history, stretch)
    rows: list[Listed] = []
    unnumbered, last, same_edge = False, before, stretch.since is not None
    steps: list[AffectedPart | None] = [*stretch.parts, None]
    for step in steps:
        known = history.known[step.numbers[-1]] if step else after
        same_edge &= step is not None or stretch.until is not None
        offset = last.offset if last and known and same_edge and last.offset == known.offset else None
        order = _order_of(last, known)
        names: tuple[str, ...] | int | None = ()
        if last and known:
            names = None if order is None else names_between(last.part, known.part)
        if isinstance(names, int):
            rows.append(_row_of_many(characteristic, last, known, names, offset))
        else:
            unnumbered |= names is None
            until = known.cut_at if known else None
            seen = [part for at, part in others if (last is None or at > last.cut_at) and (until is None or at < until)]
            for part in [*(names or ()), *seen]:
                if part not in named:
                    named.add(part)
                    rows.append(Listed(characteristic, part, "not_measured", order=order or None, offset=offset))
        if step and known:
            rows.append(
                Listed(
                    characteristic, known.part, known.found, known, known.order, offset=known.offset, again=step.again
                )
            )
        last, same_edge = known or last, True
    return tuple(rows), unnumbered


def _neighbours(history: History, stretch: Stretch) -> tuple[Known | None, Known | None]:
    """The readings about a stretch: those certainly good on its edge, else the nearest of another edge, if there is one.

    It is not known which edge has cut a part without a reading between two edges.
    """
    known = history.known
    before, after = (known[end] if end is not None else None for end in (stretch.since, stretch.until))
    own = [known[number].cut_at for part in stretch.parts for number in part.numbers]
    own += [each.cut_at for each in (before, after) if each]
    others = [known[cut.number] for cut in history.cuts if cut.number and cut.life != stretch.life]
    if own and before is None:
        before = max((each for each in others if each.cut_at < min(own)), key=lambda each: each.cut_at, default=None)
    if own and after is None:
        after = min((each for each in others if each.cut_at > max(own)), key=lambda each: each.cut_at, default=None)
    return before, after


def _order_of(last: Known | None, known: Known | None) -> str | None:
    """The order of the parts between two; empty where none is said, None where the two are of different orders."""
    orders = {each.order for each in (last, known) if each and each.order}
    return None if len(orders) > 1 else next(iter(orders), "")


def _row_of_many(
    characteristic: Characteristic, last: Known | None, known: Known | None, many: int, offset: float | None
) -> Listed:
    assert last is not None
    assert known is not None
    assert last.part
    assert known.part
    digits = len(known.part) - len(known.part.rstrip("0123456789"))
    prefix, end = known.part[: len(known.part) - digits], int(known.part[len(known.part) - digits :])
    width = len(last.part) - len(prefix)
    first, through = (f"{prefix}{number:0{width}}" for number in (end - many, end - 1))
    return Listed(characteristic, first, "not_measured", order=known.order, part_to=through, many=many, offset=offset)


def _others(
    session: Session, row: AlarmRow, characteristic: Characteristic, history: History, stretch: Stretch
) -> list[tuple[datetime, str]]:
    """Parts that readings of the machine's other characteristics name, in the order of cutting, about the time of a stretch."""
    before, after = _neighbours(history, stretch)
    times = [history.known[number].received_at for part in stretch.parts for number in part.numbers]
    times += [each.received_at for each in (before, after) if each]
    if not times:
        return []
    query = (
        select(func.coalesce(Reading.machined_at, Reading.measured_at), Reading.part)
        .where(
            Reading.machine_id == row.machine.id,
            Reading.characteristic_id != characteristic.id,
            Reading.part.is_not(None),
            Reading.received_at >= min(times),
        )
        .order_by(Reading.received_at)
        .limit(MOST_OTHERS)
    )
    if after is not None:
        query = query.where(Reading.received_at <= max(times))
    return sorted((at, part) for at, part in session.execute(query) if part is not None)


class QuarantineRow(NamedTuple):
    """A quarantine with its machine, its alarm's kind, and how many rows there are of each status."""

    quarantine: Quarantine
    machine: Machine
    kind: str
    open: int
    released: int
    scrapped: int

    @property
    def state(self) -> Literal["open", "closed"]:
        """Open while one of its parts is."""
        return "open" if self.open else "closed"


IS_OPEN: ColumnElement[bool] = exists().where(
    QuarantinedPart.machine_id == Quarantine.machine_id,
    QuarantinedPart.quarantine_id == Quarantine.id,
    QuarantinedPart.status == "open",
)
OPEN_COUNT: Select[int] = select(func.count()).select_from(Quarantine).where(IS_OPEN)


def quarantines(
    session: Session,
    *,
    machine_id: int | None = None,
    state: State = "all",
    before: int | None = None,
    limit: int = 100,
) -> list[QuarantineRow]:
    """Quarantines, the newest first."""
    query = select(Quarantine).order_by(Quarantine.id.desc()).limit(limit)
    if machine_id is not None:
        query = query.where(Quarantine.machine_id == machine_id)
    if state != "all":
        query = query.where(IS_OPEN if state == "open" else ~IS_OPEN)
    if before is not None:
        query = query.where(Quarantine.id < before)
    return _with_counts(session, session.scalars(query).all())


def _with_counts(session: Session, found: Sequence[Quarantine]) -> list[QuarantineRow]:
    ids = [each.id for each in found]
    counted = session.execute(
        select(QuarantinedPart.quarantine_id, QuarantinedPart.status, func.count())
        .where(
            QuarantinedPart.machine_id.in_({each.machine_id for each in found}), QuarantinedPart.quarantine_id.in_(ids)
        )
        .group_by(QuarantinedPart.quarantine_id, QuarantinedPart.status)
    )
    counts = {(number, status): count for number, status, count in counted}
    return [
        QuarantineRow(
            each,
            session.get_one(Machine, each.machine_id),
            alarms.alarm(session, each.alarm_id).alarm.kind,
            *(counts.get((each.id, status), 0) for status in ("open", "released", "scrapped")),
        )
        for each in found
    ]


def quarantine(session: Session, number: int) -> QuarantineRow:
    """One quarantine. Raises `NotFound`."""
    found = (
        session.scalars(
            select(Quarantine).where(Quarantine.id == number).execution_options(populate_existing=True)
        ).one_or_none()
        if 0 < number <= LARGEST_ID
        else None
    )
    if found is None:
        raise NotFound(
            _("There is no quarantine {number}.").format(number=number),
            _("Check the number; GET /api/v1/quarantines lists them."),
        )
    return _with_counts(session, [found])[0]


def of_alarm(session: Session, alarm: int) -> Quarantine | None:
    """The quarantine of an alarm, if there is one."""
    return session.scalars(select(Quarantine).where(Quarantine.alarm_id == alarm)).one_or_none()


class PartRow(NamedTuple):
    """A part set aside, and what it was measured for."""

    part: QuarantinedPart
    characteristic: Characteristic


def parts(session: Session, quarantine: Quarantine, only: int | None = None) -> list[PartRow]:
    """The parts of a quarantine in the order of their numbers."""
    query = (
        select(QuarantinedPart, Characteristic)
        .join(
            Characteristic,
            (Characteristic.machine_id == QuarantinedPart.machine_id)
            & (Characteristic.id == QuarantinedPart.characteristic_id),
        )
        .where(QuarantinedPart.machine_id == quarantine.machine_id, QuarantinedPart.quarantine_id == quarantine.id)
        .order_by(QuarantinedPart.number)
        .execution_options(populate_existing=True)
    )
    if only is not None:
        query = query.where(QuarantinedPart.number == only)
    return [PartRow(*row) for row in session.execute(query)]


def part(session: Session, quarantine: Quarantine, number: int) -> PartRow:
    """One part of a quarantine. Raises `NotFound`."""
    found = parts(session, quarantine, number)
    if not found:
        raise NotFound(
            _("Quarantine {quarantine} has no part {number}.").format(quarantine=quarantine.id, number=number),
            _("Check the number; its parts are numbered 1, 2, 3 …"),
        )
    return found[0]
