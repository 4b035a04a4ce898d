"""Queries of plans, the catalogue, and acknowledged alarms by cause. Never writes."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import Session

from app.core.period import ALWAYS, Period
from app.core.reaction import Handled, Share, pareto
from app.db.period import in_period
from app.errors import NotFound
from app.language.i18n import _
from app.loop.alarms import ended_queries as endings
from app.loop.tables.alarms import Alarm
from app.loop.tables.reactions import CatalogueEntry, ReactionPicture, ReactionPlan
from app.loop.tables.readings import Reading

MOST_ALARMS = 5_000


def plan(session: Session, number: int, version: int | None = None) -> ReactionPlan:
    """A version of a plan, the last one if none is named. Raises `NotFound`."""
    query = select(ReactionPlan).where(ReactionPlan.id == number).order_by(ReactionPlan.version.desc()).limit(1)
    if version is not None:
        query = query.where(ReactionPlan.version == version)
    found = session.scalars(query).one_or_none()
    if found is None:
        raise NotFound(_("There is no such reaction plan."), _("GET /api/v1/reactions/plans lists them."))
    return found


def versions(
    session: Session, number: int, before: int | None = None, limit: int | None = None
) -> Sequence[ReactionPlan]:
    """The versions of a plan, the newest first. Raises `NotFound`."""
    plan(session, number)
    query = select(ReactionPlan).where(ReactionPlan.id == number)
    if before is not None:
        query = query.where(ReactionPlan.version < before)
    return session.scalars(query.order_by(ReactionPlan.version.desc()).limit(limit)).all()


def hold_plans(session: Session, _given: Mapping[str, Any] | None = None) -> None:
    """Let nobody else change plans until the transaction ends: no two may be for the same alarms."""
    session.execute(select(func.pg_advisory_xact_lock(7292)))


def picture(session: Session, digest: str) -> ReactionPicture:
    """A picture; what it shows is not read yet. Raises `NotFound`."""
    found = session.get(ReactionPicture, digest)
    if found is None:
        raise NotFound(_("There is no such picture."), _("Name the `digest` of a picture that was sent before."))
    return found


def pictures_there(session: Session, digests: Iterable[str]) -> set[str]:
    """Those of these pictures that are stored."""
    return set(session.scalars(select(ReactionPicture.digest).where(ReactionPicture.digest.in_(list(digests)))))


def catalogue(session: Session, after: int = 0, limit: int | None = None) -> Sequence[CatalogueEntry]:
    """Causes and corrective actions, retired ones too, in the order in which they were added."""
    query = select(CatalogueEntry).where(CatalogueEntry.id > after).order_by(CatalogueEntry.id).limit(limit)
    return session.scalars(query).all()


def entry(session: Session, number: int, *, hold: bool = False) -> CatalogueEntry:
    """An entry of the catalogue. hold: until the transaction ends. Raises `NotFound`."""
    found = session.get(CatalogueEntry, number, with_for_update=hold or None, populate_existing=True)
    if found is None:
        raise NotFound(
            _("The catalogue has no entry {number}.").format(number=number),
            _("GET /api/v1/reactions/catalogue lists them."),
        )
    return found


class Pareto(NamedTuple):
    """Causes of alarms. alarms: in it; more: the period holds older ones. names: of the causes, by number."""

    shares: list[Share]
    alarms: int
    more: bool
    names: dict[int, str]


def causes_of_alarms(
    session: Session,
    *,
    machine_id: int | None = None,
    characteristic_id: int | None = None,
    kind: str | None = None,
    period: Period = ALWAYS,
    which: Sequence[ColumnElement[bool]] = (),
) -> Pareto:
    """Acknowledged alarms that were raised in the period, the newest `MOST_ALARMS` of them, by cause. which: conditions besides.

    One that ended by itself has no cause that anybody was asked for, and is not counted.
    """
    recovered = (
        select(Reading.received_at)
        .where(
            Reading.machine_id == Alarm.machine_id,
            Reading.characteristic_id == Alarm.characteristic_id,
            Reading.sequence > func.coalesce(Alarm.last_sequence, Alarm.sequence),
            func.coalesce(func.cardinality(Reading.alarms), 0) == 0,
        )
        .order_by(Reading.sequence)
        .limit(1)
        .scalar_subquery()
    )
    query = select(Alarm.cause, Alarm.raised_at, Alarm.acknowledged_at, recovered).where(
        Alarm.acknowledged_at.is_not(None),
        ~endings.is_by_itself(),
        in_period(Alarm.raised_at, period),
        *which,
    )
    if machine_id is not None:
        query = query.where(Alarm.machine_id == machine_id)
    if characteristic_id is not None:
        query = query.where(Alarm.characteristic_id == characteristic_id)
    if kind is not None:
        query = query.where(Alarm.kind == kind)
    rows = session.execute(query.order_by(Alarm.id.desc()).limit(MOST_ALARMS + 1)).all()
    counted = rows[:MOST_ALARMS]
    shares = pareto(
        Handled(cause, _seconds(raised, acknowledged) or 0.0, _seconds(raised, again))
        for cause, raised, acknowledged, again in counted
    )
    return Pareto(shares, len(counted), len(rows) > MOST_ALARMS, _names(session))


def _names(session: Session) -> dict[int, str]:
    return {row.id: row.name for row in session.execute(select(CatalogueEntry.id, CatalogueEntry.name))}


def _seconds(since: datetime, at: datetime | None) -> float | None:
    return None if at is None else max((at - since).total_seconds(), 0.0)
