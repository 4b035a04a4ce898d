"""The programs of the ring for Sinumerik 840D sl, 828D and One: a field of user data (GUD), or R parameters.

What rests on Siemens' manuals as they are quoted in public, and is to be tried at the control (docs/how-to/ring-programs.md):
``STOPRE`` before user data that someone else writes; ``$P_TOOLEXIST``, ``$P_TOOLND``; ``SETAL`` from 65000 to 65999 stops the
program. A changed wear is taken over where the tool or its edge is selected the next time.
"""

from collections.abc import Iterator, Sequence

from app.core.programs.lines import written
from app.core.programs.ring_dialects import Dialect, RingText
from app.core.programs.ring_settings import TOOLS, RingSettings
from app.core.programs.ring_steps import PAUSE, Alarm, Do, If, Label, Let, RingProgram, Step
from app.core.ring import LAYOUT, SIZE

ALARMS = 65_800
WHOLE = frozenset({"count", "place", "tool", "edge"})
"""Numbers that count the elements of a field: INT."""
METRIC, GROUP = "$MN_SCALING_SYSTEM_IS_METRIC", "$P_GG[13]"


class Sinumerik(Dialect):
    functions = {"abs": "ABS", "round": "ROUND", "trunc": "TRUNC"}  # noqa: RUF012 - words, never changed
    compared = {"<": "<", "<=": "<=", ">": ">", ">=": ">="}  # noqa: RUF012

    def __init__(self, settings: RingSettings) -> None:
        super().__init__(settings)
        self.names: dict[str, None] = {}
        self.passed: set[str] = set()

    def texts(self, programs: Sequence[RingProgram], comments: Sequence[str]) -> list[RingText]:
        texts = [RingText("definition", "INBAND.DEF", self._definition())] if not self.settings.first_register else []
        texts += [RingText(program.name, f"{_called(program)}.SPF", self._text(program)) for program in programs]
        return [*texts, RingText("call", "INBAND_CALLS.MPF", self._calls(programs, comments))]

    def joined(self, texts: Sequence[RingText]) -> str:
        return "\n".join(f"; ===== {text.file} =====\n{text.text}" for text in texts)

    def _definition(self) -> str:
        return "\n".join(
            (
                "; USER DATA OF THE RING: ADD THESE LINES TO MGUD.DEF OR UGUD.DEF AND ACTIVATE IT",
                f"DEF CHAN REAL INBAND[{SIZE}]",
                f"DEF CHAN REAL INBAND_EFFECT[{TOOLS + 1}]",
                "M17",
                "",
            )
        )

    def _text(self, program: RingProgram) -> str:
        self.names, self.passed = {}, set()
        steps = self.lines(program)
        arguments = ",".join(f"{_kind(name)} {self.name(name)}" for name in program.arguments)
        own = [name for name in self.names if name not in program.arguments]
        first = self.settings.first_register
        where = f"INBAND[0] TO [{SIZE - 1}], INBAND_EFFECT" if not first else f"R{first} TO R{first + SIZE - 1}"
        lines = [
            f"PROC {_called(program)}{f'({arguments})' if arguments else ''}",
            f"; INBAND: {program.title}. LAYOUT {LAYOUT}. BLOCK: {where}",
            *(f"DEF {_kind(name)} {self.name(name)}" for name in own),
            *steps,
        ]
        return "\n".join(lines) + "\n"

    def _calls(self, programs: Sequence[RingProgram], comments: Sequence[str]) -> str:
        settings = self.settings
        known = [
            f"EXTERN {_called(program)}{f'({kinds})' if kinds else ''}"
            for program in programs
            for kinds in [",".join(_kind(name) for name in program.arguments)]
        ]
        lines = (
            *(f"; {comment}" for comment in comments),
            "; THESE LINES BELONG INTO THE PART PROGRAM. AT ITS VERY BEGINNING:",
            *known,
            "; BEFORE THE FIRST TOOL IS SELECTED. 0: LAST CORRECTION IN THE OFFSETS AT THE FIRST SET-UP",
            "INBAND_SETUP(0)",
            "INBAND_CORRECTION",
            f"; BEHIND EACH SELECTION OF A TOOL THAT CUTS, HERE OF T{settings.tool}",
            f"INBAND_TOOL({settings.tool})",
            f"; BEHIND THE MEASURING. {settings.measured}: WHERE YOUR CYCLE LEAVES THE SIZE",
            "; CHARACTERISTIC, SIZE, TOOL, PART, CORRECTION IN EFFECT (0: KEPT FOR THE TOOL), STATUS",
            f"INBAND_READING({settings.number},{settings.measured},{settings.tool},$AC_ACTUAL_PARTS,0,0)",
        )
        return "\n".join(lines) + "\n"

    def name(self, name: str) -> str:
        self.names.setdefault(name)
        return f"IB_{name.upper()}"

    def cell(self, array: str, index: str) -> str:
        if not self.settings.first_register:
            return f"{'INBAND' if array == 'block' else 'INBAND_EFFECT'}[{index}]"
        first = self.settings.first_register if array == "block" else self.settings.first_effect
        return f"R[{first + int(index)}]" if index.isdecimal() else f"R[{first}+{index}]"

    def comment(self, text: str) -> str:
        return f"; {text}"

    def assigned(self, target: str, value: str) -> str:
        return f"{target}={value}"

    def jump(self, condition: str | None, label: str) -> str:
        word = "GOTOB" if label in self.passed else "GOTOF"
        return f"IF {condition} {word} {label}" if condition else f"{word} {label}"

    def label(self, name: str) -> str:
        self.passed.add(name)
        return f"{name}:"

    def missing(self, argument: str) -> None:
        """An argument that is left out is 0 here."""

    def filled(self, argument: str) -> None:
        """It is 0 already."""

    def do(self, what: Do) -> Iterator[Step | str]:
        match what:
            case Do.SYNC:
                yield "STOPRE"
            case Do.PAUSE:
                yield f"G4 F{written(PAUSE)}"
            case Do.READ_UNIT:
                yield Let("unit", "1", "MM, WHERE BASIC SYSTEM AND G70, G71, G700, G710 AGREE")
                yield f"IF ({METRIC}==1) AND ({GROUP}<>1) AND ({GROUP}<>3) GOTOF UNITOK"
                yield Let("unit", "2", "INCH")
                yield f"IF ({METRIC}==0) AND ({GROUP}<>2) AND ({GROUP}<>4) GOTOF UNITOK"
                yield "GOTOF MIXED"
                yield Label("UNITOK")
            case Do.READ_CLOCK:
                yield f"{self.name('time')}=3600*$A_HOUR+60*$A_MINUTE+$A_SECOND"
            case Do.NEW_EPOCH:
                yield f"{self.name('epoch')}=$A_DAY-TRUNC($A_DAY/11)*11"
                clock = "3600*$A_HOUR+60*$A_MINUTE+$A_SECOND+49*$A_MSECOND"
                yield f"{self.name('epoch')}=1+86400*{self.name('epoch')}+{clock}"
            case Do.FIND_TOOL:
                yield If("edge<0.5", "REPLY")
                yield f"IF $P_TOOLEXIST[{self.name('tool')}]==FALSE GOTOF REPLY"
                yield f"IF {self.name('edge')}>$P_TOOLND[{self.name('tool')}] GOTOF REPLY"
            case Do.READ_WEAR | Do.SET_WEAR:
                for wear in self.settings.wears:
                    place = f"$TC_DP{wear.parameter}[{self.name('tool')},{self.name('edge')}]"
                    yield f"IF {self.name('parameter')}=={wear.parameter} ; {wear.meaning}"
                    reading = what is Do.READ_WEAR
                    yield f"  {self.name('offset')}={place}" if reading else f"  {place}={self.name('value')}"
                    yield "ENDIF"
            case Do.RETURN:
                yield "M17"

    def stop(self, alarm: Alarm) -> Iterator[str]:
        number, text = alarm.value
        yield f'MSG("{text}")'
        yield f"SETAL({ALARMS + number})"
        yield f"{alarm.name}_M0:"
        yield "M0"
        yield "STOPRE"
        yield f"GOTOB {alarm.name}_M0"


def _called(program: RingProgram) -> str:
    return f"INBAND_{program.name.upper()}"


def _kind(name: str) -> str:
    return "INT" if name in WHOLE else "REAL"
