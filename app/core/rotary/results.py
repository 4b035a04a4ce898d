"""The result parameters of cycle 452: Q141 to Q149, and the strings QS144 to QS146 (domain §9).

A string holds four numbers of ten characters, separated by one space: for C, EX0C EY0C EA0C EB0C. What arrives by way
of a text file or a person may be damaged; what can be read is read, and what is wrong is reported.
"""

import re
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from math import isfinite
from typing import NamedTuple

from app.core.number_text import NotANumber, NumberFault, read_number
from app.core.rotary.axis import ERRORS, AxisName

WIDTH, NUMBERS = 10, 4
LEAST_DECIMALS = 4  # a tenth of a micrometre, of 0.001°
NOT_MEASURED = -1.0  # what the control writes for the scatter of an axis that was left out
STRINGS: dict[str, AxisName] = {"QS144": "A", "QS145": "B", "QS146": "C"}
MEASURED: dict[str, AxisName] = {"Q141": "A", "Q142": "B", "Q143": "C"}
OPTIMISED: dict[str, AxisName] = {"Q144": "A", "Q145": "B", "Q146": "C"}
OFFSETS = {"Q147": "X", "Q148": "Y", "Q149": "Z"}
SCALARS = (*MEASURED, *OPTIMISED, *OFFSETS)
LARGEST = 1e5  # mm or degrees; nothing on a machine is further off
_APART = re.compile(r"(?<=\d)(?=[+\N{MINUS SIGN}-]\d)")
_BEGIN = re.compile(r"(?:(?<![\w.,=:])(?<![=:] )N?\d+\s+)?(?<!\w)QS?1[0-9]{2}\s*[=:]", re.IGNORECASE)
_LINE = re.compile(r"""\s*+(?:N?\d+\s+)?(QS?1[0-9]{2})(?:\s*+[=:;]\s*+|\s++)["'“”„«]?(.*)""", re.IGNORECASE)
_CLOSING = "\"'“”»"


class Damage(StrEnum):
    """Faults of a result parameter. The sentence is worded at the edge."""

    COUNT = "count"
    LENGTH = "length"
    CUT = "cut"
    SEPARATOR = "separator"
    COMMA = "comma"
    NOT_A_NUMBER = "not_a_number"
    TOO_LARGE = "too_large"
    NEGATIVE = "negative"
    UNKNOWN = "unknown"
    TWICE = "twice"


class Flaw(NamedTuple):
    """Something wrong: in which parameter, at which of its numbers (from 1; 0: as a whole), and what stood there."""

    parameter: str
    number: int
    damage: Damage
    text: str


class ResultString(NamedTuple):
    """Values of a string, by the names of the errors; None where nothing can be read.

    Where there are not four numbers it cannot be determined which is missing, so none of them is given a name.
    """

    values: dict[str, float | None]
    flaws: tuple[Flaw, ...]


class Results(NamedTuple):
    """Result parameters as they were pasted: scalars by their numbers, position errors by axis, and what is wrong."""

    scalars: dict[str, float]
    errors: dict[AxisName, dict[str, float | None]]
    flaws: tuple[Flaw, ...]


def read_string(parameter: str, text: str) -> ResultString:
    """The four numbers of QS144, QS145 or QS146.

    >>> read_string("QS146", "0.01234567 -0.0123456 0.00123456 -0.0012345").values["EB0C"]
    -0.0012345
    >>> read_string("QS146", "0.01234567 -0.0123456 0.00123456").flaws[0].damage.value
    'count'
    """
    names = ERRORS[STRINGS[parameter]]
    flaws: list[Flaw] = []
    text = text.strip().strip("\"'“”„«»").strip()
    parts = _APART.sub(" ", text).split()  # a sign begins a number, a separator or not
    if parts and text != " ".join(parts):
        flaws.append(Flaw(parameter, 0, Damage.SEPARATOR, text))
    values: dict[str, float | None] = dict.fromkeys(names)
    if len(parts) != NUMBERS:
        flaws.append(Flaw(parameter, 0, Damage.COUNT, str(len(parts))))
        return ResultString(values, tuple(flaws))
    for number, (name, part) in enumerate(zip(names, parts, strict=False), start=1):
        value, damage = _read_number(part)
        values[name] = value
        if value is not None and len(part) != WIDTH:
            damage = damage or Damage.LENGTH
            # Beside a number as the control writes it a short one is cut: what is left of "-0.0012345" may be "-0.00".
            if WIDTH in map(len, parts) and len(part.replace(",", ".").partition(".")[2]) < LEAST_DECIMALS:
                values[name], damage = None, Damage.CUT
        if damage is not None:
            flaws.append(Flaw(parameter, number, damage, part))
    return ResultString(values, tuple(flaws))


def _read_number(text: str) -> tuple[float | None, Damage | None]:
    """A number as the control writes it, and what is wrong with it; a decimal comma is read and reported.

    >>> _read_number("-0.0123456"), _read_number("0,5"), _read_number("1.2.3")[1].value
    ((-0.0123456, None), (0.5, <Damage.COMMA: 'comma'>), 'not_a_number')
    """
    try:
        value = read_number(text)
    except NotANumber as error:
        return None, Damage.TOO_LARGE if error.fault is NumberFault.TOO_LARGE else Damage.NOT_A_NUMBER
    if "e" in text.lower():  # the control writes no exponent
        return None, Damage.NOT_A_NUMBER
    return (None, Damage.TOO_LARGE) if abs(value) > LARGEST else (value, Damage.COMMA if "," in text else None)


def write_string(values: Sequence[float]) -> str:
    """Four numbers as the control writes them: ten characters each, with as many decimals as that leaves room for.

    >>> write_string([0.01234567, -0.0123456, 0.00123456, -0.0012345])
    '0.01234567 -0.0123456 0.00123456 -0.0012345'
    """
    if len(values) != NUMBERS:
        raise ValueError(f"{NUMBERS} numbers are needed, not {len(values)}")
    return " ".join(map(write_number, values))


def write_number(value: float) -> str:
    """A number in ten characters.

    >>> write_number(-12.5), write_number(9.9999999999), write_number(-1.7e-8)
    ('-12.500000', '10.0000000', '0.00000000')
    """
    if not isfinite(value) or abs(value) > LARGEST:
        raise ValueError(f"{value} does not fit into {WIDTH} characters")
    for decimals in range(WIDTH - 2, 0, -1):
        text = f"{round(value, decimals) + 0.0:.{decimals}f}"
        if len(text) <= WIDTH:  # shorter by the sign that a value rounded to 0 has lost
            return text.ljust(WIDTH, "0")
    raise AssertionError(value)  # five digits before the point and a sign leave room for decimals


def read_results(text: str) -> Results:
    """Result parameters out of pasted text: a line each, ``Q141 = 0.0034`` or ``QS146 = "…"``, in any order.

    >>> read_results('Q143 = 0.0134\\nQS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"').scalars
    {'Q143': 0.0134}
    """
    scalars: dict[str, float] = {}
    errors: dict[AxisName, dict[str, float | None]] = {}
    flaws: list[Flaw] = []
    seen: set[str] = set()
    for line in _lines(text):
        match = _LINE.fullmatch(line)
        name, value_text = (match[1].upper(), _unquoted(match[2])) if match else ("", "")
        if match is None or name not in {*SCALARS, *STRINGS}:
            flaws.append(Flaw("", 0, Damage.UNKNOWN, line.strip()))
        elif name in seen:
            flaws.append(Flaw(name, 0, Damage.TWICE, value_text))
        elif name in STRINGS:
            read = read_string(name, value_text)
            flaws += read.flaws
            errors[STRINGS[name]] = read.values
        else:
            value, damage = _read_number(value_text.removesuffix("mm").removesuffix("мм"))
            if value == NOT_MEASURED and name not in OFFSETS:
                value, damage = None, None
            elif value is not None and value < 0 and name not in OFFSETS:
                value, damage = None, Damage.NEGATIVE  # a standard deviation is none
            if value is not None:
                scalars[name] = value
            if damage is not None and damage is not Damage.COMMA:
                flaws.append(Flaw(name, 0, damage, value_text))
        seen.add(name)
    return Results(scalars, errors, tuple(flaws))


def _unquoted(text: str) -> str:
    """The value without the semicolon and the quotation mark behind it."""
    text = text.rstrip().removesuffix(";").rstrip()
    return text[:-1] if text.endswith(tuple(_CLOSING)) else text


def _lines(text: str) -> list[str]:
    """One parameter a line, also where several were pasted side by side; a block number stays with its own."""
    pieces: list[str] = []
    for line in text.splitlines():
        begins = [0, *(match.start() for match in _BEGIN.finditer(line)), len(line)]
        pieces += [line[start:end].strip(" \t;,") for start, end in pairwise(begins)]
    return [piece for piece in pieces if piece]
