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

from app.core.parameters import BY_NAME, Kind, Parameters, mean_nominal
from app.core.programs.lines import (
    DESCRIBING,
    LONGEST_LINE,
    NUMBER,
    Note,
    Program,
    ProgramKind,
    ProgramText,
    describing,
    line_of,
    number_in,
    setting_in,
    settings,
    split,
    written,
)

INPUTS = {505: "nominal", 506: "upper_deviation", 507: "lower_deviation", 1: "tool_memory"}
VALUES = {500: "START X", 501: "START Z", 502: "PROBE RADIUS TERM", 503: "RADIUS", 504: "PROBING FEED"}
RESULTS = (510, 511, 512, 513)
CALIBRATING_MACRO, MEASURING_MACRO = 9010, 9011
SECTIONS = 3
WEAR_LIMIT, CONFIDENCE_LIMIT = 0.3, 1.0  # mm, the least of the ranges printed for R37 and R36
RING_DEVIATION = 0.01  # mm, until somebody says what the ring may deviate

_ENDS = r"(?=\s*(?:$|[A-Z#(%\[]))"
_VARIABLE = re.compile(r"#\s*(\d{1,5})\s*=\s*", re.IGNORECASE | re.ASCII)
_VALUE = re.compile(rf"({NUMBER}){_ENDS}", re.IGNORECASE | re.ASCII)
_COMPUTED = re.compile(
    r"(?:#\s*\[.*\]\s*=|IF\b|IF\[|WHILE\b|WHILE\[|GOTO\s*\d|DO\s*\d|END\s*\d|THEN\b).*", re.IGNORECASE
)
_MACRO = re.compile(rf"G\s*65\s*P\s*(\d{{1,5}})((?:\s*[A-Z]\s*{NUMBER})*)(?![\w.])", re.IGNORECASE | re.ASCII)
_ARGUMENT = re.compile(rf"A\s*({NUMBER})", re.IGNORECASE | re.ASCII)
_WORD = re.compile(rf"[A-Z]\s*(?:{NUMBER}|#\s*\d+)(?![\w.])|%\S*", re.IGNORECASE | re.ASCII)
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

    def read(self) -> ProgramText:
        for number, text in enumerate(self.texts, start=1):
            self._line(number, text, self.notes[number - 1])
        programs = (self._program(),) if self.assigned or self.values or self.results or self.kind else ()
        lines = [line_of(number, *each) for number, each in enumerate(zip(self.texts, self.notes, strict=True), 1)]
        return ProgramText(tuple(lines), programs)

    def _line(self, number: int, text: str, notes: list[Note]) -> None:
        if len(text) > LONGEST_LINE:
            notes.append(Note("too_long", {"most": LONGEST_LINE, "got": len(text)}))
            return
        comments = [next(each for each in found.groups() if each is not None) for found in _COMMENT.finditer(text)]
        for comment in comments:
            setting = setting_in(comment)
            if setting is None:
                notes.append(Note("comment", {}))
            elif setting[1] is None:
                notes.append(Note("bad_setting", {"text": comment.strip()[:80]}))
            else:
                self._assign(number, setting[0], setting[0], setting[1], notes)
                notes.append(Note("setting", {"name": setting[0], "value": setting[1]}))
        body = _COMMENT.sub(" ", text).strip()
        self._words(number, re.sub(r"^/?\s*(?:[NO]\s*\d+)?\s*", "", body, flags=re.IGNORECASE), notes)
        if not notes:
            notes.append(Note("words", {"words": body}) if body else Note("empty", {}))

    def _words(self, number: int, body: str, notes: list[Note]) -> None:
        at = 0
        passed: list[str] = []
        unknown: list[str] = []
        while at < len(body):
            if body[at].isspace():
                at += 1
            elif found := _VARIABLE.match(body, at):
                at = self._variable(number, int(found[1]), body, found.end(), notes)
            elif found := _COMPUTED.match(body, at):
                notes.append(Note("computed", {"text": found[0][:80]}))
                at = found.end()
            elif found := _MACRO.match(body, at):
                self._macro(number, found, notes)
                at = found.end()
            elif found := _WORD.match(body, at):
                passed.append(found[0])
                at = found.end()
            elif (found := _BRACKET.match(body, at)) and (end := _closing(body, found.end())):
                passed.append(body[at:end])
                at = end
            else:
                end = next((i for i in range(at, len(body)) if body[i].isspace()), len(body))
                unknown.append(body[at:end])
                at = end
        if passed:
            notes.append(Note("words", {"words": " ".join(passed)[:200]}))
        if unknown:
            notes.append(Note("unknown", {"text": " ".join(unknown)[:200]}))

    def _variable(self, number: int, variable: int, body: str, at: int, notes: list[Note]) -> int:
        """What is assigned to a variable; where the next word begins."""
        known = variable in INPUTS or variable in VALUES or variable in RESULTS
        found = _VALUE.match(body, at)
        if found is None:
            text = body[at:].strip()
            name = f"#{variable}"
            if not known or variable in RESULTS or variable == 1:
                notes.append(Note("computed", {"text": f"{name}={text}"[:80]}))
            else:
                self.assigned.pop(INPUTS.get(variable, ""), None)
                self.values.pop(name, None)
                notes.append(
                    Note("expression", {"r": name, "text": text[:80]}) if text else Note("no_value", {"r": name})
                )
            return len(body)
        self._number(number, variable, found[1], notes)
        return found.end()

    def _number(self, number: int, variable: int, text: str, notes: list[Note]) -> None:
        r, value = f"#{variable}", number_in(text)
        if value is None:
            self.assigned.pop(INPUTS.get(variable, ""), None)
            notes.append(Note("too_large", {"r": r}))
        elif variable in INPUTS:
            self._assign(number, INPUTS[variable], r, value, notes)
            notes.append(Note("assigned", _assigned(r, INPUTS[variable], value)))
        elif variable in VALUES:
            self.values[r] = value
            notes.append(Note("assigned", _assigned(r, None, value)))
        elif variable in RESULTS:
            self.results[r] = value
            notes.append(Note("result", {"r": r, "value": value}))
        else:
            notes.append(Note("not_used", {"r": r}))

    def _macro(self, number: int, found: re.Match[str], notes: list[Note]) -> None:
        macro, argument = int(found[1]), _ARGUMENT.search(found[2])
        if macro == CALIBRATING_MACRO:
            self.kind = self.kind or ProgramKind.CALIBRATION
        else:
            self.kind = ProgramKind.MEASURING
        notes.append(Note("call", {"word": f"G65 P{macro}"}))
        if argument:
            self._number(number, 1, argument[1], notes)

    def _assign(self, number: int, name: str, r: str, value: Any, notes: list[Note]) -> None:
        if name in self.assigned:
            before, line = self.assigned[name]
            notes.append(Note("again", {"r": r, "before": before, "line": line}))
        self.assigned[name] = (value, number)

    def _program(self) -> Program:
        parameters = {name: value for name, (value, _line) in self.assigned.items()}
        about: dict[str, str] = {name: parameters.pop(name) for name in DESCRIBING if name in parameters}
        notes: list[Note] = []
        kind = self.kind
        if kind is None:
            kind = ProgramKind.ASSIGNMENTS if parameters or self.values else ProgramKind.RESULTS
        if kind is ProgramKind.CALIBRATION:
            parameters = {"gauge" if name == "nominal" else name: value for name, value in parameters.items()}
        elif kind is not ProgramKind.RESULTS:
            _complete(parameters, notes)
        for name, value in parameters.items():
            field = BY_NAME.get(name)
            if field and field.kind is Kind.WHOLE and isinstance(value, float) and value == int(value):
                parameters[name] = int(value)
        return Program(kind, 1, len(self.texts), parameters, about, self.values, self.results, tuple(notes))


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
    """What the macros of the line do, said in our parameters."""
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
    taken = {name: value for name, value in implied().items() if name not in parameters}
    if taken:
        notes.append(Note("macro", {"parameters": taken}))
    parameters |= taken
    width = parameters.get("tolerance_width")
    if all(name in parameters for name in ("nominal", "upper_deviation", "lower_deviation")):
        width = mean_nominal(*(parameters[name] for name in ("nominal", "upper_deviation", "lower_deviation")))[1]
    wear = max(WEAR_LIMIT, (width or 0.0) / 2)
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
    upper = parameters.upper_deviation if parameters.nominal is not None else parameters.tolerance_width / 2
    lower = parameters.lower_deviation if parameters.nominal is not None else -parameters.tolerance_width / 2
    nominal = parameters.nominal if parameters.nominal is not None else parameters.target
    said = {"tool_memory", "nominal", "upper_deviation", "lower_deviation"}
    comments = [*describing(about), *settings(parameters, said, implied())]
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
