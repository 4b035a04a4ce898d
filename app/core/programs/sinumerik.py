"""Sinumerik: the subprograms `L05` (calibration, L92) and `L15` (measuring, L75 and L93), and any block of R assignments.

An R number of the cycles has two digits. Without an equals sign the first two digits after R are therefore the number and
the rest is the value, as the source prints it: ``R240`` is R24 = 0, ``R32199.852`` is R32 = 199.852. With an equals sign
all digits before it are the number, so ``R240=0`` is R240, which the cycles do not know. The later names (``_TZL``) say
the same as the R numbers. As on the control the last assignment counts; a program ends with M17, M02, M30 or RET.

R numbers have no unit: the cycle takes them in the one that is in effect when it is called. Under G70 or G700 they become mm
here; where the unit changes between an assignment and the call, the unit cannot be determined, and the lengths are dropped and named.
"""

import re
from typing import Any

from app.core.number_text import has_printed_minus
from app.core.parameters import BY_NAME, BY_R, TWO_POINT_SWITCH, FieldKind
from app.core.programs import printed_macros
from app.core.programs.lines import (
    LONGEST_LINE,
    NUMBER,
    UNIT,
    WORD_ENDS,
    Note,
    Program,
    ProgramKind,
    ProgramText,
    in_mm,
    is_remark,
    line_of,
    no_number,
    number_in,
    says_inch,
    setting_in,
    single_blanks,
    split,
    unit_note,
)
from app.core.programs.sinumerik_values import (
    OF_CALIBRATION,
    ONLY_CALIBRATION,
    RESULT_LENGTHS,
    RESULTS,
    Assigned,
    Building,
    program_of,
)

LATER_NAMES = {
    "_TNUM": "R10",
    "_EVNUM": "R11",
    "_NMSP": "R27",
    "_FA": "R28",
    "_K": "R29",
    "_MA": "R30",
    "_MD": "R31",
    "_SETVAL": "R32",
    "_TZL": "R33",
    "_TMV": "R34",
    "_TSA": "R36",
    "_TDIF": "R37",
    "_TUL": "R40",
    "_TLL": "R41",
}
# Parameters of the later cycles for which there is nothing here: passed over on purpose.
OTHER_NAMES = frozenset(
    {"_CALNUM", "_CHBIT", "_CORA", "_CPA", "_CPO", "_ID", "_INCA", "_KNUM", "_MVAR", "_PRNUM", "_RA", "_RF", "_STA1"}
    | {"_SZA", "_SZO", "_TENV", "_TNAME", "_VMS"}
)
CALIBRATE = frozenset({"L92", "L05", "CYCLE973"})
MEASURE = frozenset({"L93", "L15", "CYCLE974", "CYCLE977", "CYCLE978", "CYCLE979", "CYCLE994"})
CYCLES = frozenset({"L92", "L93", *(CALIBRATE | MEASURE) - {"L05", "L15"}})

_VALUE = rf"{NUMBER}(?:EX?[+-]?\d+)?"
_ENDS = r"(?=\s*,?\s*(?:$|[A-Z_\[$\"%]))(?!\s*[-+*/^])"
_UP_TO_NEXT = r".+?(?=(?<![-+*/=^])\s+(?:[A-Z_$\[][\w\[\]]*\s*=|[A-Z]\s*[\d.])|\s*$)"


def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE | re.ASCII)


_BLOCK = _pattern(r"\s*(/\d?)?\s*(?:[N:]\s*\d+)?\s*")
_ASSIGNED = _pattern(r"R\s*(\d{1,4})\s*=\s*")
_NAMED = _pattern(r"\[?\s*(_[A-Z][A-Z0-9_]*)(?:\[[^\]]*\])?\s*\]?\s*=\s*")
_PLAIN_VALUE = _pattern(rf"({_VALUE}){_ENDS}")
_EXPRESSION = _pattern(_UP_TO_NEXT)
_TOGETHER = _pattern(rf"R\s*(\d{{2}})\s*\*?\s*(?:({_VALUE}){_ENDS}|(X+(?:\.X+)?)(?![A-Z0-9])|(?=\s|$))")
_BROKEN_TOGETHER = _pattern(r"R\s*(\d{2})\s*\*?\s*([+-]\s+[\d.,]+(?:\s+[\d.,]+)*|[+-]?[\d.,]+(?:\s+[\d.,]+)+)")
_CALL = _pattern(r"(L\s*\d{1,4}|CYCLE\d{3,4})" + WORD_ENDS)
_WORD = _pattern(
    rf"[GMTFSDHXYZIJKUVWABCPQ]\s*=?\s*{NUMBER}{WORD_ENDS}"
    r"|(?:%\S*|PROC\s+\w+|EXTERN\s+\w+|RET|STOPRE|MSG)(?![\w.])|%"
)
_ENDING = _pattern(rf"(?<![A-Z_$])(?:M\s*0*(?:2|17|30){WORD_ENDS}|RET(?![\w.]))")
_HEADING = _pattern(r"%.*|L\s*(?!(?:75|92|93)$)\d+|PROC\s+\w+")
_COMMENT = re.compile(r";(.*)$|\(([^()]*)\)|\((.*)$")


class _Reader:
    def __init__(self, text: str) -> None:
        self.texts = split(text)
        self.notes: list[list[Note]] = [[] for _ in self.texts]
        self.programs: list[Program] = []
        self.inch: bool | None = None
        self.now = Building(1)

    def read(self) -> ProgramText:
        for number, text in enumerate(self.texts, start=1):
            self._line(number, text, self.notes[number - 1])
        self._end(len(self.texts))
        zero = printed_macros.work_zero(note for notes in self.notes for note in notes)
        if zero and not self.programs:
            self.programs.append(Program(ProgramKind.WORK_ZERO, 1, len(self.texts), zero, {}, {}, {}, (), inch=False))
        lines = [line_of(number, *line) for number, line in enumerate(zip(self.texts, self.notes, strict=True), 1)]
        return ProgramText(tuple(lines), tuple(self.programs))

    # --- a line

    def _line(self, number: int, text: str, notes: list[Note]) -> None:
        if len(text) > LONGEST_LINE:
            notes.append(Note("too_long", {"most": LONGEST_LINE, "got": len(text)}))
            return
        comments: list[str] = []
        if "INBAND" not in text.upper():  # a step's brackets are no comments
            statement, semicolon, comment = text.partition(";")
            steps, rest = printed_macros.steps(single_blanks(statement), printed_macros.SINUMERIK)
            notes += steps
            text = rest + semicolon + comment if steps else text

        def without(match: re.Match[str]) -> str:
            if match.string[: match.start()].rstrip().endswith("="):
                return match[0]  # R33=(…) is a calculation
            comments.append(next(group for group in match.groups() if group is not None))
            return " "

        body = _COMMENT.sub(without, text)
        if has_printed_minus(body):
            notes.append(Note("printed_minus", {}))
        body = single_blanks(body)
        for comment in comments:
            self._comment(number, comment, notes)
        if _HEADING.fullmatch(body):
            self._begin(number)
        begins = _BLOCK.match(body)
        assert begins is not None
        if begins[1]:
            notes.append(Note("skip_block", {}))
        self._words(number, body[begins.end() :], notes)
        if not notes:
            notes.append(Note("words", {"words": body}) if body else Note("empty", {}))
        self.now.last_line = number
        if ending := _ENDING.search(body):
            self._end(number)
            if ending[0].upper()[0] == "M" and not ending[0].endswith("17"):
                self.inch = None  # a main program ends with the unit that the machine begins with

    def _comment(self, number: int, comment: str, notes: list[Note]) -> None:
        setting = setting_in(comment)
        if setting is None:
            notes.append(Note("comment", {}))
        elif setting[1] is None:
            self._lose(setting[0])
            notes.append(Note("bad_setting", {"text": comment.strip()[:80]}))
        else:
            self._assign(number, setting[0], setting[1], None, notes)
            notes.append(Note("setting", {"name": setting[0], "value": setting[1]}))

    def _words(self, number: int, body: str, notes: list[Note]) -> None:
        at = 0
        passed: list[str] = []
        unknown: list[str] = []
        while at < len(body):
            if body[at].isspace() or body[at] == ",":
                at += 1
            elif match := _ASSIGNED.match(body, at):
                at = self._valued(number, f"R{int(match[1]):02}", body, match.end(), "=", notes)
            elif match := _NAMED.match(body, at):
                at = self._valued(number, match[1].upper(), body, match.end(), "name", notes)
            elif match := UNIT.match(body, at):
                self.inch = says_inch(match)
                notes.append(unit_note(match))
                at = match.end()
            elif match := _BROKEN_TOGETHER.match(body, at):
                self._lose(f"R{match[1]}")
                notes.append(no_number(f"R{match[1]}", match[2]))
                at = match.end()
            elif match := _TOGETHER.match(body, at):
                self._together(number, match, notes)
                at = match.end()
            elif match := _CALL.match(body, at):
                self._call(number, re.sub(r"\s", "", match[1].upper()), notes)
                at = match.end()
            elif match := _WORD.match(body, at):
                passed.append(match[0])
                at = match.end()
            elif is_remark(body[:at], body[at:]):
                notes.append(Note("remark", {"text": body[at:].strip()[:200]}))
                break
            else:
                match = re.compile(r"\S+").match(body, at)
                assert match is not None
                unknown.append(match[0])
                at = match.end()
        if passed:
            notes.append(Note("words", {"words": " ".join(passed)[:200]}))
        if unknown:
            notes.append(Note("unknown", {"text": " ".join(unknown)[:200]}))

    def _valued(self, number: int, r: str, body: str, at: int, how: str, notes: list[Note]) -> int:
        """Read the value after an equals sign; return the index of the next word."""
        if match := _PLAIN_VALUE.match(body, at):
            self._parameter(number, r, match[1], how, notes)
            return match.end()
        match = _EXPRESSION.match(body, at)
        text = match[0].strip() if match else ""
        if r in OTHER_NAMES:
            notes.append(Note("not_used", {"r": r}))
        else:
            self._lose(LATER_NAMES.get(r, r))
            notes.append(no_number(r, text))
        return match.end() if match else at

    def _lose(self, r: str) -> None:
        """On the control it has another value now, one that is not known here: the one before must not stand for it."""
        self.now.assigned.pop(BY_R.get(r, r), None)

    def _together(self, number: int, match: re.Match[str], notes: list[Note]) -> None:
        r = f"R{match[1]}"
        if match[2]:
            self._parameter(number, r, match[2], "run_together", notes)
        elif match[3]:
            self._lose(r)
            notes.append(Note("placeholder", {"r": r, "text": match[3]}))
        else:
            self._lose(r)
            notes.append(Note("no_value", {"r": r}))

    def _parameter(self, number: int, written_as: str, text: str, how: str, notes: list[Note]) -> None:
        r = LATER_NAMES.get(written_as, written_as)
        value = number_in(re.sub(r"EX?", "E", text.upper()))
        if r in OTHER_NAMES:
            notes.append(Note("not_used", {"r": r}))
        elif r not in BY_R and r not in {TWO_POINT_SWITCH, *ONLY_CALIBRATION, *RESULTS}:
            notes.append(Note("unknown_r", {"r": r, "text": text[:40]}))
        elif value is None:
            self._lose(r)
            notes.append(Note("too_large", {"r": r}))
        else:
            name = BY_R.get(r, r)
            inches = value if self.inch and _is_length(name) else None
            value = in_mm(value, inches is not None)
            self._assign(number, name, value, r, notes)
            data = {"r": r, "name": name, "value": value, "how": how, "text": written_as}
            notes.append(Note("assigned", data if inches is None else data | {"inch": inches}))

    def _assign(self, number: int, name: str, value: Any, r: str | None, notes: list[Note]) -> None:
        before = self.now.assigned.get(name)
        if before is not None:
            notes.append(Note("again", {"r": r or name, "before": before.value, "line": before.line}))
        self.now.assigned[name] = Assigned(value, number, r, self.inch)

    # --- programs

    def _begin(self, number: int) -> None:
        """A heading: what stood before is another program; comments right above belong to this one."""
        described = {name: assigned for name, assigned in self.now.assigned.items() if assigned.r is None}
        if self.now.called or len(described) < len(self.now.assigned):
            self._end(number - 1)
        self.now.first_line = min(self.now.first_line, number)

    def _call(self, number: int, word: str, notes: list[Note]) -> None:
        kind = ProgramKind.CALIBRATION if word in CALIBRATE else ProgramKind.MEASURING if word in MEASURE else None
        if word == "L75":
            self.now.mean_nominal = True
        elif kind is None:
            notes.append(Note("unknown", {"text": word}))
            return
        elif word not in CYCLES:
            self.now.kind = self.now.kind or kind
        else:
            if self.now.called:  # a second cycle in one program finds what was assigned for the first
                carried_over = {
                    name: assigned for name, assigned in self.now.assigned.items() if name not in OF_CALIBRATION
                }
                self._end(number - 1)
                self.now.assigned, self.now.first_line = carried_over, number
            self.now.kind, self.now.called = kind, True
        if word == "L75" or word in CYCLES:
            self.now.called_in.append(self.inch)
        notes.append(Note("call", {"word": word}))

    def _end(self, number: int) -> None:
        if self.now:
            self.now.last_line = number
            if not self.now.called_in:
                self.now.called_in.append(self.inch)
            self.programs.append(program_of(self.now, self.notes))
        self.now = Building(number + 1)


def _is_length(name: str) -> bool:
    field = BY_NAME.get(name)
    return name in RESULT_LENGTHS or (field is not None and field.kind is FieldKind.LENGTH)


def read(text: str) -> ProgramText:
    """Every line of a program text with a verdict, and the programs in it. Raises `ProgramError` for what is no text.

    >>> found = read("L15\\nN5 R103 R240 R250 R33=0,001\\nN10 L93\\nN15 M17").program
    >>> found.kind.value, found.parameters
    ('measuring', {'tool_memory': 3, 'variant': 'single', 'zero_range': 0.001})
    """
    return _Reader(text).read()
