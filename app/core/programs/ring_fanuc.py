"""The programs of the ring for Fanuc and its like (GSK): user macros B.

``G53`` alone in a block keeps the blocks behind it from being read ahead (Fanuc 16i/18i/21i-TB A-78962EN, 7.1; 21i-MB
B-63614EN, 15.7.1). Numbers are calculated with eight digits. To be tried at the control: docs/how-to/ring-programs.md.
"""

from collections.abc import Iterator, Sequence

from app.core.programs.ring_dialects import Dialect, RingText
from app.core.programs.ring_settings import RingSettings
from app.core.programs.ring_steps import Alarm, Do, If, Label, Let, RingProgram, Step
from app.core.ring import LAYOUT, SIZE

ALARMS = 90
LETTERS = {
    "applied": ("A", 1),
    "characteristic": ("C", 3),
    "measured": ("V", 22),
    "tool": ("T", 20),
    "part": ("W", 23),
    "in_effect": ("E", 8),
    "status": ("S", 19),
}
"""Letter of an argument behind G65, and the variable that it becomes."""
FREE = (*range(33, 23, -1), 21, 18, 17, *range(16, 9, -1))
"""Local variables for the program's own numbers: those behind `first` and `kept` have them."""
LEGEND_WIDTH = 70
PARTS = "#3901"


class Fanuc(Dialect):
    opening, closing = "[", "]"
    functions = {"abs": "ABS", "round": "ROUND", "trunc": "FIX"}  # noqa: RUF012 - words, never changed
    compared = {"<": " LT ", "<=": " LE ", ">": " GT ", ">=": " GE "}  # noqa: RUF012

    def __init__(self, settings: RingSettings) -> None:
        super().__init__(settings)
        self.names: dict[str, int] = {}
        self.numbers: dict[str, int] = {}

    def texts(self, programs: Sequence[RingProgram], comments: Sequence[str]) -> list[RingText]:
        texts = [
            RingText(program.name, f"{self._number(at)}.NC", self._text(program, at))
            for at, program in enumerate(programs)
        ]
        return [*texts, RingText("call", "CALLS.NC", self._calls(comments))]

    def joined(self, texts: Sequence[RingText]) -> str:
        return "%\n" + "\n".join(text.text.removeprefix("%\n").removesuffix("%\n") for text in texts) + "%\n"

    def _number(self, at: int) -> str:
        return f"O{self.settings.first_program + at:04}"

    def _text(self, program: RingProgram, at: int) -> str:
        self.names = {"first": FREE[0]}
        self.numbers = {}
        steps = self.lines(program)
        effects = "kept" in self.names
        called = " ".join(f"{LETTERS[name][0]}={name.upper().replace('_', ' ')}" for name in program.arguments)
        head = [
            "%",
            f"{self._number(at)} (INBAND {program.title}, LAYOUT {LAYOUT})",
            self.comment(f"G65 P{self.settings.first_program + at} {called}".strip()),
            *self._legend(program),
            self._remarked(f"#{self.names['first']}={self.settings.first_register}", f"FIRST OF {SIZE} REGISTERS"),
        ]
        if effects:
            words = "CORRECTION IN EFFECT OF TOOL N IS IN THIS PLUS N"
            head.append(self._remarked(f"#{self.names['kept']}={self.settings.first_effect}", words))
        return "\n".join([*head, *steps, "%"]) + "\n"

    def _legend(self, program: RingProgram) -> Iterator[str]:
        """Comments that name the variables."""
        line = ""
        for name, number in self.names.items():
            if name in {"first", "kept"}:
                continue
            entry = f"#{number} {name.upper().replace('_', ' ')}"
            if line and len(line) + len(entry) + 2 > LEGEND_WIDTH:
                yield self.comment(line)
                line = ""
            line = f"{line}, {entry}" if line else entry
        if line:
            yield self.comment(line)

    def _calls(self, comments: Sequence[str]) -> str:
        settings, first = self.settings, self.settings.first_program
        tool, size = f"T{settings.tool}.", settings.measured
        lines = (
            *(f"({comment})" for comment in comments),
            "(THESE LINES BELONG INTO THE PART PROGRAM)",
            "(AT ITS BEGINNING, BEFORE THE FIRST TOOL IS SELECTED)",
            "(A LAST CORRECTION IN THE OFFSETS AT THE FIRST SET-UP)",
            f"G65 P{first} A0.",
            f"G65 P{first + 2}",
            f"(BEHIND EACH SELECTION OF A TOOL THAT CUTS, HERE TOOL {settings.tool})",
            f"G65 P{first + 3} {tool}",
            "(BEHIND THE MEASURING. V IS WHERE YOUR CYCLE LEAVES THE SIZE)",
            "(C CHARACTERISTIC, T TOOL, W PART, E CORRECTION IN EFFECT IF NOT THE KEPT ONE)",
            "(S 1 IF THE PROBE DID NOT TRIGGER, 2 IF ON ITS FIRST MOVE, 3 MARKED)",
            f"G65 P{first + 1} C{settings.number}. V{size} {tool} W{PARTS}",
        )
        return "\n".join(lines) + "\n"

    def name(self, name: str) -> str:
        if name not in self.names:
            used = set(self.names.values())
            own = [LETTERS[name][1]] if name in LETTERS else []
            self.names[name] = next(number for number in (*own, *FREE) if number not in used)
        return f"#{self.names[name]}"

    def cell(self, array: str, index: str) -> str:
        if array == "system":
            return f"#{index}" if index.isdecimal() else f"#[{index}]"
        first = self.name("first" if array == "block" else "kept")
        return f"#[{first}]" if index == "0" else f"#[{first}+{index}]"

    def comment(self, text: str) -> str:
        return f"({_plain(text)})"

    def assigned(self, target: str, value: str) -> str:
        return f"{target}={value}"

    def jump(self, condition: str | None, label: str) -> str:
        to = f"GOTO {self._place(label)}"
        return f"IF [{condition}] {to}" if condition else to

    def label(self, name: str) -> str:
        return f"N{self._place(name)}"

    def _place(self, label: str) -> int:
        return self.numbers.setdefault(label, 10 * (len(self.numbers) + 1))

    def missing(self, argument: str) -> str:
        return f"{self.name(argument)} EQ #0"

    def filled(self, argument: str) -> str:
        return f"{self.name(argument)}={self.name(argument)}+0"

    def do(self, what: Do) -> Iterator[Step | str]:
        match what:
            case Do.SYNC:
                yield "G53"
            case Do.PAUSE:
                yield "G4 P500"
            case Do.READ_UNIT:
                yield Let("unit", "2", "INCH: G20, G70")
                yield If("abs(system[4006]-20)<0.5", "UNITOK")
                yield If("abs(system[4006]-70)<0.5", "UNITOK")
                yield Let("unit", "1", "MM")
                yield Label("UNITOK")
            case Do.READ_CLOCK:
                yield from _clock()
            case Do.NEW_EPOCH:
                yield from _clock()
                yield Let("epoch", "system[3011]-trunc(system[3011]/100)*100", "DAY OF THE MONTH")
                yield Let("epoch", "epoch-trunc(epoch/11)*11")
                yield Let("clock", "system[3001]-trunc(system[3001]/1000)*1000", "MILLISECONDS")
                yield Let("epoch", "1+86400*epoch+time+49*trunc(clock)")
            case Do.FIND_TOOL:
                yield If("edge<-0.5", "REPLY")
                yield If("edge>1.5", "REPLY")
            case Do.READ_WEAR:
                yield Let("offset", "system[parameter+tool]")
            case Do.SET_WEAR:
                yield Let("system[parameter+tool]", "value", "THE NEW WEAR")
            case Do.RETURN:
                yield "M99"

    def stop(self, alarm: Alarm) -> Iterator[str]:
        number, text = alarm.value
        yield f"#3000={ALARMS + number}({text})"


def _clock() -> Iterator[Step]:
    """Set ``time`` by the clock of the control, which says 235959."""
    yield Let("clock", "system[3012]")
    yield Let("time", "trunc(clock/10000)", "HOURS")
    yield Let("clock", "clock-time*10000")
    yield Let("time", "60*time+trunc(clock/100)", "MINUTES")
    yield Let("time", "60*time+clock-trunc(clock/100)*100", "SECONDS OF THE DAY")


def _plain(text: str) -> str:
    """Without what older controls do not take in a comment: a colon there is a program number."""
    return text.replace(":", " -").replace("(", "").replace(")", "")
