"""Reasons for attention in words, each with the page that says more."""

from typing import NamedTuple

from app.language.i18n import _, ngettext
from app.quality.wear.wording import hunting_word
from app.views.characteristic.wording import state_word
from app.views.overview.queries import Ranked
from app.views.overview.ranking import AttentionReason
from app.web.states import tone_of


class Reason(NamedTuple):
    """A sentence, where it is shown in full, and how it is coloured."""

    reason: AttentionReason
    text: str
    href: str
    tone: str

    @property
    def urgent(self) -> bool:
        """True if the list shows it in colour: a person is needed now."""
        return self.reason <= AttentionReason.NOT_EVALUATED

    @property
    def is_state(self) -> bool:
        """True if it says no more than the state does."""
        return self.reason in (AttentionReason.STOPPED, AttentionReason.OUTSIDE, AttentionReason.APPROVAL)


def reasons(ranked: Ranked) -> list[Reason]:
    """The most urgent first."""
    return [_reason(reason, ranked) for reason in ranked.inputs.reasons]


def _reason(reason: AttentionReason, ranked: Ranked) -> Reason:
    inputs, row = ranked.inputs, ranked.row
    page = f"/characteristics/{row.characteristic.key}"
    board = f"/alarms?machine={ranked.machine.key}"
    state = state_word(inputs.state)
    parts = max(0, round(inputs.parts_left or 0))
    text, href, tone = {
        AttentionReason.STOPPED: (state, board, tone_of(inputs.state)),
        AttentionReason.OUTSIDE: (state, page, tone_of(inputs.state)),
        AttentionReason.APPROVAL: (state, "/corrections", tone_of(inputs.state)),
        AttentionReason.ALARM: (
            ngettext("%(num)s active alarm", "%(num)s active alarms", inputs.alarms) % {"num": inputs.alarms},
            board,
            "attention",
        ),
        AttentionReason.NOT_EVALUATED: (_("Background evaluation fails"), page, "attention"),
        AttentionReason.SIGNAL: (
            ngettext("%(num)s open signal", "%(num)s open signals", inputs.signals) % {"num": inputs.signals},
            f"{page}/control",
            "attention",
        ),
        AttentionReason.NOT_CAPABLE: (_("Not capable"), f"{page}/capability", "attention"),
        AttentionReason.WEAR: (
            ngettext("Limit in %(num)s part", "Limit in %(num)s parts", parts) % {"num": parts},
            f"{page}#wear-curve",
            "wear",
        ),
        AttentionReason.HUNTING: (
            hunting_word(row.outlook.hunting) if row.outlook else "",
            f"{page}/what-if",
            "attention",
        ),
        AttentionReason.ALARM_FLOOD: (_("Many alarms"), f"/alarms/history?machine={ranked.machine.key}", "waiting"),
        AttentionReason.BARELY_CAPABLE: (_("Barely capable"), f"{page}/capability", "waiting"),
        AttentionReason.OLD: (_("No new readings"), page, "waiting"),
    }[reason]
    return Reason(reason, text, href, tone)
