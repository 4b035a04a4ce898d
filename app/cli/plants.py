"""``inband plant``: the plants of an installation, each in a schema of the database."""

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, as_served, cli, reachable, refuse_nothing_there, say, settings_from
from app.cli.people import Role, actor
from app.errors import Conflict, Invalid, NotFound

if TYPE_CHECKING:
    from app.plants.registry import Plant
    from app.settings import Settings

plant = typer.Typer(help="Plants: several in one database, each in a schema.", no_args_is_help=True)
cli.add_typer(plant, name="plant")

Key = Annotated[str, typer.Argument(help="Its name in addresses: /p/KEY/.", envvar="INBAND_PLANT")]


@plant.command("add")
def add_plant(
    key: Key,
    name: Annotated[
        str | None, typer.Option(envvar="INBAND_NAME", help="What people call it.", show_default="KEY")
    ] = None,
    schema: Annotated[
        str | None,
        typer.Option(
            "--schema", help="Its schema of the database; one with an Inband is taken as it is.", show_default="KEY"
        ),
    ] = None,
    host: Annotated[
        str | None, typer.Option("--host-name", help="Serve it by this host name of the server instead of /p/KEY/.")
    ] = None,
    timezone: Annotated[
        str | None, typer.Option(help="Its time zone, such as Europe/Belgrade.", show_default="the server's")
    ] = None,
    shifts: Annotated[
        str | None, typer.Option(help="When its shifts begin, such as 06:00,14:00,22:00.", show_default="the server's")
    ] = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Add a plant. Servers of this database serve it within some seconds."""
    from app.access import actions, queries
    from app.cli.base import opened
    from app.db.connections import Connections, in_schema
    from app.db.migrate import upgrade
    from app.plants import registry
    from app.plants.serving import settings_of

    settings = _settings(data_dir, database_url)
    added = registry.Plant(
        key, name or key, schema or key.replace("-", "_"), host.lower() if host else None, timezone, shifts
    )
    registry.check(added)
    with reachable(settings) as url:
        of_plant = settings_of(added, settings.model_copy(update={"database_url": url}))
        with Connections(url) as connections, connections.connect(application_name="inband command") as connection:
            registry.add(connection, added)  # not seen by servers before the schema is there
            own = in_schema(url, added.schema)
            for revision in upgrade(own):
                say(f"migrated: {revision}")
            with opened(own, settings) as database, database.begin() as session:
                token = (
                    None
                    if queries.active_admins(session)
                    else actions.create_invitation(session, role="admin", actor="inband plant add")
                )
    say(f"{added.name} is served at {of_plant.address}/ within some seconds, by every server of this database.")
    if token:
        say("The first person to open this link becomes its administrator (it works once, for a week):")
        say(f"  {of_plant.address}/invitation/{token}", style="bold")


@plant.command("list")
def list_plants(data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Print every plant: key, name, schema, address, revision of its schema; with Citus its node."""
    from app.db import citus
    from app.db.connections import Connections, in_schema
    from app.db.migrate import current
    from app.plants import registry
    from app.plants.serving import settings_of

    settings = _settings(data_dir, database_url)
    with reachable(settings) as url:
        with Connections(url) as connections, connections.connect(application_name="inband command") as connection:
            listed = registry.plants(connection)
            distributed = citus.version(connection) is not None
            places = {each.key: citus.node_of(connection, each.schema) for each in listed} if distributed else {}
        for each in listed:
            of_plant = settings_of(each, settings.model_copy(update={"database_url": url}))
            revision = current(in_schema(url, each.schema)) or "no Inband in this schema"
            place = f"\t{places[each.key] or 'coordinator'}" if places else ""
            sys.stdout.write(f"{each.key}\t{each.name}\t{each.schema}\t{of_plant.address}\t{revision}{place}\n")
    if not listed:
        say(
            "There is no plant on the list: this server serves the one in its own schema. `inband plant add` adds others."
        )


@plant.command("remove")
def remove_plant(key: Key, data_dir: DataDir = None, database_url: DatabaseUrl = None) -> None:
    """Take a plant off the list. What is stored stays in its schema."""
    from app.db.connections import Connections
    from app.plants import registry

    with (
        reachable(_settings(data_dir, database_url)) as url,
        Connections(url) as connections,
        connections.connect(application_name="inband command") as connection,
    ):
        schema = registry.plant_named(connection, key).schema
        registry.remove(connection, key)
    say(
        f"{key} is not served any more. Everything stored stays in the schema {schema}; `inband plant add` takes it again."
    )


@plant.command("member")
def add_member(
    name: Annotated[str, typer.Argument(help="The name by which somebody signs in to a plant already.")],
    source: Annotated[str, typer.Option("--from", help="Key of that plant.")],
    to: Annotated[str, typer.Option(help="Key of the plant that is added.")],
    role: Annotated[Role, typer.Option(help="What this person may do there.")],
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Let a person of one plant into another, with the same name and password."""
    from app.access import actions, queries
    from app.cli.base import opened
    from app.db.connections import Connections, in_schema
    from app.plants import registry

    settings = _settings(data_dir, database_url)
    with reachable(settings) as url:
        with Connections(url) as connections, connections.connect(application_name="inband command") as connection:
            here, there = registry.plant_named(connection, source), registry.plant_named(connection, to)
        with opened(in_schema(url, here.schema), settings) as database, database.begin() as session:
            person = queries.person_named(session, name)
        if person is None:
            raise NotFound(
                f"No person named {name} signs in to {here.name}.", "Look at the people there: Set-up, People."
            )
        with opened(in_schema(url, there.schema), settings) as database, database.begin() as session:
            actions.add_person_of_another_plant(session, person, role.value, actor())
    say(f"{person.name} may sign in to {there.name} as {role.value}, with the password of {here.name}.")


@plant.command("move")
def move_plant(
    key: Key,
    to: Annotated[str, typer.Argument(help="The node, as HOST:PORT; `inband check` lists them.", envvar="INBAND_NODE")],
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Move a plant to another node of a database that Citus distributes. Readings wait only at the end of it."""
    import psycopg

    from app.db import citus
    from app.db.connections import Connections
    from app.plants import registry

    settings = _settings(data_dir, database_url)
    with (
        reachable(settings) as url,
        Connections(url) as connections,
        connections.connect(autocommit=True, application_name="inband command") as connection,
    ):
        moved = registry.plant_named(connection, key)
        if citus.version(connection) is None:
            raise Invalid(
                "This database has no Citus, so there is no other node.",
                "docs/how-to/citus.md says how it is set up. Without it a plant moves to another server by a backup: "
                f"INBAND_SCHEMA={moved.schema} inband backup, and restore there.",
            )
        known = citus.nodes(connection)
        node = next((each for each in known if str(each) == to), None)
        if node is None:
            raise NotFound(f"There is no node {to}.", f"There are: {', '.join(map(str, known))}.")
        try:
            citus.move(connection, moved.schema, node)
        except psycopg.Error as error:
            raise Conflict(
                f"Citus could not move {moved.name}: {str(error).splitlines()[0]}.",
                "It stays where it was. What it left on a node by an earlier move is cleared away within some minutes; "
                "try again then. docs/how-to/citus.md names what each node needs.",
            ) from None
    say(f"{moved.name} lies on {node}.")


def schemas(url: str, settings: "Settings") -> "list[tuple[Plant | None, str]]":
    """Every plant of a database with its address; None: the one in the server's own schema, which comes first.

    Where plants are listed and the own schema holds none, it is not among them.
    """
    from app.db.connections import Connections, in_schema
    from app.db.migrate import current
    from app.plants.registry import plants

    listed = []
    if settings.schema_name is None:
        with Connections(url) as connections, connections.connect(application_name="inband command") as connection:
            listed = plants(connection)
    own: list[tuple[Plant | None, str]] = [] if listed and current(url) is None else [(None, url)]
    return own + [(each, in_schema(url, each.schema)) for each in listed]


def migrate_all(url: str, settings: "Settings") -> "list[Plant]":
    """Bring every plant of a database to the schema of this program; those of the list that are ready to be served.

    Raises what hinders the plant of the server's own schema; another plant whose migration fails is named, and not served.
    """
    from psycopg import Error
    from sqlalchemy.exc import DBAPIError

    from app.db.migrate import MigrationError, upgrade

    ready = []
    for plant, address in schemas(url, settings):
        try:
            upgrade(address)
        except (MigrationError, DBAPIError, Error) as error:
            if plant is None:
                raise
            say(f"Plant {plant.key} is not served: {str(error).strip().splitlines()[0]}", style="bold red")
        else:
            ready += [plant] if plant is not None else []
    return ready


def _settings(data_dir: "DataDir", database_url: "DatabaseUrl") -> "Settings":
    settings = as_served(settings_from(data_dir=data_dir, database_url=database_url))
    if settings.schema_name is not None:
        raise Invalid(
            "INBAND_SCHEMA names the schema of one plant.",
            "Run this command without it: the list belongs to the database.",
        )
    refuse_nothing_there(settings)
    return settings
