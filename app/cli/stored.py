"""Sentences on readings that an import stored."""

from app.language.i18n import ngettext


def stored_of(count: int, characteristic: str) -> str:
    """The readings that were stored of a characteristic, as a sentence begins."""
    text = ngettext("%(num)d reading of %(name)s", "%(num)d readings of %(name)s", count)
    return text % {"num": count, "name": characteristic}


def stored_before(count: int) -> str:
    """The sentence on readings that were there."""
    text = ngettext(
        "%(num)d was stored before and is not stored again.",
        "%(num)d were stored before and are not stored again.",
        count,
    )
    return text % {"num": count}
