"""``inband backup`` and ``inband restore``: everything that is stored, in one file, with PostgreSQL's own programs."""

import getpass
import os
import subprocess
import time
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, cli, reachable, refuse_empty, refuse_nothing_there, say, settings_from
from app.errors import InbandError

File = Annotated[Path, typer.Argument(help="The backup.", dir_okay=False)]


@cli.command()
def backup(file: File, data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Write everything that is stored into a file, as it is at this moment. Also while a server runs."""
    if file.exists():
        raise InbandError(f"{file} is there already.", "Name another file; a backup replaces none.")
    settings = settings_from(data_dir=data_dir, database_url=database_url)
    refuse_nothing_there(settings)
    unfinished = file.with_name(f"{file.name}.unfinished")
    with reachable(settings) as url:
        refuse_empty(url)
        unfinished.touch(0o600)  # before there is anything in it that others could read
        try:
            alone = [f"--schema={settings.schema_name}"] if settings.schema_name else []
            _run("pg_dump", url, "--format=custom", f"--file={unfinished.absolute()}", *alone)
        except BaseException:
            unfinished.unlink(missing_ok=True)
            raise
        unfinished.rename(file)
        _record(url, "backup made", file)
    say(f"{file}: {file.stat().st_size / 1000:,.0f} kB. `inband restore` brings it back.")


@cli.command()
def restore(file: File, data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Bring a backup back, into a data directory or database that is still empty."""
    if not file.exists():
        raise InbandError(f"There is no file {file}.", "Name the file that `inband backup` has written.")
    from app.db.connections import Connections
    from app.db.migrate import upgrade

    settings = settings_from(data_dir=data_dir, database_url=database_url)
    with reachable(settings) as url:
        with Connections(url, settings.database_patience) as connections, connections.connect() as connection:
            tables = connection.execute(
                "SELECT count(*) FROM pg_tables WHERE schemaname = coalesce(%s, 'public')", [settings.schema_name]
            ).fetchone()
        if tables and tables[0]:
            raise InbandError(
                "There is something in this database already; a backup is restored into an empty one only.",
                "Name a new --data-dir (or a new, empty database), and serve from there.",
            )
        _run("pg_restore", url, "--single-transaction", "--no-owner", "--exit-on-error", str(file.absolute()))
        upgrade(url)
        _record(url, "backup restored", file)
    say(f"Restored from {file}. `inband serve` goes on from there.")


def _record(url: str, action: str, file: Path) -> None:
    """Note it in the record of changes; where this cannot be written, say so: the backup is good all the same."""
    from psycopg import Error
    from sqlalchemy.exc import DBAPIError

    from app.access.audit.actions import record
    from app.db.engine import Database

    database = Database(url, pool_size=1, application_name="inband command")
    try:
        with database.begin() as session:
            record(session, f"command line ({getpass.getuser()})", action, "database", after={"file": file.name})
    except (DBAPIError, Error):  # of the engine, or of the driver, which writes the entry
        say("It is not in the record of changes: the database is not migrated, or this role may only read.")
    finally:
        database.close()


def _run(program: str, url: str, *options: str) -> None:
    """Run a program of PostgreSQL on this database. The password goes by the environment, where nobody else reads it.

    It may take hours; it is ended when the database does not answer any more.
    """
    from psycopg.conninfo import make_conninfo

    from app.db.binaries import binary
    from app.db.connections import LOOK, Connections, parameters_of

    parameters = parameters_of(url)
    environment = dict(os.environ)
    if (password := parameters.pop("password", None)) is not None:
        environment["PGPASSWORD"] = str(password)
    command = [str(binary(program)), "--no-password", f"--dbname={make_conninfo(**parameters)}", *options]
    with Connections(url) as connections, NamedTemporaryFile("w+") as words:
        process = subprocess.Popen(command, env=environment, stdout=words, stderr=words)  # noqa: S603 - our words
        try:
            while process.poll() is None:
                connections.check(0)
                time.sleep(LOOK)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
        words.seek(0)
        if process.returncode != 0:
            raise InbandError(f"{program} has failed:\n{words.read().strip()}")
