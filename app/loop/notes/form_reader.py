"""The form of a note, read and written."""

from collections.abc import Mapping

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import Invalid
from app.files.formats import cell_values
from app.language.times import plant_zone
from app.loop.notes import actions
from app.loop.notes.queries import NoteRow
from app.loop.notes.schemas import NoteIn
from app.web.forms import typed


def write_as_typed(session: Session, form: Mapping[str, str], caller: Caller) -> NoteRow:
    """Write a note as the person typed it; its time by the plant's clock, now where it is left empty.

    Sent twice, it is the same note. Raises what `actions.write_note` raises, and `Invalid` for the form.
    """
    time = form.get("at", "").strip()
    try:
        at = cell_values.moment(time, plant_zone(), fold=0) if time else None
    except cell_values.Unreadable as error:
        raise Invalid.at("at", str(error)) from None
    return actions.write_note(session, typed(NoteIn, form, at=at), caller).row
