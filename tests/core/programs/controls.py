"""Two controls, as far as correction texts need them: they run a text block by block, and can be switched off at any block."""

import re
from collections.abc import Callable
from typing import Any


class Stopped(Exception):
    """The program stopped with a message; what it had changed stays."""


class Control:
    """Wear by (tool, axis) and the variables. ``blocks``: after so many blocks the power goes. inch: it works in inch."""

    def __init__(self, *, inch: bool = False) -> None:
        self.inch = inch
        self.variables: dict[int, float] = {}
        self.wear: dict[str, float] = {}
        self.messages: list[str] = []

    def run(self, text: str, blocks: int = 10_000) -> int:
        """Run to the end, to a stop, or until the power goes; the number of blocks that were run."""
        lines = text.splitlines()
        at = done = 0
        while at < len(lines) and done < blocks:
            block = self._block(lines[at])
            done += 1
            if block in {"M17", "M99"}:
                break
            target = self._do(block)
            at = at + 1 if target is None else self._label(lines, target)
        return done

    def _block(self, line: str) -> str:
        raise NotImplementedError

    def _do(self, block: str) -> str | None:
        raise NotImplementedError

    def _label(self, lines: list[str], target: str) -> int:
        raise NotImplementedError


def evaluate(expression: str, values: dict[str, Callable[..., float]]) -> Any:
    """Arithmetic of a control that was made into arithmetic of Python."""
    assert re.fullmatch(r"[\w\s.+\-*/<>=!()\[\],\"']*", expression), expression
    return eval(expression, {"__builtins__": {}}, values)  # noqa: S307 - the texts are our own


class Sinumerik(Control):
    """R parameters and $TC_DP variables."""

    def _block(self, line: str) -> str:
        return line.partition(";")[0].strip()

    def _do(self, block: str) -> str | None:
        if found := re.fullmatch(r"IF (.+) GOTOF (\w+)", block):
            return found[2] if self._value(found[1]) else None
        if found := re.fullmatch(r"(R\d+|\$TC_DP\d+\[\d+,\d+\]|\$P_UIFR\[\d+,[XYZ],(?:TR|RT)\])=(.+)", block):
            value = float(self._value(found[2]))
            if found[1].startswith("R"):
                self.variables[int(found[1][1:])] = value
            else:
                self.wear[found[1]] = value
        elif block == "M0":
            raise Stopped(self.messages[-1])
        elif block.startswith("MSG"):
            self.messages.append(block)
        else:
            assert not block or block == "STOPRE" or re.fullmatch(r"\w+:", block), block
        return None

    def _value(self, expression: str) -> Any:
        unit = {"$MN_SCALING_SYSTEM_IS_METRIC": "1", "$P_GG[13]": "1" if self.inch else "2"}
        for name, value in unit.items():
            expression = expression.replace(name, value)
        stored = r"\$TC_DP\d+\[\d+,\d+\]|\$P_UIFR\[\d+,[XYZ],(?:TR|RT)\]"
        expression = re.sub(stored, lambda found: f"W('{found[0][1:]}')", expression)
        expression = re.sub(r"\bR(\d+)", r"V(\1)", expression).replace("<>", "!=").replace(" AND ", " and ")
        names: dict[str, Callable[..., float]] = {
            "W": lambda name: self.wear.get(f"${name}", 0.0),
            "V": lambda n: self.variables.get(n, 0.0),
            "ABS": abs,
        }
        return evaluate(expression, names)

    def _label(self, lines: list[str], target: str) -> int:
        return lines.index(f"{target}:")


class Fanuc(Control):
    """Macro variables; the wear is kept with as many decimals as such a control has."""

    decimals = 4

    def _block(self, line: str) -> str:
        return re.sub(r"\([^)]*\)", "", line).strip()

    def _do(self, block: str) -> str | None:
        if block.startswith(("#3000", "N9999", "N8020")):
            raise Stopped(block)
        if found := re.fullmatch(r"IF\[(.+)\]GOTO(\d+)", block):
            return found[2] if self._value(found[1]) else None
        block = re.sub(r"^N\d+\s*", "", block)
        if found := re.fullmatch(r"#(\d+|\[\d+\+\d+\])=(.+)", block):
            where = int(evaluate(found[1].strip("[]"), {}))
            value = float(self._value(found[2]))
            self.variables[where] = round(value, self.decimals) if 2000 < where < 3000 else value
        elif found := re.fullmatch(r"G10 P(\d+) ([XZUW])(.+)", block):
            where = {"X": 2000, "U": 2000, "Z": 2100, "W": 2100}[found[2]] + int(found[1])
            before = self.variables.get(where, 0.0) if found[2] in "UW" else 0.0
            self.variables[where] = round(before + float(found[3]), self.decimals)
        elif found := re.fullmatch(r"G90 G10 L2 P(\d)(.*)", block):
            for axis, value in re.findall(r"([XYZ])(\S+)", found[2]):
                self.variables[5200 + 20 * int(found[1]) + " XYZ".index(axis)] = float(self._value(value))
        else:
            assert not block or re.match(r"G(5\d|6[89])", block), block
        return None

    def _value(self, expression: str) -> Any:
        expression = expression.replace("#4006", "20" if self.inch else "21")
        expression = re.sub(r"#\[(\d+)\+(\d+)\]", r"V(\1+\2)", expression)
        expression = re.sub(r"#(\d+)", r"V(\1)", expression).replace("[", "(").replace("]", ")")
        for word, sign in (("GE", ">="), ("LE", "<="), ("GT", ">"), ("NE", "!="), ("EQ", "==")):
            expression = re.sub(rf"{word}(?=[\d(V-])", f" {sign} ", expression)
        return evaluate(expression, {"V": lambda n: self.variables.get(n, 0.0), "ABS": abs})

    def _label(self, lines: list[str], target: str) -> int:
        return next(at for at, line in enumerate(lines) if re.match(rf"N{target}(\s|$)", line))
