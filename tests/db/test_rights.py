"""A fact cannot be altered or removed by the role that serves, whatever it sends."""

from collections.abc import Iterator
from typing import Any

import psycopg
import pytest
from sqlalchemy import make_url

from app.db import migrate
from app.db.base import whole_metadata
from app.db.rights import APPEND_ONLY, WITH_A_LIFE, rights_of
from tests.databases import NewDatabase, drop_database
from tests.forked import inband
from tests.servers import RunServer, Server
from tests.shop import Shop

ROLE = "inband_serving"
# As docs/how-to/run-for-real.md says.
GRANTS = f"""
GRANT USAGE ON SCHEMA public TO {ROLE};
GRANT SELECT, INSERT, UPDATE, DELETE ON ALL TABLES IN SCHEMA public TO {ROLE};
GRANT USAGE ON ALL SEQUENCES IN SCHEMA public TO {ROLE};
"""
# Rows that move on or go away by themselves: notes made anew, plans, sessions, reports of a week, the journal of events.
PASSING = {
    "announced",
    "badge",
    "browser_session",
    "calibration_plan",
    "capability_verdict",
    "connection",
    "control_plan",
    "present_context",
    "delivery",
    "event",
    "fixture",
    "import_mapping",
    "invitation",
    "job_failure",
    "job_run",
    "kinematics_plan",
    "known_place",
    "login_failure",
    "machine_run",
    "notification_route",
    "outlook",
    "plant_calendar",
    "receiver",
    "receiver_group",
    "report_file",
    "report_job",
    "report_part",
    "station_device",
    "thermal_expansion",
    "wall_screen",
    "watching",
}
MOVING = {"average_memory", "machine_state", "stream", "tool"}  # any of their columns but the key may move


@pytest.fixture(scope="module")
def owned(new_database: NewDatabase) -> Iterator[str]:
    url = new_database()
    yield url
    drop_database(url)


@pytest.fixture(scope="module")
def serving(postgres: str, owned: str) -> str:
    """The address of the database for a role that may only read and write rows."""
    with psycopg.connect(postgres, autocommit=True) as connection:
        # Roles are of the whole server, which other tests share; locks are of one database, so all lock in the same.
        connection.execute("SELECT pg_advisory_lock(7292)")
        if not connection.execute("SELECT 1 FROM pg_roles WHERE rolname = %s", [ROLE]).fetchone():
            connection.execute(f"CREATE ROLE {ROLE} LOGIN PASSWORD 'secret'")
    with psycopg.connect(owned, autocommit=True) as connection:
        connection.execute(GRANTS)
    return make_url(owned).set(username=ROLE, password="secret").render_as_string(hide_password=False)


@pytest.fixture(scope="module")
def server(run_server: RunServer, serving: str, owned: str) -> Iterator[Server]:
    with run_server(serving) as running:
        yield running


def test_every_table_is_protected_or_may_pass() -> None:
    assert set(whole_metadata().tables) == APPEND_ONLY | WITH_A_LIFE | PASSING


def test_a_role_that_only_writes_rows_serves(server: Server) -> None:
    shop = Shop(server)
    number = shop.read(60)["correction"]["number"]
    shop.call("POST", f"/corrections/{shop.machine}/{number}/applied", client=shop.machine_client)
    heartbeat: dict[str, Any] = {"version": "1", "state": "online", "waiting": 0}
    told = shop.call("POST", f"/machines/{shop.machine}/heartbeat", client=shop.machine_client, **heartbeat)
    assert told["server"]["last_event"] > 0, "it may see where the server stands"
    with server.database.begin() as session:
        rights = rights_of(session.connection())
    assert (rights.role, rights.owner, rights.missing, rights.unprotected) == (ROLE, False, [], [])


@pytest.mark.parametrize("table", sorted(APPEND_ONLY | WITH_A_LIFE))
def test_no_fact_is_altered_or_removed(server: Server, table: str) -> None:
    column = next(each.name for each in whole_metadata().tables[table].columns if each.identity is None)
    statements = [f"DELETE FROM {table}"]  # noqa: S608 - our words
    if table not in MOVING:
        statements.append(f"UPDATE {table} SET {column} = {column}")  # noqa: S608 - our words
    with psycopg.connect(server.database.dsn) as connection:
        for statement in statements:
            with pytest.raises(psycopg.errors.RaiseException):
                connection.execute(statement)
            connection.rollback()
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            connection.execute(f"ALTER TABLE {table} DISABLE TRIGGER ALL")


def test_a_correction_keeps_its_amount_and_stays_closed(server: Server) -> None:
    shop = Shop(server)
    number = shop.read(60)["correction"]["number"]
    shop.call("POST", f"/corrections/{shop.machine}/{number}/applied", client=shop.machine_client)
    with psycopg.connect(server.database.dsn) as connection:
        for change in ("amount = 0", "status = 'pending'"):
            with pytest.raises(psycopg.errors.RaiseException, match="correction"):
                connection.execute(f"UPDATE correction SET {change}")  # noqa: S608 - our words
            connection.rollback()


def test_check_says_what_the_role_may_and_what_is_not_protected(server: Server, owned: str, serving: str) -> None:
    def check(url: str) -> tuple[int, str]:
        done = inband("check", "--database-url", url)
        return done.returncode, " ".join(done.stderr.split())

    status, said = check(serving)
    assert status == 0
    assert f"rights: {ROLE} reads and writes rows" in said
    status, said = check(owned)
    assert status == 0
    assert "could remove these" in said
    with psycopg.connect(owned, autocommit=True) as connection:
        connection.execute("ALTER TABLE reading DISABLE TRIGGER append_only")
        connection.execute(f"REVOKE INSERT ON exclusion FROM {ROLE}")
        status, said = check(serving)
        connection.execute("ALTER TABLE reading ENABLE TRIGGER append_only")
        connection.execute(f"GRANT INSERT ON exclusion TO {ROLE}")
    assert status == 1
    assert "nothing protects the facts in reading" in said
    assert f"{ROLE} lacks INSERT on exclusion" in said


def test_who_may_not_migrate_learns_who_may(first_program: str, serving: str) -> None:
    with psycopg.connect(first_program, autocommit=True) as connection:
        connection.execute(GRANTS)
    with pytest.raises(migrate.MigrationError, match=f"role {ROLE} may not"):
        migrate.upgrade(
            make_url(serving).set(database=make_url(first_program).database).render_as_string(hide_password=False)
        )
    assert migrate.current(first_program) == migrate.SQUASHED
    assert migrate.upgrade(first_program)
