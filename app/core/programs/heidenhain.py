"""Heidenhain: calls of the kinematics cycles TCH PROBE 450, 451 and 452 (G450, G451, G452) with their Q parameters.

Read are the calls, in Klartext or ISO, the results Q141 to Q149 and QS144 to QS146, and the blocks that cut numbers out of
these strings (SUBSTR, TONUMB). What the manual of cycle 452 asks for is looked at: M128 or TCPM off, planes not tilted, no
rotation. Lengths of a program in inches become mm; results are mm in any program. Lengths mm, angles degrees.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from app.core.number_text import has_printed_minus, plain
from app.core.programs.lines import (
    LONGEST_LINE,
    NUMBER,
    UNIT,
    Note,
    Program,
    ProgramKind,
    ProgramText,
    in_mm,
    line_of,
    no_number,
    number_in,
    says_inch,
    split,
    unit_note,
    written,
)
from app.core.rotary.axis import ERRORS
from app.core.rotary.measuring_plan import PLACES, MeasuringPlan, QValue, q_values
from app.core.rotary.results import STRINGS, read_string

ANGLE = (-359.9999, 359.9999)
LARGEST = 99_999.9999
TITLES = {450: "SAVE KINEMATICS", 451: "MEASURE KINEMATICS", 452: "PRESET COMPENSATION"}


class Q(NamedTuple):
    """A Q parameter of the cycles: its name on the control, its range, whether it is a length, and the words it takes."""

    name: str
    lowest: float
    highest: float
    length: bool = False
    words: frozenset[str] = frozenset()


_AXIS_NAMES = ("START ANGLE {} AXIS", "END ANGLE {} AXIS", "INCID. ANGLE {} AXIS", "MEAS. POINTS {} AXIS")
PARAMETERS: dict[str, Q] = {
    "Q406": Q("MODE", 0, 3),
    "Q407": Q("SPHERE RADIUS", 0.0001, 99.9999, length=True),
    "Q320": Q("SET-UP CLEARANCE", 0, LARGEST, length=True, words=frozenset({"PREDEF"})),
    "Q408": Q("RETR. HEIGHT", 0, LARGEST, length=True),
    "Q253": Q("F PRE-POSITIONING", 0, LARGEST, length=True, words=frozenset({"FMAX", "FAUTO", "PREDEF"})),
    "Q380": Q("REFERENCE ANGLE", 0, 360),
    **{
        f"Q{411 + 4 * at + place}": Q(name.format(letter), *((0, 12) if place == 3 else ANGLE))
        for at, letter in enumerate("ABC")
        for place, name in enumerate(_AXIS_NAMES)
    },
    "Q423": Q("NO. OF PROBE POINTS", 3, 8),
    "Q431": Q("PRESET", 0, 3),
    "Q432": Q("BACKLASH, ANG. RANGE", -3, 3),
}
OF_SAVING: dict[str, Q] = {"Q410": Q("MODE", 0, 3), "Q409": Q("MEMORY DESIGNATION", 0, LARGEST)}
ONLY_451 = frozenset({"Q406", "Q431"})
RESULT_NUMBERS = frozenset(f"Q{number}" for number in range(141, 150))
WIDTH = 10  # characters of a number in QS144 to QS146, which one blank parts

_BLOCK = re.compile(r"\s*/?\s*(?:N\s*)?\d*\s+(?=\D)|\s*/?\s*N\s*\d+\s*", re.ASCII | re.IGNORECASE)
_CALL = re.compile(
    r"(?:TCH\s+PROBE\s+|G)(45[012])(?:\.0)?(?![\d.])\s*([^=~;]*?)(?<!\s)(?=\s*(?:Q[SLR]?\d+\s*=|~|\*?$))", re.IGNORECASE
)
_NUMBER = re.compile(rf"(Q\d{{1,4}})\s*=\s*({NUMBER})(?=\s*(?:$|[~;*]|Q))", re.ASCII | re.IGNORECASE)
_STRING = re.compile(r"(QS\d{1,4})\s*=\s*[\"“”]([^\"“”]*)[\"“”]", re.ASCII | re.IGNORECASE)
_WORD = re.compile(r"(Q\d{1,4})\s*+=?\s*(FMAX|FAUTO|PREDEF)\b", re.ASCII | re.IGNORECASE)
_BROKEN = re.compile(
    r"(Q[SLR]?\d{1,4})\s*=\s*([^~;]*?)(?<!\s)(?=\s*(?:$|[~;]|\*$|Q[SLR]?\d+\s*=))", re.ASCII | re.IGNORECASE
)
_OF_CALL = re.compile(r"\s*(?:\d+\s+)?Q(?:S409|(?!14\d\b)\d{3})\b", re.ASCII | re.IGNORECASE)  # a line without its ~
_SUBSTR = re.compile(
    r"(QS\d{1,4})\s*=\s*SUBSTR\s*\(\s*SRC_(QS14[456])\s+BEG(\d{1,3})\s+LEN(\d{1,3})\s*\)", re.ASCII | re.IGNORECASE
)
_TONUMB = re.compile(r"(Q[LR]?\d{1,4})\s*=\s*TONUMB\s*\(\s*SRC_(QS\d{1,4})\s*\)", re.ASCII | re.IGNORECASE)
_STATES = (
    (
        "tcpm_active",
        re.compile(r"\bM128\b|FUNCTION\s+TCPM", re.IGNORECASE),
        re.compile(r"\bM129\b|FUNCTION\s+RESET\s+TCPM", re.IGNORECASE),
    ),
    ("tilted", re.compile(r"\bPLANE\s+(?!RESET)\w+", re.IGNORECASE), re.compile(r"\bPLANE\s+RESET", re.IGNORECASE)),
    (
        "rotated",
        re.compile(r"CYCL\s+DEF\s+10\.1\s+ROT\s*[+-]?0*\.?0*[1-9]", re.IGNORECASE),
        re.compile(r"CYCL\s+DEF\s+10\.1\s+ROT\s*[+-]?0*\.?0*\s*$", re.IGNORECASE),
    ),
)


class _Reader:
    def __init__(self, text: str) -> None:
        self.texts = split(text)
        self.notes: list[list[Note]] = [[] for _ in self.texts]
        self.programs: list[Program] = []
        self.inch: bool | None = None
        self.call: tuple[int, int, dict[str, Any], bool] | None = None  # cycle, first line, values, in inches
        self.going_on = False
        self.pieces: dict[str, str] = {}  # QS: the value that was cut out into it
        self.states: dict[str, int] = {}
        self.results: dict[str, float] = {}
        self.first_result = 0

    def read(self) -> ProgramText:
        for number, text in enumerate(self.texts, start=1):
            self._line(number, text, self.notes[number - 1])
        self._end_call(len(self.texts))
        if self.results:
            self.programs.append(
                Program(
                    ProgramKind.RESULTS, self.first_result, len(self.texts), {}, {}, {}, self.results, (), inch=False
                )
            )
        lines = [line_of(number, *line) for number, line in enumerate(zip(self.texts, self.notes, strict=True), 1)]
        return ProgramText(tuple(lines), tuple(self.programs))

    def _line(self, number: int, text: str, notes: list[Note]) -> None:
        if len(text) > LONGEST_LINE:
            notes.append(Note("too_long", {"most": LONGEST_LINE, "got": len(text)}))
            return
        body, _semicolon, comment = text.partition(";")
        if has_printed_minus(body):
            notes.append(Note("printed_minus", {}))
        goes_on = text.rstrip().endswith("~")
        body = plain(body)
        if self.call is not None and not self.going_on and not _OF_CALL.match(body):
            self._end_call(number - 1)
        if begins := _BLOCK.match(f" {body}"):
            body = f" {body}"[begins.end() :]
        if unit := UNIT.search(body):
            self.inch = says_inch(unit)
            notes.append(unit_note(unit))
        for state, on, off in _STATES:
            if off.search(body):
                self.states.pop(state, None)
            elif on.search(body):
                self.states[state] = number
        if called := _CALL.search(body):
            self._begin_call(number, int(called[1]), notes)
        self._assignments(number, body, notes)
        self.going_on = goes_on
        if not notes:
            words = body.replace("~", "").strip()
            notes.append(
                Note("words", {"words": words[:200]}) if words else Note("comment" if comment else "empty", {})
            )

    # --- calls

    def _begin_call(self, number: int, cycle: int, notes: list[Note]) -> None:
        self._end_call(number - 1)
        self.call = (cycle, number, {}, bool(self.inch))
        notes.append(Note("cycle", {"cycle": cycle}))
        if cycle != 450:
            notes.extend(Note(state, {"line": line}) for state, line in self.states.items())

    def _end_call(self, line: int) -> None:
        if self.call is None:
            return
        cycle, first, values, inch = self.call
        missing = [name for name in _expected(cycle) if name not in values]
        notes = [Note("q_missing", {"names": ", ".join(missing[:8])})] if missing else []
        if inch and any(PARAMETERS[name].length for name in values if name in PARAMETERS):
            notes.append(Note("from_inch", {}))
        parameters = {"cycle": cycle} | values
        self.programs.append(
            Program(ProgramKind.KINEMATICS, first, max(first, line), parameters, {}, {}, {}, tuple(notes), inch)
        )
        self.call = None

    # --- what is behind an equals sign

    def _assignments(self, number: int, body: str, notes: list[Note]) -> None:
        rest = body
        for pattern, take in ((_SUBSTR, self._substr), (_TONUMB, self._tonumb), (_STRING, self._string)):
            rest = pattern.sub(lambda match, take=take: take(number, match, notes), rest)  # type: ignore[misc]
        rest = _WORD.sub(lambda match: self._value(match[1].upper(), match[2].upper(), notes), rest)
        rest = _NUMBER.sub(lambda match: self._number(number, match[1].upper(), match[2], notes), rest)
        for match in _BROKEN.finditer(rest):
            q = match[1].upper()
            if self.call is not None or q in RESULT_NUMBERS or q in STRINGS:
                if self.call is not None:
                    self.call[2].pop(q, None)
                self.results.pop(q, None)
                notes.append(no_number(q, match[2]))

    def _number(self, number: int, q: str, text: str, notes: list[Note]) -> str:
        value = number_in(text)
        if value is None:
            if self.call is not None:
                self.call[2].pop(q, None)
            notes.append(Note("too_large", {"r": q}))
        elif self.call is not None:
            self._value(q, value, notes)
        elif q in RESULT_NUMBERS:
            self.first_result = self.first_result or number
            self.results[q] = value
            notes.append(Note("result", {"r": q, "value": value}))
        return " "

    def _value(self, q: str, value: QValue, notes: list[Note]) -> str:
        if self.call is None:
            return " "
        cycle, _first, values, inch = self.call
        known = _expected(cycle).get(q)
        if known is None:
            notes.append(Note("unknown_q", {"r": q, "cycle": cycle}))
            return " "
        data: dict[str, Any] = {"r": q, "value": value}
        if isinstance(value, str):
            if value not in known.words:
                values.pop(q, None)
                notes.append(Note("no_number", {"r": q, "text": value}))
                return " "
        elif inch and known.length:
            data |= {"inch": value, "value": (value := in_mm(value, True))}
        values[q] = value
        notes.append(Note("q_assigned", data))
        if not isinstance(value, str) and not known.lowest <= value <= known.highest:
            notes.append(Note("q_range", {"r": q, "value": value, "lowest": known.lowest, "highest": known.highest}))
        return " "

    def _string(self, number: int, match: re.Match[str], notes: list[Note]) -> str:
        q = match[1].upper()
        if self.call is not None and self.call[0] == 450 and q == "QS409":
            self.call[2]["Q409"] = match[2]
            notes.append(Note("q_assigned", {"r": q, "value": match[2][:40]}))
        elif q in STRINGS:
            self.first_result = self.first_result or number
            result = read_string(q, match[2])
            known = {name: value for name, value in result.values.items() if value is not None}
            self.results |= known
            notes += [Note("result", {"r": name, "value": value}) for name, value in known.items()]
            notes += [Note("no_number", {"r": q, "text": flaw.text[:40]}) for flaw in result.flaws if not known]
        return " "

    def _substr(self, number: int, match: re.Match[str], notes: list[Note]) -> str:
        target, source = match[1].upper(), match[2].upper()
        begin, length = int(match[3]), int(match[4])
        names = ERRORS[STRINGS[source]]
        at, beside = divmod(begin, WIDTH + 1)
        if length == WIDTH and beside in (0, 1) and at < len(names) and begin in (0, *(11 * n for n in range(1, 4))):
            self.pieces[target] = names[at]
            notes.append(Note("cut_out", {"name": names[at], "source": source, "r": target}))
        else:
            self.pieces.pop(target, None)
            notes.append(Note("cut_wrong", {"source": source, "begin": begin, "length": length}))
        return " "

    def _tonumb(self, number: int, match: re.Match[str], notes: list[Note]) -> str:
        name = self.pieces.get(match[2].upper())
        if name is not None:
            notes.append(Note("as_number", {"name": name, "r": match[1].upper()}))
        return " "


def _expected(cycle: int) -> dict[str, Q]:
    if cycle == 450:
        return OF_SAVING
    return {name: q for name, q in PARAMETERS.items() if cycle == 451 or name not in ONLY_451}


def read(text: str) -> ProgramText:
    """Every line of a text with a verdict, and the calls in it. Raises `ProgramError` for what is no text.

    >>> found = read("12 TCH PROBE 452 PRESET COMPENSATION ~\\n   Q407=+12.5 ;SPHERE RADIUS ~\\n   Q253=FMAX").program
    >>> found.kind.value, found.parameters
    ('kinematics', {'cycle': 452, 'Q407': 12.5, 'Q253': 'FMAX'})
    """
    return _Reader(text).read()


# --- writing


def write_call(cycle: int, values: Mapping[str, QValue], number: int | None = None) -> Iterator[str]:
    """One call in Klartext, a line for each Q parameter."""
    head = f"TCH PROBE {cycle} {TITLES[cycle]}" + (" ~" if values else "")
    yield head if number is None else f"{number} {head}"
    names = _expected(cycle)
    last = len(values) - 1
    for place, (q, value) in enumerate(values.items()):
        end = " ~" if place < last else ""
        yield f"    {q}={_q(value)} ;{names[q].name}{end}"


def write_plan(plan: MeasuringPlan, memory: int = 0) -> str:
    """The program of a measuring plan: the kinematics is saved, measured, and the result strings are taken apart.

    memory: where cycle 450 saves the kinematics. `read` makes the same plan of the text.
    """
    return "\n".join(_plan(plan, memory)) + "\n"


def _plan(plan: MeasuringPlan, memory: int) -> Iterator[str]:
    yield f"BEGIN PGM INBAND_{plan.cycle} MM"
    yield "; CALIBRATION SPHERE CLAMPED, PRESET IN ITS CENTER AND ACTIVE"
    yield "; MODE FUNCTION MODE MILL; M128 AND FUNCTION TCPM OFF; NO TILTED PLANE"
    yield "; BASIC ROTATION OFF; SET PRESET AND BASIC ROTATION AGAIN AFTERWARDS"
    yield "; TOWARDS THE SPHERE THE SMALLER OF Q253 AND FMAX OF THE PROBE COUNTS;"
    yield "; ROTARY AXES MOVE WITH Q253, AND THE PROBE IS NOT MONITORED MEANWHILE"
    for axis in plan.order:
        if axis.teeth:
            yield f"; {axis.axis} HAS HIRTH TEETH OF {written(axis.teeth)} DEGREES: KEEP Q408 ABOVE 0"
        if not axis.encoder:
            yield f"; {axis.axis} HAS NO ENCODER OF ITS OWN: KEEP 1 DEGREE TO THE LIMIT SWITCHES"
    yield 'TOOL CALL "TOUCH_PROBE" Z'
    yield from write_call(450, {"Q410": 0.0, "Q409": float(memory)})
    yield from write_call(plan.cycle, q_values(plan))
    register = 0
    for axis in plan.order:
        source = next(name for name, letter in STRINGS.items() if letter == axis.axis)
        for place, name in enumerate(ERRORS[axis.axis]):
            yield f"QS0 = SUBSTR ( SRC_{source} BEG{place * (WIDTH + 1)} LEN{WIDTH} ) ; {name}"
            yield f"QL{register} = TONUMB ( SRC_QS0 ) ; {name}"
            register += 1
    yield f"END PGM INBAND_{plan.cycle} MM"


def _q(value: QValue) -> str:
    if isinstance(value, str):
        return value
    rounded = round(value, PLACES) + 0.0
    return f"{'-' if rounded < 0 else '+'}{written(abs(rounded))}"
