"""The words of the states."""

from app.core.state import State
from app.language.i18n import _


def state_word(state: State) -> str:
    """The state in one or two words."""
    return {
        State.PROBE_FAULT: _("Probe fault"),
        State.PAUSED: _("Paused"),
        State.TOOL_WORN: _("Tool worn"),
        State.HELD: _("Held"),
        State.OVERSIZE: _("Oversize"),
        State.UNDERSIZE: _("Undersize"),
        State.NO_DATA: _("No readings yet"),
        State.AWAITING_APPROVAL: _("Awaiting approval"),
        State.CORRECTING: _("Correcting"),
        State.DRIFTING_UP: _("Drifting up"),
        State.DRIFTING_DOWN: _("Drifting down"),
        State.MEASURE_ONLY: _("Measure only"),
        State.IN_BAND: _("In band"),
    }[state]
