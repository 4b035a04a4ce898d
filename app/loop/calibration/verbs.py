"""Acts on a place that is calibrated: accept what was found, or exclude a pair. Asked first on its page."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import NotFound
from app.language.formatting import mm, signed_mm, um
from app.language.i18n import _, ngettext
from app.loop.calibration import actions, pairs, queries, wording
from app.loop.calibration.queries import CalibrationRow, Place
from app.loop.calibration.schemas import SuggestionAcceptIn
from app.loop.tables.machines import Machine
from app.web.fields import ReasonIn
from app.web.verb import Verb, said


@dataclass(frozen=True)
class OfPlace:
    """A place, the calibration or pair of it that is meant, and who acts."""

    session: Session
    machine: Machine
    place: Place
    number: int
    caller: Caller

    @property
    def values(self) -> Mapping[str, Any]:
        """The number of the calibration or pair, and the place in words."""
        return {"number": self.number, "where": wording.place_words(self.place)}


def _accept(on: OfPlace, given: ReasonIn) -> CalibrationRow:
    return actions.accept(on.session, on.machine, on.number, given.reason, on.caller)


def _accept_suggestion(on: OfPlace, given: SuggestionAcceptIn) -> CalibrationRow:
    location, seen = on.place.location, given.empirical_value
    return pairs.accept_suggestion(on.session, on.machine, location, given.reason, on.caller, seen=seen)


def _exclude(on: OfPlace, given: ReasonIn) -> None:
    pairs.exclude_pair(on.session, on.machine, on.place.location, on.number, given.reason, on.caller)


def _accepting(on: OfPlace) -> list[str]:
    row = queries.calibration(on.session, on.machine, on.number)
    if Place(row.record.memory, row.record.location) != on.place:
        raise NotFound(wording.no_such_page(), wording.go_to_overview())
    if row.status != "proposed":
        raise NotFound(*wording.cannot_accept(row))
    sentences = [wording.sentence(row.record), *map(wording.warning_sentence, wording.warnings(row.record))]
    return [*sentences, *_sets(on.place, row.record.value_before, row.record.proposed)]


def _suggesting(on: OfPlace) -> list[str]:
    suggestion = queries.suggestion(on.session, on.machine, on.place.location)
    suggested = suggestion.comparison.suggested
    summary = wording.what_pairs_say(suggestion.comparison, suggestion.empirical_value)
    if suggested is None:
        raise NotFound(_("There is no empirical value to accept. {said}").format(said=summary), _("Add pairs."))
    return [summary, *_sets(on.place, suggestion.empirical_value, suggested)]


def _suggested(on: OfPlace) -> dict[str, str]:
    """The suggestion on the page, so that another one is not accepted unseen."""
    suggested = queries.suggestion(on.session, on.machine, on.place.location).comparison.suggested
    return {} if suggested is None else {"empirical_value": f"{suggested:.9f}"}


def _sets(place: Place, before: float, after: float | None) -> list[str]:
    if place.memory == "tool":
        return [_("The offset R10 = {n} is set to {after}.").format(n=place.location, after=signed_mm(after))]
    return [
        _("The empirical value R11 = {n} goes from {before} to {after}; readings from now on use it.").format(
            n=place.location, before=um(before), after=um(after)
        ),
        _("The running average begins at 0."),
    ]


def _excluding(on: OfPlace) -> list[str]:
    pair = queries.pair(on.session, on.machine, on.place.location, on.number)
    return [
        _("{machine_value} on the machine, {true_value} on {instrument}.").format(
            machine_value=mm(pair.machine_value), true_value=mm(pair.true_value), instrument=pair.instrument
        ),
        _("It stays on record and no longer counts in the mean."),
    ]


def _of_average(on: OfPlace) -> bool:
    return on.place.memory == "average"


SUGGESTION: Verb[OfPlace, SuggestionAcceptIn] = Verb(
    name="suggestion",
    body=SuggestionAcceptIn,
    act=_accept_suggestion,
    fits=_of_average,
    word=lambda: _("Accept"),
    title=lambda _on: _("Accept the empirical value?"),
    follows=_suggesting,
    reasons=lambda: [_("Compared with the CMM"), _("Compared with a micrometer")],
    hidden=_suggested,
    said=lambda: _("The empirical value is accepted: calibration {n}."),
)
PLACE: tuple[Verb[OfPlace, Any], ...] = (
    Verb(
        name="accept",
        body=ReasonIn,
        act=_accept,
        word=lambda: _("Accept"),
        title=lambda _on: _("Accept calibration {number}?"),
        follows=_accepting,
        reasons=lambda: [_("Calibrated as planned"), _("Stylus replaced"), _("After a collision")],
        said=lambda: _("Calibration {n} is accepted."),
    ),
    SUGGESTION,
    Verb(
        name="exclude",
        body=ReasonIn,
        act=_exclude,
        fits=_of_average,
        word=lambda: _("Exclude"),
        title=lambda _on: _("Exclude this pair?"),
        follows=_excluding,
        reasons=lambda: [_("Misread"), _("Another part"), _("Typing error")],
        said=lambda: _("The pair is excluded."),
    ),
)


def done(code: str, number: int | None) -> str | None:
    """The page's message after an act, or after something was typed in; None for an unknown one."""
    typed = {
        "calibrated": _("Calibration {n} is stored."),
        "plan": _("The plan is set."),
        "pairs": ngettext("{n} pair is stored.", "{n} pairs are stored.", number or 0),
    }
    return said(PLACE, code, number, typed)
