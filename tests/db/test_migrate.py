from concurrent.futures import ThreadPoolExecutor

import psycopg
import pytest
from alembic import command

from app.db import migrate
from app.db.migrate import MigrationError
from tests.conftest import NewDatabase, in_database


@pytest.fixture
def empty(postgres: str, request: pytest.FixtureRequest) -> str:
    name = f"empty_{abs(hash(request.node.nodeid))}"
    with psycopg.connect(postgres, autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name}")
    return in_database(postgres, name)


def test_tables_and_migrations_say_the_same(new_database: NewDatabase) -> None:
    assert migrate.differences(new_database()) == []


def test_an_empty_database_is_brought_to_the_head(empty: str) -> None:
    todo = migrate.pending(empty)
    assert todo
    assert migrate.current(empty) is None
    assert migrate.upgrade(empty) == todo
    assert migrate.current(empty) == migrate.head()
    assert migrate.pending(empty) == migrate.upgrade(empty) == []


def test_what_was_measured_before_the_last_migrations_stays(empty: str) -> None:
    with migrate._connected(empty) as connection:
        command.upgrade(migrate._config(connection), "0009")
    with psycopg.connect(empty) as connection:
        connection.execute("INSERT INTO machine (key, name, control) VALUES ('lathe-1', 'Lathe 1', 'fanuc')")
        connection.execute("INSERT INTO machine_state (machine_id) SELECT id FROM machine")
        connection.execute(
            "INSERT INTO alarm (machine_id, tool_memory, kind, data) SELECT id, 3, 'tool_life', '{}' FROM machine"
        )
    assert migrate.upgrade(empty)[0].startswith("0010 ")
    with psycopg.connect(empty) as connection:
        assert connection.execute(
            "SELECT m.key, a.kind FROM machine m JOIN alarm a ON a.machine_id = m.id"
        ).fetchall() == [("lathe-1", "tool_life")]
    assert migrate.differences(empty) == []


def test_of_processes_that_start_together_one_migrates(empty: str) -> None:
    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(migrate.upgrade, [empty] * 4))
    assert sorted(map(len, done)) == [0, 0, 0, len(max(done))]
    assert migrate.current(empty) == migrate.head()


def test_a_database_of_a_newer_program_is_left_alone(new_database: NewDatabase) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("UPDATE alembic_version SET version_num = 'from tomorrow'")
    with pytest.raises(MigrationError, match="newer"):
        migrate.upgrade(url)
    assert migrate.current(url) == "from tomorrow"
