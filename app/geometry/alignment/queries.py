"""Alignments as they were found. Never writes."""

from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.db.text import holds_words
from app.errors import NotFound
from app.geometry.alignment.tables import Alignment
from app.language.i18n import _
from app.loop.readings import queries as readings
from app.loop.tables.machines import Machine
from app.web.fields import LARGEST_ID

SHOWN = 200  # alignments of a history


class SetUp(NamedTuple):
    """Alignments under one name on one machine: the newest, and their number."""

    newest: Alignment
    alignments: int


def subject_of(alignment: Alignment) -> str:
    """The name of an alignment in the record of changes and in acknowledgements."""
    return f"alignment/{alignment.id}"


def alignment(session: Session, number: int, only: int | None = None) -> Alignment:
    """One alignment; ``only`` of this machine, for a machine's key. Raises `NotFound`."""
    row = None
    if 0 < number <= LARGEST_ID:
        row = session.scalars(select(Alignment).where(Alignment.id == number)).one_or_none()
    if row is None or (only is not None and row.machine_id != only):
        raise NotFound(
            _("There is no alignment {number}.").format(number=number), _("GET /api/v1/alignments lists them.")
        )
    return row


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
    holding: str = "",
    before: int | None = None,
    newest_first: bool = False,
    limit: int = 100,
) -> list[Alignment]:
    """Alignments of all machines or of one, in the order in which they came."""
    query = select(Alignment).where(Alignment.id > after).limit(limit)
    if holding:
        names = (Alignment.name, Alignment.part, Machine.name, Machine.key)
        query = query.join(Machine, Machine.id == Alignment.machine_id).where(*holds_words(holding, *names))
    if machine_id is not None:
        query = query.where(Alignment.machine_id == machine_id)
    if before is not None:
        query = query.where(Alignment.id < before)
    return list(session.scalars(query.order_by(Alignment.id.desc() if newest_first else Alignment.id)))


def recomputed_as(session: Session, alignment: Alignment) -> list[int]:
    """The numbers of the alignments that the touches of this one were computed again as."""
    return list(
        session.scalars(
            select(Alignment.id)
            .where(Alignment.machine_id == alignment.machine_id, Alignment.recomputed_from == alignment.id)
            .order_by(Alignment.id)
        )
    )


def pushed(session: Session, alignment: Alignment) -> list[readings.PushedResult]:
    """Values of a, b, c that are, or become, readings."""
    source = f"alignment:{alignment.id}"
    return readings.pushed_results(session, [source], "abc")[source]


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
    chain = (
        select(Alignment.id, Alignment.id.label("touched"))
        .where(here, Alignment.name == name, Alignment.recomputed_from.is_(None))
        .cte("kept", recursive=True)
    )
    chain = chain.union_all(select(Alignment.id, chain.c.touched).where(here, Alignment.recomputed_from == chain.c.id))
    last = select(func.max(chain.c.id)).group_by(chain.c.touched)
    rows = session.scalars(
        select(Alignment).where(here, Alignment.id.in_(last)).order_by(Alignment.id.desc()).limit(SHOWN)
    )
    return sorted(rows, key=lambda row: (row.aligned_at, row.id))
