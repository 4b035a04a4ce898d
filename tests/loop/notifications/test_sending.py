"""One step of notifying at a time, against the database: what is planned, sent again, and forgotten."""

from typing import Any

import pytest
from sqlalchemy import text

from app.db.engine import Database
from app.loop.notifications import sending
from app.loop.notifications.means import Answer, Job
from app.loop.notifications.schemas import RouteIn
from app.loop.notifications.tables import NotificationRoute, Receiver


def machine(session: Any) -> int:
    return session.scalar(text("INSERT INTO machine (key, name, control) VALUES ('m', 'M', 'other') RETURNING id")) or 0


def raise_alarm(session: Any, kind: str = "offset_limit") -> None:
    session.execute(
        text("INSERT INTO alarm (machine_id, tool_memory, kind) SELECT id, 1, :kind FROM machine"), {"kind": kind}
    )


@pytest.fixture
def routed(database: Database) -> Database:
    """A machine, a receiver and a route."""
    with database.begin() as session:
        machine(session)
        session.add(Receiver(name="Anna", means="mail", address="anna@example.com", created_by="tests"))
        session.flush()
        number = session.scalar(text("SELECT id FROM receiver"))
        rule = RouteIn(name="All", steps=[{"receivers": [number]}])  # type: ignore[list-item]
        stored = rule.model_dump(mode="json", exclude={"name", "enabled"})
        session.add(NotificationRoute(name="All", rule=stored, created_by="tests"))
    return database


def planned(database: Database) -> list[Job]:
    with database.begin() as session:
        return sending.plan(session, "http://inband.test", frozenset())


def test_nothing_is_announced_before_it_is_committed(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
        assert planned(routed) == []
    (job,) = planned(routed)
    assert job.message.subject == "Offset limit: M, tool 1"


def test_an_alarm_that_cannot_be_worded_keeps_no_other_waiting(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session, "hunting")  # without the numbers that its sentence names
        raise_alarm(session)
        raise_alarm(session, "tool_worn")
    (job,) = planned(routed)
    assert job.message.subject == "3 alarms: Tool worn, Hunting … – M", "the most urgent first"


def test_one_process_plans_at_a_time_and_what_it_has_begun_is_its_own(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
    with routed.begin() as session:
        assert len(sending.plan(session, "", frozenset())) == 1
        assert planned(routed) == []
    assert planned(routed) == []


def test_what_a_server_has_left_behind_is_sent_again(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
    (left,) = planned(routed)
    with routed.begin() as session:
        session.execute(text("UPDATE receiver SET busy_until = now()"))
        session.execute(text("UPDATE delivery SET asked_at = now() - interval '1 hour'"))
    (again,) = planned(routed)
    assert again.delivery > left.delivery
    assert again.alarms == left.alarms
    with routed.begin() as session:
        states = session.scalars(text("SELECT state FROM delivery ORDER BY id")).all()
        assert states == ["lost", "sending"]
        sending.end(session, again, Answer(delivered=True, text="250"))
    assert planned(routed) == []


def test_a_mail_that_may_have_arrived_is_tried_again_after_its_minute(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
    (job,) = planned(routed)
    with routed.begin() as session:
        sending.end(session, job, Answer(delivered=False, text="?", perhaps=True))
        session.execute(text("UPDATE receiver SET retry_at = now()"))
    assert planned(routed) == []
    with routed.begin() as session:
        session.execute(text("UPDATE receiver SET last_at = last_at - interval '1 minute'"))
    assert len(planned(routed)) == 1


def test_receivers_that_fail_keep_nobody_waiting(routed: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sending, "MOST_AT_ONCE", 1)
    with routed.begin() as session:
        raise_alarm(session)
        session.execute(text("UPDATE receiver SET failures = 1"))
        other = Receiver(name="Ben", means="mail", address="ben@example.com", created_by="tests")
        session.add(other)
        session.flush()
        rule = RouteIn(name="Ben", steps=[{"receivers": [other.id]}])  # type: ignore[list-item]
        stored = rule.model_dump(mode="json", exclude={"name", "enabled"})
        session.add(NotificationRoute(name="Ben", rule=stored, created_by="tests"))
    assert [job.address for job in planned(routed)] == ["ben@example.com"]


def test_two_receivers_with_one_address_are_one_person(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
        session.add(Receiver(name="A. B.", means="mail", address="Anna@Example.com", created_by="tests"))
        session.flush()
        numbers = session.scalars(text("SELECT id FROM receiver ORDER BY id")).all()
        rule = RouteIn(name="Both", repeat=5, steps=[{"receivers": list(numbers)}])  # type: ignore[list-item]
        stored = rule.model_dump(mode="json", exclude={"name", "enabled"})
        session.add(NotificationRoute(name="Both", rule=stored, created_by="tests"))
    (job,) = planned(routed)
    with routed.begin() as session:
        sending.end(session, job, Answer(delivered=True, text="250"))
    assert planned(routed) == []
    with routed.begin() as session:
        session.execute(text("UPDATE receiver SET last_at = last_at - interval '2 minutes'"))
    assert planned(routed) == [], "the alarm is announced"
    with routed.begin() as session:
        session.execute(text("UPDATE announced SET at = at - interval '5 minutes'"))
    (reminder,) = planned(routed)
    assert reminder.message.subject.startswith("Reminder: ")


def test_somebody_whose_access_has_ended_gets_nothing(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
        session.execute(
            text(
                "WITH p AS (INSERT INTO person (name, role, password_hash, disabled_at)"
                " VALUES ('Anna', 'viewer', '', now()) RETURNING id) UPDATE receiver SET person_id = p.id FROM p"
            )
        )
    assert planned(routed) == []


def test_what_is_old_is_forgotten(routed: Database) -> None:
    with routed.begin() as session:
        raise_alarm(session)
    (job,) = planned(routed)
    with routed.begin() as session:
        sending.end(session, job, Answer(delivered=True, text="250"))
    with routed.begin() as session:
        session.execute(text("UPDATE delivery SET asked_at = now() - interval '32 days'"))
        session.execute(text("UPDATE announced SET at = now() - interval '32 days'"))
        sending.forget_old(session)
        assert session.scalar(text("SELECT count(*) FROM delivery")) == 0
        assert session.scalar(text("SELECT count(*) FROM announced")) == 1, "the alarm is still active"
        acknowledged = "acknowledged_at = now(), acknowledged_by = 'anna', action = 'noted', comment = 'Seen'"
        session.execute(text(f"UPDATE alarm SET {acknowledged}"))  # noqa: S608 - words of this file
        sending.forget_old(session)
        assert session.scalar(text("SELECT count(*) FROM announced")) == 0
