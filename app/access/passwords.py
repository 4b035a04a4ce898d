"""Passwords: argon2id by pwdlib, a few at a time, and the same work for a name that nobody has."""

import hashlib
import re
import secrets
import unicodedata
from concurrent.futures import ThreadPoolExecutor
from functools import cache

from pwdlib import PasswordHash

from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.memory import give_way

SHORTEST = 10
LONGEST = 200
GUESSES = 7
"""Parts that a guesser must get right: a letter counts as one, a common word, a run or a year as one as well."""
# What the lists of broken passwords begin with, in the languages of shop floors, and what everybody here thinks of first.
_COMMON = """
password passwort passwd kennwort lozinka sifra parola parol salasana contrasena senha motdepasse haslo heslo jelszo wachtwoord
welcome willkommen bienvenue benvenuto dobrodosli hello hallo hola secret geheim tajna master admin administrator root
operator engineer viewer user guest test demo login letmein iloveyou iloveu trustno changeme default access service support
dragon monkey shadow sunshine princess football baseball superman batman michael jordan charlie jennifer ashley daniel andrea
thomas matthew hunter ranger soccer hockey killer george computer internet whatever starwars pokemon freedom flower cheese
ginger pepper summer winter spring autumn sommer fruhling herbst monday januar january february
inband sinumerik siemens heidenhain fanuc machine maschine masina cnc lathe drehmaschine mill tool werkzeug production
company firma office werkstatt abc qwe asd
"""
_ROWS = (
    "qwertyuiop",
    "qwertzuiop",
    "azertyuiop",
    "asdfghjkl",
    "qsdfghjklm",
    "yxcvbnm",
    "zxcvbnm",
    "wxcvbn",
    "йцукенгшщзхъ",
    "abcdefghijklmnopqrstuvwxyz",
    "01234567890",
    "1qaz2wsx3edc4rfv5tgb6yhn7ujm",
    "1q2w3e4r5t6z7u8i9o0p",
    "1q2w3e4r5t6y7u8i9o0p",
)
_LIKE_LETTERS = str.maketrans("0134578@$!|", "oieastbasii")

_hashing = PasswordHash.recommended()
_code_cost = 2**15  # n of scrypt: 32 MB and a tenth of a second for each code that is tried
# Argon2 takes 64 MB and four threads for each: a crowd at the door must exhaust neither the memory nor the processors that
# readings need. The threads that it starts give way as the one that starts them does.
_threads = ThreadPoolExecutor(2, "passwords", initializer=give_way)


def hashed(password: str) -> str:
    """Stored form of a password."""
    return _threads.submit(_hashing.hash, password).result()


def matches(password: str, password_hash: str | None) -> bool:
    """Tell if this is the password. None, for a person who does not exist, takes as long and is never right."""
    right = _threads.submit(lambda: _hashing.verify(password, password_hash or _nobodys())).result()
    return right and password_hash is not None


def looked_up(code: str) -> bytes:
    """Stored form of a code by which its owner is found: the same for the same code, and slow to compute for all that are tried."""
    return _threads.submit(
        hashlib.scrypt,
        code.encode("utf-8", "surrogatepass"),
        salt=b"inband badge",
        n=_code_cost,
        r=8,
        p=1,
        maxmem=2**26,
        dklen=32,
    ).result()


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
    elif _parts(password, name) < GUESSES:
        wrong = _(
            "is guessed too easily: use several words that do not belong together, no common password, row of keys, "
            "repetition or name"
        )
    elif any("\ud800" <= character <= "\udfff" for character in password):
        wrong = _("holds half a character (a lone surrogate)")
    if wrong:
        raise Invalid(f"{field}: {wrong}", _("Choose another password."), errors=[FieldError(field, wrong)])


def _parts(password: str, name: str) -> int:
    """Return how many parts a guesser must get right, who knows common words, rows of keys, repetitions and the name.

    >>> [_parts(each, "Ana") for each in ("password1234", "1234567890", "P@ssw0rd2026!", "correct horse battery")]
    [2, 1, 3, 21]
    """
    rest = _plain(password)
    rest = re.sub(r"(.{1,5}?)\1{2,}", lambda same: same[1], rest)  # abcabcabc, 11111
    rest = re.sub(r"^(.{3,}?)\1+$", lambda same: same[1], rest)
    count = 0
    for known in _known(name):
        for spelled in {known, known[::-1]}:
            if len(spelled) >= 3:
                count += rest.count(spelled)
                rest = rest.replace(spelled, "\0")
                letters = rest.translate(_LIKE_LETTERS)
                for at in reversed([match.start() for match in re.finditer(re.escape(spelled), letters)]):
                    count += 1
                    rest = rest[:at] + "\0" + rest[at + len(spelled) :]
    rest, runs = _runs().subn("\0", rest)
    rest, years = re.subn(r"(19|20)\d\d", "\0", rest)
    return count + runs + years + len(rest.replace("\0", ""))


def _plain(text: str) -> str:
    """Small letters without their marks."""
    return "".join(
        letter for letter in unicodedata.normalize("NFKD", text.casefold()) if not unicodedata.combining(letter)
    )


def _known(name: str) -> list[str]:
    """Common words and those of the name, the longest first."""
    return sorted({*_COMMON.split(), *re.split(r"\W+", _plain(name))}, key=len, reverse=True)


@cache  # compiled when the first password is chosen: it takes 0.14 s, which no start needs to wait for
def _runs() -> re.Pattern[str]:
    """An expression for three neighbours or more of a row, in either direction."""
    pieces = {
        row[at : at + length]
        for one in _ROWS
        for row in (one, one[::-1])
        for length in range(3, len(row) + 1)
        for at in range(len(row) - length + 1)
    }
    return re.compile("|".join(sorted(map(re.escape, pieces), key=len, reverse=True)))
