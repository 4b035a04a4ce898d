"""Making a key, on a connection of the driver: the command `inband key add` is to need no more than that.

A secret is 256 random bits, so its plain SHA-256 is as good as unguessable and the table holds no secret.
"""

import hashlib
import secrets
from typing import Any, NamedTuple

from psycopg import Connection

from app.access import names
from app.access.audit.entry_actions import write
from app.errors import NotFound
from app.language.i18n import _

PREFIX = "inband_"
"""Makes a leaked key recognisable to people and scanners."""


class NewKey(NamedTuple):
    """A key just made; the secret is shown only this once."""

    id: int
    secret: str


def new_secret() -> str:
    """A secret nobody has had before."""
    return PREFIX + secrets.token_urlsafe(32)


def digest(secret: str) -> bytes:
    """Stored digest of a secret."""
    return hashlib.sha256(secret.encode("utf-8", "surrogatepass")).digest()


def subject_of(machine: str | None) -> str:
    """Name what the record of changes tells of a key: its machine, or people."""
    return "people" if machine is None else f"machine/{machine}"


def insert_key(
    connection: Connection[Any], *, name: str, actor: str, role: str | None = None, machine: str | None = None
) -> NewKey:
    """Make a key with a role, or one of a machine (named by its key), in the transaction of this connection.

    Raises `Invalid` for a name that cannot be used, `NotFound` for a machine that is not there.
    """
    name = names.seen(name)
    if (role is None) == (machine is None):
        raise ValueError("a key has either a role or a machine")
    machine_id = None
    if machine is not None:
        row = connection.execute("SELECT id FROM machine WHERE key = %s", [machine]).fetchone()
        if row is None:
            raise NotFound(
                _("There is no machine {key}.").format(key=repr(machine)), _("GET /api/v1/machines lists them.")
            )
        (machine_id,) = row
    secret = new_secret()
    (key_id,) = connection.execute(
        "INSERT INTO api_key (secret_hash, name, role, machine_id) VALUES (%s, %s, %s, %s) RETURNING id",
        [digest(secret), name, role, machine_id],
    ).fetchone() or (0,)
    after = {"id": key_id, "name": name} | ({"role": role} if role else {})
    write(connection, actor, "key made", subject_of(machine), None, after)
    return NewKey(key_id, secret)
