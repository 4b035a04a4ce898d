"""``inband migrate`` and ``inband check``."""

import platform

import typer
from sqlalchemy import text

from app import __version__
from app.cli.base import DatabaseUrl, DataDir, cli, explain, people, reachable, say, settings_from
from app.db import migrate as migrations
from app.db.engine import Database


@cli.command()
def migrate(data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Bring the database to the schema of this program."""
    with reachable(settings_from(data_dir=data_dir, database_url=database_url)) as url:
        done = migrations.upgrade(url)
        for each in done:
            say(f"migrated: {each}")
        if not done:
            say(f"nothing to do: the database is at {migrations.current(url)}")


@cli.command()
def check(data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Look at configuration, database and migrations, and say what is wrong and what to do. Changes nothing."""
    try:
        settings = settings_from(data_dir=data_dir, database_url=database_url)
        _well("Inband", f"{__version__}, Python {platform.python_version()}")
        _well("configuration", f"{settings.address}, {settings.workers} worker(s)")
        if settings.database_url is None and not (settings.data_dir / "postgres").exists():
            _well("database", f"none yet in {settings.data_dir}; `inband serve` makes it")
            return
        with reachable(settings) as url:
            database = Database(url, pool_size=1)
            with database.begin() as session:
                version, size = session.execute(
                    text(
                        "SELECT current_setting('server_version'), pg_size_pretty(pg_database_size(current_database()))"
                    )
                ).one()
            database.close()
            where = "your own server" if settings.database_url else f"embedded in {settings.data_dir}"
            _well("database", f"PostgreSQL {version}, {size}, {where}")
            todo = migrations.pending(url)
            now = migrations.current(url)
    except Exception as error:
        words, status = explain(error)
        if not words:
            raise
        _wrong(words)
        raise typer.Exit(status) from None
    if todo:
        _wrong(
            f"{len(todo)} migration(s) to run: {', '.join(todo)}. `inband migrate` runs them, `inband serve` does so too."
        )
        raise typer.Exit(1)
    _well("migrations", f"at {now}, none to run")


def _well(what: str, words: str) -> None:
    people.print(f"[green]ok[/green]    {what}: ", end="")
    say(words)


def _wrong(words: str) -> None:
    people.print("[bold red]wrong[/bold red] ", end="")
    say(words)
