"""Alignments as they were found. Never writes."""

from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.alignments.tables import Alignment
from app.errors import NotFound
from app.machines.tables import Machine
from app.readings import queries as readings
from app.web.fields import LARGEST_ID
from app.web.i18n import _

SHOWN = 200  # alignments of a history


class SetUp(NamedTuple):
    """What was aligned under one name on one machine: the newest alignment, and how many there are."""

    newest: Alignment
    alignments: int


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


def set_ups(session: Session, machine_id: int | None = None, limit: int = 100) -> list[SetUp]:
    """Every name with its newest alignment, the one that came last first."""
    counted = (
        select(func.max(Alignment.id).label("id"), func.count().label("count"))
        .where(Alignment.name.is_not(None))
        .group_by(Alignment.machine_id, Alignment.name)
        .order_by(func.max(Alignment.id).desc())
        .limit(limit)
    )
    if machine_id is not None:
        counted = counted.where(Alignment.machine_id == machine_id)
    latest = counted.subquery()
    rows = session.execute(
        select(Alignment, latest.c.count).join(latest, latest.c.id == Alignment.id).order_by(Alignment.id.desc())
    )
    return [SetUp(*row) for row in rows]


def history(session: Session, machine_id: int, name: str) -> list[Alignment]:
    """The last alignments of one name in the order in which they were touched.

    Of touches that were computed again the last result counts.
    """
    here = Alignment.machine_id == machine_id
    kept = (
        select(Alignment.id, Alignment.id.label("touched"))
        .where(here, Alignment.name == name, Alignment.recomputed_from.is_(None))
        .cte("kept", recursive=True)
    )
    kept = kept.union_all(select(Alignment.id, kept.c.touched).where(here, Alignment.recomputed_from == kept.c.id))
    last = select(func.max(kept.c.id)).group_by(kept.c.touched)
    rows = session.scalars(
        select(Alignment).where(here, Alignment.id.in_(last)).order_by(Alignment.id.desc()).limit(SHOWN)
    )
    return sorted(rows, key=lambda each: (each.aligned_at, each.id))
