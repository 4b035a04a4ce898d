"""The alarm kind of a loop that over-corrects."""

from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register
from app.quality.wear.wording import hunting_sentence, remedy_sentence

HUNTING = register(
    AlarmKind(
        "hunting",
        word=lambda: _("Hunting"),
        sentence=lambda alarm: f"{hunting_sentence(alarm.data)} {remedy_sentence(alarm.data, alarm.data['settings'])}",
        what_to_do=lambda: _("An engineer chooses a setting on the what-if map and proposes it there."),
        icon="hunting",
    )
)
