"""Sentences about control plans."""

from collections.abc import Iterable

from app.core.control_plan import By, Due, Judged, Plan, Ran, Rhythm, Tightened
from app.language.i18n import _, ngettext
from app.loop.readings.wording import field_word


def asked(every: int | None, minutes: float | None = None) -> str:
    """The interval in a few words; empty where neither parts nor minutes count."""
    words = []
    if every is not None:
        words.append(_("every part") if every == 1 else _("1 in {n} parts").format(n=every))
    if minutes is not None:
        words.append(_("every {n} min while the machine runs").format(n=f"{minutes:g}"))
    return ", ".join(words)


def plan_words(plan: Plan) -> str:
    """A plan in one line."""
    if not plan.asks and not plan.required_context:
        return _("No control plan")
    words = [asked(plan.every, plan.minutes)] if plan.every or plan.minutes else []
    if plan.per_shift:
        words.append(_("once in each shift"))
    if plan.after_change:
        words.append(
            ngettext(
                "the first part after a tool change",
                "each of the first {n} parts after a tool change",
                plan.after_change,
            ).format(n=plan.after_change)
        )
    if plan.after_alarm:
        words.append(
            ngettext(
                "the next part after an alarm", "each of the next {n} parts after an alarm", plan.after_alarm
            ).format(n=plan.after_alarm)
        )
    if plan.required_context:
        words.append(_("each reading with {fields}").format(fields=fields_words(plan.required_context)))
    line = "; ".join(words)
    return line[:1].upper() + line[1:]


def fields_words(fields: Iterable[str]) -> str:
    """Fields of a context in a line."""
    return ", ".join(field_word(field).lower() for field in fields)


def due_word(due: str) -> str:
    """The state of a plan in a word."""
    return {
        Due.NOT_PLANNED: _("Not planned"),
        Due.LATER: _("As planned"),
        Due.DUE: _("Measure the next part"),
        Due.MISSED: _("Measurement missed"),
    }[Due(due)]


def rule_word(by: str) -> str:
    """The rule of a plan by which something was missed."""
    return {By.PARTS: _("parts"), By.MINUTES: _("minutes"), By.SHIFT: _("shift")}[By(by)]


def state_sentences(plan: Plan, rhythm: Rhythm, since: Ran, judged: Judged, *, of_part: bool) -> list[str]:
    """State the measurement that is due, why, and the parts that are known not to be measured."""
    sentences = []
    if rhythm.tightened is Tightened.ALARM:
        sentences.append(_("Every part is measured for now, because of an alarm."))
    elif rhythm.tightened is Tightened.TOOL_CHANGE:
        sentences.append(_("Every part is measured for now, because the tool was changed."))
    if judged.next_in is not None and judged.next_in > 1:
        sentences.append(_("The part to measure is number {n} from now.").format(n=judged.next_in))
    if since.parts is not None:
        sentences.append(
            ngettext(
                "{n} part was cut since the last reading and not measured.",
                "{n} parts were cut since the last reading and not measured.",
                since.parts,
            ).format(n=since.parts)
        )
    elif not of_part:
        sentences.append(
            _(
                "Parts that are not measured are not known: the characteristic has no part. State it in Set-up, for this one and "
                "for the others of the same part."
            )
        )
    elif plan.asks:
        sentences.append(
            _("Parts that are not measured are not known: no other characteristic of this part was measured since.")
        )
    if plan.minutes is not None:
        sentences.append(
            _("The machine is known to have run for {n} min since the last reading.").format(n=int(since.minutes))
        )
    return sentences
