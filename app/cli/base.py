"""What all commands share: settings from options and environment, the database they work on, how they speak."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from rich.console import Console
from sqlalchemy.exc import OperationalError

from app.db.embedded import EmbeddedServer, EmbeddedServerError
from app.db.engine import Database
from app.db.migrate import MigrationError, upgrade
from app.errors import InbandError
from app.settings import Settings

cli = typer.Typer(
    help="Inband decides tool-offset corrections from CNC probe readings.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
people = Console(stderr=True, highlight=False)

DataDir = Annotated[
    Path | None,
    typer.Option(
        envvar="INBAND_DATA_DIR", help="Where Inband keeps what it stores.", show_default="the user's data folder"
    ),
]
DatabaseUrl = Annotated[
    str | None,
    typer.Option(
        envvar="INBAND_DATABASE_URL", help="A PostgreSQL of your own.", show_default="embedded, in the data folder"
    ),
]


def say(words: str, style: str | None = None) -> None:
    """Tell a person something."""
    people.print(words, style=style, markup=False, soft_wrap=True)


def settings_from(**options: Any) -> Settings:
    """The settings: options given on the command line before the environment's."""
    return Settings(**{name: value for name, value in options.items() if value is not None})


@contextmanager
def reachable(settings: Settings) -> Iterator[str]:
    """Where the database is, as long as the block runs: the one that is named, else the embedded one."""
    if settings.database_url is not None:
        yield settings.database_url
    else:
        with EmbeddedServer(settings.data_dir) as url:
            yield url


@contextmanager
def migrated(settings: Settings) -> Iterator[Database]:
    """The database, with the schema of this program."""
    with reachable(settings) as url:
        upgrade(url)
        database = Database(url, pool_size=2, application_name="inband command")
        try:
            yield database
        finally:
            database.close()


def explain(error: Exception) -> tuple[str | None, int]:
    """What went wrong, in words, and the exit status; no words for what is a fault of the program."""
    match error:
        case ValidationError():
            lines = [_setting(problem) for problem in error.errors(include_url=False, include_input=False)]
            return "\n".join(lines), 2
        case InbandError():
            fields = [f"  {each.field}: {each.message}" for each in error.errors if each.message not in error.detail]
            return "\n".join([error.detail, *fields, *([error.what_to_do] if error.what_to_do else [])]), 1
        case EmbeddedServerError() | MigrationError():
            return str(error), 1
        case OperationalError():
            return (
                f"The database cannot be used: {str(error.orig).strip()}\nIs INBAND_DATABASE_URL right, and the server up?",
                1,
            )
    return None, 1


def _setting(problem: Any) -> str:
    name = str(problem["loc"][0]) if problem["loc"] else ""
    words = str(problem["msg"]).removeprefix("Value error, ")
    return f"--{name.replace('_', '-')} / INBAND_{name.upper()}: {words}" if name else words
