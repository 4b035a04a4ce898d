"""Receivers that fail, from the mail server and the webhook to the people who have to know: real PostgreSQL, both sinks."""

from collections.abc import Iterator
from datetime import timedelta
from typing import Any

import pytest
from sqlalchemy import text

from app.core.notify import ENOUGH_FAILURES
from app.db.engine import Database
from app.loop.notifications import failing_queries as failing
from app.loop.notifications import means, notifier, sending
from app.loop.notifications.means import Answer, Job
from app.loop.notifications.schemas import RouteIn
from app.loop.notifications.tables import NotificationRoute, Receiver
from tests.databases import NewDatabase, drop_database
from tests.in_process import InProcess, in_process
from tests.loop.notifications.sinks import Hooks
from tests.servers import free_port
from tests.shop import Person, Shop, unique
from tests.waits import until


@pytest.fixture(scope="module")
def plant(new_database: NewDatabase) -> Iterator[InProcess]:
    """The whole application with a mail server that does not run."""
    url = new_database()
    settings: dict[str, Any] = {
        "mail_server": f"localhost:{free_port()}",
        "mail_security": "none",
        "public_url": "http://inband.test",
        "webhook_networks": "127.0.0.0/8",
    }
    with pytest.MonkeyPatch.context() as quick:
        quick.setattr(notifier, "EVERY", 0.05)
        quick.setattr(notifier, "END_WITHIN", 0.1)
        quick.setattr(means, "STEP", 0.3)
        quick.setattr(sending, "pause_after", lambda _failures: timedelta(0))
        with in_process(url, **settings) as running:
            yield running
    drop_database(url)


def receiver(shop: Shop, address: str, kind: str = "webhook", **more: Any) -> Any:
    return shop.call("POST", "/notifications/receivers", 201, name=unique("andon"), means=kind, address=address, **more)


def route(shop: Shop, *to: Any) -> Any:
    steps = [{"after": 0, "receivers": [each["id"] for each in to]}]
    return shop.call("POST", "/notifications/routes", 201, name=unique("route"), machines=[shop.machine], steps=steps)


def now(shop: Shop, of: Any) -> Any:
    return shop.call("GET", f"/notifications/receivers/{of['id']}")


def until_it_fails(shop: Shop, of: Any) -> Any:
    return until(lambda: (found := now(shop, of))["failing"] and found)


def about(hooks: Hooks, path: str, of: Any) -> list[Any]:
    """What a webhook was sent about a receiver that fails."""
    said = [each for each in hooks.at(path) if each["type"] == "receivers"]
    return [each for each in said if of["id"] in {one["id"] for one in each["receivers"]}]


@pytest.mark.parametrize(
    ("kind", "answer", "what_to_do"),
    [
        ("mail", "no mail server listens at localhost:", None),
        ("500", "500 Internal Server Error", "Check the address, and the program behind it"),
        ("hang", "no answer within 0.3 s", "Check the address, and the program behind it"),
    ],
)
def test_one_that_fails_again_and_again_is_seen_and_reported_until_it_is_reached(
    plant: InProcess, hooks: Hooks, kind: str, answer: str, what_to_do: str | None
) -> None:
    shop, path = Shop(plant), f"/{unique('well')}"
    bad_path = f"/{unique('x')}-{kind}"
    if kind == "mail":
        bad = receiver(shop, "anna@example.com", "mail")
    else:  # of changes: an alarm that may have arrived waits a minute
        bad = receiver(shop, hooks.url + bad_path, events=["alarm"])
    well = receiver(shop, hooks.url + path)
    route_id = route(shop, well, *([bad] if kind == "mail" else []))["id"]
    shop.read(350)
    found = until_it_fails(shop, bad)
    assert found["failures"] >= ENOUGH_FAILURES
    assert found["failure"].startswith(answer)
    assert found["failing_since"]
    assert (found["what_to_do"] or "").startswith(what_to_do or "")
    assert now(shop, well)["failing"] is False

    (message,) = until(lambda: about(hooks, path, bad))
    assert bad["name"] in message["subject"]
    for words in (bad["name"], answer, "http://inband.test/setup/notifications#receivers"):
        assert words in message["text"]
    admin, operator = Person(plant, "admin"), Person(plant, "operator")
    listed = admin.open("/todo")
    assert bad["name"] in listed
    assert answer in listed
    assert bad["name"] in operator.open("/todo")
    assert answer not in operator.open("/todo"), "what was answered may name addresses"
    assert bad["name"] in operator.open("/todo/not-reached")
    assert answer in admin.open("/setup/notifications")
    assert "inband_failing_receivers 1.0" in plant.client().get("/metrics").text

    if kind == "mail":
        shop.call("DELETE", f"/notifications/routes/{route_id}", 204)
        shop.call("DELETE", f"/notifications/receivers/{bad['id']}", 204)
    else:
        hooks.mended.add(bad_path)
        assert until(lambda: not now(shop, bad)["failing"])
        assert now(shop, bad)["failure"] is None
    assert bad["name"] not in operator.open("/todo")
    assert bad["name"] not in operator.open("/todo/not-reached")
    assert len(about(hooks, path, bad)) == 1, "no flood"


def added(session: Any, *names: str, **more: Any) -> list[int]:
    """Receivers, all of one route."""
    rows = [Receiver(name=each, means="mail", address=f"{each}@example.com", created_by="t", **more) for each in names]
    session.add_all(rows)
    session.flush()
    numbers = [row.id for row in rows]
    rule = RouteIn(name="All", steps=[{"receivers": numbers}]).model_dump(mode="json", exclude={"name", "enabled"})  # type: ignore[list-item]
    session.add(NotificationRoute(name="All", rule=rule, created_by="t"))
    return numbers


def planned(database: Database) -> list[Job]:
    with database.begin() as session:
        return sending.plan(session, "http://inband.test", frozenset())


def end(database: Database, job: Job, *, delivered: bool) -> None:
    with database.begin() as session:
        sending.end(session, job, Answer(delivered=delivered, text="250" if delivered else "550 nobody"))


def fails(database: Database, number: int, times: int = ENOUGH_FAILURES) -> None:
    with database.begin() as session:
        values = {"id": number, "times": times}
        session.execute(
            text(
                "UPDATE receiver SET failures = :times, failing_since = now(), failure = '550 nobody',"
                " retry_at = now() + interval '1 hour' WHERE id = :id"
            ),
            values,
        )


def pass_time(database: Database, minutes: int) -> None:
    """Let what was reported be so much older."""
    with database.begin() as session:
        for row in session.query(Receiver):
            moved = {at: failing.reported_at(row)[int(at)] - timedelta(minutes=minutes) for at in row.reported}
            row.reported = {at: moment.isoformat() for at, moment in moved.items()}


def test_three_failures_are_none_and_four_are_reported_once_to_everybody_else(database: Database) -> None:
    with database.begin() as session:
        anna, ben, cem = added(session, "anna", "ben", "cem")
    fails(database, anna, ENOUGH_FAILURES - 1)
    assert planned(database) == []
    fails(database, anna)
    jobs = planned(database)
    assert {job.receiver for job in jobs} == {ben, cem}
    assert {job.message.subject for job in jobs} == {"anna is not reached: notifications do not arrive"}
    assert planned(database) == [], "they are under way"
    for job in jobs:
        end(database, job, delivered=True)
    pass_time(database, 11)
    assert planned(database) == []


def test_more_that_fail_are_one_message_and_it_waits(database: Database) -> None:
    with database.begin() as session:
        anna, ben, cem, _dina = added(session, "anna", "ben", "cem", "dina")
    fails(database, anna)
    for job in planned(database):
        if job.receiver == ben:
            end(database, job, delivered=True)
    fails(database, cem)
    with database.begin() as session:
        session.execute(text("UPDATE receiver SET busy_until = NULL"))
        session.execute(text("UPDATE receiver SET away_until = now() + interval '1 day' WHERE name = 'dina'"))
    assert planned(database) == []
    pass_time(database, 11)
    (job,) = planned(database)
    assert (job.receiver, job.message.data["receivers"][0]["name"]) == (ben, "cem")


def test_one_that_comes_and_goes_is_reported_once_an_hour(database: Database) -> None:
    with database.begin() as session:
        anna, _ben = added(session, "anna", "ben")
    fails(database, anna)
    (job,) = planned(database)
    end(database, job, delivered=True)
    pass_time(database, 30)
    fails(database, anna)  # it was reached in between
    assert planned(database) == []
    pass_time(database, 31)
    assert len(planned(database)) == 1


def test_a_report_that_did_not_arrive_is_sent_again_and_its_receiver_may_fail_too(database: Database) -> None:
    with database.begin() as session:
        anna, ben = added(session, "anna", "ben")
    fails(database, anna)
    for _each in range(ENOUGH_FAILURES):
        with database.begin() as session:
            session.execute(text("UPDATE receiver SET retry_at = NULL, failures = 0 WHERE id = :id"), {"id": ben})
        (job,) = planned(database)
        end(database, job, delivered=False)
    fails(database, ben)
    assert planned(database) == []
    with database.begin() as session:
        (cause,) = failing.causes(failing.failing(session))
        assert [row.name for row in cause] == ["anna", "ben"], "the same was answered: one trouble"
        assert session.scalar(failing.COUNT) == 1


@pytest.mark.parametrize(
    "column", ["quiet = '[{\"days\": [1,2,3,4,5,6,7], \"begins\": \"00:00\", \"ends\": \"00:00\"}]'", "address = 'Anna@Example.com'"]
)  # fmt: skip
def test_neither_who_is_quiet_nor_who_has_the_same_address_is_notified(database: Database, column: str) -> None:
    with database.begin() as session:
        anna, ben = added(session, "anna", "ben")
        session.execute(text(f"UPDATE receiver SET {column} WHERE id = :id"), {"id": ben})  # noqa: S608 - names of this file
    fails(database, anna)
    assert planned(database) == []


def test_a_browser_that_is_closed_does_not_fail(database: Database) -> None:
    with database.begin() as session:
        anna, _ben = added(session, "anna", "ben")
        session.execute(text("UPDATE receiver SET means = 'browser' WHERE id = :id"), {"id": anna})
    fails(database, anna)
    assert planned(database) == []
    with database.begin() as session:
        assert session.scalar(failing.COUNT) == 0
