"""The words of the states, of the next action, and of the choices."""

from typing import NamedTuple

from app.core.state import CharacteristicState
from app.language.formatting import read_um
from app.language.i18n import _
from app.loop.characteristics.wording import result_label
from app.views.characteristic.state_queries import CharacteristicRow


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


class NextAction(NamedTuple):
    """The next action of a person about a characteristic. path: of the page where it is done, None where there is none."""

    words: str
    path: str | None = None


def next_action(row: CharacteristicRow, machine: str) -> NextAction | None:
    """Return the next action at a characteristic, in words short enough to be read from two metres; None: nothing to do."""
    path = f"/alarms/{row.alarms[0][0]}" if row.alarms else None
    waiting = next((each for each in row.corrections if each[1] == row.state), None)
    if waiting is not None and row.state in WAITING:
        path = path or f"/machines/{machine}/corrections/{waiting[0]}"
    if row.state in _ACTIONS:
        amount = read_um(waiting[2] if waiting else None, row.parameters.half)
        return NextAction(_ACTIONS[row.state]().format(tool=row.parameters.tool_memory, amount=amount), path)
    return NextAction(_("Acknowledge the alarm"), path) if row.alarms else None


WAITING = {CharacteristicState.HELD, CharacteristicState.AWAITING_APPROVAL}
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


def reading_link(key: str, sequence: int) -> str:
    """Address of the page of a reading."""
    return f"/characteristics/{key}/readings/{sequence}"


def code_word(action: str) -> str:
    """Decision in a few words."""
    return {
        "none": _("No correction"),
        "correct": _("Corrected"),
        "hold": _("Correction held"),
        "stop": _("Stop asked for"),
    }.get(action, action)


def result_short(name: str) -> str:
    """Name of a variant's result where several stand side by side on a phone."""
    return {
        "out_of_roundness": _("Out of round"),
        "taper": _("Taper"),
        "straightness": _("Straightness"),
        "repeat_range": _("Range"),
        "repeat_deviation": _("Std dev."),
    }.get(name) or result_label(name)
