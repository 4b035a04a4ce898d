"""Queries of touch tests. Never writes."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from app.errors import NotFound
from app.language.i18n import _
from app.loop.tables.machines import Machine
from app.loop.tables.touch_tests import TouchTest

NEWEST = 10  # on the page of the connection


class TouchTestRow(NamedTuple):
    """A touch test, its machine, and the database's time at which it was looked at."""

    test: TouchTest
    machine: Machine
    now: datetime

    @property
    def state_age(self) -> float:
        """Seconds since it is in its state."""
        return max(0.0, (self.now - self.test.state_at).total_seconds())


def _rows(machine: Machine) -> Select[TouchTest, Machine, datetime]:
    return (
        select(TouchTest, Machine, func.clock_timestamp())
        .join(Machine, Machine.id == TouchTest.machine_id)
        .where(TouchTest.machine_id == machine.id)
        .execution_options(populate_existing=True)
    )


def open_test(session: Session, machine: Machine) -> TouchTestRow | None:
    """The touch test of a machine that is not over."""
    row = session.execute(_rows(machine).where(TouchTest.ended_at.is_(None))).one_or_none()
    return None if row is None else TouchTestRow(*row)


def touch_test(session: Session, machine: Machine, number: int, *, locked: bool = False) -> TouchTestRow:
    """One touch test of a machine. Raises `NotFound`."""
    query = _rows(machine).where(TouchTest.id == number)
    row = session.execute(query.with_for_update(of=TouchTest) if locked else query).one_or_none()
    if row is None:
        raise NotFound(
            _("Machine {machine} has no touch test {number}.").format(machine=machine.key, number=number),
            _("Look at its connection: the page lists the newest."),
        )
    return TouchTestRow(*row)


def touch_tests(
    session: Session, machine: Machine, before: int | None = None, limit: int = NEWEST
) -> Sequence[TouchTestRow]:
    """The touch tests of a machine, the newest first."""
    query = _rows(machine).order_by(TouchTest.id.desc()).limit(limit)
    query = query if before is None else query.where(TouchTest.id < before)
    return [TouchTestRow(*row) for row in session.execute(query)]
