from concurrent.futures import ThreadPoolExecutor

import psycopg
import pytest

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


def test_a_database_of_the_last_revision_before_the_squash_is_stamped_and_keeps_its_rows(
    new_database: NewDatabase,
) -> None:
    url = new_database()
    tables = "SELECT * FROM machine", "SELECT * FROM machine_state", "SELECT * FROM alarm"
    with psycopg.connect(url) as connection:
        connection.execute("INSERT INTO machine (key, name, control) VALUES ('lathe-1', 'Lathe 1', 'fanuc')")
        connection.execute("INSERT INTO machine_state (machine_id) SELECT id FROM machine")
        connection.execute("INSERT INTO alarm (machine_id, tool_memory, kind) SELECT id, 3, 'tool_life' FROM machine")
        connection.execute("UPDATE alembic_version SET version_num = %s", [migrate.SQUASHED])
        before = [connection.execute(table).fetchall() for table in tables]
    todo = migrate.pending(url)
    assert migrate.current(url) == migrate.SQUASHED, "whoever asks changes nothing"
    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(migrate.upgrade, [url] * 4))
    assert sorted(done) == [[], [], [], todo]
    assert todo
    assert migrate.current(url) == migrate.head()
    with psycopg.connect(url) as connection:
        assert [connection.execute(table).fetchall() for table in tables] == before
    assert migrate.differences(url) == []


def test_a_database_of_an_earlier_revision_before_the_squash_is_left_alone(new_database: NewDatabase) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '0030'")
    with pytest.raises(MigrationError, match=rf"revision 0030.*goes on from.*{migrate.SQUASHED}.*{migrate.CARRIER}"):
        migrate.upgrade(url)
    assert migrate.current(url) == "0030"


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
