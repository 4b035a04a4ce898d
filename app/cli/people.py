"""``inband user add`` and ``inband key add``: the first people and keys, also while a server runs."""

import getpass
import sys
from enum import StrEnum
from typing import Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, cli, migrated, say, settings_from
from app.people import actions

user = typer.Typer(help="People who sign in.", no_args_is_help=True)
key = typer.Typer(help="Keys by which machines and programs call.", no_args_is_help=True)
cli.add_typer(user, name="user")
cli.add_typer(key, name="key")


class Role(StrEnum):
    """What a person, or a person's program, may do; each may also do what those before may."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ENGINEER = "engineer"
    ADMIN = "admin"


def _actor() -> str:
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
    with migrated(settings) as database, database.begin() as session:
        actions.add_person(session, name=name, role=role.value, password=password, actor=_actor())
    say(f"{name} may sign in at {settings.address} as {role.value}.")


@key.command("add")
def add_key(
    role: Annotated[
        Role | None, typer.Option(envvar="INBAND_ROLE", help="A key for a program, with this role.")
    ] = None,
    machine: Annotated[str | None, typer.Option(envvar="INBAND_MACHINE", help="A key for this machine.")] = None,
    name: Annotated[
        str, typer.Option(envvar="INBAND_NAME", help="What it is for, so that it can be told from others.")
    ] = "",
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Add a key and print its secret, this once."""
    if (role is None) == (machine is None):
        raise typer.BadParameter("say either --role ROLE or --machine MACHINE")
    with (
        migrated(settings_from(data_dir=data_dir, database_url=database_url)) as database,
        database.begin() as session,
    ):
        made = actions.add_key(
            session, role=role.value if role else None, machine=machine, name=name or "command line", actor=_actor()
        )
    sys.stdout.write(f"{made.secret}\n")
