"""Alignments as they were found. Never writes."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.alignments.tables import Alignment
from app.errors import NotFound
from app.machines.tables import Machine
from app.readings import queries as readings
from app.web.fields import LARGEST_ID
from app.web.i18n import _


def alignment(session: Session, number: int, only: int | None = None) -> Alignment:
    """One alignment; ``only`` of this machine, for a machine's key. Raises `NotFound`."""
    found = None
    if 0 < number <= LARGEST_ID:
        found = session.scalars(select(Alignment).where(Alignment.id == number)).one_or_none()
    if found is None or (only is not None and found.machine_id != only):
        raise NotFound(
            _("There is no alignment {number}.").format(number=number), _("GET /api/v1/alignments lists them.")
        )
    return found


def by_key(session: Session, machine: Machine, key: str) -> Alignment | None:
    """The alignment that was sent with this key."""
    return session.scalars(
        select(Alignment).where(Alignment.machine_id == machine.id, Alignment.key == key)
    ).one_or_none()


def alignments(
    session: Session,
    machine_id: int | None = None,
    *,
    after: int = 0,
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[Alignment]:
    """Alignments of all machines or of one, in the order in which they came."""
    wanted = select(Alignment).where(Alignment.id > after).limit(limit)
    if machine_id is not None:
        wanted = wanted.where(Alignment.machine_id == machine_id)
    if before is not None:
        wanted = wanted.where(Alignment.id < before)
    return list(session.scalars(wanted.order_by(Alignment.id.desc() if newest_first else Alignment.id)))


def recomputed_as(session: Session, found: Alignment) -> list[int]:
    """The numbers of the alignments that the touches of this one were computed again as."""
    return list(
        session.scalars(
            select(Alignment.id)
            .where(Alignment.machine_id == found.machine_id, Alignment.recomputed_from == found.id)
            .order_by(Alignment.id)
        )
    )


def pushed(session: Session, found: Alignment) -> list[tuple[str, str, int | None, str | None]]:
    """Of a, b, c those that are, or become, readings: with characteristic, sequence, and why not."""
    keys = {f"alignment:{found.id}:{name}": name for name in "abc"}
    rows = readings.readings_of_results(session, keys)
    return [
        (name, rows[key][0], rows[key][1].sequence, rows[key][1].refused) for key, name in keys.items() if key in rows
    ]
