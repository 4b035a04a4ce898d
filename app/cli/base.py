"""Common parts of all commands: settings from options and environment, their database, their output."""

import json
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from app import __version__
from app.errors import InbandError

if TYPE_CHECKING:
    from app.db.engine import Database
    from app.settings import Settings

cli = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
people = Console(stderr=True, highlight=False)
SERVER = find_spec("app.db") is not None
"""This is more than the distribution inband-bridge: decisions/0064."""


def _tell_version(wanted: bool) -> None:
    if wanted:
        schema = ""
        if SERVER:
            from app.db.migrate import head

            schema = f", schema {head()}"
        typer.echo(f"inband {__version__} (Python {platform.python_version()}{schema})")
        raise typer.Exit


@cli.callback()
def inband(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_tell_version,
            is_eager=True,
            help="Print the versions of the program, of Python and of the schema, and end.",
        ),
    ] = False,
) -> None:
    """Inband decides tool-offset corrections from CNC probe readings."""


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


class Level(StrEnum):
    """The least that is logged."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class LogFormat(StrEnum):
    """Format of the log."""

    TEXT = "text"
    JSON = "json"


LogLevel = Annotated[
    Level | None, typer.Option(envvar="INBAND_LOG_LEVEL", help="The least that is logged.", show_default="info")
]
LogForm = Annotated[
    LogFormat | None,
    typer.Option("--log-format", envvar="INBAND_LOG_FORMAT", help="How it is logged.", show_default="text"),
]


def say(words: str, style: str | None = None) -> None:
    """Tell a person something."""
    people.print(words, style=style, markup=False, soft_wrap=True)


def settings_from(**options: Any) -> "Settings":
    """The settings: options given on the command line before the environment's."""
    from app.settings import Settings

    return Settings(**{name: value for name, value in options.items() if value is not None})


SERVED = "served.json"
"""In the data folder: where the server that was begun last listens."""


def remember_address(settings: "Settings") -> None:
    """Keep the address of this server for commands that print it. A folder that cannot be written keeps none."""
    from app.db.embedded import EmbeddedServerError, make_data_dir

    said = {"host": settings.host, "port": settings.port, "public_url": settings.public_url}
    with suppress(EmbeddedServerError, OSError):
        make_data_dir(settings.data_dir)
        (settings.data_dir / SERVED).write_text(json.dumps(said))


def as_served(settings: "Settings") -> "Settings":
    """The settings with the address of the server of this data folder, where none is said to this command."""
    if settings.model_fields_set & {"host", "port", "public_url"}:
        return settings
    with suppress(OSError, ValueError):
        said = json.loads((settings.data_dir / SERVED).read_text())
        known = {name: said[name] for name in ("host", "port", "public_url") if name in said}
        return settings.model_copy(update=known)
    return settings


@contextmanager
def reachable(settings: "Settings") -> Iterator[str]:
    """URL of the database for as long as the block runs: the named one, or the embedded one, created if need be."""
    from app.db.connections import in_schema, plain_url
    from app.db.embedded import EmbeddedServer

    def of_plant(url: str) -> str:
        return in_schema(url, settings.schema_name) if settings.schema_name else plain_url(url)

    if settings.database_url is not None:
        yield of_plant(settings.database_url)
    else:
        with EmbeddedServer(settings.data_dir) as url:
            yield of_plant(url)


@contextmanager
def existing(settings: "Settings") -> Iterator["Database"]:
    """The database of an Inband that is there already; see `existing_url`."""
    with existing_url(settings) as url, opened(url, settings) as database:
        yield database


@contextmanager
def existing_url(settings: "Settings") -> Iterator[str]:
    """URL of an existing Inband database, which is neither created nor migrated.

    Raises `InbandError` where there is none, or one of another version.
    """
    from app.db.migrate import current, head, pending, wait_for_others

    refuse_nothing_there(settings)
    with reachable(settings) as url:
        if current(url) != head():
            wait_for_others(url)
        if refuse_empty(url) != head() and pending(url):
            raise InbandError(
                "This database has the schema of an older Inband.",
                "Stop the server, make a backup with the Inband that it belongs to, then run `inband migrate`.",
            )
        yield url


def refuse_nothing_there(settings: "Settings") -> None:
    """Refuse a data directory without a database, and name those that are known: a slip of the pen makes no new one.

    Raises `InbandError`. A database that is named by its address is looked at by `refuse_empty`.
    """
    from app.db.embedded import EmbeddedServer, clusters_in_use

    if settings.database_url is not None or EmbeddedServer(settings.data_dir).exists:
        return
    usual = type(settings).model_fields["data_dir"].get_default(call_default_factory=True)
    there = {usual} if EmbeddedServer(usual).exists else set()
    known = sorted(map(str, there | clusters_in_use()))
    raise InbandError(
        f"There is no Inband in {settings.data_dir}.",
        (
            f"There is one in {', '.join(known)}: name it with --data-dir. "
            if known
            else "Name its folder with --data-dir. "
        )
        + "If your server was started with --database-url (INBAND_DATABASE_URL), name the same here. "
        "`inband serve` and `inband restore` make a new one.",
    )


def refuse_empty(url: str) -> str:
    """Revision of the database; one in which there is no Inband is refused. Raises `InbandError`."""
    from app.db.migrate import current

    revision = current(url)
    if revision is None:
        raise InbandError(
            "There is no Inband in this database.",
            "Look at --data-dir and --database-url; they are to be those of the server. "
            "`inband serve`, `inband migrate` and `inband restore` make a new one.",
        )
    return revision


@contextmanager
def opened(url: str, settings: "Settings") -> Iterator["Database"]:
    """The database at an address, for a command."""
    from app.db.connections import Connections
    from app.db.engine import Database

    with Connections(url, settings.database_patience) as connections:
        database = Database(url, pool_size=2, application_name="inband command", connections=connections)
        try:
            yield database
        finally:
            database.close()


def explain(error: Exception) -> tuple[str | None, int]:
    """Message and exit status for an error; no message for a fault of the program."""
    if isinstance(error, InbandError):
        fields = [
            f"  {problem_field.field}: {problem_field.message}"
            for problem_field in error.errors
            if problem_field.message not in error.detail
        ]
        return "\n".join([error.detail, *fields, *([error.what_to_do] if error.what_to_do else [])]), 1
    return _explain_server(error) if SERVER else (None, 1)


def _explain_server(error: Exception) -> tuple[str | None, int]:
    from psycopg import OperationalError as Away
    from pydantic import ValidationError
    from sqlalchemy.exc import OperationalError

    from app.db.binaries import BinariesError
    from app.db.connections import held_up
    from app.db.embedded import EmbeddedServerError
    from app.db.migrate import MigrationError

    match error:
        case ValidationError():
            lines = [_setting(problem) for problem in error.errors(include_url=False, include_input=False)]
            return "\n".join(lines), 2
        case EmbeddedServerError() | BinariesError() | MigrationError():
            return str(error), 1
        case OperationalError() | Away() if held_up(getattr(error, "orig", error)):
            return (
                "Other work holds what this command needs, and it could not wait any longer. Try again when that has ended.",
                1,
            )
        case OperationalError() | Away():
            return (
                f"The database cannot be used: {str(getattr(error, 'orig', error)).strip()}\nIs INBAND_DATABASE_URL right, and the server up?",
                1,
            )
    return None, 1


def _setting(problem: Any) -> str:
    from app.settings import variable_of

    name = str(problem["loc"][0]).removeprefix("INBAND_").lower() if problem["loc"] else ""
    words = str(problem["msg"]).removeprefix("Value error, ")
    return f"--{name.replace('_', '-')} / {variable_of(name)}: {words}" if name else words
