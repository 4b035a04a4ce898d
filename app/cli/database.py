"""``inband migrate`` and ``inband check``."""

import platform
import re
from collections.abc import Sequence
from contextlib import ExitStack, closing
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from app import __version__
from app.cli.base import (
    DatabaseUrl,
    DataDir,
    as_served,
    cli,
    explain,
    opened,
    people,
    reachable,
    refuse_empty,
    refuse_nothing_there,
    say,
    settings_from,
)
from app.errors import InbandError

if TYPE_CHECKING:
    import psycopg

    from app.db.rights import Rights
    from app.jobs.tables import JobFailure
    from app.loop.notifications.tables import Receiver
    from app.plants.registry import Plant
    from app.settings import Settings


@cli.command()
def migrate(
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
    back_to: Annotated[
        str | None,
        typer.Option(
            help="Go back to the schema of an older Inband, which its --version names. Later things are lost."
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="With --back-to: what is lost may be lost.")] = False,
) -> None:
    """Bring the database to the schema of this program, each of its plants."""
    from app.cli.plants import schemas
    from app.db import migrate as migrations

    settings = settings_from(data_dir=data_dir, database_url=database_url)
    refuse_nothing_there(settings)  # an empty database of a server of one's own is migrated: it was made for that
    with reachable(settings) as url:
        if back_to is not None:
            _go_back(url, back_to, sure=yes)
            return
        failed = False
        for plant, address in schemas(url, settings):
            of_plant = f"plant {plant.key}: " if plant else ""
            try:
                done = migrations.upgrade(address)
            except Exception as error:  # the other plants are migrated all the same
                words, _status = explain(error)
                if plant is None or not words:
                    raise
                say(f"{of_plant}{words}", style="bold red")
                failed = True
                continue
            for revision in done:
                say(f"{of_plant}migrated: {revision}")
            if not done:
                say(f"{of_plant}nothing to do: the database is at {migrations.current(address)}")
        if failed:
            raise typer.Exit(1)


def _go_back(url: str, revision: str, *, sure: bool) -> None:
    from app.db import migrate as migrations

    refuse_empty(url)
    lost = migrations.losses(url, revision)
    if lost and not sure:
        raise InbandError(
            "\n  ".join(
                [f"To go back to {revision} undoes these migrations, and loses what only they have room for:", *lost]
            ),
            "Stop every server on this database and make a backup. Then add --yes.",
        )
    for done in migrations.downgrade(url, revision):
        say(f"undone: {done}")
    say(
        f"The database is at {migrations.current(url)}. Start the Inband of that schema now; this one would migrate again."
    )


@cli.command()
def check(data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Look at configuration, database and migrations, and say what is wrong and what to do. Changes nothing."""
    from sqlalchemy import text

    from app.cli.plants import schemas
    from app.db import citus
    from app.db.binaries import advice as release_advice
    from app.db.binaries import age, binaries
    from app.db.connections import Connections
    from app.db.disk import free, shortage
    from app.db.engine import Database
    from app.db.replication import advice_on, in_words, replication_of

    try:
        settings = settings_from(data_dir=data_dir, database_url=database_url)
        _well("Inband", f"{__version__}, Python {platform.python_version()}")
        _well("configuration", f"{as_served(settings).address}, {settings.workers} worker(s)")
        _well("time zone", f"{settings.timezone}; INBAND_TIMEZONE names another")
        refuse_nothing_there(settings)
        with reachable(settings) as url:
            places = schemas(url, settings)
            own = places[0][0] is None
            if own:
                refuse_empty(url)
            with (
                Connections(url, settings.database_patience) as connections,
                closing(Database(url, pool_size=1, connections=connections)) as database,
                database.begin() as session,
            ):
                version, size = session.execute(
                    text(
                        "SELECT current_setting('server_version'), pg_size_pretty(pg_database_size(current_database()))"
                    )
                ).one()
                replication = replication_of(session)
                driver: psycopg.Connection = session.connection().connection.driver_connection  # type: ignore[assignment]
                distributed = citus.in_words(driver, of_plant=own)
                missing = citus.missing(driver, [plant.schema for plant, _address in places if plant])
                answering = f"{driver.info.host} port {driver.info.port}"
            where = "your own server" if settings.database_url else f"embedded in {settings.data_dir}"
            if settings.database_url is None:
                where += f", programs of {binaries().folder}"
            _well("database", f"PostgreSQL {version}, {size}, {where}")
            if distributed:
                _well("Citus", distributed)
            for advice in missing:
                _note(f"Citus: {advice}")
            if advice_on_release := release_advice(_release(version), embedded=settings.database_url is None):
                _note(f"database: {advice_on_release}")
            if old := age(_release(version), embedded=settings.database_url is None, today=datetime.now(UTC).date()):
                _note(f"database: {old}")
            if settings.database_url is not None:
                _well("copies", f"{in_words(replication)} (asked of {answering})")
            for advice in advice_on(replication):
                _note(advice)
            conditions = [_condition(plant, address, settings) for plant, address in places]
    except Exception as error:
        words, status = explain(error)
        if not words:
            raise
        _wrong(words)
        raise typer.Exit(status) from None
    away = _replica(settings)
    full = shortage(settings.data_dir)
    if full:
        _wrong(full)
    else:
        _well("disk", f"{free(settings.data_dir) / 1e9:,.1f} GB free where {settings.data_dir} lies")
    well = [_plant(condition) for condition in conditions]
    well += [_rights(conditions, own=settings.database_url is not None)]
    if full or away or not all(well):
        raise typer.Exit(1)


def _replica(settings: "Settings") -> bool:
    """Say how the replica is that charts and reports read, if one is named. True if it is unreachable."""
    from sqlalchemy.exc import OperationalError

    from app.db.connections import Connections
    from app.db.engine import Database
    from app.db.replication import lag_of

    if settings.read_database_url is None or settings.database_url is None:
        return False
    urls = (settings.database_url, settings.read_database_url)
    try:
        with ExitStack() as stack:
            written, read = (
                stack.enter_context(
                    closing(
                        Database(
                            url, pool_size=1, connections=Connections(url, settings.database_patience, of_several=of)
                        )
                    )
                )
                for url, of in zip(urls, ("read-write", "prefer-standby"), strict=True)
            )
            lag = lag_of(written, read)
            place = read.connections.place
    except OperationalError as error:
        _wrong(f"replica: it cannot be read, so charts and reports read the server that is written to: {error.orig}")
        return True
    if lag.in_recovery:
        words = "it has everything" if lag.bytes <= 0 else f"{lag.bytes / 1e6:,.1f} MB behind"
        _well("replica", f"{words}; it is read while it is at most {settings.read_most_behind:g} s behind ({place})")
    else:
        _note(f"replica: {place} is no standby: charts and reports disturb the server that is written to.")
    return False


class _Condition(NamedTuple):
    """A plant: `wrong` in words, or what was found in its schema. name: as lines begin; empty for the server's own."""

    name: str
    schema: str = ""
    revision: str | None = None
    todo: Sequence[str] = ()
    failing: "Sequence[JobFailure]" = ()
    receivers: "Sequence[Receiver]" = ()
    rights: "Rights | None" = None
    bare: Sequence[str] = ()
    wrong: str = ""


def _condition(plant: "Plant | None", address: str, settings: "Settings") -> _Condition:
    from sqlalchemy import text

    from app.db import citus, migrate
    from app.db.rights import rights_of
    from app.jobs import queries as jobs
    from app.loop.notifications.failing_queries import failing

    name = f"plant {plant.key}: " if plant else ""
    try:
        if todo := migrate.pending(address):
            return _Condition(name, todo=todo)
        with opened(address, settings) as database, database.begin() as session:
            connection = session.connection()
            driver: psycopg.Connection = connection.connection.driver_connection  # type: ignore[assignment]
            return _Condition(
                name,
                connection.scalar(text("SELECT current_schema()")) or "",
                migrate.current(address),
                failing=jobs.failures(session),
                receivers=failing(session),
                rights=rights_of(connection),
                bare=citus.unprotected(driver) if citus.version(driver) else (),
            )
    except Exception as error:
        words, _status = explain(error)
        if plant is None or not words:
            raise
        return _Condition(name, wrong=words)


def _plant(found: _Condition) -> bool:
    """Say how a plant is. False if something has to be done."""
    name = found.name
    if found.wrong:
        _wrong(f"{name}{found.wrong}")
        return False
    if found.todo:
        _wrong(
            f"{name}{len(found.todo)} migration(s) to run: {', '.join(found.todo)}. `inband migrate` runs them, `inband serve` does so too."
        )
        return False
    _well(f"{name}migrations", f"at {found.revision}, none to run")
    for failure in found.failing:
        _wrong(
            f"{name}background job {failure.job} fails for {failure.subject or 'all'} since {failure.first_at:%Y-%m-%d %H:%M} UTC, "
            f"{failure.failures} time(s): {failure.error} It is tried again by itself at {failure.retry_at:%H:%M} UTC."
        )
    for each in found.receivers:
        _wrong(
            f"{name}receiver {each.name} ({each.means}) is not reached, {each.failures} times in a row: {each.failure} "
            "When it is repaired, send it a test: Set-up, Notifications."
        )
    if not found.failing and not name:
        _well("background jobs", "none fails")
    if found.bare:
        _wrong(
            f"{name}rights: nothing protects the facts in {', '.join(found.bare)} on their node. "
            "As the owner of the tables: `inband migrate`."
        )
    return not found.failing and not found.receivers and not found.bare


def _rights(conditions: "Sequence[_Condition]", *, own: bool) -> bool:
    """Say what the role may do, and whether facts are protected. False if something has to be done."""
    known = [(found, found.rights) for found in conditions if found.rights is not None]
    for found, rights in known:
        if rights.missing:
            _wrong(
                f"{found.name}rights: the role {rights.role} lacks {', '.join(rights.missing)}. As the owner of the tables: "
                f"GRANT SELECT, INSERT, UPDATE, DELETE ON ALL TABLES IN SCHEMA {found.schema} TO {rights.role}; "
                f"GRANT USAGE ON ALL SEQUENCES IN SCHEMA {found.schema} TO {rights.role};"
            )
        if rights.unprotected:
            _wrong(
                f"{found.name}rights: nothing protects the facts in {', '.join(rights.unprotected)} any more: their trigger was "
                "removed or switched off. Find out by whom; `ALTER TABLE ... ENABLE TRIGGER ALL`, or restore a backup made before."
            )
    if any(rights.missing or rights.unprotected for _found, rights in known):
        return False
    owned = [rights for _found, rights in known if rights.owner]
    if not known:
        return True
    if not owned:
        _well("rights", f"{known[0][1].role} reads and writes rows, and can neither alter nor remove facts")
    elif own:
        _note(
            f"rights: facts are protected by triggers, but the role {owned[0].role} could remove these (it owns tables or is a "
            "superuser). Serve with a role of its own that may read and write rows only; the source says how, in "
            "docs/how-to/run-for-real.md, *A role that cannot alter facts*."
        )
    else:
        _well("rights", "facts are protected by triggers; anyone who may read the data folder could remove them")
    return True


def _release(version: str) -> tuple[int, int]:
    """Major and minor release of `18.4 (Debian 18.4-1)`; a development version has no minor release."""
    numbers = [int(number) for number in re.findall(r"\d+", version.partition(" ")[0])]
    return numbers[0], numbers[1] if len(numbers) > 1 else 0


def _well(what: str, words: str) -> None:
    people.print(f"[green]ok[/green]    {what}: ", end="")
    say(words)


def _note(words: str) -> None:
    people.print("[yellow]note[/yellow]  ", end="")
    say(words)


def _wrong(words: str) -> None:
    people.print("[bold red]wrong[/bold red] ", end="")
    say(words)
