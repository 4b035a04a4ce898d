"""Work zeros and fixtures: what was found, and how far a fixture is from where it was. Never writes. Lengths in mm."""

from collections.abc import Sequence
from math import hypot
from statistics import median
from typing import NamedTuple

from sqlalchemy import Select, func, select, tuple_
from sqlalchemy.dialects.postgresql import distinct_on
from sqlalchemy.orm import Session, aliased

from app.core.decision.step import rounded
from app.core.geometry.work_zero import Shift, judge_shift
from app.db.text import holds_words
from app.errors import NotFound
from app.geometry.work_zero.tables import Fixture, WorkZero
from app.language.i18n import _
from app.loop.machines.queries import machine_named
from app.loop.readings import queries as readings
from app.loop.tables.machines import Machine
from app.web.fields import LARGEST_ID

AXES = ("x", "y", "z")
MOST_BEFORE = 100  # zeros whose median a fixture is compared with


class Compared(NamedTuple):
    """A zero against what its fixture is compared with.

    shifts: by axis, of those that both know. reference: the number of the zero compared with, None for a median.
    """

    zero: WorkZero
    state: Shift
    shifts: dict[str, float]
    reference: int | None

    @property
    def total(self) -> float | None:
        """All axes together."""
        return hypot(*self.shifts.values()) if self.shifts else None


class FixtureRow(NamedTuple):
    """A fixture as the overview shows it."""

    machine: Machine
    key: str
    zeros: int
    last: Compared
    settings: Fixture


def subject_of(zero: WorkZero) -> str:
    """The name of a work zero in the record of changes and in acknowledgements."""
    return f"work-zero/{zero.id}"


def place_before(session: Session, zero: WorkZero) -> dict[str, float]:
    """The place of the zero that a new one in its fixture is compared with, by axis; nothing without one."""
    compared_with = compared(session, zero)
    if compared_with is None:
        return {}
    return {axis: round(getattr(zero, axis) - shift, 9) for axis, shift in compared_with.shifts.items()}


def work_zero(session: Session, number: int, only: int | None = None) -> WorkZero:
    """One work zero; ``only`` of this machine, for a machine's key. Raises `NotFound`."""
    zero = (
        session.scalars(select(WorkZero).where(WorkZero.id == number)).one_or_none()
        if 0 < number <= LARGEST_ID
        else None
    )
    if zero is None or (only is not None and zero.machine_id != only):
        raise NotFound(
            _("There is no work zero {number}.").format(number=number), _("GET /api/v1/work-zeros lists them.")
        )
    return zero


def by_key(session: Session, machine: Machine, key: str) -> WorkZero | None:
    """The zero that was sent with this key."""
    return session.scalars(select(WorkZero).where(WorkZero.machine_id == machine.id, WorkZero.key == key)).one_or_none()


def work_zeros(
    session: Session,
    machine_id: int | None = None,
    fixture: str | None = None,
    *,
    after: int = 0,
    holding: str = "",
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[WorkZero]:
    """Work zeros of all machines, of one, or of one fixture, in the order in which they came."""
    query = select(WorkZero).where(WorkZero.id > after).limit(limit)
    if holding:
        names = (WorkZero.fixture, WorkZero.part, WorkZero.work_offset, Machine.name, Machine.key)
        query = query.join(Machine, Machine.id == WorkZero.machine_id).where(*holds_words(holding, *names))
    if machine_id is not None:
        query = query.where(WorkZero.machine_id == machine_id)
    if fixture is not None:
        query = query.where(WorkZero.fixture == fixture)
    if before is not None:
        query = query.where(WorkZero.id < before)
    return list(session.scalars(query.order_by(WorkZero.id.desc() if newest_first else WorkZero.id)))


def settings_of(session: Session, machine_id: int, key: str) -> Fixture:
    """Settings of a fixture; without any, the first zero is the reference and there are no limits."""
    fixture = session.get(Fixture, (machine_id, key), populate_existing=True)
    return fixture or Fixture(machine_id=machine_id, key=key, basis="first", characteristics={})


def _standing(machine_id: int, fixture: str) -> Select[WorkZero]:
    """The zeros of a fixture that count: one computed again is in place of the first, touched at the same time."""
    later = aliased(WorkZero)
    again = select(later.id).where(later.machine_id == WorkZero.machine_id, later.recomputed_from == WorkZero.id)
    return select(WorkZero).where(WorkZero.machine_id == machine_id, WorkZero.fixture == fixture, ~again.exists())


OLDEST_FIRST = (WorkZero.touched_at, WorkZero.id)
NEWEST_FIRST = (WorkZero.touched_at.desc(), WorkZero.id.desc())


def newest_by_offset(session: Session, machine_id: int, fixture: str) -> list[WorkZero]:
    """The zero of each work offset in a fixture that was touched last."""
    here = select(WorkZero.work_offset).where(WorkZero.machine_id == machine_id, WorkZero.fixture == fixture)
    newest = _standing(machine_id, fixture).order_by(*NEWEST_FIRST).limit(1)  # by the index, however many there are
    return [
        session.scalars(newest.where(WorkZero.work_offset == offset)).one()
        for offset in sorted(session.scalars(here.distinct()))
    ]


def compared(session: Session, zero: WorkZero, settings: Fixture | None = None) -> Compared | None:
    """A zero against what its fixture is compared with; None for one without a fixture.

    Only zeros of the same work offset are compared: two parts may lie in one fixture. settings: of the fixture, if known.
    """
    if zero.fixture is None:
        return None
    return against(session, zero, settings or settings_of(session, zero.machine_id, zero.fixture))


def against(session: Session, zero: WorkZero, settings: Fixture) -> Compared:
    """A zero of this fixture against what it is compared with."""
    same = WorkZero.work_offset == zero.work_offset
    if settings.basis == "frozen":
        query = select(WorkZero).where(WorkZero.machine_id == zero.machine_id, WorkZero.id == settings.reference, same)
        before = list(session.scalars(query))
    else:
        earlier = _standing(zero.machine_id, settings.key).where(
            same, tuple_(*OLDEST_FIRST) < (zero.touched_at, zero.id)
        )
        order, limit = (OLDEST_FIRST, 1) if settings.basis == "first" else (NEWEST_FIRST, MOST_BEFORE)
        before = list(session.scalars(earlier.order_by(*order).limit(limit)))
    return _against(zero, before, settings)


def _against(zero: WorkZero, before: Sequence[WorkZero], settings: Fixture) -> Compared:
    shifts = {}
    for axis in AXES:
        here = getattr(zero, axis)
        there = [value for earlier in before if (value := getattr(earlier, axis)) is not None]
        if here is not None and there and not (len(before) == 1 and before[0].id == zero.id):
            shifts[axis] = rounded(here - median(there))
    state = judge_shift(list(shifts.values()), settings.warning, settings.alarm)
    return Compared(zero, state, shifts, before[0].id if settings.basis != "median" and before else None)


def history(
    session: Session, machine: Machine, fixture: str, *, before: int | None = None, limit: int = 200
) -> list[Compared]:
    """The last zeros of a fixture as they were touched, oldest first, each against what it is compared with now.

    before: the number of the zero before which they were touched.
    """
    settings = settings_of(session, machine.id, fixture)
    query, newest = _standing(machine.id, fixture), _standing(machine.id, fixture)
    then = None if before is None else session.get(WorkZero, (machine.id, before))
    if then is not None:
        newest = newest.where(tuple_(*OLDEST_FIRST) < (then.touched_at, then.id))
    zeros = list(session.scalars(newest.order_by(*NEWEST_FIRST).limit(limit)))[::-1]
    if not zeros:
        return []
    if settings.basis == "median":
        earlier = query.where(tuple_(*OLDEST_FIRST) < (zeros[0].touched_at, zeros[0].id))
        before_it = {
            offset: list(
                session.scalars(
                    earlier.where(WorkZero.work_offset == offset).order_by(*NEWEST_FIRST).limit(MOST_BEFORE)
                )
            )[::-1]
            for offset in {row.work_offset for row in zeros}
        }
        comparisons = []
        for zero in zeros:
            same = before_it[zero.work_offset]
            comparisons.append(_against(zero, same[-MOST_BEFORE:], settings))
            same.append(zero)
        return comparisons
    references = session.scalars(
        select(WorkZero).where(WorkZero.machine_id == machine.id, WorkZero.id == settings.reference)
        if settings.basis == "frozen"
        else query.ext(distinct_on(WorkZero.work_offset)).order_by(WorkZero.work_offset, *OLDEST_FIRST)
    ).all()
    return [
        _against(zero, [row for row in references if row.work_offset == zero.work_offset], settings) for zero in zeros
    ]


def fixtures(session: Session, only: int | None = None) -> list[FixtureRow]:
    """Every fixture with its last zero, by machine and name."""
    place = (WorkZero.machine_id, WorkZero.fixture)
    counted = select(*place, func.count()).where(WorkZero.fixture.is_not(None)).group_by(*place)
    if only is not None:
        counted = counted.where(WorkZero.machine_id == only)
    rows = [
        _fixture_row(session, session.get_one(Machine, machine_id), key or "", count)
        for machine_id, key, count in session.execute(counted)
    ]
    return sorted(rows, key=lambda row: (row.machine.key, row.key))


def fixture_of(session: Session, machine: str, fixture: str) -> FixtureRow:
    """One fixture. Raises `NotFound`."""
    machine_row, key = machine_named(session, machine), fixture[:64].replace("\0", "")
    counted = select(func.count()).where(WorkZero.machine_id == machine_row.id, WorkZero.fixture == key)
    count = session.scalar(counted)
    if not count:
        raise NotFound(
            _("Machine {machine} has no work zero of a fixture {fixture}.").format(
                machine=machine_row.key, fixture=repr(fixture[:64])
            ),
            _("Name the fixture with a work zero: that makes it known. GET /api/v1/work-zeros/fixtures lists them."),
        )
    return _fixture_row(session, machine_row, key, count)


def _fixture_row(session: Session, machine: Machine, key: str, count: int) -> FixtureRow:
    settings = settings_of(session, machine.id, key)
    last = max(newest_by_offset(session, machine.id, key), key=lambda zero: (zero.touched_at, zero.id))
    return FixtureRow(machine, key, count, against(session, last, settings), settings)


def pushed(session: Session, zeros: Sequence[WorkZero]) -> dict[int, list[readings.PushedResult]]:
    """The results of these zeros that are, or become, readings, by the number of the zero."""
    results = readings.pushed_results(
        session, [f"work-zero:{zero.id}" for zero in zeros], (*AXES, "diameter", "length", "width")
    )
    return {zero.id: results[f"work-zero:{zero.id}"] for zero in zeros}


def recomputed_as(session: Session, zero: WorkZero) -> int | None:
    """The number of the zero that these touches were computed again as, the last of them."""
    return session.scalar(
        select(func.max(WorkZero.id)).where(WorkZero.machine_id == zero.machine_id, WorkZero.recomputed_from == zero.id)
    )
