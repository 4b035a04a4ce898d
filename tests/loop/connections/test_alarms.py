"""Alarms of bridges: silent, backing up; they end by themselves, and with the connection."""

from datetime import timedelta
from typing import Any

import psycopg
from sqlalchemy import text

from app.jobs.actions import run_jobs
from app.loop.connections import late_readings, server_away
from app.loop.connections.jobs import due, job
from tests.loop.connections.test_heartbeat import ago, beat
from tests.servers import Server
from tests.shop import Person, Shop

MINUTE = 60.0


def silent_for(shop: Shop, minutes: int) -> None:
    """Let the bridge of this machine be silent for so long."""
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(
            "UPDATE connection SET received_at = now() - make_interval(mins => %s)"
            " WHERE machine_id = (SELECT id FROM machine WHERE key = %s)",
            [minutes, shop.machine],
        )


def run(shop: Shop) -> None:
    """Run the job as the server itself does each minute: twice, as the first run after a start says nothing of silence."""
    for _ in range(2):
        run_jobs(shop.server.database, [job(MINUTE)])


def kinds(shop: Shop) -> list[str]:
    return [alarm["kind"] for alarm in shop.alarms()]


def test_a_silent_bridge_raises_an_alarm_that_ends_when_it_speaks(shop: Shop, operator: Person) -> None:
    beat(shop)
    silent_for(shop, 3)
    run(shop)
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "bridge_silent"
    assert "heard last at" in alarm["text"]
    assert shop.call("GET", f"/machines/{shop.machine}/connection")["silent"] is True
    run(shop)
    assert shop.call("GET", f"/alarms/{alarm['id']}")["count"] == 1
    assert "Bridge is silent" in operator.open(f"/todo?machine={shop.machine}")
    beat(shop)
    run(shop)
    ended = shop.call("GET", f"/alarms/{alarm['id']}")
    assert (ended["state"], ended["outcome"][0]["code"]) == ("acknowledged", "bridge_heard")
    assert shop.alarms() == []


def test_an_acknowledged_silence_is_not_reported_again_but_the_next_one_is(shop: Shop) -> None:
    beat(shop)
    silent_for(shop, 10)
    run(shop)
    (alarm,) = shop.alarms()
    shop.acknowledge(alarm["id"], "noted", comment="Machine is switched off")
    run(shop)
    assert shop.alarms() == []
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute("SET session_replication_role = replica")  # else it is refused: an alarm is a fact
        connection.execute("UPDATE alarm SET raised_at = now() - interval '8 minutes' WHERE id = %s", [alarm["id"]])
    run(shop)
    assert shop.alarms() == []
    beat(shop)
    silent_for(shop, 3)
    run(shop)
    assert kinds(shop) == ["bridge_silent"]


def test_no_silence_is_reported_when_the_server_itself_was_away(shop: Shop) -> None:
    beat(shop)
    silent_for(shop, 30)
    with shop.server.database.begin() as session:
        for away in ("DELETE FROM job_run", "UPDATE job_run SET finished_at = now() - interval '20 minutes'"):
            session.execute(text(away))
            subjects = {unit.subject for unit in due(timedelta(seconds=60), session)}
            assert f"connection/{shop.machine}/bridge_silent" not in subjects
        session.rollback()


def test_a_machine_that_never_had_a_heartbeat_is_not_silent(shop: Shop) -> None:
    run(shop)
    assert shop.alarms() == []


def test_a_backlog_raises_an_alarm_that_ends_with_it(shop: Shop) -> None:
    beat(shop, waiting=7, oldest_waiting_at=ago(minutes=9))
    run(shop)
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "bridge_backing_up"
    assert alarm["text"].startswith("7 readings wait in the bridge, the oldest since")
    shop.acknowledge(alarm["id"], "noted")
    beat(shop, waiting=8, oldest_waiting_at=ago(minutes=10))
    run(shop)
    assert shop.alarms() == []
    beat(shop)
    beat(shop, state="full", waiting=100)
    run(shop)
    (alarm,) = shop.alarms()
    assert "full with 100 readings" in alarm["text"]
    beat(shop, waiting=2, oldest_waiting_at=ago(seconds=5))
    run(shop)
    assert shop.alarms() == []


def test_removing_a_connection_ends_its_alarms(shop: Shop, server: Server) -> None:
    beat(shop, state="full", waiting=100)
    silent_for(shop, 3)
    run(shop)
    assert sorted(kinds(shop)) == ["bridge_backing_up", "bridge_silent"]
    ids = [alarm["id"] for alarm in shop.alarms()]
    path = f"/machines/{shop.machine}/connection"
    shop.call("DELETE", path, 403, client=server.client(server.key("engineer")))
    shop.call("DELETE", path, 204)
    assert shop.alarms() == []
    assert {shop.call("GET", f"/alarms/{number}")["outcome"][0]["code"] for number in ids} == {"connection_removed"}
    shop.call("GET", path, 404)
    shop.call("DELETE", path, 204)
    actions: list[Any] = shop.call("GET", f"/audit?subject=machine/{shop.machine}")["items"]
    assert [each["action"] for each in actions].count("connection removed") == 1
    run(shop)
    assert shop.alarms() == []
    beat(shop)
    shop.call("GET", path)


def gap(shop: Shop, minutes: int, busy: float = 0) -> None:
    """Let the server have been unreachable for so long, as this machine sees it. busy: seconds that another job took."""
    with shop.server.database.begin() as session:
        session.execute(text("DELETE FROM job_run WHERE job = 'server_away'"))
        ran = "INSERT INTO job_run VALUES (:job, now() - make_interval(mins => :ago), :seconds, 1)"
        for job_name, ended, seconds in (("server_away", minutes, 0.0), ("long", 0, busy)):
            session.execute(text(ran), {"job": job_name, "ago": ended, "seconds": seconds})
        for unit in server_away.due(session):
            if f"/{shop.machine}/" in unit.subject:
                server_away.tell(session, unit)
        session.execute(text("DELETE FROM job_run WHERE job IN ('server_away', 'long')"))


def later(shop: Shop, minutes: int) -> dict[str, Any]:
    """Let the alarm about it be older, run the job, and return the alarm."""
    [number] = [alarm["id"] for alarm in shop.alarms() if alarm["kind"] == "server_away"]
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute("SET session_replication_role = replica")  # else it is refused: an alarm is a fact
        connection.execute(
            "UPDATE alarm SET data = data || jsonb_build_object('until', now() - make_interval(mins => %s)) WHERE id = %s",
            [minutes, number],
        )
    run_jobs(shop.server.database, [server_away.JOB])
    return dict(shop.call("GET", f"/alarms/{number}"))


def test_a_server_that_was_away_for_an_hour_says_so_at_each_machine_that_was_at_work(server: Server) -> None:
    bridged, direct, idle = Shop(server), Shop(server), Shop(server)
    idle.read(0, measured_at=ago(hours=9))
    for shop in (bridged, direct):
        shop.read(0, measured_at=ago(minutes=70))
    beat(bridged, waiting=3)
    gap(bridged, 3)
    assert bridged.alarms() == [], "shorter than it may take to start again"
    for shop in (bridged, direct, idle):
        gap(shop, 60)
    assert (kinds(bridged), kinds(direct), kinds(idle)) == (["server_away"], ["server_away"], [])
    [alarm] = bridged.alarms()
    assert "no correction and no stop reached this machine" in alarm["text"]
    for shop, late in ((bridged, 3), (direct, 1)):
        shop.push([0.0] * late, measured_at=[ago(minutes=50 - n) for n in range(late)])
    assert later(bridged, 5)["state"] == "active", "readings wait in the bridge"
    beat(bridged, waiting=0)
    ended = later(bridged, 5)
    assert (ended["state"], ended["outcome"][0]["code"]) == ("acknowledged", "server_back")
    assert "3 readings came late" in ended["outcome"][0]["text"]
    assert later(direct, 5)["outcome"][0]["late"] == 1
    run_jobs(server.database, [server_away.JOB])
    assert (kinds(bridged), kinds(direct)) == ([], [])


def test_jobs_that_took_long_are_no_server_that_was_away(shop: Shop) -> None:
    shop.read(0)
    gap(shop, 9, busy=500)
    assert shop.alarms() == []


def test_a_silence_that_is_over_says_how_many_readings_came_late(shop: Shop) -> None:
    beat(shop)
    silent_for(shop, 40)
    run(shop)
    [alarm] = shop.alarms()
    shop.push([0.0] * 2, measured_at=[ago(minutes=30), ago(minutes=20)])
    beat(shop, waiting=5, oldest_waiting_at=ago(minutes=1))
    run(shop)
    [outcome] = shop.call("GET", f"/alarms/{alarm['id']}")["outcome"]
    assert outcome["text"] == "The bridge has spoken again. 7 readings came late, and their decisions with them."


def looked_for_late(shop: Shop) -> None:
    """Look for readings that came late in the last minutes."""
    with shop.server.database.begin() as session:
        session.execute(text("DELETE FROM job_run WHERE job = 'late_readings'"))
        session.execute(text("INSERT INTO job_run VALUES ('late_readings', now() - interval '2 minutes', 0, 1)"))
        for unit in late_readings.due(session):
            if f"/{shop.machine}/" in unit.subject:
                late_readings.tell(session, unit)
                late_readings.tell(session, unit)
        session.execute(text("DELETE FROM job_run WHERE job = 'late_readings'"))


def came_in_time(shop: Shop, minutes: int) -> None:
    """Let the readings so far have come that long ago, when they were measured."""
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute("SET session_replication_role = replica")  # else it is refused: a reading is a fact
        connection.execute(
            "UPDATE reading SET received_at = now() - make_interval(mins => %s), measured_at = now() - make_interval(mins => %s)"
            " WHERE machine_id = (SELECT id FROM machine WHERE key = %s)",
            [minutes, minutes, shop.machine],
        )


def test_readings_of_a_machine_whose_network_failed_say_so(shop: Shop) -> None:
    shop.read(0)
    came_in_time(shop, 50)
    shop.push([0.0] * 4, measured_at=[ago(minutes=40 - 10 * n) for n in range(4)])
    looked_for_late(shop)
    [alarm] = shop.alarms()
    assert (alarm["kind"], alarm["count"]) == ("readings_late", 1)
    assert alarm["text"].startswith("4 readings came late: measured from ")
    looked_for_late(shop)
    assert shop.call("GET", f"/alarms/{alarm['id']}")["count"] == 1


def test_late_ones_that_come_one_by_one_say_so(shop: Shop) -> None:
    """The job looks once a minute: one of them in each look."""
    shop.read(0)
    came_in_time(shop, 50)

    def late_one(minutes: int, came: int) -> None:
        """Measured, and received, so many minutes ago."""
        shop.push([0.0], measured_at=[ago(minutes=minutes)])
        with psycopg.connect(shop.server.database.dsn) as connection:
            connection.execute("SET session_replication_role = replica")
            connection.execute(
                "UPDATE reading SET received_at = now() - make_interval(mins => %s) WHERE received_at > now() - interval '1 minute'"
                " AND sequence > 1 AND machine_id = (SELECT id FROM machine WHERE key = %s)",
                [came, shop.machine],
            )

    late_one(40, came=3)
    looked_for_late(shop)
    assert shop.alarms() == [], "one alone"
    late_one(30, came=1)
    looked_for_late(shop)
    [alarm] = shop.alarms()
    assert alarm["text"].startswith("2 readings came late: measured from ")
    shop.push([0.0], measured_at=[ago(minutes=20)])
    looked_for_late(shop)
    looked_for_late(shop)
    [alarm] = shop.alarms()
    assert alarm["text"].startswith("3 readings came late"), "each counts once"
    shop.acknowledge(alarm["id"], "noted")
    looked_for_late(shop)
    assert shop.alarms() == []


def test_a_clock_that_is_behind_and_sizes_by_hand_are_no_network_that_failed(server: Server) -> None:
    behind, by_hand = Shop(server), Shop(server)
    behind.push([0.0] * 3, measured_at=[ago(minutes=60 - n) for n in range(3)])
    by_hand.read(0)
    came_in_time(by_hand, 50)
    by_hand.push([0.0] * 2, measured_at=[ago(minutes=30), ago(minutes=20)], context=[{"by_hand": True}] * 2)
    for shop in (behind, by_hand):
        looked_for_late(shop)
        assert shop.alarms() == []


def test_what_a_silent_bridge_says_is_said_once(shop: Shop) -> None:
    shop.read(0)
    came_in_time(shop, 50)
    beat(shop)
    silent_for(shop, 40)
    run(shop)
    beat(shop)
    shop.push([0.0] * 2, measured_at=[ago(minutes=30), ago(minutes=20)])
    looked_for_late(shop)
    assert kinds(shop) == ["bridge_silent"]


def refused(*keys: str) -> list[dict[str, Any]]:
    return [
        {"key": key, "characteristic": "bore", "reason": "No such characteristic.", "at": ago(minutes=1)}
        for key in keys
    ]


def test_a_quarantine_raises_an_alarm_that_ends_when_it_is_empty(shop: Shop) -> None:
    beat(shop, quarantined=1, quarantine=refused("p-1"))
    run(shop)
    [alarm] = shop.alarms()
    assert alarm["kind"] == "bridge_quarantine"
    assert alarm["text"].endswith("The newest is p-1 of bore: No such characteristic.")
    shop.acknowledge(alarm["id"], "noted")
    run(shop)
    assert shop.alarms() == [], "answered"
    beat(shop, quarantined=2, quarantine=refused("p-2", "p-1"))
    run(shop)
    [alarm] = shop.alarms()
    assert alarm["text"].startswith("2 readings were refused")
    beat(shop)
    run(shop)
    ended = shop.call("GET", f"/alarms/{alarm['id']}")
    assert (ended["state"], ended["outcome"][0]["code"]) == ("acknowledged", "quarantine_empty")
