"""The list of plants: the table ``inband.plant`` of the database, which `inband plant` writes and every server reads."""

import re
from typing import Any, NamedTuple

import psycopg

from app.errors import Conflict, Invalid, NotFound

KEY = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
HOST = re.compile(r"(?=.{1,253}$)[a-z0-9]([a-z0-9-]*[a-z0-9])?(\.[a-z0-9]([a-z0-9-]*[a-z0-9])?)*")
_COLUMNS = "key, name, schema, host, timezone, shifts"
_TABLE = """
CREATE SCHEMA IF NOT EXISTS inband;
CREATE TABLE IF NOT EXISTS inband.plant (
    key text PRIMARY KEY, name text NOT NULL, schema text NOT NULL UNIQUE, host text UNIQUE, timezone text, shifts text,
    added_at timestamptz NOT NULL DEFAULT now()
)
"""


class Plant(NamedTuple):
    """A plant of the list. host: its own name of this server; None: it is served below ``/p/KEY``.

    timezone, shifts: as the settings of these names; None: those of the server.
    """

    key: str
    name: str
    schema: str
    host: str | None = None
    timezone: str | None = None
    shifts: str | None = None

    @property
    def prefix(self) -> str:
        """The beginning of its addresses."""
        return "" if self.host else f"/p/{self.key}"


def plants(connection: psycopg.Connection[Any]) -> list[Plant]:
    """Every plant, by name. None where no plant was ever added."""
    (there,) = connection.execute("SELECT to_regclass('inband.plant')").fetchone() or (None,)
    if there is None:
        return []
    rows = connection.execute(f"SELECT {_COLUMNS} FROM inband.plant ORDER BY lower(name), key")  # noqa: S608 - our own
    return [Plant(*row) for row in rows]


def plant_named(connection: psycopg.Connection[Any], key: str) -> Plant:
    """The plant with this key. Raises `NotFound`."""
    known = plants(connection)
    for plant in known:
        if plant.key == key:
            return plant
    names = ", ".join(plant.key for plant in known) or "none yet; `inband plant add` makes one"
    raise NotFound(f"There is no plant {key}.", f"There are: {names}.")


def check(plant: Plant) -> None:
    """Raises `Invalid` for a key or a host name that no address can hold."""
    if not KEY.fullmatch(plant.key):
        raise Invalid(
            f"{plant.key!r} cannot be the key of a plant.",
            "Take up to 40 small letters, digits and hyphens, such as novi-sad: it is part of addresses.",
        )
    if plant.host is not None and not HOST.fullmatch(plant.host):
        raise Invalid(
            f"{plant.host!r} is no host name.", "Name it without https:// and without a port, such as novi-sad.example."
        )
    if not plant.name.strip() or not plant.name.isprintable() or len(plant.name) > 100:
        raise Invalid("The name of the plant is empty, too long or not printable.", "Take up to 100 characters.")


def add(connection: psycopg.Connection[Any], plant: Plant) -> None:
    """Add a plant to the list, which is made if there is none. Raises `Conflict` where key, schema or host are in use."""
    connection.execute(_TABLE)
    try:
        connection.execute(
            f"INSERT INTO inband.plant ({_COLUMNS}) VALUES (%s, %s, %s, %s, %s, %s)",  # noqa: S608 - our own
            plant,
        )
    except psycopg.errors.UniqueViolation as error:
        column = (error.diag.constraint_name or "").removeprefix("plant_").removesuffix("_key")
        taken = {"schema": f"schema {plant.schema}", "host": f"host name {plant.host}"}.get(column, f"key {plant.key}")
        raise Conflict(
            f"Another plant has the {taken} already.", "`inband plant list` shows them all; take another."
        ) from None


def remove(connection: psycopg.Connection[Any], key: str) -> None:
    """Take a plant off the list; its schema stays as it is. Raises `NotFound`."""
    plant_named(connection, key)
    connection.execute("DELETE FROM inband.plant WHERE key = %s", (key,))
