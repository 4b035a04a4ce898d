"""Writing an entry of the record of changes on a connection of the driver: a command of one statement needs no more."""

from contextvars import ContextVar
from typing import Any, NamedTuple

from psycopg import Connection
from psycopg.types.json import Jsonb

_INSERT = """
INSERT INTO audit_entry (actor, person_id, key_id, action, subject, before, after, why, device_id)
VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s)
"""


class Acting(NamedTuple):
    """The numbers of who acts: of a person or of a key; and of the station device where a person has identified themselves."""

    person_id: int | None = None
    key_id: int | None = None
    device_id: int | None = None


NOBODY = Acting()
# Set where a caller is recognised and seen by everything that this request does: whatever is recorded has the right number,
# also where an action is handed a name only.
acting: ContextVar[Acting] = ContextVar("acting", default=NOBODY)


def write(
    connection: Connection[Any],
    actor: str,
    action: str,
    subject: str,
    before: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
    why: str | None = None,
    *,
    by: Acting | None = None,
) -> None:
    """Record a change; see `app.access.audit.actions.record`, which takes a session."""
    by = by or acting.get()
    values = [None if side is None else Jsonb(side) for side in (before, after)]
    connection.execute(_INSERT, [actor, by.person_id, by.key_id, action, subject, *values, why or None, by.device_id])
