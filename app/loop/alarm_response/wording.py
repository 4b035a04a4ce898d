"""The sentences about alarms: what is wrong, what to do, what each action brings about, and what followed."""

import logging
from collections.abc import Sequence

from app.language.formatting import read_um
from app.language.i18n import _, ngettext
from app.language.times import in_sentence
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarms.kinds import kind_named
from app.loop.alarms.reading_kinds import IMPLAUSIBLE, PROBE_FAULT
from app.loop.tables.alarms import Alarm

log = logging.getLogger(__name__)


def kind_word(kind: str) -> str:
    """Return the name of an alarm kind."""
    return kind_named(kind).word()


def sentence(alarm: Alarm) -> str:
    """Return the statement of what is wrong. One whose numbers do not fit its sentence keeps no page from all others."""
    try:
        return kind_named(alarm.kind).sentence(alarm)
    except (LookupError, TypeError, ValueError):
        log.exception("alarm %s cannot be put into words", alarm.id)
        return _("{kind}: its numbers cannot be read.").format(kind=kind_word(alarm.kind))


def chart_of(row: AlarmRow) -> str:
    """Return the address of the control chart that an alarm is about; empty for alarms without one."""
    chart = kind_named(row.alarm.kind).chart
    return chart(row.characteristic.key, row.alarm.data) if chart and row.characteristic else ""


def concerns_parts(row: AlarmRow) -> bool:
    """Tell if parts cut before may be bad: of a characteristic, or of what a tool cuts."""
    named = row.characteristic is not None or row.alarm.tool_memory is not None
    return named and kind_named(row.alarm.kind).concerns_parts


def what_to_do(kind: str) -> str:
    """Return the advice for the operator: where to look first."""
    return kind_named(kind).what_to_do()


def action_word(action: str) -> str:
    """Return an action as it is on its button."""
    return {
        "tool_replaced": _("Tool changed"),
        "keep_cutting": _("Keep cutting"),
        "false_reading": _("False reading"),
        "sister_tool": _("Switch to sister tool"),
        "offset_set": _("Report the true offset"),
        "measured_by_hand": _("Measured by hand"),
        "noted": _("Noted"),
    }.get(action, action)


def offered(row: AlarmRow) -> list[str]:
    """Return the actions that make sense for this alarm, the likeliest first."""
    alarm = row.alarm
    kind = kind_named(alarm.kind)
    return [
        action
        for action in (*kind.actions, *kind.more_actions(alarm))
        if not (action == "tool_replaced" and alarm.tool_memory is None)
        and not (action == "keep_cutting" and row.held is None and alarm.kind != IMPLAUSIBLE.name)
        and not (action == "sister_tool" and row.sister is None)
    ]


def consequences(row: AlarmRow, action: str) -> list[str]:
    """Consequences of this action, shown before it is confirmed."""
    alarm, held = row.alarm, row.held
    sentences: list[str] = []
    match action:
        case "tool_replaced":
            sentences.append(
                _("Tool {tool} begins a new life: offset, sum of corrections, parts and average start again.").format(
                    tool=alarm.tool_memory
                )
            )
            sentences.append(_("Corrections computed for the old tool are dropped."))
        case "keep_cutting":
            if alarm.kind == IMPLAUSIBLE.name:
                sentences.append(_("The reading was true: the next ones are expected at its level."))
            if held is not None:
                sentences.append(
                    _("Correction {number} of {amount} is released: the machine applies it to tool {tool}.").format(
                        number=held.number, amount=read_um(held.amount, alarm.data.get("limit")), tool=held.tool_memory
                    )
                )
                sentences.append(
                    _("If readings since then say that nothing is to be corrected, it is dropped instead.")
                )
        case "sister_tool":
            sentences += [
                _(
                    "From now on the characteristics of tool {tool} correct tool {sister}; each gets a new version of its parameters."
                ).format(tool=alarm.tool_memory, sister=row.sister),
                _("Corrections computed for tool {tool} are dropped; the running averages begin at 0.").format(
                    tool=alarm.tool_memory
                ),
                _("Select tool {sister} at the machine before the next part.").format(sister=row.sister),
            ]
        case "offset_set":
            sentences += [
                _("It is handled as a manual edit of tool {tool}: the running averages begin at 0.").format(
                    tool=alarm.tool_memory
                ),
                _("Parts cut until now say nothing about it; then correcting goes on."),
            ]
        case "false_reading":
            sentences.append(
                ngettext(
                    "The reading is taken out of the statistics; it stays on record.",
                    "The {n} readings of this alarm are taken out of the statistics; they stay on record.",
                    alarm.count,
                ).format(n=alarm.count)
            )
            sentences.append(_("What it asked for is withdrawn, unless the machine has applied it already."))
        case "measured_by_hand":
            sentences += [
                _("Your measurement is shown beside the machine's value; the reading is not excluded."),
                _("Enter a size, or say whether the part is good or scrap."),
            ]
        case "noted":
            sentences.append(_("Nothing else changes."))
            if held is not None:
                sentences.append(
                    _("Correction {number} stays held; it can be released or rejected in the tool memory.").format(
                        number=held.number
                    )
                )
    if alarm.kind == PROBE_FAULT.name:
        sentences.append(_("Compensation of this characteristic goes on."))
    return sentences


def comments(kind: str, action: str) -> list[str]:
    """Return comments to choose from with one touch.

    The first one is chosen already and repeats what the person has touched, no more: nobody is made to say what was not
    looked at. Who changed an offset, and why, is not known before it is said: there nothing is chosen.
    """
    lead = {"noted": [_("Seen")], "offset_set": []}.get(action, [action_word(action)])
    own = kind_named(kind).comments.get(action)
    return [*lead, *(text for text in (own() if own else _usual_comments(action)) if text not in lead)]


def _usual_comments(action: str) -> Sequence[str]:
    return {
        "tool_replaced": [_("Insert indexed"), _("New insert"), _("New tool"), _("Insert chipped")],
        "keep_cutting": [_("Edge looked at, still good"), _("Until the end of the batch"), _("Replaced at next stop")],
        "false_reading": [_("Chip on the stylus"), _("Coolant on the part"), _("Part not clamped right")],
        "sister_tool": [_("Edge worn"), _("Insert chipped"), _("Planned life reached")],
        "measured_by_hand": [_("Micrometer"), _("Bore gauge"), _("Plug gauge"), _("CMM")],
        "noted": [_("Part set aside")],
    }.get(action, [])


def was_first(alarm: Alarm) -> str:
    """The conflict when someone else has already acknowledged the alarm."""
    return _("{who} acknowledged alarm {number} on {at} already: {action}, “{comment}”.").format(
        who=alarm.acknowledged_by,
        number=alarm.id,
        at=in_sentence(alarm.acknowledged_at),
        action=action_word(alarm.action or ""),
        comment=alarm.comment,
    )
