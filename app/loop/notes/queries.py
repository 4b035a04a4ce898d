"""Notes of machines and characteristics. Never writes."""

from typing import NamedTuple

from sqlalchemy import ColumnElement, Select, or_, select
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.core.period import ALWAYS, Period
from app.db.period import in_period
from app.db.text import holds_words
from app.errors import NotFound
from app.language.i18n import _
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.notes import Note
from app.loop.tables.readings import Reading

NEWEST = 5  # on the page of what they are about


class NoteRow(NamedTuple):
    """A note, its machine, and the characteristic where it is of one."""

    note: Note
    machine: Machine
    characteristic: Characteristic | None

    @property
    def home(self) -> str:
        """The page of what it is about."""
        if self.characteristic is None:
            return f"/machines/{self.machine.key}"
        return f"/characteristics/{self.characteristic.key}"

    @property
    def about(self) -> str:
        """The name of what it is about."""
        return self.machine.name if self.characteristic is None else self.characteristic.name


def on_charts_of(characteristic_id: int) -> ColumnElement[bool]:
    """The notes of a characteristic and those of its whole machine, as a condition beside that on the machine."""
    return or_(Note.characteristic_id == characteristic_id, Note.characteristic_id.is_(None))


_ROWS: Select[Note, Machine, Characteristic | None] = (
    select(Note, Machine, Characteristic)
    .join(Machine, Machine.id == Note.machine_id)
    .outerjoin(
        Characteristic, (Characteristic.machine_id == Note.machine_id) & (Characteristic.id == Note.characteristic_id)
    )
)


def note(session: Session, number: int) -> NoteRow:
    """One note, withdrawn or not. Raises `NotFound`."""
    row = session.execute(_ROWS.where(Note.id == number)).one_or_none()
    if row is None:
        raise NotFound(
            _("There is no note {number}.").format(number=number), _("Check it; GET /api/v1/notes lists them.")
        )
    return NoteRow(*row)


def notes(
    session: Session,
    *,
    machine_id: int | None = None,
    characteristic: Characteristic | None = None,
    period: Period = ALWAYS,
    named: str = "",
    holding: str = "",
    withdrawn: bool = False,
    before: int | None = None,
    limit: int = 100,
) -> list[NoteRow]:
    """Notes, the last written first.

    characteristic: those on its charts, its machine's too. period: of the moments that they are about. named: those whose
    text holds this. holding: those in whose text, author or name of what they are about these words are found. withdrawn: these as well.
    """
    query = _ROWS.order_by(Note.id.desc()).limit(limit)
    if machine_id is not None:
        query = query.where(Note.machine_id == machine_id)
    if characteristic is not None:
        query = query.where(Note.machine_id == characteristic.machine_id, on_charts_of(characteristic.id))
    if period.bounded:
        query = query.where(in_period(Note.at, period))
    if named:
        query = query.where(Note.text.icontains(named, autoescape=True))
    names = (Note.text, Note.written_by, Machine.name, Characteristic.name)
    query = query.where(*holds_words(holding, *names))
    if not withdrawn:
        query = query.where(Note.withdrawn_at.is_(None))
    if before is not None:
        query = query.where(Note.id < before)
    return [NoteRow(*row) for row in session.execute(query)]


def reading(session: Session, characteristic: Characteristic, sequence: int) -> Reading | None:
    """The reading that a note is about; None where there is none of this number."""
    return session.get(Reading, (characteristic.machine_id, characteristic.id, sequence))


def may_withdraw(note: Note, caller: Caller) -> bool:
    """Tell if the caller has written it, or is an engineer; who may only look has written none."""
    own = (note.person_id, note.key_id) == (caller.person_id, caller.key_id)
    return caller.may("engineer") or (caller.may("operator") and own)
