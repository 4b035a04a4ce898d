"""Fanuc-like lathe line (domain §6): the macro variables #500 to #513, and the calls of the two macros.

    #500 #501  start X, Z              #505        nominal             #510-#512  results of the three sections
    #502       probe radius term       #506 #507   ES, EI              #513       rejects counted
    #503       radius                  #504        probing feed        #[2700+n]  wear of offset n

The macros touch a bore at three sections along Z, pass it with two of three inside, and add the middle of the tolerance
minus the mean of the three to the tool's offset. Here that is R33 = 0, k = 1, acceptance 2 of 3 and factor -1. The line
has neither wear limit nor confidence limit: the least of the cycles' ranges is taken, and said.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from app.core.natural_limit import assumed, half_width
from app.core.number_text import has_printed_minus
from app.core.parameters import BY_NAME, FieldKind, Parameters, mean_nominal
from app.core.programs import printed_macros, unit_check
from app.core.programs.lines import (
    DESCRIBING,
    LONGEST_LINE,
    NUMBER,
    UNIT,
    WORD_ENDS,
    Note,
    Program,
    ProgramKind,
    ProgramText,
    describing,
    in_mm,
    is_remark,
    line_of,
    mixed,
    no_number,
    number_in,
    says_inch,
    setting_in,
    settings,
    single_blanks,
    split,
    unit_note,
    written,
)

INPUTS = {505: "nominal", 506: "upper_deviation", 507: "lower_deviation", 1: "tool_memory"}
VALUES = {500: "START X", 501: "START Z", 502: "PROBE RADIUS TERM", 503: "RADIUS", 504: "PROBING FEED"}
RESULTS = (510, 511, 512, 513)
WITHOUT_UNIT = (1, 513)
CALIBRATING_MACRO, MEASURING_MACRO = 9010, 9011
SECTIONS = 3
WEAR_LIMIT, CONFIDENCE_LIMIT = 0.3, 1.0  # mm, the least of the ranges printed for R37 and R36
FEELER, MOST_FEELER = 2, 1.0  # variable of the printed edge finder's macro, and the mm from which it raises an alarm
RING_DEVIATION = 0.01  # mm, until a person says what the ring may deviate

_ENDS = r"(?=\s*(?:$|[A-Z#(%\[]))"
_VARIABLE = re.compile(r"#\s*(\d{1,5})\s*=\s*", re.IGNORECASE | re.ASCII)
_VALUE = re.compile(rf"({NUMBER}){_ENDS}", re.IGNORECASE | re.ASCII)
_COMPUTED = re.compile(
    r"(?:#\s*\[.*\]\s*=|IF\b|IF\[|WHILE\b|WHILE\[|GOTO\s*\d|DO\s*\d|END\s*\d|THEN\b).*", re.IGNORECASE
)
_MACRO = re.compile(rf"G\s*65\s*P\s*(\d{{1,5}})((?:\s*[A-Z]\s*{NUMBER})*)(?![\w.])", re.IGNORECASE | re.ASCII)
_BROKEN_ARGUMENT = re.compile(r"\s+[\d.,]+", re.ASCII)
# On lathes G70 and G71 are the finishing and the roughing cycle, with words of their own.
_TURNING_CYCLE = re.compile(r"\s*(?:[PQUWRDIK]\s*[-\d.#\[]|[A-Z]\s*\d*\.?\s*[PQUWD]\s*[-\d.#\[])", re.IGNORECASE)
_ARGUMENT = re.compile(rf"A\s*({NUMBER})", re.IGNORECASE | re.ASCII)
_WORD = re.compile(rf"[A-Z]\s*(?:{NUMBER}|#\s*\d+){WORD_ENDS}|%\S*", re.IGNORECASE | re.ASCII)
_CHOOSES_OFFSET = re.compile(r"IF\s*\[\s*#1\s*EQ\s*5[4-9]\.?0*\s*\]", re.IGNORECASE)
_BRACKET = re.compile(r"[A-Z]\s*-?\[", re.IGNORECASE | re.ASCII)
_COMMENT = re.compile(r";(.*)$|\(([^()]*)\)|\((.*)$")


class _Reader:
    def __init__(self, text: str) -> None:
        self.texts = split(text)
        self.notes: list[list[Note]] = [[] for _ in self.texts]
        self.assigned: dict[str, tuple[Any, int]] = {}
        self.values: dict[str, float] = {}
        self.results: dict[str, float] = {}
        self.kind: ProgramKind | None = None
        self.inch: bool | None = None
        self.lengths: dict[str, tuple[int, bool | None]] = {}  # variable: line and unit of its value
        self.called_in: list[bool | None] = []
        self.chooses_offset = any(map(_CHOOSES_OFFSET.search, self.texts))  # #1 is 54 for G54 there, and no tool
        self.feeler: tuple[int, float] | None = None  # line and mm of #2, which the edge finder's macro takes off Z

    def read(self) -> ProgramText:
        for number, text in enumerate(self.texts, start=1):
            self._line(number, text, self.notes[number - 1])
        programs = (self._program(),) if self.assigned or self.values or self.results or self.kind else ()
        zero = printed_macros.work_zero(note for notes in self.notes for note in notes)
        if zero and self.kind is None and "nominal" not in self.assigned:  # #1 is no tool there, #502 no radius
            programs = (self._work_zero(zero),)
        lines = [line_of(number, *line) for number, line in enumerate(zip(self.texts, self.notes, strict=True), 1)]
        return ProgramText(tuple(lines), programs)

    def _work_zero(self, zero: dict[str, Any]) -> Program:
        """The work zero of an edge finder's macro, with the feeler that it takes off Z."""
        notes: list[Note] = []
        inch = self.inch is True
        if "tip" in zero:
            zero["tip"] = in_mm(zero["tip"], inch)
        if self.feeler is not None:
            line, zero["feeler"] = self.feeler
            step = Note("step", {"step": "feeler", "r": "#2", "value": zero["feeler"]})
            at = self.notes[line - 1]
            self.notes[line - 1] = [step if note == Note("not_used", {"r": "#2"}) else note for note in at]
            if not 0 <= zero["feeler"] <= MOST_FEELER:
                notes.append(Note("feeler_range", {"value": f"{zero['feeler']:g}", "highest": f"{MOST_FEELER:g}"}))
        return Program(ProgramKind.WORK_ZERO, 1, len(self.texts), zero, {}, {}, {}, tuple(notes), inch=inch)

    def _line(self, number: int, text: str, notes: list[Note]) -> None:
        if len(text) > LONGEST_LINE:
            notes.append(Note("too_long", {"most": LONGEST_LINE, "got": len(text)}))
            return
        comments = [next(group for group in match.groups() if group is not None) for match in _COMMENT.finditer(text)]
        for comment in comments:
            setting = setting_in(comment)
            if setting is None:
                notes.append(Note("comment", {}))
            elif setting[1] is None:
                self.assigned.pop(setting[0], None)
                notes.append(Note("bad_setting", {"text": comment.strip()[:80]}))
            else:
                self._assign(number, setting[0], setting[0], setting[1], notes)
                notes.append(Note("setting", {"name": setting[0], "value": setting[1]}))
        body = _COMMENT.sub(" ", text)
        if has_printed_minus(body):
            notes.append(Note("printed_minus", {}))
        numbered = single_blanks(body)
        body = re.sub(r"^/?\s*(?:[NO]\s*\d+)?\s*", "", numbered, flags=re.IGNORECASE)
        self._words(number, self._steps(body, notes), notes)
        if not notes:
            notes.append(Note("words", {"words": numbered}) if numbered else Note("empty", {}))

    def _steps(self, body: str, notes: list[Note]) -> str:
        """Note the steps of a printed macro; return what else is in the block."""
        steps, rest = printed_macros.steps(body, printed_macros.FANUC)
        for step in steps:
            if step.data["step"] in {"measured", "size", "centre"} and step.data["r"] in self.results:
                self._lose(int(step.data["r"][1:]))
            nominal, radius = self.assigned.get("nominal"), self.values.get("#503")
            if step.data["step"] == "probing_target" and nominal is not None and radius is not None:
                sign = -1 if step.data.get("sign") else 1
                step.data["value"] = sign * round(printed_macros.target(nominal[0], radius), 6)
        notes += steps
        return rest

    def _words(self, number: int, body: str, notes: list[Note]) -> None:
        at = 0
        passed: list[str] = []
        unknown: list[str] = []
        while at < len(body):
            if body[at].isspace():
                at += 1
            elif match := _VARIABLE.match(body, at):
                at = self._variable(number, int(match[1]), body, match.end(), notes)
            elif match := _COMPUTED.match(body, at):
                notes.append(Note("computed", {"text": match[0][:80]}))
                at = match.end()
            elif match := _MACRO.match(body, at):
                self._macro(number, match, notes)
                at = match.end()
                if match[2] and (broken := _BROKEN_ARGUMENT.match(body, at)):
                    self._lose(1)
                    notes.append(no_number("#1", match[2].strip() + broken[0]))
                    at = broken.end()
            elif (match := UNIT.match(body, at)) and not self._turning_cycle(body, match):
                self.inch = says_inch(match)
                notes.append(unit_note(match))
                at = match.end()
            elif match := _WORD.match(body, at):
                passed.append(match[0])
                at = match.end()
            elif (match := _BRACKET.match(body, at)) and (end := _closing(body, match.end())):
                passed.append(body[at:end])
                at = end
            elif is_remark(body[:at], body[at:]):
                notes.append(Note("remark", {"text": body[at:].strip()[:200]}))
                break
            else:
                end = next((i for i in range(at, len(body)) if body[i].isspace()), len(body))
                unknown.append(body[at:end])
                at = end
        if passed:
            notes.append(Note("words", {"words": " ".join(passed)[:200]}))
        if unknown:
            notes.append(Note("unknown", {"text": " ".join(unknown)[:200]}))

    @staticmethod
    def _turning_cycle(body: str, word: re.Match[str]) -> bool:
        return "7" in word[0] and _TURNING_CYCLE.match(body, word.end()) is not None

    def _variable(self, number: int, variable: int, body: str, at: int, notes: list[Note]) -> int:
        """Read the value that is assigned to a variable; return the index of the next word."""
        known = variable in INPUTS or variable in VALUES or variable in RESULTS
        match = _VALUE.match(body, at)
        if match is None:
            text = body[at:].strip()
            name = f"#{variable}"
            reason = no_number(name, text)
            self._lose(variable)
            if not known or (reason.code == "expression" and (variable in RESULTS or variable == 1)):
                notes.append(Note("computed", {"text": f"{name}={text}"[:80]}))
            else:
                notes.append(reason)
            return len(body)
        self._number(number, variable, match[1], notes)
        return match.end()

    def _lose(self, variable: int) -> None:
        """On the control it has another value now, one that is not known here: the one before must not stand for it."""
        self.assigned.pop(INPUTS.get(variable, ""), None)
        self.values.pop(f"#{variable}", None)
        self.results.pop(f"#{variable}", None)
        self.lengths.pop(f"#{variable}", None)

    def _number(self, number: int, variable: int, text: str, notes: list[Note]) -> None:
        r, value = f"#{variable}", number_in(text)
        if value is None:
            self._lose(variable)
            notes.append(Note("too_large", {"r": r}))
            return
        inches: dict[str, float] = {}
        if variable in {*INPUTS, *VALUES, *RESULTS} and variable not in WITHOUT_UNIT:
            self.lengths[r] = (number, self.inch)
            if self.inch:
                inches, value = {"inch": value}, in_mm(value, True)
        if variable == 1 and self.chooses_offset:
            notes.append(Note("step", {"step": "offset_chosen", "r": r, "value": value}))
        elif variable in INPUTS:
            self._assign(number, INPUTS[variable], r, value, notes)
            notes.append(Note("assigned", _assigned(r, INPUTS[variable], value) | inches))
        elif variable in VALUES:
            self.values[r] = value
            notes.append(Note("assigned", _assigned(r, None, value) | inches))
        elif variable in RESULTS:
            self.results[r] = value
            notes.append(Note("result", {"r": r, "value": value} | inches))
        else:
            if variable == FEELER:
                self.feeler = (number, in_mm(value, self.inch is True))
            notes.append(Note("not_used", {"r": r}))

    def _unit(self, notes: list[Note]) -> bool:
        """Tell if the lengths were in inches. Lengths of an ambiguous unit are dropped, and named."""
        units = [unit for _line, unit in self.lengths.values()]
        if units and mixed([*units, *(self.called_in or [self.inch])]):
            for r, (line, _unit) in list(self.lengths.items()):
                self.notes[line - 1].append(Note("unit_mixed", {"r": r}))
                self._lose(int(r[1:]))
            return False
        if any(units):
            notes.append(Note("from_inch", {}))
        return any(units)

    def _macro(self, number: int, match: re.Match[str], notes: list[Note]) -> None:
        macro, argument = int(match[1]), _ARGUMENT.search(match[2])
        if macro == CALIBRATING_MACRO:
            self.kind = self.kind or ProgramKind.CALIBRATION
        else:
            self.kind = ProgramKind.MEASURING
        self.called_in.append(self.inch)
        notes.append(Note("call", {"word": f"G65 P{macro}"}))
        if argument:
            self._number(number, 1, argument[1], notes)

    def _assign(self, number: int, name: str, r: str, value: Any, notes: list[Note]) -> None:
        if name in self.assigned:
            before, line = self.assigned[name]
            notes.append(Note("again", {"r": r, "before": before, "line": line}))
        self.assigned[name] = (value, number)

    def _program(self) -> Program:
        notes: list[Note] = []
        inch = self._unit(notes)
        parameters = {name: value for name, (value, _line) in self.assigned.items()}
        about: dict[str, str] = {name: parameters.pop(name) for name in DESCRIBING if name in parameters}
        kind = self.kind
        if kind is None:
            kind = ProgramKind.ASSIGNMENTS if parameters or self.values else ProgramKind.RESULTS
        if kind is ProgramKind.CALIBRATION:
            parameters = {"gauge" if name == "nominal" else name: value for name, value in parameters.items()}
        elif kind is not ProgramKind.RESULTS:
            _complete(parameters, notes)
        for name, value in parameters.items():
            field = BY_NAME.get(name)
            if field and field.kind is FieldKind.WHOLE and isinstance(value, float) and value == int(value):
                parameters[name] = int(value)
        return Program(kind, 1, len(self.texts), parameters, about, self.values, self.results, tuple(notes), inch)


def _assigned(r: str, name: str | None, value: float) -> dict[str, Any]:
    return {"r": r, "name": name, "value": value, "how": "=", "text": r}


def _closing(body: str, at: int) -> int | None:
    """Behind the bracket that closes the one opened just before ``at``."""
    depth = 1
    for place in range(at, len(body)):
        depth += {"[": 1, "]": -1}.get(body[place], 0)
        if depth == 0:
            return place + 1
    return None


def implied() -> dict[str, Any]:
    """The fixed behaviour of the line's macros as parameters."""
    values = {
        "variant": "along",
        "points": SECTIONS,
        "zero_range": 0.0,
        "weighting_factor": 1.0,
        "factor": -1.0,
        "accept": {"n": 2, "m": SECTIONS},
        "feature": "inside",
    }
    return {name: value for name, value in values.items() if name in BY_NAME or name == "accept"}


def _complete(parameters: dict[str, Any], notes: list[Note]) -> None:
    """Add what the macros do, and the two limits that the line does not have."""
    if "target" in parameters:
        for name in ("nominal", "upper_deviation", "lower_deviation"):
            parameters.pop(name, None)
    added = {name: value for name, value in implied().items() if name not in parameters}
    if added:
        notes.append(Note("macro", {"parameters": added}))
    parameters |= added
    width = parameters.get("tolerance_width")
    if all(name in parameters for name in ("nominal", "upper_deviation", "lower_deviation")):
        width = mean_nominal(*(parameters[name] for name in ("nominal", "upper_deviation", "lower_deviation")))[1]
    natural = parameters.get("natural_limit") or assumed(parameters)
    wear = max(WEAR_LIMIT, half_width(width or 0.0, natural))
    for name, value in (("wear_limit", wear), ("confidence_limit", max(CONFIDENCE_LIMIT, wear))):
        if name not in parameters:
            parameters[name] = value
            notes.append(Note("assumed", {"name": name, "value": value}))
    if "tool_memory" not in parameters:  # R10 = 0 corrects nothing, which nobody means by the macro of this line
        notes.append(Note("no_tool", {}))


def read(text: str) -> ProgramText:
    """Every line of a macro text with a verdict, and the program in it. Raises `ProgramError` for what is no text.

    >>> found = read("#505=40. (NOMINAL)\\n#506 = 0.025\\n#507=0.\\nG65 P9011 A3.").program
    >>> found.parameters["nominal"], found.parameters["tool_memory"], found.parameters["accept"]
    (40.0, 3, {'n': 2, 'm': 3})
    """
    return _Reader(text).read()


def touches(results: Mapping[str, float]) -> list[list[float]] | None:
    """#510 to #512 as the touches of a reading, one list per section; None unless all three are there.

    >>> touches({"#510": 40.002, "#511": 40.004, "#512": 40.003, "#513": 0})
    [[40.002], [40.004], [40.003]]
    """
    names = [f"#{variable}" for variable in RESULTS[:SECTIONS]]
    return [[results[name]] for name in names] if all(name in results for name in names) else None


# --- writing


def pointed(value: float) -> str:
    """A number as macros want it: with a decimal point.

    >>> pointed(40.0), pointed(-0.016)
    ('40.', '-0.016')
    """
    text = written(value)
    return text if "." in text else f"{text}."


def write_measuring(parameters: Parameters, about: Mapping[str, str], values: Mapping[str, float]) -> str:
    """The variables of the lathe line and the call of its measuring macro; `read` makes the same parameters of it."""
    upper = parameters.upper_deviation if parameters.nominal is not None else parameters.tolerance.upper
    lower = parameters.lower_deviation if parameters.nominal is not None else parameters.tolerance.lower
    nominal = parameters.nominal if parameters.nominal is not None else parameters.target
    written = {"tool_memory", "nominal", "upper_deviation", "lower_deviation"}
    comments = [*describing(about), *settings(parameters, written, implied())]
    block = [
        (505, nominal, "NOMINAL"),
        (506, upper or 0.0, "UPPER DEVIATION ES"),
        (507, lower or 0.0, "LOWER DEVIATION EI"),
    ]
    call = f"G65 P{MEASURING_MACRO} A{parameters.tool_memory}. (MEASURING MACRO, A: OFFSET OF THE TOOL)"
    return _text("MEASURING", comments, block, values, call)


def write_calibration(gauge: float, about: Mapping[str, str], values: Mapping[str, float]) -> str:
    """The variables for the ring of this size, mm, and the call of the calibrating macro."""
    block = [
        (505, gauge, "SIZE OF THE RING"),
        (506, RING_DEVIATION, "WHAT THE RING MAY BE LARGER"),
        (507, -RING_DEVIATION, "WHAT IT MAY BE SMALLER"),
    ]
    return _text("CALIBRATION", [*describing(about)], block, values, f"G65 P{CALIBRATING_MACRO} (CALIBRATING MACRO)")


def _text(
    title: str, comments: list[str], block: list[tuple[int, float, str]], values: Mapping[str, float], call: str
) -> str:
    def lines() -> Iterator[str]:
        yield f"({title}, LATHE LINE)"
        yield from unit_check.fanuc(unit_check.LATHE_LINE_ALARM)
        for comment in comments:
            yield f"({comment})"
        for variable, meaning in VALUES.items():
            value = values.get(f"#{variable}")
            yield f"(#{variable} {meaning}: AS IT IS)" if value is None else f"#{variable}={pointed(value)} ({meaning})"
        for variable, value, meaning in block:
            yield f"#{variable}={pointed(value)} ({meaning})"
        yield call
        yield "M99"

    return "\n".join(lines()) + "\n"
