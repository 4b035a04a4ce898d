"""Who is there and who is signed in. Never writes."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import NamedTuple, cast

from sqlalchemy import and_, func, or_, select
from sqlalchemy.orm import Session

from app.alarms.tables import Alarm
from app.offsets.tables import Correction
from app.people.callers import Caller, Role
from app.people.keys import digest
from app.people.tables import ApiKey, BrowserSession, Invitation, LoginFailure, Person


def signed_in(session: Session, token: str) -> tuple[Caller, dict[str, int]] | None:
    """Whose browser session this token is, and what waits for people: the numbers of the navigation; None if it has ended."""
    active_alarms = select(func.count()).select_from(Alarm).where(Alarm.acknowledged_at.is_(None)).scalar_subquery()
    waiting = (
        select(func.count()).select_from(Correction).where(Correction.status.in_(("held", "awaiting_approval")))
    ).scalar_subquery()
    row = session.execute(
        select(
            Person.id,
            Person.name,
            Person.role,
            BrowserSession.csrf,
            active_alarms.label("active_alarms"),
            waiting.label("waiting_corrections"),
        )
        .join(BrowserSession, BrowserSession.person_id == Person.id)
        .where(
            BrowserSession.token_hash == digest(token),
            BrowserSession.expires_at > func.now(),
            Person.disabled_at.is_(None),
        )
    ).one_or_none()
    if row is None:
        return None
    caller = Caller("person", row.name, role=cast("Role", row.role), person_id=row.id, csrf=row.csrf)
    return caller, {"active_alarms": row.active_alarms, "waiting_corrections": row.waiting_corrections}


def person_named(session: Session, name: str) -> Person | None:
    """By the name, in any spelling of upper and lower case."""
    return session.scalars(select(Person).where(func.lower(Person.name) == func.lower(name))).one_or_none()


def person(session: Session, person_id: int) -> Person | None:
    return session.get(Person, person_id)


class PersonRow(NamedTuple):
    """A person, and when they last signed in on a browser that is still signed in."""

    person: Person
    signed_in_at: datetime | None


def people(session: Session, after: int = 0, limit: int = 1000) -> list[PersonRow]:
    """Everybody, in the order in which they came; the disabled too."""
    last = (
        select(BrowserSession.person_id, func.max(BrowserSession.created_at).label("at"))
        .where(BrowserSession.expires_at > func.now())
        .group_by(BrowserSession.person_id)
        .subquery()
    )
    rows = session.execute(
        select(Person, last.c.at)
        .outerjoin(last, last.c.person_id == Person.id)
        .where(Person.id > after)
        .order_by(Person.id)
        .limit(limit)
    )
    return [PersonRow(row[0], row[1]) for row in rows]


def active_admins(session: Session) -> int:
    """How many people may still administer."""
    return (
        session.scalar(
            select(func.count()).select_from(Person).where(Person.role == "admin", Person.disabled_at.is_(None))
        )
        or 0
    )


def anybody(session: Session) -> bool:
    """Whether there is anyone who could sign in."""
    return session.scalar(select(Person.id).where(Person.disabled_at.is_(None)).limit(1)) is not None


def open_invitation(session: Session, token: str) -> Invitation | None:
    """The invitation of this link, if it was not used and has not expired."""
    return session.scalars(
        select(Invitation).where(
            Invitation.token_hash == digest(token), Invitation.used_at.is_(None), Invitation.expires_at > func.now()
        )
    ).one_or_none()


def open_invitations(session: Session) -> Sequence[Invitation]:
    """Links given out and not used yet."""
    return session.scalars(
        select(Invitation)
        .where(Invitation.used_at.is_(None), Invitation.expires_at > func.now())
        .order_by(Invitation.created_at)
    ).all()


def role_keys(session: Session, after: int = 0, limit: int = 1000) -> Sequence[ApiKey]:
    """The keys that have a role, revoked ones too."""
    return session.scalars(
        select(ApiKey).where(ApiKey.role.is_not(None), ApiKey.id > after).order_by(ApiKey.id).limit(limit)
    ).all()


def machine_keys(session: Session, machine_id: int, after: int = 0, limit: int = 1000) -> Sequence[ApiKey]:
    """The keys of one machine, revoked ones too."""
    return session.scalars(
        select(ApiKey).where(ApiKey.machine_id == machine_id, ApiKey.id > after).order_by(ApiKey.id).limit(limit)
    ).all()


def keys_by_machine(session: Session) -> dict[int, int]:
    """How many keys each machine has that still work, by the machine's id."""
    rows = session.execute(
        select(ApiKey.machine_id, func.count())
        .where(ApiKey.machine_id.is_not(None), ApiKey.revoked_at.is_(None))
        .group_by(ApiKey.machine_id)
    )
    return {machine_id: count for machine_id, count in rows if machine_id is not None}


class Failures(NamedTuple):
    """Failed sign-ins lately: with this name from this address, from this address in all, with this name in all."""

    pair: int
    address: int
    name: int
    last: datetime | None
    now: datetime


def failures(session: Session, name: str, address: str, within: timedelta) -> Failures:
    """Count them by the database's clock, which all processes share."""
    of_name = LoginFailure.name == name
    of_address = LoginFailure.address == address
    row = session.execute(
        select(
            func.count().filter(and_(of_name, of_address)),
            func.count().filter(of_address),
            func.count().filter(of_name),
            func.max(LoginFailure.at),
            func.clock_timestamp(),
        ).where(or_(of_name, of_address), LoginFailure.at > func.clock_timestamp() - within)
    ).one()
    return Failures(*row)
