"""The words of the states."""

from app.core.state import CharacteristicState
from app.language.i18n import _


def state_word(state: CharacteristicState) -> str:
    """The state in one or two words."""
    return {
        CharacteristicState.PROBE_FAULT: _("Probe fault"),
        CharacteristicState.PAUSED: _("Paused"),
        CharacteristicState.TOOL_WORN: _("Tool worn"),
        CharacteristicState.HELD: _("Held"),
        CharacteristicState.OVERSIZE: _("Oversize"),
        CharacteristicState.UNDERSIZE: _("Undersize"),
        CharacteristicState.NO_DATA: _("No readings yet"),
        CharacteristicState.AWAITING_APPROVAL: _("Awaiting approval"),
        CharacteristicState.CORRECTING: _("Correcting"),
        CharacteristicState.DRIFTING_UP: _("Drifting up"),
        CharacteristicState.DRIFTING_DOWN: _("Drifting down"),
        CharacteristicState.MEASURE_ONLY: _("Measure only"),
        CharacteristicState.IN_BAND: _("In band"),
    }[state]
