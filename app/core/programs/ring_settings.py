"""Settings of the programs of the ring: the control, its registers, and the limits that hold at the machine."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from app.core.parameters import MachineType
from app.core.programs.correction_forms import Form
from app.core.programs.corrections import LAST_REGISTER
from app.core.ring import SIZE


class RingControl(StrEnum):
    """Controls that ring programs are written for. fanuc: GSK and others with the same user macros, too."""

    SINUMERIK = "sinumerik"
    FANUC = "fanuc"
    HAAS = "haas"


class Offsets(StrEnum):
    """Place of the wear that the mailbox may set.

    edges: `$TC_DP` of Sinumerik. lathe_line and lathe: the wear from #2700 and from #2000 on a Fanuc, as the correction texts
    have them; on a Haas lathe from #2700. mill: length and radius (Haas: diameter) wear.
    """

    EDGES = "edges"
    LATHE_LINE = "lathe_line"
    LATHE = "lathe"
    MILL = "mill"


class Wear(NamedTuple):
    """One register of a tool's wear. parameter: its number in the mailbox; on Fanuc and Haas tool n has #[parameter+n]."""

    parameter: int
    meaning: str
    tools: int


TOOLS: Final = 99
"""Tools for which the number of the correction in effect is kept."""
MAIL_TIME: Final = {RingControl.SINUMERIK: 1.0, RingControl.FANUC: 1.0, RingControl.HAAS: 3.0}
"""Seconds without mail behind a correction that was taken, after which the program goes on. Haas is read number by number."""
MOST_PARTS: Final = 9_999_999
MOST_CHARACTERISTICS: Final = 9_999
LONGEST_SIZE: Final = 9_999
TOLERANCE: Final = 0.0006
"""mm: a control keeps three decimals, and rounds."""
TOLERANCE_INCH: Final = 0.00006
"""A control in inch keeps four."""

WEARS: Final[dict[tuple[RingControl, Offsets], tuple[Wear, ...]]] = {
    (RingControl.SINUMERIK, Offsets.EDGES): (
        Wear(12, "WEAR OF LENGTH 1", TOOLS),
        Wear(13, "WEAR OF LENGTH 2", TOOLS),
        Wear(14, "WEAR OF LENGTH 3", TOOLS),
        Wear(15, "WEAR OF THE RADIUS", TOOLS),
    ),
    (RingControl.FANUC, Offsets.LATHE_LINE): (
        Wear(2700, "WEAR IN X", LAST_REGISTER[Form.WEAR_VARIABLES]),
        Wear(2800, "WEAR IN Z", LAST_REGISTER[Form.WEAR_VARIABLES]),
    ),
    (RingControl.FANUC, Offsets.LATHE): (
        Wear(2000, "WEAR IN X", LAST_REGISTER[Form.WEAR_VARIABLES_2000]),
        Wear(2100, "WEAR IN Z", LAST_REGISTER[Form.WEAR_VARIABLES_2000]),
    ),
    (RingControl.FANUC, Offsets.MILL): (
        Wear(10000, "WEAR OF THE LENGTH", TOOLS),
        Wear(12000, "WEAR OF THE RADIUS", TOOLS),
    ),
    (RingControl.HAAS, Offsets.LATHE): (Wear(2700, "WEAR IN X", 50), Wear(2800, "WEAR IN Z", 50)),
    (RingControl.HAAS, Offsets.MILL): (
        Wear(2200, "WEAR OF THE LENGTH", TOOLS),
        Wear(2600, "WEAR OF THE DIAMETER", TOOLS),
    ),
}
FIRST_REGISTERS: Final = {RingControl.SINUMERIK: 0, RingControl.FANUC: 700, RingControl.HAAS: 10800}
"""Where the block begins if nothing is said; 0: in `INBAND[98]`, a field of its own."""
NOT_FREE: Final = {
    RingControl.SINUMERIK: (range(100),),
    RingControl.FANUC: (range(500), range(598, 604)),
    RingControl.HAAS: (range(500), range(550, 604), range(10000, 10500), range(10550, 10604)),
}
"""Variables that the measuring cycles, the probes and the texts of corrections and work offsets use, or that a reset clears."""
HIGHEST: Final = {RingControl.SINUMERIK: 32_535, RingControl.FANUC: 999, RingControl.HAAS: 10_999}
"""The last variable that a program can keep over power off."""
HIGHEST_OF_ALL: Final = max(HIGHEST.values())


class RingError(ValueError):
    """These settings make no programs. code: `offsets`, `taken` or `too_high`, worded at the edge; data: the values for it."""

    def __init__(self, code: str, field: str, **data: object) -> None:
        super().__init__(f"{field}: {code} {data}")
        self.code, self.field, self.data = code, field, data


def offsets_of(control: RingControl, machine: MachineType) -> Offsets:
    """The place of the wear on such a machine, as correction texts take it if nothing is said."""
    if control is RingControl.SINUMERIK:
        return Offsets.EDGES
    if machine in {MachineType.MILL, MachineType.MILL_TURN}:
        return Offsets.MILL
    return Offsets.LATHE if control is RingControl.HAAS else Offsets.LATHE_LINE


@dataclass(frozen=True, slots=True)
class RingSettings:
    """Settings of the programs.

    first_register: of the block; behind its 98 stand, from the next hundred on, the numbers of the corrections in effect, one
    for each tool. number: the characteristic's in the ring. tool, measured: for the call behind the measuring, the location
    and the word that holds the size. time_out: seconds after which the program no longer waits for the bridge; it stops then,
    or writes on (go_on). largest_step: mm. first_program: number of the first program on Fanuc and Haas. decision_time: seconds that
    a reading waits for the server's decision; without one the program goes on, or stops (decision_stops), and a decision that
    comes late counts at the next reading or correction. hold_stops: a hold stops the machine as a stop does.

    Raises `RingError` where the control does not have these registers.
    """

    control: RingControl
    offsets: Offsets
    first_register: int = 0
    number: int = 1
    tool: int = 1
    measured: str = ""
    time_out: float = 30.0
    go_on: bool = False
    largest_step: float = 0.1
    first_program: int = 9820
    decision_time: float = 3.0
    decision_stops: bool = False
    hold_stops: bool = False

    def __post_init__(self) -> None:
        if (self.control, self.offsets) not in WEARS:
            choices = [offsets.value for control, offsets in WEARS if control is self.control]
            raise RingError("offsets", "offsets", control=self.control.value, choices=choices)
        object.__setattr__(self, "first_register", self.first_register or FIRST_REGISTERS[self.control])
        if self.first_register:
            last = max(self.first_register + SIZE, self.first_effect + TOOLS + 1) - 1
            if last > HIGHEST[self.control]:
                raise RingError("too_high", "first_register", last=last, highest=HIGHEST[self.control])
            for taken in NOT_FREE[self.control]:
                if self.first_register < taken.stop and last >= taken.start:
                    raise RingError("taken", "first_register", first=taken.start, last=taken.stop - 1)

    @property
    def first_effect(self) -> int:
        """The first of the registers behind the block: 0 holds the corrections back if it is not 0, n belongs to tool n."""
        return self.first_register + 100 if self.first_register else 0

    @property
    def wears(self) -> tuple[Wear, ...]:
        """The registers that the mailbox may set."""
        return WEARS[self.control, self.offsets]
