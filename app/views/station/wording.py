"""The next action at a machine, in words that are short enough to be read from two metres."""

from app.language.formatting import read_um
from app.language.i18n import _
from app.views.characteristic import wording
from app.views.station.queries import Station


def next_action(station: Station) -> str:
    """Return the next action of a person at this machine: about the characteristic that needs someone first, or an alarm."""
    if station.first is not None:
        action = wording.next_action(station.first, station.machine.key)
        if action is not None:
            return action.words
    if station.active:
        return _("Acknowledge the alarm")
    if station.waiting:
        first = station.waiting[0]
        amount = read_um(first.row.correction.amount, first.parameters.half)
        if first.row.correction.status == "pending":
            tool = first.row.correction.tool_memory
            return _("Add {amount} to the offset of tool {tool}").format(amount=amount, tool=tool)
        return _("Decide on the correction of {amount}").format(amount=amount)
    return _("Nothing to do")
