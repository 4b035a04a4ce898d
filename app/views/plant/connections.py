"""Last exchanges between a machine and the server, as far as they are recorded. Never writes."""

from datetime import datetime
from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.language.i18n import _
from app.loop.connections import queries as bridges
from app.loop.connections import wording
from app.loop.machines import keys
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import Correction


class Connection(NamedTuple):
    """One way of the machine to the server: its name, since when nothing came, more in words, and the page about it."""

    what: str
    at: datetime | None
    more: str
    path: str = ""


def connections_of(session: Session, machine: Machine) -> list[Connection]:
    """Return the last reading, the last correction that was confirmed, the last one fetched as text, and the newest key."""
    received = session.scalar(select(func.max(Stream.last_received_at)).where(Stream.machine_id == machine.id))
    applied, fetched = session.execute(
        select(func.max(Correction.applied_at), func.max(Correction.fetched_at)).where(
            Correction.machine_id == machine.id
        )
    ).one()
    in_use = [key for key in keys.machine_keys(session, machine.id) if key.revoked_at is None]
    bridge = bridges.find_connection(session, machine.id)
    heard = [] if bridge is None else [_bridge(machine, bridge)]
    return [
        *heard,
        Connection(_("Last reading received"), received, ""),
        Connection(_("Last correction confirmed"), applied, ""),
        Connection(_("Last corrections fetched as program text"), fetched, ""),
        Connection(
            _("Newest key in use"),
            max((key.created_at for key in in_use), default=None),
            ", ".join(key.name for key in in_use[:5]) or _("Without a key the machine cannot push readings."),
        ),
    ]


def _bridge(machine: Machine, row: bridges.ConnectionRow) -> Connection:
    detail = row.connection.detail or wording.explained(f"connection_{row.connection.state}")
    return Connection(_("Bridge heard"), row.connection.received_at, detail, f"/machines/{machine.key}/connection")
