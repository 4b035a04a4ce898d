"""Words of quarantines and affected parts."""

from app.language.formatting import as_read
from app.language.i18n import _
from app.loop.quarantine.history import Known
from app.loop.quarantine.queries import Between
from app.loop.quarantine.tables import QuarantinedPart
from app.web.states import State, show

for _state in (
    State("quarantined", lambda: _("set aside"), "attention", "held"),
    State("released", lambda: _("released"), "steady", "applied"),
    State("scrapped", lambda: _("scrapped"), "stop", "rejected"),
):
    show(_state)


def status_word(status: str) -> str:
    """A status of a part as people read it."""
    return {"open": _("set aside"), "released": _("released"), "scrapped": _("scrapped")}.get(status, status)


def found_word(found: str) -> str:
    """The verdict of a reading on its part."""
    return {
        "bad": _("out of tolerance"),
        "unknown": _("measured, says nothing"),
        "good": _("in tolerance, not believed"),
        "not_measured": _("not measured"),
    }.get(found, found)


def cut_without() -> str:
    """The sentence below a table that names corrections a part was cut without."""
    return _(
        "Cut without correction: numbers of the corrections that were issued before the part was cut, but took effect only after it."
    )


def part_name(part: str | None, to: str | None = None) -> str:
    """A part by its name, or a row of several."""
    return _("no name") if part is None else part if to is None else _("{first} to {last}").format(first=part, last=to)


def _end(known: Known) -> str:
    at = as_read(known.cut_at, "minutes")
    if known.part is None:
        return _("reading {number}, {at}").format(number=known.sequence, at=at)
    return _("{part} (reading {number}, {at})").format(part=known.part, number=known.sequence, at=at)


def span(between: Between) -> list[str]:
    """The beginning and the end of a list, and what it cannot name."""
    since = (
        _("Last certainly good: {end}.").format(end=_end(between.since))
        if between.since
        else _("No part before it is certainly good: the list begins with the first one of this edge.")
    )
    sentences = [since]
    if between.cut_short:
        sentences = [
            _("More readings than are looked at: parts before the first one of this list may be affected too.")
        ]
    if between.until:
        sentences.append(_("Good again from {end}.").format(end=_end(between.until)))
    elif between.open:
        sentences.append(_("No good part has ended the list yet: those cut since, not measured, belong to it."))
    if between.unnumbered:
        sentences.append(_("And those cut between, not measured: their names do not tell how many there are."))
    return sentences


def decided(part: QuarantinedPart) -> str:
    """The decision about a part: by whom, when, why."""
    if part.decided_at is None:
        return ""
    return _("{who}, {at}: {why}").format(who=part.decided_by, at=as_read(part.decided_at, "minutes"), why=part.reason)
