"""What people do to readings after the fact. The readings themselves are written by the writer alone."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.audit import actions as audit
from app.db.events import publish
from app.errors import Conflict
from app.readings import queries
from app.readings.by_hand.actions import Found as FoundByHand
from app.readings.by_hand.actions import measure as measure_by_hand
from app.readings.records import Entry
from app.readings.tables import Exclusion
from app.web.i18n import _

__all__ = ["FoundByHand", "exclude", "exclude_all", "measure_by_hand"]


def exclude(session: Session, entry: Entry, sequence: int, actor: str, reason: str) -> Exclusion:
    """Take a reading out of the statistics, never out of the record.

    Raises `NotFound`, and `Conflict` when it has been excluded already, saying by whom.
    """
    queries.record_of(session, entry, sequence)
    made: Exclusion | None = session.scalar(
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
    if made is None:
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
                "at": first.at.isoformat(timespec="seconds"),
                "reason": first.reason,
            },
            _("There is nothing left to do."),
        )
    audit.record(
        session,
        actor,
        "reading excluded",
        f"reading/{entry.characteristic}/{sequence}",
        before={"excluded": False},
        after={"excluded": True},
        why=reason,
    )
    publish(
        session,
        {
            "kind": "reading",
            "machine": entry.machine,
            "characteristic": entry.characteristic,
            "sequence": sequence,
            "excluded": True,
        },
    )
    return made


def exclude_all(session: Session, entry: Entry, sequences: Sequence[int], actor: str, reason: str) -> list[int]:
    """Take several readings of one characteristic out of the statistics at once; those excluded already are left alone.

    Returns the ones that were excluded now.
    """
    at = {"machine_id": entry.machine_id, "characteristic_id": entry.characteristic_id}
    made = sorted(
        session.scalars(
            insert(Exclusion)
            .values([{**at, "sequence": sequence, "actor": actor, "reason": reason} for sequence in sequences])
            .on_conflict_do_nothing()
            .returning(Exclusion.sequence)
        )
        if sequences
        else ()
    )
    if made:
        audit.record(
            session,
            actor,
            "readings excluded",
            f"reading/{entry.characteristic}",
            before={"excluded": False},
            after={"excluded": True, "sequences": made},
            why=reason,
        )
        publish(
            session,
            {
                "kind": "reading",
                "machine": entry.machine,
                "characteristic": entry.characteristic,
                "sequence": made[-1],
                "excluded": True,
            },
        )
    return made
