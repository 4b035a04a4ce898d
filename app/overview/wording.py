"""Why a characteristic needs somebody, in words, each with the page that says more."""

from typing import NamedTuple

from app.overview.queries import Ranked
from app.overview.ranking import Why
from app.plant.wording import state_word
from app.wear.wording import hunting_word
from app.web.i18n import _, ngettext


class Reason(NamedTuple):
    """A sentence, where it is shown in full, and how it is coloured."""

    why: Why
    text: str
    href: str
    tone: str


def reasons(ranked: Ranked) -> list[Reason]:
    """The most urgent first."""
    return [_reason(why, ranked) for why in ranked.told.reasons]


def _reason(why: Why, ranked: Ranked) -> Reason:
    told, row = ranked.told, ranked.row
    page = f"/characteristics/{row.characteristic.key}"
    board = f"/alarms?machine={ranked.machine.key}"
    state = state_word(told.state)
    parts = max(0, round(told.parts_left or 0))
    text, href, tone = {
        Why.STOPPED: (state, board, "stop"),
        Why.OUTSIDE: (state, page, "attention"),
        Why.ALARM: (
            ngettext("%(num)s active alarm", "%(num)s active alarms", told.alarms) % {"num": told.alarms},
            board,
            "attention",
        ),
        Why.SIGNAL: (
            ngettext("%(num)s open signal", "%(num)s open signals", told.signals) % {"num": told.signals},
            f"{page}/control",
            "attention",
        ),
        Why.NOT_CAPABLE: (_("Not capable"), f"{page}/capability", "attention"),
        Why.WEAR: (
            ngettext("Limit in %(num)s part", "Limit in %(num)s parts", parts) % {"num": parts},
            f"{page}#wear-curve",
            "wear",
        ),
        Why.HUNTING: (
            hunting_word(row.outlook.hunting) if row.outlook else "",
            f"{page}/what-if",
            "attention",
        ),
        Why.LOUD: (_("Many alarms"), f"/alarms/history?machine={ranked.machine.key}", "waiting"),
        Why.BARELY_CAPABLE: (_("Barely capable"), f"{page}/capability", "waiting"),
        Why.OLD: (_("No new readings"), page, "waiting"),
    }[why]
    return Reason(why, text, href, tone)
