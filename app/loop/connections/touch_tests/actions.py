"""Asking for a touch test, answering its questions, stopping it; and the reports of the bridge.

The bridge writes and takes back; here is written down how far it is. A test that may have changed an offset is over only when
the bridge says that it is taken back, or cannot be.
"""

from datetime import timedelta
from typing import Any, Final

from sqlalchemy import select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, NotFound
from app.language.i18n import _
from app.loop.connections.queries import connection_of
from app.loop.connections.touch_tests import queries, wording
from app.loop.connections.touch_tests.queries import TouchTestRow
from app.loop.connections.touch_tests.schemas import QUESTIONS, TouchTestAnswer, TouchTestIn, TouchTestReport
from app.loop.machines.queries import machine_for, machine_named
from app.loop.tables.machines import Machine
from app.loop.tables.touch_tests import TouchTest

NEXT: Final = {"before": "go", "after": "compared", "size": "answered"}
"""The state after a yes."""
BEFORE_ANYTHING: Final = frozenset({"asked", "read"})
"""States in which nothing can have been written."""
ON_THE_WAY_BACK: Final = frozenset({"answered", "stopping"})
READ: Final = ("mapping", "place", "unit", "before", "shown_before", "shown_after")


def ask(session: Session, machine: str, given: TouchTestIn, caller: Caller, silent_after: timedelta) -> TouchTestRow:
    """Ask the bridge of a machine for a touch test.

    Raises `NotFound` for a machine without a bridge, or a location that it does not have; `Conflict` while another one is open,
    while the bridge is silent, and where it makes none by the page.
    """
    owner = machine_named(session, machine)
    _check(session, owner, given.tool_memory, silent_after)
    values = {"machine_id": owner.id, **given.model_dump(), "asked_by": caller.name, "state": "asked"}
    number = session.scalar(insert(TouchTest).values(values).on_conflict_do_nothing().returning(TouchTest.id))
    if number is None:
        raise Conflict(
            _("A touch test of machine {machine} is open.").format(machine=owner.key),
            _("Answer its questions or stop it; one is made at a time."),
        )
    record(session, caller.name, "touch test asked for", _subject(owner, number), None, given.model_dump())
    row = queries.touch_test(session, owner, number)
    _tell(session, row)
    return row


def _check(session: Session, machine: Machine, tool_memory: int, silent_after: timedelta) -> None:
    row = connection_of(session, machine)
    if row.silent(silent_after):
        raise Conflict(
            _("The bridge of machine {machine} is silent.").format(machine=machine.key),
            _("Look whether its computer runs and reaches this server, then ask again."),
        )
    location = next((each for each in row.connection.locations if each["tool_memory"] == tool_memory), None)
    if location is None:
        raise NotFound(
            _("The bridge of machine {machine} has no location for tool {tool}.").format(
                machine=machine.key, tool=tool_memory
            ),
            _("Add a [[machine.{machine}.location]] to its configuration.").format(machine=machine.key),
        )
    if not location.get("touch_test_by_page"):
        raise Conflict(
            _("The bridge of machine {machine} makes no touch tests by the page.").format(machine=machine.key),
            wording.how_to_allow(machine.key),
        )


def answer(session: Session, machine: str, number: int, given: TouchTestAnswer, caller: Caller) -> TouchTestRow:
    """Answer the open question; the same answer given twice counts once.

    Raises `NotFound`; `Conflict` for a question that is not open.
    """
    owner = machine_named(session, machine)
    row = queries.touch_test(session, owner, number, locked=True)
    test = row.test
    after = NEXT[given.question] if given.yes else "answered"
    if QUESTIONS.get(test.state) != given.question:
        if test.state == after and test.refused == (None if given.yes else given.question):
            return row
        raise Conflict(
            _("This question of touch test {number} is not open: {state}.").format(
                number=number, state=wording.explained(test.state)
            ),
            _("Check the present state of the test."),
        )
    test.refused = None if given.yes else given.question
    test.answered_by = caller.name
    _becomes(row, after)
    record(session, caller.name, "touch test answered", _subject(owner, number), None, given.model_dump())
    return _saved(session, row)


def stop(session: Session, machine: str, number: int, caller: Caller) -> TouchTestRow:
    """Stop a test; what the bridge has written is taken back. Stopping twice is harmless.

    Raises `NotFound`; `Conflict` for one that is over otherwise.
    """
    owner = machine_named(session, machine)
    row = queries.touch_test(session, owner, number, locked=True)
    test = row.test
    if test.state in ON_THE_WAY_BACK or test.state == "cancelled":
        return row
    if test.ended_at is not None:
        raise Conflict(
            _("Touch test {number} is over: {state}.").format(number=number, state=wording.explained(test.state)),
            _("There is nothing left to stop."),
        )
    test.answered_by = caller.name
    if test.state in BEFORE_ANYTHING:
        _ends(row, "cancelled", _("Stopped before anything was written."))
    else:
        _becomes(row, "stopping")
    record(session, caller.name, "touch test stopped", _subject(owner, number), None, {"state": test.state})
    return _saved(session, row)


def report(session: Session, machine: str, number: int, given: TouchTestReport, caller: Caller) -> TouchTestRow:
    """Take what the bridge says. Said twice it counts once; what a person did meanwhile is not undone by it.

    Raises `NotFound`; `NotAllowed` for the key of another machine; `Conflict` for a step that does not follow.
    """
    owner = machine_for(session, caller, machine, "operator")
    row = queries.touch_test(session, owner, number, locked=True)
    test = row.test
    if test.state == given.state:
        return row
    if not _follows(test, given.state):
        raise Conflict(
            _("Touch test {number} cannot become {new}: {state}.").format(
                number=number, new=given.state, state=wording.explained(test.state)
            ),
            _("Take the offset back, and report how that ended."),
        )
    if given.state == "read" and test.state == "asked":
        _take(test, given)
        _becomes(row, "read")
    elif given.state == "written" and test.state == "go":
        _becomes(row, "written")
    elif given.state not in {"read", "written"}:
        _take(test, given)
        _ends(row, given.state, given.detail)
        after = {"tool_memory": test.tool_memory, "mapping": test.mapping, "detail": test.detail}
        record(
            session, caller.name, f"touch test {given.state.replace('_', ' ')}", _subject(owner, number), None, after
        )
    return _saved(session, row)


def abandon(session: Session, machine: Machine, caller: Caller) -> None:
    """End the open test of a machine whose bridge is there no more."""
    number = session.scalar(
        select(TouchTest.id).where(TouchTest.machine_id == machine.id, TouchTest.ended_at.is_(None))
    )
    if number is None:
        return
    row = queries.touch_test(session, machine, number, locked=True)
    test = row.test
    if test.ended_at is not None:
        return
    words = _("The connection was removed before the bridge said how it ended.")
    if test.state not in BEFORE_ANYTHING and test.shown_before is not None:
        words = f"{words} {wording.by_hand(test)}"
    _ends(row, "failed", words)
    record(session, caller.name, "touch test failed", _subject(machine, number), None, {"detail": words})
    _saved(session, row)


def _follows(test: TouchTest, state: str) -> bool:
    if test.ended_at is not None:
        return False
    if state == "read":
        return True
    if state == "written":
        return test.state not in BEFORE_ANYTHING
    return state != "proved" or (test.state == "answered" and test.refused is None)


def _take(test: TouchTest, given: TouchTestReport) -> None:
    for name in READ:
        if (value := getattr(given, name)) is not None:
            setattr(test, name, value)


def _becomes(row: TouchTestRow, state: str) -> None:
    row.test.state, row.test.state_at = state, row.now


def _ends(row: TouchTestRow, state: str, detail: str | None) -> None:
    _becomes(row, state)
    row.test.ended_at, row.test.detail = row.now, detail


def _saved(session: Session, row: TouchTestRow) -> TouchTestRow:
    session.flush()
    saved = queries.touch_test(session, row.machine, row.test.id)
    _tell(session, saved)
    return saved


def _tell(session: Session, row: TouchTestRow) -> None:
    news: dict[str, Any] = {"kind": "touch_test", "machine": row.machine.key, "tool": row.test.tool_memory}
    publish(session, news | {"id": row.test.id, "state": row.test.state})


def _subject(machine: Machine, number: int) -> str:
    return f"machine/{machine.key}/touch-test/{number}"
