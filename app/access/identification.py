"""Identification at a station: by PIN or by badge, for one action.

A PIN is short, so that it can be typed with gloves; it opens nothing elsewhere. Who guesses it is slowed down by person and
device: after `FREE` wrong ones within a day it is locked there for a minute, and twice as long with each further one. Who has
identified themselves on the device before is kept out by their own wrong PINs alone.

A wrong badge names nobody, so different unknown badges are counted by device: after `FREE_BADGES` all badges are locked on it,
and a name with its PIN still works. The same unknown badge counts once, however often it is scanned; a right one takes back no
other's failures.
"""

from datetime import datetime, timedelta
from functools import partial
from itertools import pairwise
from typing import NamedTuple, cast

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from app.access import names, queries
from app.access.actions import check_password
from app.access.attempts import Wait, count_once, note_attempt, refuse_again, remember, strike_out, strike_out_one
from app.access.audit.actions import Acting, record
from app.access.callers import Caller, Role
from app.access.devices import Device
from app.access.passwords import hashed, looked_up, matches
from app.access.tables import Badge, Person
from app.db.engine import Database
from app.errors import Conflict, InbandError, Invalid, NotFound, TooManyRequests
from app.language.formatting import as_read
from app.language.i18n import _

SHORTEST_PIN, LONGEST_PIN = 4, 12
SHORTEST_BADGE, LONGEST_BADGE = 6, 100
COUNTED = timedelta(days=1)
FREE, FREE_ON_DEVICE, FREE_BADGES = 5, 60, 20
"""Wrong ones before one must wait: PINs of a name on a device, of all names on it, different badges on it."""
WAIT = Wait(first=60.0, longest=4 * 3600.0)


class NotIdentified(InbandError):
    """Wrong name, PIN or badge. Which of them is wrong is not said."""

    status = 401
    kind = "not-identified"
    title = "Not identified"


class Shown(NamedTuple):
    """Proof of a person: a badge, or a name and a PIN."""

    name: str = ""
    pin: str = ""
    badge: str = ""


def identify(database: Database, device: Device, shown: Shown) -> Caller:
    """Tell who acts on this device.

    Runs transactions of its own, because a failure must be kept although the request fails.
    Raises `NotIdentified`, or `TooManyRequests` while the PIN is locked.
    """
    person = _by_badge(database, device, shown.badge) if shown.badge else _by_pin(database, device, shown)
    if person is None:
        with database.begin() as session:
            subject = f"machine/{device.machine}/stations/{device.id}"
            how = "badge" if shown.badge else "PIN"
            record(session, device.name, "identification failed", subject, after={"by": how}, by=Acting())
        raise NotIdentified(
            _("Badge not known.") if shown.badge else _("Wrong name or PIN."),
            _("Scan it again, or type your name and PIN. An administrator binds badges: Set-up, Stations.")
            if shown.badge
            else _("Type both again. Everybody sets their own PIN on the page of their account."),
        )
    return Caller("person", person.name, role=cast("Role", person.role), person_id=person.id)


def _by_pin(database: Database, device: Device, shown: Shown) -> Person | None:
    """Return who has this name and PIN. Raises `TooManyRequests` while it is locked."""
    name = names.as_stored(shown.name.replace("\0", "")[:400].encode(errors="replace").decode())
    counted_as, place = guess = name.casefold()[:200], _place(device)
    refuse_again(database, *guess)
    with database.begin() as session:
        person = queries.person_named(session, name)
        known = person is not None and queries.known_place(session, person.id, place)
        note_attempt(session, counted_as, place, COUNTED, partial(_refuse_pin, known=known), guess)
    usable = person is not None and person.disabled_at is None
    right = matches(shown.pin[: LONGEST_PIN + 1], person.pin_hash if person is not None and usable else None)
    if person is None or not right:
        return None
    with database.begin() as session:
        strike_out(session, counted_as, place)
        remember(session, person.id, [place])
    return person


def _by_badge(database: Database, device: Device, code: str) -> Person | None:
    """Return whose badge this is. Raises `TooManyRequests` while badges are locked."""
    place = f"{_place(device)} badges"
    refuse_again(database, place)
    with database.begin() as session:
        attempt = note_attempt(session, place, place, COUNTED, _refuse_badge, (place,))
    code_hash = looked_up(_badge_code(code)[: LONGEST_BADGE + 1])
    with database.begin() as session:
        person = session.scalars(
            select(Person)
            .join(Badge, Badge.person_id == Person.id)
            .where(Badge.code_hash == code_hash, Person.disabled_at.is_(None))
        ).one_or_none()
        if person is None:
            count_once(session, attempt, code_hash.hex(), place)
        else:
            strike_out_one(session, attempt)
            remember(session, person.id, [_place(device)])
        return person


def _place(device: Device) -> str:
    return f"station {device.id}"


def _refuse_pin(failures: queries.Failures, *, known: bool) -> None:
    """Raises `TooManyRequests` while the PIN is locked. known: this person has identified themselves here before."""
    left = WAIT.left(failures.pair, FREE, failures.now)
    if not known:
        left = max(left, WAIT.left(failures.address, FREE_ON_DEVICE, failures.now))
    if left > 0:
        raise TooManyRequests(
            _("The PIN is locked on this device until {until}.").format(until=_until(failures.now, left)),
            _("Scan your badge, or sign in on another device for what cannot wait."),
            retry_after=left,
        )


def _refuse_badge(failures: queries.Failures) -> None:
    """Raises `TooManyRequests` while badges are locked."""
    left = WAIT.left(failures.address, FREE_BADGES, failures.now)
    if left > 0:
        raise TooManyRequests(
            _("Badges are locked on this device until {until}.").format(until=_until(failures.now, left)),
            _("Type your name and PIN, or sign in on another device for what cannot wait."),
            retry_after=left,
        )


def _until(now: datetime, left: int) -> str:
    """The first full minute after the wait."""
    return as_read(now + timedelta(seconds=left + 59), "minutes")


def set_pin(session: Session, caller: Caller, password: str, pin: str, keep_token: str | None) -> None:
    """A person sets their own PIN; an empty one is none any more.

    Raises `Invalid` when the password is wrong or the PIN cannot be used; `SessionEnded` as `change_password` does.
    """
    person = check_password(session, caller, password, keep_token, "password")
    if pin:
        _acceptable(pin)
    had = person.pin_hash is not None
    person.pin_hash = hashed(pin) if pin else None
    record(
        session,
        caller.name,
        "PIN set" if pin else "PIN removed",
        f"person/{person.name}",
        {"pin": had},
        {"pin": bool(pin)},
    )


def _acceptable(pin: str) -> None:
    """Raises `Invalid` for a PIN that is guessed too easily."""
    wrong = None
    if not (pin.isascii() and pin.isdigit() and SHORTEST_PIN <= len(pin) <= LONGEST_PIN):
        wrong = _("must have {least} to {most} digits").format(least=SHORTEST_PIN, most=LONGEST_PIN)
    elif len(set(pin)) < 3 or len({int(b) - int(a) for a, b in pairwise(pin)}) == 1:
        wrong = _("is guessed too easily: use at least three different digits, no row such as 1234")
    if wrong:
        raise Invalid.at("pin", wrong, do=_("Choose another PIN."))


def add_badge(session: Session, person_id: int, code: str, actor: str) -> Person:
    """Bind a badge to a person. Raises `Invalid`, `NotFound`; `Conflict` for a badge that is bound."""
    code = _badge_code(code)
    if not SHORTEST_BADGE <= len(code) <= LONGEST_BADGE:
        wrong = _("must have {least} to {most} characters").format(least=SHORTEST_BADGE, most=LONGEST_BADGE)
        raise Invalid.at("code", wrong, do=_("Scan the badge again."))
    person = _person(session, person_id)
    code_hash = looked_up(code)
    if session.get(Badge, code_hash) is not None:
        raise Conflict(_("This badge is bound to a user already."), _("Remove it there first, or use another badge."))
    session.add(Badge(code_hash=code_hash, person_id=person.id))
    session.flush()
    record(session, actor, "badge bound", f"person/{person.name}")
    return person


def remove_badges(session: Session, person_id: int, actor: str) -> Person:
    """Remove all badges of a person. Harmless without any. Raises `NotFound`."""
    person = _person(session, person_id)
    gone = session.scalars(delete(Badge).where(Badge.person_id == person.id).returning(Badge.created_at)).all()
    if gone:
        record(session, actor, "badges removed", f"person/{person.name}", {"badges": len(gone)}, {"badges": 0})
    return person


class Identifiable(NamedTuple):
    """A person, and by what they can identify themselves at a station."""

    person: Person
    badges: int


def identifiable(session: Session) -> list[Identifiable]:
    """Return everybody who is let in, by name."""
    badges = select(func.count()).where(Badge.person_id == Person.id).scalar_subquery()
    rows = session.execute(select(Person, badges).where(Person.disabled_at.is_(None)).order_by(Person.name))
    return [Identifiable(*row) for row in rows]


def _badge_code(code: str) -> str:
    return "".join(code.split())


def _person(session: Session, person_id: int) -> Person:
    person = queries.person(session, person_id)
    if person is None:
        raise NotFound(_("There is no such person."), _("Choose one of the list."))
    return person
