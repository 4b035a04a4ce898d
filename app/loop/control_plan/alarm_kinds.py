"""Alarm kind of measurements that a control plan asks for and that were not made. The next reading ends it."""

from app.core.control_plan import MISSED_ALARM
from app.language.i18n import _, ngettext
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.control_plan.wording import asked, fields_words
from app.loop.tables.alarms import Alarm


def _sentence(alarm: Alarm) -> str:
    data = alarm.data
    plan = asked(data.get("every"), data.get("minutes_planned"))
    if data.get("by") == "parts":
        n = int(data.get("parts") or 0)
        sentence = ngettext(
            "{n} part or more was cut without a measurement that the control plan asks for.",
            "{n} parts or more were cut without a measurement that the control plan asks for.",
            n,
        ).format(n=n)
    elif data.get("by") == "minutes":
        sentence = _("The machine has run for {n} min or more without a measurement.").format(
            n=int(data.get("minutes") or 0)
        )
    else:
        return _("A shift in which the part was made has ended without a measurement.")
    return _("{sentence} Planned: {plan}.").format(sentence=sentence, plan=plan) if plan else sentence


def _lacks(alarm: Alarm) -> str:
    data = alarm.data
    n = int(data.get("readings") or 0)
    sentence = ngettext(
        "{n} reading does not say what the control plan requires: {fields}. It is stored all the same.",
        "{n} readings do not say what the control plan requires: {fields}. They are stored all the same.",
        n,
    )
    return sentence.format(n=n, fields=fields_words(data.get("fields") or ()))


CONTEXT_MISSING = register(
    AlarmKind(
        "context_missing",
        word=lambda: _("Context missing"),
        sentence=_lacks,
        what_to_do=lambda: _(
            "Let the machine or its bridge send it as the reading's context, or scan it on the measuring sheet. The next readings that "
            "have all of it end this alarm."
        ),
        icon="no_data",
        outcomes={
            "complete": lambda item: _("Reading {n} has all of it.").format(n=item.get("sequence")),
            "plan_changed": lambda _item: _("The control plan was changed."),
        },
    )
)

MISSED = register(
    AlarmKind(
        MISSED_ALARM,
        word=lambda: _("Measurement missed"),
        sentence=_sentence,
        what_to_do=lambda: _(
            "Measure the next part; its reading ends this alarm. Check whether the program skips the probing cycle, or the gauge "
            "is out of order. Parts cut in the meantime have not been measured."
        ),
        icon="no_data",
        comments={"noted": lambda: [_("Probe was switched off"), _("Gauge out of order"), _("Set-up parts")]},
        outcomes={
            "measured": lambda item: _("Reading {n} has ended it.").format(n=item.get("sequence")),
            "plan_changed": lambda _item: _("The control plan was changed."),
        },
    )
)
