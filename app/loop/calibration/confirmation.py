"""Confirmation dialogs before a value is set or a pair excluded: title, consequences, and the reasons to choose from."""

from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.errors import NotFound
from app.language.i18n import _, ngettext
from app.language.numbers import mm, um
from app.loop.calibration import queries, wording
from app.loop.calibration.queries import Place
from app.loop.tables.machines import Machine
from app.web.fields import Reason
from app.web.forms import length
from app.web.validation import checked


@dataclass(frozen=True)
class Question:
    """Content of a confirmation dialog. seen: the suggestion on the page, so that another one is not accepted unseen."""

    title: str
    button: str
    follows: list[str]
    reasons: list[str]
    seen: str = ""


def question(session: Session, machine: Machine, place: Place, what: str, number: int) -> Question:
    """The dialog for this action. Raises `NotFound`."""
    if what == "accept":
        return _accept(session, machine, place, number)
    if what == "suggestion" and place.memory == "average":
        return _suggestion(session, machine, place)
    if what == "exclude" and place.memory == "average":
        pair = queries.pair(session, machine, place.location, number)
        return Question(
            _("Exclude this pair?"),
            _("Exclude"),
            [
                _("{machine_value} on the machine, {true_value} on {instrument}.").format(
                    machine_value=mm(pair.machine_value), true_value=mm(pair.true_value), instrument=pair.instrument
                ),
                _("It stays on record and no longer counts in the mean."),
            ],
            [_("Misread"), _("Another part"), _("Typing error")],
        )
    raise NotFound(wording.no_such_page(), wording.go_to_overview())


def _accept(session: Session, machine: Machine, place: Place, number: int) -> Question:
    row = queries.calibration(session, machine, number)
    if Place(row.record.memory, row.record.location) != place:
        raise NotFound(wording.no_such_page(), wording.go_to_overview())
    if row.status != "proposed":
        raise NotFound(*wording.cannot_accept(row))
    sentences = [wording.sentence(row.record), *map(wording.warning_sentence, wording.warnings(row.record))]
    follows = [*sentences, *_sets(place, row.record.value_before, row.record.proposed)]
    return Question(_("Accept calibration {n}?").format(n=number), _("Accept"), follows, _reasons())


def _suggestion(session: Session, machine: Machine, place: Place) -> Question:
    suggestion = queries.suggestion(session, machine, place.location)
    suggested = suggestion.comparison.suggested
    summary = wording.what_pairs_say(suggestion.comparison, suggestion.empirical_value)
    if suggested is None:
        raise NotFound(_("There is no empirical value to accept. {said}").format(said=summary), _("Add pairs."))
    follows = [summary, *_sets(place, suggestion.empirical_value, suggested)]
    reasons = [_("Compared with the measuring machine"), _("Compared with a micrometer")]
    return Question(_("Accept the empirical value?"), _("Accept"), follows, reasons, seen=f"{suggested:.9f}")


def _sets(place: Place, before: float, after: float | None) -> list[str]:
    if place.memory == "tool":
        return [_("The offset R10 = {n} is set to {after}.").format(n=place.location, after=mm(after))]
    return [
        _("The empirical value R11 = {n} goes from {before} to {after}; readings from now on use it.").format(
            n=place.location, before=um(before), after=um(after)
        ),
        _("The running average begins at 0."),
    ]


def _reasons() -> list[str]:
    return [_("Calibrated as planned"), _("Stylus replaced"), _("After a collision")]


def reason(text: str) -> Any:
    """The reason, as the API takes it. Raises `Invalid`."""
    return checked(Reason, text, "reason")


def seen(text: str | None) -> float | None:
    """The suggestion that the person saw, mm."""
    value = length(text)
    return value if isinstance(value, float) else None


def done(what: str, number: int | None) -> str | None:
    """The page's message after the action."""
    return {
        "accept": _("Calibration {n} is accepted.").format(n=number),
        "suggestion": _("The empirical value is accepted: calibration {n}.").format(n=number),
        "exclude": _("The pair is excluded."),
        "calibrated": _("Calibration {n} is stored.").format(n=number),
        "plan": _("The plan is set."),
        "pairs": ngettext("{n} pair is stored.", "{n} pairs are stored.", number or 0).format(n=number),
    }.get(what)
