"""What is published comes with the commit, in one row, and holds up nobody before."""

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.db.events import publish

LOCKED = text("SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND classid = 7291 AND pid = pg_backend_pid()")


def told(database: Database) -> list[list[str]]:
    """The kinds of the changes of each event."""
    with database.begin() as session:
        rows = session.scalars(text("SELECT changes FROM event ORDER BY id")).all()
    return [[change["kind"] for change in changes] for changes in rows]


def locks(session: Session) -> int:
    return session.scalar(LOCKED) or 0


def test_one_row_for_all_that_a_transaction_publishes(database: Database) -> None:
    with database.begin() as session:
        publish(session, {"kind": "one"})
        publish(session, {"kind": "two"}, {"kind": "three"})
        assert locks(session) == 0, "others may commit meanwhile"
    assert told(database) == [["one", "two", "three"]]


def test_what_is_rolled_back_is_not_sent(database: Database) -> None:
    with pytest.raises(ZeroDivisionError), database.begin() as session:
        publish(session, {"kind": "lost"})
        raise ZeroDivisionError
    with database.sessions() as session:
        publish(session, {"kind": "lost"})
        session.rollback()
        publish(session, {"kind": "lost too"})
        session.close()
        session.commit()
        publish(session, {"kind": "kept"})
        session.commit()
        session.commit()
    assert told(database) == [["kept"]]


def test_of_savepoints_what_is_released(database: Database) -> None:
    with database.begin() as session:
        publish(session, {"kind": "before"})
        with session.begin_nested():
            publish(session, {"kind": "released"})
        with pytest.raises(ZeroDivisionError), session.begin_nested():
            publish(session, {"kind": "lost"})
            with session.begin_nested():
                publish(session, {"kind": "released within what is lost"})
            raise ZeroDivisionError
        publish(session, {"kind": "after"})
        assert locks(session) == 0
    assert told(database) == [["before", "released", "after"]]
