"""``inband backup`` and ``inband restore``: everything that is stored, in one file, with PostgreSQL's own programs."""

import os
import subprocess
from pathlib import Path
from typing import Annotated
from urllib.parse import unquote, urlsplit

import psycopg
import typer

from app.cli.base import DatabaseUrl, DataDir, cli, reachable, say, settings_from
from app.db.embedded import binary
from app.db.migrate import upgrade
from app.errors import InbandError

File = Annotated[Path, typer.Argument(help="The backup.", dir_okay=False)]


@cli.command()
def backup(file: File, data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Write everything that is stored into a file, as it is at this moment. Also while a server runs."""
    if file.exists():
        raise InbandError(f"{file} is there already.", "Name another file; a backup replaces none.")
    unfinished = file.with_name(f"{file.name}.unfinished")
    unfinished.touch(0o600)  # before there is anything in it that others could read
    with reachable(settings_from(data_dir=data_dir, database_url=database_url)) as url:
        try:
            _run("pg_dump", url, "--format=custom", f"--file={unfinished.absolute()}")
        except InbandError:
            unfinished.unlink(missing_ok=True)
            raise
    unfinished.rename(file)
    say(f"{file}: {file.stat().st_size / 1000:,.0f} kB. `inband restore` brings it back.")


@cli.command()
def restore(file: File, data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Bring a backup back, into a data directory or database that is still empty."""
    if not file.exists():
        raise InbandError(f"There is no file {file}.", "Name the file that `inband backup` has written.")
    settings = settings_from(data_dir=data_dir, database_url=database_url)
    with reachable(settings) as url:
        with psycopg.connect(url) as connection:
            found = connection.execute("SELECT count(*) FROM pg_tables WHERE schemaname = 'public'").fetchone()
        if found and found[0]:
            raise InbandError(
                "There is something in this database already; a backup is restored into an empty one only.",
                "Name a new --data-dir (or a new, empty database), and serve from there.",
            )
        _run("pg_restore", url, "--single-transaction", "--no-owner", "--exit-on-error", str(file.absolute()))
        upgrade(url)
    say(f"Restored from {file}. `inband serve` goes on from there.")


def _run(program: str, url: str, *options: str) -> None:
    """Run a program of PostgreSQL on this database. The password goes by the environment, where nobody else reads it."""
    parts = urlsplit(url)
    environment = dict(os.environ)
    if parts.password:
        environment["PGPASSWORD"] = unquote(parts.password)
        url = parts._replace(netloc=parts.netloc.replace(f":{parts.password}@", "@", 1)).geturl()
    command = [str(binary(program)), "--no-password", f"--dbname={url}", *options]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)  # noqa: S603 - our words
    if done.returncode != 0:
        raise InbandError(f"{program} has failed:\n{done.stderr.strip()}")
