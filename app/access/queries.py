"""People, keys and sign-ins. Never writes."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple, cast

from psycopg import AsyncConnection
from sqlalchemy import ScalarSelect, and_, func, or_, select
from sqlalchemy.orm import Session

from app.access.callers import Caller, Role
from app.access.new_keys import digest
from app.access.tables import ApiKey, Badge, BrowserSession, Invitation, KnownPlace, LoginFailure, Person
from app.web.live import Access

PLACE_KEPT = timedelta(days=180)
"""Time that a place counts as known after the last sign-in from there."""


class SignedIn(NamedTuple):
    """A browser session: whose it is, and the numbers of the navigation by name."""

    caller: Caller
    waiting: dict[str, int]


def signed_in(session: Session, token: str, waiting: Mapping[str, ScalarSelect[int]]) -> SignedIn | None:
    """Return the browser session of this token; None if it has ended.

    waiting: the queries of the numbers of the navigation, answered in the same round trip.
    """
    row = session.execute(
        select(
            Person.id,
            Person.name,
            Person.role,
            BrowserSession.csrf,
            *(number.label(name) for name, number in waiting.items()),
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
    return SignedIn(caller, {name: getattr(row, name) for name in waiting})


_GRANTED = """
SELECT s.token_hash, NULL::int, p.role FROM browser_session s JOIN person p ON p.id = s.person_id
WHERE s.token_hash = ANY(%s) AND s.expires_at > now() AND p.disabled_at IS NULL
UNION ALL
SELECT NULL, k.id, k.role FROM api_key k WHERE k.id = ANY(%s) AND k.revoked_at IS NULL
UNION ALL
SELECT d.token_hash, NULL, NULL FROM station_device d WHERE d.token_hash = ANY(%s) AND d.revoked_at IS NULL
"""


async def still_granted(conn: AsyncConnection[Any], accesses: Collection[Access]) -> Collection[Access]:
    """Return those of the accesses that are granted still, with the role that they had."""
    sessions = [access.session for access in accesses if access.session is not None]
    keys = [access.key for access in accesses if access.key is not None]
    cursor = await conn.execute(_GRANTED, (sessions, keys, sessions))
    return {Access(*row) for row in await cursor.fetchall()}


def person_named(session: Session, name: str) -> Person | None:
    """By the name, in any spelling of upper and lower case."""
    return session.scalars(select(Person).where(func.lower(Person.name) == func.lower(name))).one_or_none()


def names(session: Session) -> Sequence[str]:
    """The names of everybody who was ever let in, the disabled too."""
    return session.scalars(select(Person.name)).all()


def known_place(session: Session, person_id: int, place: str) -> bool:
    """Tell if the person has signed in from this place lately."""
    lately = KnownPlace.last_at > func.now() - PLACE_KEPT
    known = select(KnownPlace.place).where(KnownPlace.person_id == person_id, KnownPlace.place == place, lately)
    return session.scalar(known) is not None


WITHOUT_ACCESS = select(Person.id).where(Person.disabled_at.is_not(None))
"""The people whose access has ended."""


def person(session: Session, person_id: int) -> Person | None:
    return session.get(Person, person_id)


def hold_person(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the person whom a route names until the transaction ends (`app.web.etags`)."""
    session.get(Person, given["person"], with_for_update=True)


def badges(session: Session, person_id: int) -> int:
    """Number of badges that identify this person."""
    return session.scalar(select(func.count()).where(Badge.person_id == person_id)) or 0


class PersonRow(NamedTuple):
    """A person, and when they last signed in on a browser that is still signed in."""

    person: Person
    signed_in_at: datetime | None


def people(session: Session, after: int = 0, limit: int | None = None) -> list[PersonRow]:
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
    """Number of active administrators."""
    return (
        session.scalar(
            select(func.count()).select_from(Person).where(Person.role == "admin", Person.disabled_at.is_(None))
        )
        or 0
    )


def anybody(session: Session) -> bool:
    """Tell if there is anyone who could sign in."""
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


def role_keys(session: Session, after: int = 0, limit: int | None = None) -> Sequence[ApiKey]:
    """The keys that have a role, revoked ones too."""
    return session.scalars(
        select(ApiKey).where(ApiKey.role.is_not(None), ApiKey.id > after).order_by(ApiKey.id).limit(limit)
    ).all()


class Failed(NamedTuple):
    """Failed sign-ins: their number, and the time of the last one."""

    number: int
    last: datetime | None


class Failures(NamedTuple):
    """Failed sign-ins lately: with this name from this address, from this address in all, with this name in all."""

    pair: Failed
    address: Failed
    name: Failed
    now: datetime


def failures(session: Session, name: str, address: str, within: timedelta) -> Failures:
    """Count them by the database's clock, which all processes share."""
    of_name = LoginFailure.name == name
    of_address = LoginFailure.address == address
    row = session.execute(
        select(
            func.clock_timestamp(),
            *(
                total.filter(of_these)
                for of_these in (and_(of_name, of_address), of_address, of_name)
                for total in (func.count(), func.max(LoginFailure.at))
            ),
        ).where(or_(of_name, of_address), LoginFailure.at > func.clock_timestamp() - within)
    ).one()
    now, pairs, last_pair, addressed, last_addressed, named, last_named = row
    return Failures(Failed(pairs, last_pair), Failed(addressed, last_addressed), Failed(named, last_named), now)
