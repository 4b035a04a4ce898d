"""Bringing a database to the schema this program knows, in-process: no alembic command, no alembic.ini.

Several server processes may start at once; an advisory lock lets one migrate while the others wait and then find it done.
A migration that cannot get a table within ``LOCK_PATIENCE`` gives up rather than make every reading queue behind it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import psycopg
from psycopg.errors import InsufficientPrivilege, LockNotAvailable, RaiseException

from app import HOUSE
from app.db import citus
from app.db.connections import Connections

if TYPE_CHECKING:  # SQLAlchemy and Alembic: half a second to read, which most commands need not spend
    from alembic.config import Config
    from alembic.script import Script, ScriptDirectory
    from sqlalchemy import Connection
    from sqlalchemy.exc import DBAPIError
    from sqlalchemy.schema import SchemaItem

LOCK = 7_010_000_833  # any number, the same in every process
LOCK_PATIENCE = "5s"
MIGRATIONS = HOUSE / "migrations"
OTHERS_TURN = "10min"
SQUASHED = "0018"
"""Last of the revisions of the first published program. Its tables are those of the first schema, so it is stamped as that."""
FOLDED = "0135"
"""The last revision of those that became the four after 0101: a database that ran them one by one has the same tables."""
CARRIERS = {SQUASHED: "ef7d1ef of 2026-11-22", FOLDED: "5993ea4f of 2026-11-27"}
"""The last commits that carry the revisions up to these, one by one."""
OPTIONS = f"-c timezone=UTC -c lock_timeout={LOCK_PATIENCE}"


class MigrationError(Exception):
    """The database cannot be brought to this schema; the message says why and what to do."""


def upgrade(url: str) -> list[str]:
    """Run the pending migrations; their names. None of a migration that fails remains.

    A database at `SQUASHED` is stamped as the first schema, in one transaction with the migrations after it.
    """
    if current(url) == head() and not _bare(url):
        return []
    from alembic import command

    with _alone(url) as connection:
        _make_schema(connection)
        now, todo = _revision(connection), _pending(connection)
        connection.commit()  # alembic commits only what it has begun itself
        if todo:
            if now == SQUASHED:
                _stamp(connection, SQUASHED, _scripts().get_base())
            command.upgrade(config(connection), "head")
            connection.commit()
        if citus.version(driver := _driver(connection)):
            citus.protect(driver)
            connection.commit()
    return todo


def _bare(url: str) -> bool:
    """Tell if a node of Citus lacks a protection of facts: its migration ended before it was given."""
    with Connections(url).connect(autocommit=True, options=OPTIONS) as connection:
        return bool(citus.version(connection) and citus.unprotected(connection))


def downgrade(url: str, revision: str) -> list[str]:
    """Take migrations back until the database is at an earlier revision; their names, newest first. All of them or none.

    At `SQUASHED` the first published program finds its database again. Raises `MigrationError`.
    """
    from alembic import command

    with _alone(url) as connection:
        todo = [f"{script.revision} {script.doc.rstrip('.')}" for script in _since(connection, revision)]
        connection.commit()
        if todo:
            connection.begin()  # one transaction for all of them
            base = _scripts().get_base()
            command.downgrade(config(connection), base if revision == SQUASHED and base else revision)
            if revision == SQUASHED:
                _stamp(connection, base, SQUASHED)
            connection.commit()
    return todo


def losses(url: str, revision: str) -> list[str]:
    """Tell what `downgrade` would take back, newest first: the name of each migration, and what it says is lost."""
    with connected(url) as connection:
        return [_loss(script) for script in _since(connection, revision)]


def _loss(script: Script) -> str:
    paragraphs = [" ".join(each.split()) for each in script.longdoc.split("\n\n")]
    lost = [each.removeprefix("`downgrade` ") for each in paragraphs if each.startswith("`downgrade`")]
    return f"{script.revision} {script.doc.rstrip('.')}" + (f": {lost[0]}" if lost else "")


@contextmanager
def _alone(url: str) -> Iterator[Connection]:
    """A connection that migrates while no other does; the lock ends with it. What people can fix is said in words."""
    from sqlalchemy import text
    from sqlalchemy.exc import DBAPIError, OperationalError

    with connected(url) as connection:
        connection.execute(text(f"SET lock_timeout = '{OTHERS_TURN}'"))
        try:
            connection.execute(text("SELECT pg_advisory_lock(:lock)"), {"lock": LOCK})
        except OperationalError as error:
            if "lock timeout" not in str(error):
                raise
            raise MigrationError(
                f"another Inband has been migrating this database for {OTHERS_TURN}. Look whether it still works; "
                "if it does not, end it and try again."
            ) from error
        connection.execute(text(f"SET lock_timeout = '{LOCK_PATIENCE}'"))
        if citus.version(driver := _driver(connection)):
            citus.permit_triggers(driver)
        try:
            yield connection
        except DBAPIError as error:
            if (words := _in_words(error, connection)) is None:
                raise
            raise MigrationError(words) from error


def wait_for_others(url: str) -> None:
    """Return once nobody migrates this database: a server that starts for the first time does. Raises `MigrationError`."""
    with _alone(url):
        pass


def _driver(connection: Connection) -> psycopg.Connection[Any]:
    driver = connection.connection.driver_connection
    assert isinstance(driver, psycopg.Connection)
    return driver


def _in_words(error: DBAPIError, connection: Connection) -> str | None:
    match error.orig:
        case LockNotAvailable():
            return (
                f"a table was in use for {LOCK_PATIENCE}, so the database was left as it was. "
                "Stop the servers on this database, or try again at a quieter moment."
            )
        case InsufficientPrivilege():
            return (
                f"migrations have to run, and the role {_driver(connection).info.user} may not change tables. "
                "Run `inband migrate` with INBAND_DATABASE_URL of the role that owns them, then start again."
            )
        case RaiseException() as refusal:  # a migration that looks at the rows before it goes back
            return f"the database was left as it was: {refusal.diag.message_primary}"
    return None


def current(url: str) -> str | None:
    """The database's revision; None before the first migration."""
    with Connections(url).connect(options=OPTIONS) as connection:
        (there,) = connection.execute("SELECT to_regclass('alembic_version')").fetchone() or (None,)
        row = connection.execute("SELECT version_num FROM alembic_version").fetchone() if there else None
    return str(row[0]) if row else None


def head() -> str | None:
    """The revision that this program's tables are at: the one migration that no other goes on from."""
    texts = [path.read_text(encoding="utf-8") for path in (MIGRATIONS / "versions").glob("*.py")]
    here = {match[1] for source in texts if (match := re.search(r'^revision\b.*?= "(\w+)"', source, re.MULTILINE))}
    heads = here - {
        match[1] for source in texts if (match := re.search(r'^down_revision\b.*?= "(\w+)"', source, re.MULTILINE))
    }
    return heads.pop() if len(heads) == 1 else _scripts().get_current_head()


def pending(url: str) -> list[str]:
    """The migrations still to run, oldest first, as ``revision summary``."""
    if current(url) == head():
        return []
    with connected(url) as connection:
        return _pending(connection)


def differences(url: str) -> list[Any]:
    """Changes that ``alembic revision --autogenerate`` would write; empty when tables.py and migrations agree."""
    from alembic.autogenerate import compare_metadata
    from alembic.runtime.migration import MigrationContext

    from app.db.base import whole_metadata

    with connected(url) as connection:
        options = {"compare_type": True, "compare_server_default": True, "include_object": include_object}
        return list(compare_metadata(MigrationContext.configure(connection, opts=options), whole_metadata()))


def include_object(item: SchemaItem, *_: object) -> bool:
    """Partitions and whatever else a migration marks as ``skip_autogenerate`` belong to their parent table."""
    return not item.info.get("skip_autogenerate", False)


@contextmanager
def connected(url: str) -> Iterator[Connection]:
    """A connection on which no reading waits for long behind a migration."""
    from sqlalchemy import NullPool, create_engine

    with Connections(url) as connections:
        engine = create_engine(
            "postgresql+psycopg://", creator=lambda: connections.connect(options=OPTIONS), poolclass=NullPool
        )
        with engine.connect() as connection:
            yield connection


def config(connection: Connection | None = None) -> Config:
    """Alembic's configuration, which needs no file: an installed program has none. That of its command is in pyproject.toml."""
    from alembic.config import Config

    made = Config(attributes={"connection": connection})
    made.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    return made


def _scripts() -> ScriptDirectory:
    from alembic.script import ScriptDirectory

    try:
        return ScriptDirectory.from_config(config())
    except Exception as error:
        raise MigrationError(
            f"the migrations are not in {MIGRATIONS} ({error}). This installation is not whole: install Inband again."
        ) from error


def _make_schema(connection: Connection) -> None:
    """Create the schema that the address names, if there is none."""
    from sqlalchemy import text
    from sqlalchemy.exc import ProgrammingError

    there, path = connection.execute(text("SELECT current_schema(), current_setting('search_path')")).one()
    if there is None:
        schema = path.split(",")[0].strip(' "')
        try:
            connection.execute(text(f'CREATE SCHEMA IF NOT EXISTS "{schema}"'))
        except ProgrammingError as error:
            raise MigrationError(
                f"there is no schema {schema} in this database, and this role may not create it. Name the schema that there is "
                "in INBAND_SCHEMA, or run `inband migrate` with the role that owns the database."
            ) from error
        connection.commit()


def _revision(connection: Connection) -> str | None:
    from alembic.runtime.migration import MigrationContext

    return MigrationContext.configure(connection).get_current_revision()


def _stamp(connection: Connection, before: str | None, after: str | None) -> None:
    from sqlalchemy import text

    change = text("UPDATE alembic_version SET version_num = :after WHERE version_num = :before")
    connection.execute(change, {"before": before, "after": after})


def _since(connection: Connection, revision: str) -> list[Script]:
    """Migrations that this database has and one at an earlier revision has not, newest first."""
    _pending(connection)  # a database that this program does not know is refused
    scripts, now = _scripts(), _revision(connection)
    if now is None or now == SQUASHED:
        return []
    target = scripts.get_base() if revision == SQUASHED else revision
    there = list(scripts.iterate_revisions(now, "base"))
    revisions = [script.revision for script in there]
    if target not in revisions:
        raise MigrationError(
            f"there is no way back from {now} to {revision}, only to {', '.join([*revisions[1:], SQUASHED])}. "
            "`inband --version` of the older program names the revision that it wants."
        )
    return there[: revisions.index(target)]


def _pending(connection: Connection) -> list[str]:
    scripts, now = _scripts(), _revision(connection)
    if now == SQUASHED:
        now = scripts.get_base()
    if now is not None and now not in {script.revision for script in scripts.walk_revisions()}:
        if re.fullmatch(r"\d{4}", now) and (last := next((last for last in CARRIERS if now < last), None)):
            raise MigrationError(
                f"the database is at revision {now}, of a program that was never published; this Inband goes on from the last "
                f"one of those, {last}. Make a backup with the Inband that has served it. Then check out commit "
                f"{CARRIERS[last]}, which carries the revisions up to {last}, and run its `inband migrate` on this database; "
                "after that, start this Inband."
            )
        raise MigrationError(
            f"the database is at revision {now}, which this Inband does not know: a newer one has used it. "
            "Run that newer Inband, or restore a backup made before."
        )
    todo = [script for script in scripts.iterate_revisions("head", now or "base") if script.revision != now]
    return [f"{script.revision} {script.doc.rstrip('.')}" for script in reversed(todo)]
