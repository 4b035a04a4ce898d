"""The end of a shadow trial: the characteristic corrects from now on."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.core.parameters import Mode
from app.errors import Conflict, Invalid
from app.language.formatting import um_limit
from app.language.i18n import _
from app.loop.characteristics.actions import CharacteristicChange, change_characteristic
from app.loop.characteristics.queries import CurrentCharacteristic, characteristic_named
from app.quality.trial.queries import Settings
from app.quality.trial.schemas import StartIn
from app.web.verb import Verb


@dataclass(frozen=True)
class OfTrial:
    """A characteristic on trial, who acts on it, and the settings that were proposed."""

    session: Session
    key: str
    caller: Caller
    settings: Settings | None = None

    @property
    def current(self) -> CurrentCharacteristic:
        """It as it is now. Raises `NotFound`."""
        return characteristic_named(self.session, self.key)

    @property
    def number(self) -> int:
        """Version of its parameters."""
        return self.current.version.version

    @property
    def values(self) -> Mapping[str, Any]:
        """Its name and its tool."""
        current = self.current
        tool = current.parameters.tool_memory
        return {"name": current.characteristic.name, "tool": tool, "where": _("tool {tool}").format(tool=tool)}


def start_correcting(on: OfTrial, given: StartIn) -> CurrentCharacteristic:
    """End the trial: a new version of the parameters with the mode *automatic*, and the settings where they are named.

    409 where it corrects already, or other parameters are in force; 422 without a tool memory (R10).
    """
    current = on.current
    parameters = current.parameters
    if parameters.mode is not Mode.MEASURE_ONLY and parameters.tool_memory:
        raise Conflict(
            _("{name} corrects already.").format(name=current.characteristic.name), _("There is nothing left to do.")
        )
    if not parameters.tool_memory:
        raise Invalid.at(
            "parameters_version",
            _("names no tool memory (R10): there is nothing to correct"),
            do=_("Name the tool in Set-up first."),
        )
    changes: dict[str, Any] = {"mode": Mode.AUTOMATIC.value}
    named = {"weighting_factor": given.weighting_factor, "zero_range": given.zero_range}
    changes |= {name: value for name, value in named.items() if value is not None}
    change = CharacteristicChange(
        parameters=changes, parameters_version=given.parameters_version or current.version.version, reason=given.reason
    )
    return change_characteristic(on.session, on.key, change, on.caller.name)


def _follows(on: OfTrial) -> list[str]:
    sentences = [
        _("From the next reading on corrections of tool {tool} go to the machine, without asking.").format(**on.values)
    ]
    if on.settings is not None:
        sentences.append(
            _("Weighting factor k = {k}, zero range R33 = {r33}: a new version of the parameters.").format(
                k=f"{on.settings.weighting_factor:g}", r33=um_limit(on.settings.zero_range, "")
            )
        )
    sentences.append(
        _("The sign and size of the factor were never tried: make a touch test, or watch the first corrections.")
    )
    return sentences


def _hidden(on: OfTrial) -> dict[str, str]:
    hidden = {"parameters_version": str(on.number)}
    if on.settings is not None:
        hidden |= {name: f"{value:.9f}" for name, value in on.settings._asdict().items()}
    return hidden


START: Verb[OfTrial, StartIn] = Verb(
    name="start",
    body=StartIn,
    act=start_correcting,
    role="engineer",
    own=lambda on: on.current.version.created_by == on.caller.name and not on.current.parameters.measures_only,
    word=lambda: _("Switch to automatic"),
    title=lambda _on: _("Let {name} correct tool {tool}?"),
    follows=_follows,
    hidden=_hidden,
    reasons=lambda: [_("Shadow trial looked at"), _("Touch test made"), _("Agreed with the machinist")],
    said=lambda: _("It corrects from now on."),
)
