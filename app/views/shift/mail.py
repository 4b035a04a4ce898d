"""A shift in words, for the mail at its end."""

import logging
from datetime import UTC, datetime, timedelta
from urllib.parse import urlencode

from sqlalchemy.orm import Session

from app.core.spc.capability import CAPABLE
from app.language.formatting import age, as_read, fixed, plain_um
from app.language.i18n import _, ngettext
from app.loop.alarm_response.wording import kind_word
from app.views.shift import queries
from app.views.shift.queries import Shift

log = logging.getLogger(__name__)
MOST = 10
"""Machines, and active alarms, that a mail names."""


def shift_words(session: Session, end: datetime, address: str) -> tuple[str, str] | None:
    """Subject and text about the shift that ends at this moment; None where nothing happened in it.

    Where it cannot be worked out, the mail leads to its page: nobody waits for the next one in vain.
    """
    inside = end.astimezone(UTC) - timedelta(microseconds=1)  # on the clock on the wall, the hour before may not exist
    link = f"{address}/shift?{urlencode({'at': inside.isoformat()})}"
    try:
        with session.begin_nested():
            found = queries.shift(session, inside, end)
    except Exception:
        log.exception("the shift until %s cannot be worked out", end)
        return _("Shift until {end}").format(end=as_read(end, "minutes")), f"{link}\n"
    return None if found.empty else (_subject(found), f"{_text(found)}\n\n{link}\n")


def _subject(found: Shift) -> str:
    assert found.period.start is not None
    assert found.period.end is not None
    parts = ngettext("{n} part", "{n} parts", found.made.parts).format(n=found.made.parts)
    return _("Shift {start} to {end}: {parts}, {outside} out of tolerance").format(
        start=as_read(found.period.start, "minutes"),
        end=as_read(found.period.end, "time"),
        parts=parts,
        outside=found.made.outside,
    )


def _text(found: Shift) -> str:
    made, answered, coming = found.made, found.answered, found.next
    lines = [
        _("Parts: {parts}, in tolerance {inside}, out of tolerance {outside}").format(
            parts=made.parts, inside=made.inside, outside=made.outside
        ),
        _alarms(answered),
        _("Corrections: {n}, {held} held back, {not_taken} not taken").format(
            n=made.corrections, held=made.held, not_taken=made.not_taken
        )
        + ("" if made.largest is None else _(", the largest {largest}").format(largest=plain_um(made.largest))),
        _("Tool changes: {n}").format(n=found.tool_changes),
    ]
    if len(found.machines) > 1:
        busy = [each for each in found.machines if each.made.readings or each.answered.alarms]
        lines += ["", *(_machine(each) for each in busy[:MOST])]
        lines += [_("… and {n} more machines").format(n=len(busy) - MOST)] if len(busy) > MOST else []
    lines += ["", _("Next:") if not coming.nothing else _("Next: nothing needs attention.")]
    for row in coming.alarms[:MOST]:
        name = row.characteristic.name if row.characteristic else row.machine.name
        lines.append(f"- {kind_word(row.alarm.kind)}: {name}")
    if coming.active > len(coming.alarms[:MOST]):
        lines.append(_("- {n} more active alarms").format(n=coming.active - len(coming.alarms[:MOST])))
    for each in coming.wearing[:MOST]:
        parts = max(0, round(each.inputs.parts_left or 0))
        words = ngettext("limit in {n} part", "limit in {n} parts", parts).format(n=parts)
        lines.append(f"- {each.row.characteristic.name}: {words}")
    lines += [
        _("- {name}: index {index}, below {limit}").format(
            name=each.row.characteristic.name, index=fixed(each.inputs.ppk, 2), limit=fixed(CAPABLE, 2)
        )
        for each in coming.below[:MOST]
    ]
    return "\n".join(lines)


def _machine(each: queries.OfMachine) -> str:
    return _("{machine}: {parts} parts, {outside} out, {alarms} alarms").format(
        machine=each.machine.name, parts=each.made.parts, outside=each.made.outside, alarms=each.answered.alarms
    )


def _alarms(answered: queries.Answered) -> str:
    count = _("Alarms: {n}").format(n=answered.alarms)
    if answered.alarms and (answered.median is None or answered.longest is None):
        count += _(", none acknowledged")
    elif answered.median is not None and answered.longest is not None:
        count += _(", acknowledged after {median} (median), {longest} at most").format(
            median=age(answered.median.total_seconds()), longest=age(answered.longest.total_seconds())
        )
    return count + (_("; {n} still active").format(n=answered.active) if answered.active else "")
