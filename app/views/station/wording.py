"""The next action at a machine, in words that are short enough to be read from two metres."""

from app.core.state import CharacteristicState
from app.language.i18n import _
from app.language.numbers import um
from app.views.station.queries import Station


def next_action(station: Station) -> str:
    """Return the next action of a person at this machine."""
    first = station.first
    if first is not None and first.state in _ACTIONS:
        amount = next(
            (amount for _number, status, amount in reversed(first.corrections) if status == first.state), None
        )
        return _ACTIONS[first.state]().format(tool=first.parameters.tool_memory, amount=um(amount))
    if station.active:
        return _("Acknowledge the alarm")
    if station.waiting:
        amount = station.waiting[0].row.correction.amount
        return _("Decide on the correction of {amount}").format(amount=um(amount))
    return _("Nothing to do")


_ACTIONS = {
    CharacteristicState.PROBE_FAULT: lambda: _("Check the probe and the part"),
    CharacteristicState.PAUSED: lambda: _("Acknowledge the alarm"),
    CharacteristicState.TOOL_WORN: lambda: _("Check tool {tool}"),
    CharacteristicState.HELD: lambda: _("Decide on the held correction"),
    CharacteristicState.OVERSIZE: lambda: _("Set the part aside"),
    CharacteristicState.UNDERSIZE: lambda: _("Set the part aside"),
    CharacteristicState.AWAITING_APPROVAL: lambda: _("Approve the correction of {amount}"),
    CharacteristicState.NO_DATA: lambda: _("Measure the first part"),
}
