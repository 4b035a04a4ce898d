"""The NC programs of the ring for a characteristic: settings from what a caller says, and the texts. Nothing is stored."""

from typing import Literal

from app.core.parameters import MachineType
from app.core.programs.lines import describing
from app.core.programs.ring_dialects import RingText
from app.core.programs.ring_settings import Offsets, RingControl, RingError, RingSettings, offsets_of
from app.core.programs.ring_texts import joined, texts
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic

RingPart = Literal["all", "definition", "setup", "reading", "correction", "tool", "call"]
RING_CONTROLS = tuple(control.value for control in RingControl)
MEASURED = {RingControl.SINUMERIK: "R43", RingControl.FANUC: "#510", RingControl.HAAS: "#188"}
"""The variable in which measuring cycles often leave the size: to be replaced by one's own."""
SIZE_WORD = r"^[#$A-Za-z0-9_\[\].]{1,40}$"
"""Such a variable: `#510`, `R43`, `_OVR[4]`."""


def ring_control(current: CurrentCharacteristic, control: str | None) -> RingControl:
    """The control that was asked for, else the machine's. Raises `Invalid` where nothing is written for it."""
    control = control or current.machine.control
    if control not in RING_CONTROLS:
        raise Invalid.at(
            "control",
            _("must be sinumerik, fanuc or haas: programs for the bridge are not written for {control}").format(
                control=control
            ),
            do=_("Say for which control, for example control=haas."),
        )
    return RingControl(control)


def ring_settings(
    current: CurrentCharacteristic,
    control: RingControl,
    *,
    number: int = 1,
    first_register: int = 0,
    time_out: float = 30.0,
    go_on: bool = False,
    largest_step: float = 0.1,
    measured: str | None = None,
    offsets: Offsets | None = None,
    decision_time: float = 3.0,
    decision_stops: bool = False,
    hold_stops: bool = False,
) -> RingSettings:
    """Settings of the programs for the machine of a characteristic; offsets: as on such a machine if left out.

    Raises `Invalid` for registers that it cannot have.
    """
    try:
        return RingSettings(
            control=control,
            offsets=offsets or offsets_of(control, MachineType(current.machine.type)),
            first_register=first_register,
            number=number,
            tool=max(current.parameters.tool_memory, 1),
            measured=measured or MEASURED[control],
            time_out=time_out,
            go_on=go_on,
            largest_step=largest_step,
            decision_time=decision_time,
            decision_stops=decision_stops,
            hold_stops=hold_stops,
        )
    except RingError as error:
        raise Invalid.at(error.field, _refused(error)) from None


def _refused(error: RingError) -> str:
    return {
        "taken": _("must leave {first} to {last} free: cycles, probes or a reset use them"),
        "too_high": _("is too high: the last register would be {last}, and the control keeps them up to {highest}"),
        "offsets": _("are not kept so on this control"),
    }[error.code].format(**error.data)


def ring_texts(current: CurrentCharacteristic, settings: RingSettings) -> list[RingText]:
    """Every text for the control, the calls for the part program last."""
    characteristic = current.characteristic
    about = {"characteristic": characteristic.key, "name": characteristic.name, "part": characteristic.part or ""}
    number = f"CHARACTERISTIC {settings.number} IN THE RING"
    return texts(settings, [*(line.upper() for line in describing(about)), number])


def ring_text(current: CurrentCharacteristic, settings: RingSettings, part: str) -> RingText:
    """One of the texts, or all in one. Raises `Invalid` where this control has no such text."""
    written = ring_texts(current, settings)
    if part == "all":
        ending = "txt" if settings.control is RingControl.SINUMERIK else "nc"
        programs = written if settings.control is RingControl.SINUMERIK else written[:-1]
        return RingText("all", f"INBAND-RING.{ending}", joined(settings, programs))
    for text in written:
        if text.key == part:
            return text
    raise Invalid.at("ring", _("must be one of {parts}").format(parts=", ".join(text.key for text in written)))


def ring_word(key: str) -> str:
    """Name of a text, with when it runs."""
    return {
        "definition": _("User data: once, into MGUD.DEF or UGUD.DEF"),
        "setup": _("Set up the block"),
        "reading": _("Send a reading"),
        "correction": _("Take a correction"),
        "tool": _("A tool was selected"),
        "call": _("Calls for the part program"),
    }[key]


def offsets_word(offsets: Offsets) -> str:
    """Name of a place of the wear."""
    return {
        Offsets.EDGES: _("$TC_DP of the edge"),
        Offsets.LATHE_LINE: _("lathe, from #2700 on"),
        Offsets.LATHE: _("lathe"),
        Offsets.MILL: _("mill, length and radius"),
    }[offsets]
