"""Passwords: argon2id by pwdlib, a few at a time, and the same work for a name that nobody has."""

import secrets
import threading
from functools import cache

from pwdlib import PasswordHash

from app.errors import FieldError, Invalid
from app.web.i18n import _

SHORTEST = 10
LONGEST = 200

_hashing = PasswordHash.recommended()
# Argon2 takes 64 MB for each: a crowd at the door must not exhaust the memory that readings need.
_at_once = threading.BoundedSemaphore(2)


def hashed(password: str) -> str:
    """What is stored of a password."""
    with _at_once:
        return _hashing.hash(password)


def matches(password: str, password_hash: str | None) -> bool:
    """Whether this is the password. None, for a person who does not exist, takes as long and is never right."""
    with _at_once:
        right = _hashing.verify(password, password_hash or _nobodys())
    return right and password_hash is not None


@cache
def _nobodys() -> str:
    return _hashing.hash(secrets.token_urlsafe())


def acceptable(password: str, name: str, field: str = "password") -> None:
    """Raises `Invalid` for a password that is guessed too easily: length counts, not special characters."""
    wrong = None
    if len(password) < SHORTEST:
        wrong = _("must have at least {n} characters; several words make a good one").format(n=SHORTEST)
    elif len(password) > LONGEST:
        wrong = _("must have at most {n} characters").format(n=LONGEST)
    elif len(set(password)) < 4 or name.casefold() in password.casefold():
        wrong = _("is guessed too easily: do not repeat one letter or use your name")
    elif any("\ud800" <= character <= "\udfff" for character in password):
        wrong = _("holds half a character (a lone surrogate)")
    if wrong:
        raise Invalid(f"{field}: {wrong}", _("Choose another password."), errors=[FieldError(field, wrong)])
