"""Adding people, what they may do, their passwords and invitations."""

import secrets
from datetime import UTC, datetime, timedelta
from typing import NamedTuple, cast

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from app.access import names, queries
from app.access.audit.actions import record
from app.access.callers import Caller, Role
from app.access.keys import add_key, revoke_key
from app.access.new_keys import NewKey, digest
from app.access.passwords import acceptable, hashed, matches
from app.access.tables import ROLES, BrowserSession, Invitation, Person
from app.errors import Conflict, FieldError, Invalid, NotFound, NotSignedIn
from app.language.i18n import _

__all__ = [
    "NewKey",
    "accept_invitation",
    "add_key",
    "add_person",
    "add_role_key",
    "change_password",
    "change_role",
    "check_password",
    "create_invitation",
    "disable_person",
    "enable_person",
    "reset_password",
    "revoke_key",
    "withdraw_invitation",
]

INVITATION_LASTS = timedelta(days=7)
GUESSES = 5
"""Wrong present passwords after which a session ends: anyone who has stolen it must not find the password out by it."""


class SessionEnded(NotSignedIn):
    """The browser's session has ended, because the present password was wrong too often."""

    def __init__(self) -> None:
        super().__init__(
            _("This browser has been signed out, because the present password was wrong {n} times.").format(n=GUESSES),
            _("Sign in again. If you have forgotten the password, ask an administrator for a new one."),
        )


def add_person(session: Session, *, name: str, role: str, password: str, actor: str) -> Person:
    """Add a person who may sign in.

    Raises `Invalid` for a name or password that cannot be used, `Conflict` for a name that is taken or looks like one that is.
    """
    _role(role)
    acceptable(password, name)
    return _added(session, name, role, hashed(password), actor)


def add_person_of_another_plant(session: Session, person: Person, role: str, actor: str) -> Person:
    """Add a person who may sign in to another plant already, with the same name and password.

    Raises `Invalid` for an unknown role, `Conflict` for a name that is taken or looks like one that is.
    """
    return _added(session, person.name, _role(role), person.password_hash, actor)


def _added(session: Session, name: str, role: str, password_hash: str, actor: str) -> Person:
    session.execute(select(func.pg_advisory_xact_lock(7292, 0)))  # of two who look alike, one comes second
    name = names.of_person(name, queries.names(session))
    person = Person(name=name, role=role, password_hash=password_hash)
    session.add(person)
    session.flush()
    record(session, actor, "person added", f"person/{name}", None, {"name": name, "role": role})
    return person


def add_role_key(session: Session, *, name: str, role: str, actor: str) -> NewKey:
    """Make a key for a program, with a person's role. Raises `Invalid`."""
    return add_key(session, name=name, role=_role(role), actor=actor)


def create_invitation(session: Session, role: str, actor: str = "command line") -> str:
    """Make a one-time link; who opens it chooses a name and a password. Returns its token, this once."""
    _role(role)
    token = secrets.token_urlsafe(32)
    session.execute(delete(Invitation).where(Invitation.expires_at < func.now() - timedelta(days=30)))
    session.add(Invitation(token_hash=digest(token), role=role, expires_at=datetime.now(UTC) + INVITATION_LASTS))
    session.flush()
    record(session, actor, "invitation made", "people", None, {"role": role})
    return token


def withdraw_invitation(session: Session, token_hash: bytes, actor: str) -> None:
    """Make a link that was given out useless. Harmless if it was used already."""
    role = session.scalar(
        delete(Invitation)
        .where(Invitation.token_hash == token_hash, Invitation.used_at.is_(None))
        .returning(Invitation.role)
    )
    if role is not None:
        record(session, actor, "invitation withdrawn", "people", {"role": role}, None)


def accept_invitation(session: Session, token: str, name: str, password: str) -> Person:
    """A person opened their link and chose a name and a password.

    Raises `NotFound` for a link that was used or has expired; what `add_person` raises leaves the link usable.
    """
    role = session.scalar(
        update(Invitation)
        .where(Invitation.token_hash == digest(token), Invitation.used_at.is_(None), Invitation.expires_at > func.now())
        .values(used_at=func.now())
        .returning(Invitation.role)
    )
    if role is None:
        raise NotFound(
            _("This invitation has been used already, or is too old."), _("Ask an administrator for a new one.")
        )
    return add_person(session, name=name, role=role, password=password, actor=f"{names.seen(name)} (invitation)")


def change_password(session: Session, caller: Caller, old: str, new: str, keep_token: str | None) -> bool:
    """A person changes their own password; their other browsers are signed out, and their PIN ends.

    Returns if there was a PIN. Badges stay: `app.access.identification.remove_badges`. Raises `Invalid` when the old password is wrong or the new one cannot be used. Who was wrong `GUESSES` times has lost
    the session: `SessionEnded`, which must not take the transaction back.
    """
    person = check_password(session, caller, old, keep_token, "old")
    acceptable(new, person.name, "new")
    person.password_hash = hashed(new)
    had_pin = _end_pin(session, person, caller.name)
    own_token = digest(keep_token) if keep_token else b""
    session.execute(
        delete(BrowserSession).where(BrowserSession.person_id == person.id, BrowserSession.token_hash != own_token)
    )
    record(session, caller.name, "password changed", f"person/{person.name}")
    return had_pin


def _end_pin(session: Session, person: Person, actor: str) -> bool:
    """Remove the PIN with the password that it was set with; tell if there was one."""
    if person.pin_hash is None:
        return False
    person.pin_hash = None
    record(session, actor, "PIN removed", f"person/{person.name}", {"pin": True}, {"pin": False})
    return True


def check_password(session: Session, caller: Caller, password: str, token: str | None, field: str) -> Person:
    """A person says their present password once more, before something that their session alone must not do.

    Raises `Invalid` when it is wrong; `SessionEnded` when it was wrong `GUESSES` times.
    """
    person = _person(session, caller.person_id)
    own = _own_session(session, person, token) if token else None
    if not matches(password, person.password_hash):
        if own is not None:
            _count_guess(session, own, person)
        wrong = _("is not your present password")
        raise Invalid(f"{field}: {wrong}", _("Type your present password again."), errors=[FieldError(field, wrong)])
    if own is not None:
        own.wrong_passwords = 0
    return person


def _own_session(session: Session, person: Person, token: str) -> BrowserSession:
    """Lock the session, so that guesses come one after the other. Raises `SessionEnded` if it has ended meanwhile."""
    own = session.scalars(
        select(BrowserSession)
        .where(BrowserSession.token_hash == digest(token), BrowserSession.person_id == person.id)
        .with_for_update()
    ).one_or_none()
    if own is None:
        raise SessionEnded
    return own


def _count_guess(session: Session, own: BrowserSession, person: Person) -> None:
    own.wrong_passwords += 1
    if own.wrong_passwords >= GUESSES:
        session.delete(own)
        record(session, person.name, "session ended", f"person/{person.name}", after={"wrong_passwords": GUESSES})
        session.flush()
        raise SessionEnded


class NewPassword(NamedTuple):
    """A password to be handed over. had_pin: their PIN has ended. badges: those that still identify them at stations."""

    person_id: int
    name: str
    password: str
    had_pin: bool
    badges: int


def reset_password(session: Session, person_id: int, actor: str) -> NewPassword:
    """Give a person who has forgotten theirs a new password, shown this once; sign them out everywhere and end their PIN."""
    person = _person(session, person_id)
    password = "-".join(secrets.token_hex(2) for _part in range(4))
    person.password_hash = hashed(password)
    session.execute(delete(BrowserSession).where(BrowserSession.person_id == person.id))
    record(session, actor, "password reset", f"person/{person.name}")
    had_pin = _end_pin(session, person, actor)
    return NewPassword(person.id, person.name, password, had_pin, queries.badges(session, person.id))


def change_role(session: Session, person_id: int, role: str, actor: str) -> Person:
    """Give a person another role, from now on. Raises `Conflict` when nobody would be left to administer."""
    _role(role)
    _lock_admins(session)
    person = _person(session, person_id)
    before = person.role
    if before == role:
        return person
    if before == "admin":
        _keep_an_admin(session, person)
    person.role = role
    session.flush()
    record(session, actor, "role changed", f"person/{person.name}", {"role": before}, {"role": role})
    return person


def disable_person(session: Session, person_id: int, actor: str) -> Person:
    """End a person's access, at once and in every browser. Raises `Conflict` for the last administrator."""
    _lock_admins(session)
    person = _person(session, person_id)
    if person.disabled_at is not None:
        return person
    if person.role == "admin":
        _keep_an_admin(session, person)
    person.disabled_at = session.scalar(select(func.now()))
    session.execute(delete(BrowserSession).where(BrowserSession.person_id == person.id))
    session.flush()
    record(session, actor, "person disabled", f"person/{person.name}", {"disabled": False}, {"disabled": True})
    return person


def enable_person(session: Session, person_id: int, actor: str) -> Person:
    """Let a person in again, with the role they had."""
    person = _person(session, person_id)
    if person.disabled_at is not None:
        person.disabled_at = None
        session.flush()
        record(session, actor, "person enabled", f"person/{person.name}", {"disabled": True}, {"disabled": False})
    return person


def _person(session: Session, person_id: int | None) -> Person:
    person = None if person_id is None else queries.person(session, person_id)
    if person is None:
        raise NotFound(_("There is no such person."), _("GET /api/v1/people lists everybody."))
    return person


def _role(role: str) -> Role:
    if role not in ROLES:
        wrong = _("must be one of {choices}").format(choices=", ".join(ROLES))
        raise Invalid(f"role: {wrong}", errors=[FieldError("role", wrong)])
    return cast("Role", role)


def _lock_admins(session: Session) -> None:
    """Two administrators who remove each other at the same moment come one after the other."""
    session.execute(
        select(Person.id)
        .where(Person.role == "admin", Person.disabled_at.is_(None))
        .order_by(Person.id)
        .with_for_update()
    )


def _keep_an_admin(session: Session, person: Person) -> None:
    if person.disabled_at is None and queries.active_admins(session) <= 1:
        raise Conflict(
            _("{name} is the only administrator left; without one no user could be added.").format(name=person.name),
            _("Make another user an administrator first."),
        )
