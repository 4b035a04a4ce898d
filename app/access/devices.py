"""Devices bound to machines: a tablet that shows the station of one machine for as long as it is used.

An administrator makes a one-time code; who types it on the device binds it. The device itself may do nothing but look: anyone who
acts there identifies themselves for that one action (`app.access.identification`).
"""

import secrets
from collections.abc import Collection, Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy import select, text, update
from sqlalchemy.orm import Session
from sqlalchemy.sql import func

from app.access import names
from app.access.audit.actions import record
from app.access.audit.tables import AuditEntry
from app.access.new_keys import digest
from app.access.queries import PLACE_KEPT
from app.access.tables import Person, StationDevice
from app.errors import Invalid, NotFound
from app.language.i18n import _

CODE_LASTS = timedelta(minutes=30)
LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
CODE_LENGTH = 12
"""Letters of a code: 60 bits, which nobody guesses in the half hour that it lasts."""
UNUSED = PLACE_KEPT
"""Time without use after which a device is no longer bound."""
RECENT = 6


class Device(NamedTuple):
    """A device that is bound; machine: the key of its machine."""

    id: int
    name: str
    machine_id: int
    machine: str
    csrf: str


def make_code(session: Session, machine: str, name: str, actor: str) -> str:
    """Make a one-time code that binds a device to this machine. Returns it, this once. Raises `Invalid`, `NotFound`."""
    name = names.seen(name)
    machine_id = session.scalar(text("SELECT id FROM machine WHERE key = :key"), {"key": machine})
    if machine_id is None:
        raise NotFound(_("There is no machine {key}.").format(key=repr(machine)), _("Choose one of the list."))
    code = "".join(secrets.choice(LETTERS) for _letter in range(CODE_LENGTH))
    device = StationDevice(machine_id=machine_id, name=name, code_hash=digest(code), csrf=secrets.token_urlsafe(32))
    session.add(device)
    session.flush()
    record(session, actor, "station code made", f"machine/{machine}/stations/{device.id}", None, {"name": name})
    return "-".join(code[at : at + 4] for at in range(0, CODE_LENGTH, 4))


def bind(session: Session, code: str) -> tuple[Device, str]:
    """Bind the device on which the code was typed; its token, for the cookie alone. Raises `Invalid`."""
    typed = "".join(letter for letter in code.upper() if letter.isalnum())
    token = secrets.token_urlsafe(32)
    bound = session.scalar(
        update(StationDevice)
        .where(
            StationDevice.code_hash == digest(typed),
            StationDevice.revoked_at.is_(None),
            StationDevice.created_at > func.now() - CODE_LASTS,
        )
        .values(code_hash=None, token_hash=digest(token), bound_at=func.now(), last_used_at=func.now())
        .returning(StationDevice.id)
    )
    device = device_of(session, token) if bound is not None else None
    if device is None:
        raise Invalid.at(
            "code",
            _("is not a code of this server, was used already, or is older than {n} minutes").format(
                n=round(CODE_LASTS.total_seconds() / 60)
            ),
            do=_("Ask an administrator for a new one: Set-up, Stations."),
        )
    record(session, device.name, "station device bound", f"machine/{device.machine}/stations/{device.id}")
    return device, token


_OF_TOKEN = text("""
SELECT d.id, d.name, d.machine_id, m.key, d.csrf FROM station_device d JOIN machine m ON m.id = d.machine_id
WHERE d.token_hash = :token AND d.revoked_at IS NULL AND d.last_used_at > now() - CAST(:unused AS interval)
""")
_USED = text(
    "UPDATE station_device SET last_used_at = now() WHERE id = :id AND last_used_at < now() - interval '1 minute'"
)


def device_of(session: Session, token: str) -> Device | None:
    """Return the device with this token, and note that it is used; None if it is not bound any more."""
    row = session.execute(_OF_TOKEN, {"token": digest(token), "unused": UNUSED}).one_or_none()
    if row is None:
        return None
    session.execute(_USED, {"id": row.id})
    return Device(*row)


def revoke(session: Session, device_id: int, actor: str) -> None:
    """End a device, or the code that was not used yet. Revoking twice is harmless. Raises `NotFound`."""
    device = session.get(StationDevice, device_id)
    if device is None:
        raise NotFound(_("There is no such device."), _("Look at the list in Set-up, Stations."))
    if device.revoked_at is None:
        device.revoked_at = session.scalar(select(func.now()))
        record(session, actor, "station device revoked", f"station/{device.id}", {"name": device.name}, None)


class DeviceRow(NamedTuple):
    """A device as Set-up lists it. code_until: the end of a code that was not used yet."""

    id: int
    name: str
    machine_id: int
    bound_at: datetime | None
    last_used_at: datetime | None
    code_until: datetime | None


def devices(session: Session) -> list[DeviceRow]:
    """Return the devices that are bound and the codes that can be used still, the oldest first."""
    rows = session.execute(
        select(
            StationDevice.id,
            StationDevice.name,
            StationDevice.machine_id,
            StationDevice.bound_at,
            StationDevice.last_used_at,
            StationDevice.created_at,
        )
        .where(
            StationDevice.revoked_at.is_(None),
            (StationDevice.last_used_at > func.now() - UNUSED)
            | (StationDevice.bound_at.is_(None) & (StationDevice.created_at > func.now() - CODE_LASTS)),
        )
        .order_by(StationDevice.id)
    )
    return [
        DeviceRow(number, name, machine, bound, used, None if bound else created + CODE_LASTS)
        for number, name, machine, bound, used, created in rows
    ]


def names_of(session: Session, numbers: Collection[int]) -> dict[int, str]:
    """Return what devices are called, those too that were revoked."""
    found = session.execute(select(StationDevice.id, StationDevice.name).where(StationDevice.id.in_(numbers)))
    return {row.id: row.name for row in found}


def people_at(session: Session, device_id: int) -> Sequence[str]:
    """Return the names of those who have acted on this device lately, the last one first."""
    entries = (
        select(AuditEntry.id, AuditEntry.person_id)
        .where(AuditEntry.device_id == device_id)
        .order_by(AuditEntry.id.desc())
        .limit(200)
        .subquery()
    )
    last = func.max(entries.c.id)
    return session.scalars(
        select(Person.name)
        .join(entries, entries.c.person_id == Person.id)
        .where(Person.disabled_at.is_(None))
        .group_by(Person.name)
        .order_by(last.desc())
        .limit(RECENT)
    ).all()
