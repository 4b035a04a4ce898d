"""Bringing a database to the schema this program knows, in-process: no alembic command, no alembic.ini.

Several server processes may start at once; an advisory lock lets one migrate while the others wait and then find it done.
A migration that cannot get a table within ``LOCK_PATIENCE`` gives up rather than make every reading queue behind it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, NullPool, create_engine, text
from sqlalchemy.exc import OperationalError
from sqlalchemy.schema import SchemaItem

from app.db.base import whole_metadata
from app.db.engine import psycopg_url
from app.settings import HOUSE

LOCK = 7_010_000_833  # any number, the same in every process
LOCK_PATIENCE = "5s"
OPTIONS = f"-c timezone=UTC -c lock_timeout={LOCK_PATIENCE}"


class MigrationError(Exception):
    """The database cannot be brought to this schema; the message says why and what to do."""


def upgrade(url: str) -> list[str]:
    """Run the pending migrations; their names. None of a migration that fails remains."""
    with _connected(url) as connection:
        connection.execute(text("SET lock_timeout = 0"))  # for the others' turn we wait
        connection.execute(text("SELECT pg_advisory_lock(:lock)"), {"lock": LOCK})
        connection.execute(text(f"SET lock_timeout = '{LOCK_PATIENCE}'"))
        todo = _pending(connection)
        connection.commit()  # alembic commits only what it has begun itself
        if todo:
            try:
                command.upgrade(_config(connection), "head")
            except OperationalError as error:
                if "lock timeout" not in str(error):
                    raise
                raise MigrationError(
                    f"a table was in use for {LOCK_PATIENCE}, so the database was left as it was. "
                    "Stop the servers on this database, or try again at a quieter moment."
                ) from error
        return todo  # the lock ends with the connection


def current(url: str) -> str | None:
    """The database's revision; None before the first migration."""
    with _connected(url) as connection:
        return MigrationContext.configure(connection).get_current_revision()


def head() -> str | None:
    """The revision that this program's tables are at."""
    return _scripts().get_current_head()


def pending(url: str) -> list[str]:
    """The migrations still to run, oldest first, as ``revision summary``."""
    with _connected(url) as connection:
        return _pending(connection)


def differences(url: str) -> list[Any]:
    """What ``alembic revision --autogenerate`` would write: empty when tables.py and migrations say the same."""
    with _connected(url) as connection:
        options = {"compare_type": True, "compare_server_default": True, "include_object": include_object}
        return list(compare_metadata(MigrationContext.configure(connection, opts=options), whole_metadata()))


def include_object(item: SchemaItem, *_: object) -> bool:
    """Partitions and whatever else a migration marks as ``skip_autogenerate`` belong to their parent table."""
    return not item.info.get("skip_autogenerate", False)


@contextmanager
def _connected(url: str) -> Iterator[Connection]:
    engine = create_engine(
        psycopg_url(url), poolclass=NullPool, connect_args={"options": OPTIONS, "connect_timeout": 10}
    )
    with engine.connect() as connection:
        yield connection


def _config(connection: Connection | None = None) -> Config:
    return Config(toml_file=HOUSE / "pyproject.toml", attributes={"connection": connection})


def _scripts() -> ScriptDirectory:
    try:
        return ScriptDirectory.from_config(_config())
    except Exception as error:
        raise MigrationError(
            f"the migrations are not in {HOUSE / 'migrations'} ({error}). Inband runs from its tree: clone it and `make run`."
        ) from error


def _pending(connection: Connection) -> list[str]:
    scripts, now = _scripts(), MigrationContext.configure(connection).get_current_revision()
    if now is not None and now not in {script.revision for script in scripts.walk_revisions()}:
        raise MigrationError(
            f"the database is at revision {now}, which this Inband does not know: a newer one has used it. "
            "Run that newer Inband, or restore a backup made before."
        )
    todo = [script for script in scripts.iterate_revisions("head", now or "base") if script.revision != now]
    return [f"{script.revision} {script.doc}" for script in reversed(todo)]
