"""Actions of people on stored readings. The readings themselves are written by the writer alone."""

from collections.abc import Sequence
from datetime import UTC, datetime

from sqlalchemy import select, update
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit import actions as audit
from app.db.events import publish
from app.errors import Conflict
from app.language.i18n import _
from app.language.times import in_sentence
from app.loop.characteristics.correction_queries import correction_changed
from app.loop.machines.queries import lock_machines
from app.loop.readings import queries
from app.loop.readings.records import Entry
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Exclusion, Reading, Stream
from app.loop.tables.tools import OUTSTANDING, Correction


def exclude(session: Session, entry: Entry, sequence: int, actor: str, reason: str) -> Exclusion:
    """Take a reading out of the statistics, never out of the record.

    Raises `NotFound`, and `Conflict` when it has been excluded already, saying by whom.
    """
    queries.record_of(session, entry, sequence)
    lock_machines(session, [entry.machine_id])  # before the first row, as an acknowledgement does
    exclusion: Exclusion | None = session.scalar(
        insert(Exclusion)
        .values(
            machine_id=entry.machine_id,
            characteristic_id=entry.characteristic_id,
            sequence=sequence,
            actor=actor,
            reason=reason,
        )
        .on_conflict_do_nothing()
        .returning(Exclusion)
    )
    if exclusion is None:
        first = session.scalars(
            select(Exclusion).where(
                Exclusion.machine_id == entry.machine_id,
                Exclusion.characteristic_id == entry.characteristic_id,
                Exclusion.sequence == sequence,
            )
        ).one()
        raise Conflict(
            _("Reading %(sequence)s of %(characteristic)s was excluded by %(actor)s already, on %(at)s: %(reason)s")
            % {
                "sequence": sequence,
                "characteristic": entry.characteristic,
                "actor": first.actor,
                "at": in_sentence(first.at),
                "reason": first.reason,
            },
            _("There is nothing left to do."),
        )
    _forget_level(session, entry, [sequence])
    audit.record(
        session,
        actor,
        "reading excluded",
        f"reading/{entry.characteristic}/{sequence}",
        before={"excluded": False},
        after={"excluded": True} | _withdraw(session, entry, sequence, actor, reason),
        why=reason,
    )
    publish(session, entry.changed(sequence) | {"excluded": True})
    return exclusion


def exclude_all(session: Session, entry: Entry, sequences: Sequence[int], actor: str, reason: str) -> list[int]:
    """Take several readings of one characteristic out of the statistics at once; those excluded already are left alone.

    Returns the ones that were excluded now.
    """
    lock_machines(session, [entry.machine_id])
    at = {"machine_id": entry.machine_id, "characteristic_id": entry.characteristic_id}
    excluded = sorted(
        session.scalars(
            insert(Exclusion)
            .values([{**at, "sequence": sequence, "actor": actor, "reason": reason} for sequence in sequences])
            .on_conflict_do_nothing()
            .returning(Exclusion.sequence)
        )
        if sequences
        else ()
    )
    if excluded:
        _forget_level(session, entry, excluded)
        audit.record(
            session,
            actor,
            "readings excluded",
            f"reading/{entry.characteristic}",
            before={"excluded": False},
            after={"excluded": True, "sequences": excluded},
            why=reason,
        )
        publish(session, entry.changed(excluded[-1]) | {"excluded": True})
    return excluded


def _withdraw(session: Session, entry: Entry, sequence: int, actor: str, reason: str) -> dict[str, list[int]]:
    """Reject the correction that a reading asked for, where it is on its way: a false reading is no reason for it.

    What is held, its alarm decides; program text that was fetched may be in the control by now. Returns what the record says.
    """
    machine = session.get_one(Machine, entry.machine_id)
    asked = select(Correction).where(
        Correction.machine_id == entry.machine_id,
        Correction.characteristic_id == entry.characteristic_id,
        Correction.sequence == sequence,
        Correction.status.in_(OUTSTANDING),
        Correction.fetched_at.is_(None),
    )
    rows = session.scalars(asked.order_by(Correction.number).execution_options(populate_existing=True)).all()
    for correction in rows:
        correction.status, correction.reason = "rejected", reason
        correction.decided_at, correction.decided_by = datetime.now(UTC), actor
        publish(session, correction_changed(session, machine, correction))
    return {"rejected": [correction.number for correction in rows]} if rows else {}


REMEMBERED = 8  # readings after which what one of them was makes no difference to the level (1/2 to the 8th of it)
NOT_OF_LEVEL = (
    *("implausible", "tool_worn_held", "before_tool_change"),
    *("probe_fault", "first_move_triggered", "touch_fault", "beyond_natural_limit"),
)


def _forget_level(session: Session, entry: Entry, sequences: Sequence[int]) -> None:
    """A level that readings taken out have made is not believed any more: the next reading begins it again.

    The machine is locked.
    """
    at = (Stream.machine_id == entry.machine_id, Stream.characteristic_id == entry.characteristic_id)
    newest = session.scalar(select(Stream.level_sequence).where(*at))
    if newest is None or not any(newest - REMEMBERED < sequence <= newest for sequence in sequences):
        return
    made_it = session.scalar(
        select(Reading.sequence)
        .where(
            Reading.machine_id == entry.machine_id,
            Reading.characteristic_id == entry.characteristic_id,
            Reading.sequence.in_(sequences),
            Reading.sequence > newest - REMEMBERED,
            Reading.sequence <= newest,
            Reading.code.not_in(NOT_OF_LEVEL),
        )
        .limit(1)
    )
    if made_it is not None:
        session.execute(
            update(Stream)
            .where(*at)
            .values(level=None, level_sequence=None)
            .execution_options(synchronize_session=False)
        )
