"""The sentences about corrections and tool offsets: what each status means, and why something cannot be done now."""

from collections.abc import Callable
from datetime import UTC, datetime

from app.language.formatting import NOTHING, PLUS_MINUS, age, fixed, mm, um
from app.language.i18n import _, ngettext
from app.language.times import in_sentence
from app.loop.tables.tools import COUNTED_LATE, NO_HELP, OPPOSED, OVERSHOT, Correction
from app.loop.tools.gain_queries import ToolGain
from app.loop.tools.lives_queries import Life
from app.loop.tools.queries import OffsetChange

# Why the system itself dropped a correction, as it is stored: the word, and what goes with it; in words.
EXPIRED = "expired after hours:"
PAUSED = "offset differs, alarm:"
DROPPED: dict[str, Callable[[], str]] = {
    EXPIRED: lambda: _("expired: not applied within {} h"),
    PAUSED: lambda: _("the machine holds another offset than it was computed for (alarm {})"),
    OPPOSED: lambda: _("corrections before it did the opposite of what they asked (alarm {})"),
    OVERSHOT: lambda: _("corrections before it acted too strongly (alarm {})"),
    NO_HELP: lambda: _("corrections before it did not bring parts back into tolerance (alarm {})"),
    COUNTED_LATE: lambda: _("corrections before it acted earlier than they were counted (alarm {})"),
}


def why(correction: Correction) -> str | None:
    """The reason given with the decision; automatic reasons in words."""
    reason = correction.reason
    if reason is None or correction.decided_by is not None:
        return reason
    for begins, words in DROPPED.items():
        if reason.startswith(begins):
            return words().format(reason.removeprefix(begins).strip())
    return reason


def has_expired(correction: Correction) -> bool:
    """Tell if it was dropped because it was never applied in time."""
    return correction.decided_by is None and (correction.reason or "").startswith(EXPIRED)


def status_word(status: str) -> str:
    """A correction's status as it is inside a sentence."""
    return {
        "held": _("held"),
        "awaiting_approval": _("awaiting approval"),
        "pending": _("pending"),
        "applied": _("applied"),
        "rejected": _("rejected"),
        "superseded": _("superseded"),
    }.get(status, status)


def status_explained(status: str) -> str:
    """The meaning of a status: the awaited action, or the final state."""
    return {
        "held": _("Waits for an operator: its reading said that the tool is worn, or was not plausible."),
        "awaiting_approval": _("Waits for approval."),
        "pending": _("Waits for the machine to apply it."),
        "applied": _("Is in the offset."),
        "rejected": _("Was refused; it changes nothing."),
        "superseded": _("Was replaced by something newer; it changes nothing."),
    }.get(status, status)


def moment(at: datetime | None) -> str:
    """A moment inside a sentence that programs read as well."""
    return in_sentence(at)


def refused(correction: Correction, machine: str, verb: str) -> tuple[str, str]:
    """The reason why a correction in this status does not allow the action, and what to do instead.

    verb: `applied`, `rejected`, `approve` or `release`.
    """
    return _how_it_stands(correction, machine), _instead(correction, verb)


def _how_it_stands(correction: Correction, machine: str) -> str:
    values = {
        "number": correction.number,
        "machine": machine,
        "who": correction.decided_by or _("the system"),
        "at": moment(correction.decided_at),
        "why": why(correction) or "–",
        "tool": correction.tool_memory,
    }
    match correction.status:
        case "held":
            text = _(
                "Correction {number} of {machine} is held: its reading said that tool {tool} is worn, or was not plausible."
            )
        case "awaiting_approval":
            text = _("Correction {number} of {machine} still awaits approval.")
        case "pending":
            text = _("Correction {number} of {machine} is pending: it waits for the machine to apply it.")
        case "applied":
            values |= {"who": correction.applied_by or "?", "at": moment(correction.applied_at)}
            text = _("Correction {number} of {machine} was applied already, on {at}, confirmed by {who}.")
        case "rejected":
            text = _("Correction {number} of {machine} was rejected by {who} on {at}: {why}")
        case _ if correction.superseded_by is not None:
            values["by"] = correction.superseded_by
            text = _("Correction {number} of {machine} was superseded by correction {by}.")
        case _ if has_expired(correction):
            text = _("Correction {number} of {machine} was superseded on {at}: {why}.")
        case _:
            text = _("Correction {number} of {machine} was superseded by {who} on {at}: {why}")
    return text.format(**values)


def _instead(correction: Correction, verb: str) -> str:
    closed = correction.status in {"rejected", "superseded"}
    if verb == "applied":
        if has_expired(correction):
            return _(
                "If the machine has not applied it, leave it out: the next reading decides again. If it has, read the offset "
                "at the control and enter it by a manual edit of tool {tool}, PUT /api/v1/machines/…/tools/{tool}."
            ).format(tool=correction.tool_memory)
        if closed:
            return _(
                "It must not be in the offset. If the machine has applied it, take {amount} back out of the offset, "
                "or enter the present offset by a manual edit of tool {tool}."
            ).format(amount=um(correction.amount), tool=correction.tool_memory)
        if correction.status == "held":
            return _("Acknowledge its alarm or release it first. A machine applies pending corrections only.")
        return _("Approve it first. A machine applies pending corrections only.")
    if correction.status == "applied":
        return _("It cannot be taken back. If the offset is wrong, edit the offset of tool {tool} by hand.").format(
            tool=correction.tool_memory
        )
    if closed:
        return _("There is nothing left to do: the next reading asks for a new correction if one is needed.")
    return {
        "pending": _("Leave it to the machine, or reject it if it must not be applied."),
        "held": _("Acknowledge its alarm, or release or reject it here."),
        "awaiting_approval": _("Approve or reject it."),
    }.get(correction.status, "")


def edit_note(superseded: list[int]) -> str | None:
    """Corrections that were superseded when an offset was edited or a tool changed."""
    if not superseded:
        return None
    return ngettext(
        "Correction {numbers} was computed for the offset before and is superseded: do not apply it.",
        "Corrections {numbers} were computed for the offset before and are superseded: do not apply them.",
        len(superseded),
    ).format(numbers=", ".join(map(str, superseded)))


def will_fall(numbers: list[int]) -> str:
    """Open corrections that will be superseded when an offset is edited or a tool changed."""
    return ngettext(
        "Correction {numbers} was computed for the present offset and will be superseded.",
        "Corrections {numbers} were computed for the present offset and will be superseded.",
        len(numbers),
    ).format(numbers=", ".join(map(str, numbers)))


def will_fall_with_it(numbers: list[int]) -> str:
    """Open corrections that will be superseded when the empirical value is changed."""
    return ngettext(
        "Correction {numbers} was computed with the present empirical value and will be superseded if that changes.",
        "Corrections {numbers} were computed with the present empirical value and will be superseded if that changes.",
        len(numbers),
    ).format(numbers=", ".join(map(str, numbers)))


def counted_on(numbers: list[int]) -> str | None:
    """Said when a correction is rejected on which later ones count."""
    if not numbers:
        return None
    return ngettext(
        "Correction {numbers} of the same tool was computed as if this one were applied: decide about it, too.",
        "Corrections {numbers} of the same tool were computed as if this one were applied: decide about them, too.",
        len(numbers),
    ).format(numbers=", ".join(map(str, numbers)))


def is_out(correction: Correction) -> str:
    """Said of a correction that was fetched as program text, before it falls and when it fell."""
    return _(
        "Correction {number} was fetched as program text by {who} on {at}: it may be in the control already, or come there."
    ).format(number=correction.number, who=correction.fetched_by, at=moment(correction.fetched_at))


def named_by_readings(correction: Correction, named: int | None) -> str | None:
    """Said to a person who marks a correction applied, where the readings of the machine name the last one in effect."""
    if named is None or named >= correction.number:
        return None
    return _(
        "The readings of this machine name the last correction in effect, {named} when they asked for {number}: while they name one "
        "before {number}, parts count as cut without it, and it is taken back. Let the machine name {number}, or leave correction_in_effect out."
    ).format(named=named, number=correction.number)


def still_active(alarm: int) -> str:
    """Said when a held correction is released past its alarm."""
    return _(
        "Its alarm {alarm} (tool worn) is still active: acknowledge it on the board of alarms, where the decision about "
        "the tool is recorded."
    ).format(alarm=alarm)


def offset_differs(alarm: int, expected: float, reported: float, fallen: list[int]) -> str:
    """Said to the machine that reported another offset than expected."""
    sentence = _(
        "The machine holds {reported}, expected was {expected}. Nothing is corrected through this tool until alarm "
        "{alarm} is answered with the one that is true."
    ).format(reported=mm(reported), expected=mm(expected), alarm=alarm)
    return " ".join(filter(None, (sentence, edit_note(fallen))))


def lasted(life: Life) -> str:
    """Duration of an edge's life, so far if it is still in use."""
    duration = life.lasted(datetime.now(UTC))
    return NOTHING if duration is None else age(duration.total_seconds())


def gain(of: ToolGain) -> str:
    """The gain of a tool's corrections, its uncertainty, and from how many corrections."""
    if of.gain is None:
        return _("not known yet")
    return ngettext(
        "{gain} {pm} {error} from {n} correction", "{gain} {pm} {error} from {n} corrections", of.gain.corrections
    ).format(gain=fixed(of.gain.value, 2), pm=PLUS_MINUS, error=fixed(of.gain.half_width, 2), n=of.gain.corrections)


def event_word(kind: str) -> str:
    """A step in the history of an offset."""
    return {
        "change": _("Tool changed"),
        "edit": _("Manual edit"),
        "correction": _("Correction"),
        "reported": _("Reported offset"),
    }.get(kind, kind)


def step(change: OffsetChange) -> str:
    """The text of a step in the history, without its kind."""
    event = change.event
    if event.correction is not None:
        return _("correction {number}: {amount}, {actor}").format(
            number=event.correction, amount=um(change.amount), actor=event.actor
        )
    return ", ".join(filter(None, (event.reason, event.actor)))
