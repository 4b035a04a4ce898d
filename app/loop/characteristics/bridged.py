"""Warnings at set-up of what the bridge of a machine does not carry of a characteristic: its corrections, and a stop."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.web.warnings import WarningOut


def warnings(current: CurrentCharacteristic) -> Iterator[WarningOut]:
    """Warn of corrections that would wait at the server, and of a machine that a probe fault does not stop."""
    if current.mapped is not None and not current.parameters.measures_only:
        yield from _uncarried(current, [place for place in current.mapped if place.get("corrected", True)])
    if current.carries_decisions is False:
        text = _(
            "This machine cannot be stopped by Inband: its bridge carries no decision to the control. A stop is an alarm here, and "
            "nothing more"
        )
        yield WarningOut(code="no_stop", text=text)


def _uncarried(current: CurrentCharacteristic, corrected: Sequence[Mapping[str, Any]]) -> Iterator[WarningOut]:
    """Warn where no correction of this tool memory reaches the control. corrected: the locations to which the bridge carries any."""
    memory = current.parameters.tool_memory
    location = next((place for place in corrected if place["tool_memory"] == memory), None)
    code = "not_mapped"
    if not corrected:
        text = _(
            "The bridge of this machine carries no corrections: those of tool memory {value} wait here until they are entered at "
            "the control and confirmed. If they will not be, set the mode to measure_only"
        )
    elif location is None:
        text = _(
            "The bridge of this machine has no location for tool memory {value}: no correction of it reaches the control until "
            "[[machine.{machine}.location]] names it. The other tools go on"
        )
    elif location.get("proved_at") is None and location.get("proof_needed", True):
        code = "not_proved"
        text = _(
            "No touch test has proved the location of tool memory {value}: the bridge holds its corrections back until one has. Make "
            "it before the first part: inband bridge touch-test --config plant.toml {machine} {value}"
        )
    else:
        return
    yield WarningOut(
        code=code, text=text.format(value=memory, machine=current.machine.key), field="parameters.tool_memory"
    )
