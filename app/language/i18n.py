"""The language of the page: every sentence that people read goes through here.

`_("...")` looks the sentence up in the catalog of the request's language. English is the language of the source, so its
catalog is empty; further languages are folders `frontend/locale/<language>/LC_MESSAGES/inband.mo` and need no code.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from gettext import NullTranslations, translation

from app import HOUSE

LOCALE_DIR = HOUSE / "frontend" / "locale"
DEFAULT_LANGUAGE = "en"

_language: ContextVar[str] = ContextVar("language", default=DEFAULT_LANGUAGE)


@cache
def languages() -> tuple[str, ...]:
    """The languages that can be chosen: English and every catalog that is there."""
    catalogs = sorted(mo.parents[1].name for mo in LOCALE_DIR.glob("*/LC_MESSAGES/inband.mo"))
    return (DEFAULT_LANGUAGE, *(language for language in catalogs if language != DEFAULT_LANGUAGE))


@cache
def catalog(language: str) -> NullTranslations:
    """The sentences of one language; English has none of its own."""
    if language == DEFAULT_LANGUAGE or language not in languages():
        return NullTranslations()
    return translation("inband", LOCALE_DIR, [language])


def negotiate(accept_language: str | None) -> str:
    """The best language for an Accept-Language header, in the order the browser gives."""
    from babel import negotiate_locale

    tags = [part.split(";")[0].strip().replace("-", "_") for part in (accept_language or "").split(",")]
    return negotiate_locale([tag for tag in tags if tag], list(languages())) or DEFAULT_LANGUAGE


@contextmanager
def speaking(language: str) -> Iterator[None]:
    """Everything inside is worded in this language."""
    token = _language.set(language)
    try:
        yield
    finally:
        _language.reset(token)


def current_language() -> str:
    return _language.get()


def _(message: str) -> str:
    """The sentence in the language of the page."""
    return str(catalog(_language.get()).gettext(message))


def ngettext(singular: str, plural: str, n: int) -> str:
    """The sentence for n things in the language of the page."""
    return str(catalog(_language.get()).ngettext(singular, plural, n))
