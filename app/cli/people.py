"""``inband user add`` and ``inband key add``: the first people and keys, also while a server runs."""

import getpass
import sys
from enum import StrEnum
from typing import Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, cli, existing, existing_url, say, settings_from

user = typer.Typer(help="People who sign in.", no_args_is_help=True)
key = typer.Typer(help="Keys by which machines and programs call.", no_args_is_help=True)
cli.add_typer(user, name="user")
cli.add_typer(key, name="key")


class Role(StrEnum):
    """Role of a person, or of a person's program; each may also do what those before it may."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ENGINEER = "engineer"
    ADMIN = "admin"


def actor() -> str:
    """The user who runs the command, for the record of changes."""
    return f"command line ({getpass.getuser()})"


@user.command("add")
def add_user(
    name: Annotated[str, typer.Argument(help="The name to sign in with.", envvar="INBAND_NAME")],
    role: Annotated[Role, typer.Option(envvar="INBAND_ROLE", help="What this person may do.")],
    password_stdin: Annotated[
        bool,
        typer.Option("--password-stdin", envvar="INBAND_PASSWORD_STDIN", help="Read the password from standard input."),
    ] = False,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Add a person."""
    settings = settings_from(data_dir=data_dir, database_url=database_url)
    if password_stdin:
        password = sys.stdin.readline().rstrip("\r\n")
    elif sys.stdin.isatty():
        password = typer.prompt(f"Password for {name}", hide_input=True, confirmation_prompt=True, err=True)
    else:
        raise typer.BadParameter("there is no terminal to ask for a password; pipe it in with --password-stdin")
    from app.access import actions

    with existing(settings) as database, database.begin() as session:
        actions.add_person(session, name=name, role=role.value, password=password, actor=actor())
    where = f" at {settings.public_url}" if settings.public_url else ""  # no other address is known to this command
    say(f"{name} may sign in{where} as {role.value}.")


@key.command("add")
def add_key(
    role: Annotated[
        Role | None, typer.Option(envvar="INBAND_ROLE", help="A key for a program, with this role.")
    ] = None,
    machine: Annotated[str | None, typer.Option(envvar="INBAND_MACHINE", help="A key for this machine.")] = None,
    name: Annotated[
        str, typer.Option(envvar="INBAND_NAME", help="What it is for, which tells it apart from others.")
    ] = "",
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Add a key and print its secret, this once."""
    if (role is None) == (machine is None):
        raise typer.BadParameter("say either --role ROLE or --machine MACHINE")
    from app.access.new_keys import insert_key
    from app.db.connections import LIMITS, Connections

    settings = settings_from(data_dir=data_dir, database_url=database_url)
    # Without SQLAlchemy, which takes longer to read than everything else here.
    with (
        existing_url(settings) as url,
        Connections(url, settings.database_patience) as connections,
        connections.connect(options=LIMITS, application_name="inband command") as connection,
    ):
        new_key = insert_key(
            connection, role=role and role.value, machine=machine, name=name or "command line", actor=actor()
        )
    sys.stdout.write(f"{new_key.secret}\n")
