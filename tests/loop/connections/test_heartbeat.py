"""Heartbeats of bridges and the connections that they make."""

from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg
import pytest
from sqlalchemy import text

from app.loop.connections.queries import server_mark
from tests.servers import Server
from tests.shop import Shop

BEAT: dict[str, Any] = {"version": "0.2.0", "state": "online", "waiting": 0}


def beat(shop: Shop, status: int = 200, **changes: Any) -> Any:
    return shop.call(
        "POST", f"/machines/{shop.machine}/heartbeat", status, client=shop.machine_client, **BEAT | changes
    )


def connection(shop: Shop) -> Any:
    return shop.call("GET", f"/machines/{shop.machine}/connection")


def ago(**time: float) -> str:
    return (datetime.now(UTC) - timedelta(**time)).isoformat()


def events_of(shop: Shop) -> list[str]:
    with psycopg.connect(shop.server.database.dsn) as connection:
        rows = connection.execute("SELECT changes FROM event ORDER BY id").fetchall()
    return [
        change["state"]
        for (changes,) in rows
        for change in changes
        if change["kind"] == "connection" and change["machine"] == shop.machine
    ]


def version_of(shop: Shop) -> int:
    """The number that moves with each lock of the machine."""
    with psycopg.connect(shop.server.database.dsn) as connection:
        row = connection.execute(
            "SELECT version FROM machine_state s JOIN machine m ON m.id = s.machine_id WHERE m.key = %s", [shop.machine]
        ).fetchone()
    assert row is not None
    return int(row[0])


def test_a_long_text_is_refused_by_its_characters(shop: Shop) -> None:
    wrong = beat(shop, 422, detail="x" * 1001)["errors"][0]["message"]
    assert wrong == "must have at most 1000 characters, not 1001"


def test_the_last_heartbeat_is_shown(shop: Shop) -> None:
    shop.call("GET", f"/machines/{shop.machine}/connection", 404)
    beat(shop)
    beat(
        shop,
        waiting=3,
        oldest_waiting_at=ago(seconds=40),
        quarantined=1,
        quarantine=[
            {"key": "a:1:2", "characteristic": "seat", "reason": "No such characteristic.", "at": ago(hours=1)}
        ],
        clock_offset=-3.5,
        kind="haas",
        started_at=ago(hours=2),
        mapping="5b8c1f0e",
        hold_all=True,
        identity="SN-4711",
        locations=[{"tool_memory": 3, "mapping": "77d0", "proved_at": ago(days=1), "offset": -0.0123}],
        something_newer={"that": "this server does not know"},
    )
    shown = connection(shop)
    assert (shown["state"], shown["silent"], shown["backing_up"], shown["waiting"]) == ("online", False, False, 3)
    assert 40 <= shown["oldest_waiting"] < 400
    assert (shown["clock_offset"], shown["kind"], shown["mapping"]) == (-3.5, "haas", "5b8c1f0e")
    assert (shown["hold_all"], shown["identity"]) == (True, "SN-4711")
    assert shown["quarantine"][0]["reason"] == "No such characteristic."
    assert shown["locations"][0]["offset"] == -0.0123
    listed = shop.call("GET", "/connections?limit=1000")["items"]
    assert [each["machine"] for each in listed].count(shop.machine) == 1


def test_the_answer_says_where_the_server_stands(shop: Shop) -> None:
    with psycopg.connect(shop.server.database.dsn) as connection:
        system, timeline, newest = connection.execute(
            "SELECT (pg_control_system()).system_identifier::text, (pg_control_checkpoint()).timeline_id,"
            " (SELECT max(id) FROM event)"
        ).fetchone() or ("", 0, 0)
    first = beat(shop)["server"]  # its own event comes with its commit
    assert (first["system"], first["timeline"]) == (system, timeline)
    assert first["last_event"] >= newest
    shop.read(1)
    assert beat(shop)["server"]["last_event"] > first["last_event"]


def test_the_number_of_the_last_event_stays_when_the_journal_is_emptied(shop: Shop) -> None:
    shop.read(1)
    before = beat(shop)["server"]["last_event"]
    with shop.server.database.begin() as session:
        session.execute(text("DELETE FROM event"))
        assert server_mark(session).last_event >= before
        session.rollback()  # others have events of theirs in it


def test_only_a_change_is_an_event_and_no_heartbeat_takes_the_lock(shop: Shop) -> None:
    version = version_of(shop)
    for state in ("starting", "starting", "online", "online", "control_away"):
        beat(shop, state=state)
    beat(shop, state="control_away", quarantined=2)
    beat(shop, state="control_away", quarantined=2, waiting=5)
    assert events_of(shop) == ["starting", "online", "control_away", "control_away"]
    assert version_of(shop) == version


def test_the_last_error_stays_after_it_is_over(shop: Shop) -> None:
    beat(shop, state="control_away", detail="The control does not answer.")
    since = connection(shop)["since"]
    beat(shop, state="control_away")
    assert connection(shop)["since"] == since
    beat(shop, detail="12 readings since the start")
    shown = connection(shop)
    assert (shown["state"], shown["detail"]) == ("online", "12 readings since the start")
    assert shown["error"] == "The control does not answer."
    assert shown["since"] > since


def test_it_backs_up_by_the_age_of_the_oldest_or_when_full(shop: Shop) -> None:
    beat(shop, waiting=9, oldest_waiting_at=ago(minutes=4))
    assert connection(shop)["backing_up"] is False
    beat(shop, waiting=9, oldest_waiting_at=ago(minutes=6))
    assert connection(shop)["backing_up"] is True
    beat(shop)
    assert connection(shop)["backing_up"] is False
    beat(shop, state="full", detail="The store is full.")
    assert connection(shop)["backing_up"] is True


def test_the_age_of_the_oldest_is_by_the_clock_of_the_bridge(shop: Shop) -> None:
    a_day_behind: dict[str, Any] = {"oldest_waiting_at": ago(days=1, seconds=10), "sent_at": ago(days=1)}
    beat(shop, waiting=1, **a_day_behind)
    shown = connection(shop)
    assert shown["backing_up"] is False
    assert shown["oldest_waiting"] < 300


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("state", {"state": "happy"}),
        ("waiting", {"waiting": -1}),
        ("waiting", {"waiting": 2**31}),
        ("oldest_waiting_at", {"oldest_waiting_at": "yesterday"}),
        ("started_at", {"started_at": "0001-01-01T00:00:00+14:00"}),
        ("mapping", {"mapping": "x" * 65}),
        ("hold_all", {"hold_all": 1}),
        ("locations[0].tool_memory", {"locations": [{"tool_memory": 0}]}),
        ("quarantine", {"quarantine": [{"key": "k", "reason": "r", "at": ago(hours=1)}] * 21}),
        ("detail", {"detail": "x" * 1001}),
    ],
)
def test_what_cannot_be_is_named(shop: Shop, field: str, changes: dict[str, Any]) -> None:
    problem = beat(shop, 422, **changes)
    assert field in [error["field"] for error in problem["errors"]]
    assert "heartbeat" not in problem["title"]


def test_a_machine_speaks_for_itself_alone(shop: Shop, server: Server) -> None:
    other = Shop(server)
    beat(shop)
    beat(other)
    shop.call("POST", f"/machines/{other.machine}/heartbeat", 403, client=shop.machine_client, **BEAT)
    own = shop.call("GET", "/connections", client=shop.machine_client)["items"]
    assert [each["machine"] for each in own] == [shop.machine]
    shop.call("GET", f"/machines/{other.machine}/connection", 403, client=shop.machine_client)
    viewer = server.client(server.key("viewer"))
    shop.call("POST", f"/machines/{shop.machine}/heartbeat", 403, client=viewer, **BEAT)
    shop.call("POST", "/machines/nobody/heartbeat", 404, **BEAT)
    shop.call("POST", f"/machines/{shop.machine}/heartbeat", client=server.client(server.key("operator")), **BEAT)


def test_the_list_goes_on_by_pages(server: Server) -> None:
    shops = [Shop(server) for _ in range(3)]
    for shop in shops:
        beat(shop)
    first, seen, after = shops[0], [], ""
    while True:
        page = first.call("GET", f"/connections?limit=1&after={after}")
        seen += [each["machine"] for each in page["items"]]
        if page["next"] is None:
            break
        after = page["next"]
    assert seen == sorted(seen)
    assert {shop.machine for shop in shops} <= set(seen)


def test_a_machine_that_cannot_be_stopped_is_named_in_the_alarm(shop: Shop) -> None:
    shop.read(2000)
    [alarm] = shop.alarms()
    said = "This machine cannot be stopped by Inband"

    def text() -> str:
        return str(shop.call("GET", f"/alarms/{alarm['id']}")["text"])

    assert said not in text(), "over REST the answer says stop"
    beat(shop, carries_decisions=False)
    assert said in text()
    assert connection(shop)["carries_decisions"] is False
    shop.read(400, shop.another("worn"))
    assert [said in each["text"] for each in shop.alarms() if each["kind"] == "tool_worn"] == [True]
    beat(shop, carries_decisions=True)
    assert said not in text()


def test_times_in_which_the_control_runs_are_kept(shop: Shop) -> None:
    def runs(**back: float) -> list[bool]:
        """Whether each run took a while; back: put them back by that first."""
        of = "machine_id = (SELECT id FROM machine WHERE key = %s)"
        with psycopg.connect(shop.server.database.dsn) as connection:
            moved = f"UPDATE machine_run SET begin = begin - %s, until = until - %s WHERE {of}"  # noqa: S608 - our words
            connection.execute(moved, (timedelta(**back), timedelta(**back), shop.machine))
            query = f"SELECT until - begin >= interval '20 seconds' FROM machine_run WHERE {of} ORDER BY begin"  # noqa: S608
            return [took for (took,) in connection.execute(query, (shop.machine,))]

    beat(shop, running=False)
    beat(shop)
    beat(shop, running=None)
    beat(shop, 422, running="yes")
    assert runs() == []
    beat(shop, running=True)
    assert runs(seconds=20) == [False]
    beat(shop, running=True)
    assert runs(hours=1) == [True], "one heartbeat may be lost"
    beat(shop, running=True)
    assert runs(days=40) == [True, False]
    beat(shop, running=True)
    assert runs() == [False], "what is old goes"
