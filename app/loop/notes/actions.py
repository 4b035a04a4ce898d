"""Writing a note, and withdrawing it."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, Invalid, NotAllowed, NotFound
from app.language.formatting import as_read
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic, characteristic_named
from app.loop.machines.queries import machine_named
from app.loop.notes import queries
from app.loop.notes.queries import NoteRow
from app.loop.notes.schemas import NoteIn
from app.loop.tables.notes import Note
from app.web.created import Created, sent_before


def write_note(session: Session, given: NoteIn, caller: Caller) -> Created[NoteRow]:
    """Write a note. It needs no lock: nothing is decided by it.

    Raises `NotFound`; `Invalid` for a characteristic of another machine; `Conflict` for a key that was used otherwise.
    """
    current = characteristic_named(session, given.characteristic) if given.characteristic else None
    machine = current.machine if current else machine_named(session, given.machine or "")
    if given.machine not in (None, machine.key):
        raise Invalid.at("machine", _("this characteristic is of machine {key}").format(key=machine.key))
    moment = _moment_of(session, current, given.sequence) if current and given.sequence else datetime.now(UTC)
    at = given.at or moment
    values = {
        "machine_id": machine.id,
        "characteristic_id": current.characteristic.id if current else None,
        "sequence": given.sequence,
        "at": at,
        "text": given.text,
        "key": given.key,
        "written_by": caller.name,
        "person_id": caller.person_id,
        "key_id": caller.key_id,
    }
    number = session.scalar(insert(Note).values(values).on_conflict_do_nothing().returning(Note.id))
    if number is None:
        return _sent_before(session, values, timed=given.at is not None)
    about: dict[str, Any] = {"machine": machine.key, "characteristic": given.characteristic}
    after = about | {"at": at.isoformat(), "text": given.text}
    record(session, caller.name, "note written", f"note/{number}", None, after)
    publish(session, {"kind": "note", **about, "id": number, "state": "written"})
    return Created(queries.note(session, number))


def _moment_of(session: Session, current: CurrentCharacteristic, sequence: int) -> datetime:
    reading = queries.reading(session, current.characteristic, sequence)
    if reading is None:
        raise NotFound(
            _("Characteristic {key} has no reading {sequence}.").format(
                key=current.characteristic.key, sequence=sequence
            ),
            _("Name one of its readings, or a moment in `at`."),
        )
    return reading.measured_at


def _sent_before(session: Session, values: dict[str, Any], *, timed: bool) -> Created[NoteRow]:
    """The note of this key. timed: the moment was said, so it is compared too."""
    number = session.scalars(
        select(Note.id).where(Note.machine_id == values["machine_id"], Note.key == values["key"])
    ).one()
    row = queries.note(session, number)
    compared = ["characteristic_id", "sequence", "text", *(["at"] if timed else [])]
    same = all(getattr(row.note, name) == values[name] for name in compared)
    return sent_before(row, values["key"], _("note"), same=same, id=number)


def withdraw_note(session: Session, number: int, reason: str, caller: Caller) -> NoteRow:
    """Withdraw a note: it leaves charts and lists, and stays on record.

    Raises `NotFound`; `NotAllowed` for one that someone else has written; `Conflict` for one that is withdrawn.
    """
    session.execute(select(Note.id).where(Note.id == number).with_for_update())
    row = queries.note(session, number)
    note = row.note
    if not queries.may_withdraw(note, caller):
        raise NotAllowed(
            _("Note {number} was written by {name}.").format(number=number, name=note.written_by),
            _("Its author can withdraw it, or an engineer."),
        )
    if note.withdrawn_at is not None:
        raise Conflict(
            _("Note {number} was withdrawn by {name} at {at}.").format(
                number=number, name=note.withdrawn_by, at=as_read(note.withdrawn_at, "minutes")
            ),
            _("There is nothing left to do."),
        )
    note.withdrawn_at, note.withdrawn_by, note.withdrawn_why = datetime.now(UTC), caller.name, reason
    record(session, caller.name, "note withdrawn", f"note/{number}", {"text": note.text}, None, reason)
    key = row.characteristic.key if row.characteristic else None
    publish(
        session,
        {"kind": "note", "machine": row.machine.key, "characteristic": key, "id": number, "state": "withdrawn"},
    )
    return row
