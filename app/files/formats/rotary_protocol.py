"""The protocol that a control writes after cycle 451 or 452 (TCHPRAUTO.html), read by its labels: see `rotary_words`.

The labels are those of the cycle's manual; controls and versions word them differently, so what is not understood is
handed back line by line. Lengths become mm, angles degrees. Nothing raises.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from app.core.number_text import has_broken_number, plain
from app.core.rotary.axis import ERRORS, AxisName
from app.core.rotary.results import SCALARS, STRINGS
from app.files.formats.cell_values import folded
from app.files.formats.markup import Row, rows_of
from app.files.formats.rotary_words import AXIS_KEYS, HEAD_KEYS, LONGEST_LABEL, Words, fits, known_words

LARGEST = 1e6
FEW = 20  # lines that may be not understood whatever else there is
# 1.212,3344 with a mark for the thousands and 1.2e-05 are no numbers here: half of one would be another one.
_NUMBER = re.compile(
    r"(?:(?<![\w.,+-])|(?<=,)(?=[+-]))([+-]?\d{1,12}(?:[.,]\d{1,12})?)(?![.,]?\d)\s*(mm|um|µm|μm|°|deg|grad|inch|in|\")?(?![\w])"
)
_COORDINATE = re.compile(r"\b([xyz])\s*+[=:]?\s*+([+-]?[\d.,]{1,26}(?<![.,]))\s*(mm|um|µm|μm)?", re.IGNORECASE)
_DEVIATION = re.compile(r"\be([xyz])([abc])\b")
_WORDS = re.compile(r"[^\d+\N{MINUS SIGN}]*")
_LAST_WORD = re.compile(r"[^\W\d]\)?\Z")
_VALUE = re.compile(r"[+\N{MINUS SIGN}-]?\d")
_THOUSANDS = re.compile(r"\d[ '’]\d{3}(?!\d)")
_CLOCK = re.compile(r"\d{1,2}:\d{2}")
_LETTER = re.compile(r"\s*([abc])(?:[\s-]*(?:achse|axis|os))?\s*", re.IGNORECASE)
_ERROR = re.compile(
    r"\b(E[XYZABC]0[ABC])\b\s*+[=:]?\s*+([+-]?\d{1,6}(?:[.,]\d{1,12})?)\s*(mm|um|µm|μm|°|deg|grad)?(?![\w.,]*\w)",
    re.IGNORECASE,
)
_CYCLE = re.compile(r"\b45[0-3]\b")
_WORD_BEFORE_TIME = re.compile(r"\s?[,;]?\s?\b(?:uhrzeit|um|time|at|čas|cas|ura|ob)\b\s*:?\s*(?=\d)", re.IGNORECASE)
VECTORS = frozenset({"correction", "before", "after"})
_PARAMETER = re.compile(r"\b(QS?1[0-9]{2})\b", re.IGNORECASE)
SIGNS = {"+": 1, "-": -1, "positiv": 1, "negativ": -1, "positive": 1, "negative": -1, "pozitivna": 1, "negativna": -1}
Point = tuple[float, float, float]


class Unread(NamedTuple):
    """A line of the protocol that was not understood. label: what comes before its value, as printed."""

    line: int
    text: str
    label: str = ""


class Deviation(NamedTuple):
    """A row of the table behind a diagram, mm: deviations before and, where they are given, after; None: no such column."""

    angle: float
    approach: int
    measured: tuple[float | None, float | None, float | None]
    optimised: tuple[float | None, float | None, float | None]


@dataclass
class AxisProtocol:
    """Values of one axis. numbers: by `AXIS_KEYS`; vectors: X Y Z of correction, before, after."""

    numbers: dict[str, float] = field(default_factory=dict)
    vectors: dict[str, Point] = field(default_factory=dict)
    angles: tuple[float, ...] = ()
    errors: dict[str, float] = field(default_factory=dict)
    deviations: list[Deviation] = field(default_factory=list)


@dataclass
class Protocol:
    """Content of a protocol: texts of the head, axes, result parameters as printed, and the lines not understood."""

    head: dict[str, str] = field(default_factory=dict)
    ball_radius: float | None = None
    incidence: float | None = None
    axes: dict[AxisName, AxisProtocol] = field(default_factory=dict)
    parameters: list[str] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)
    rows: int = 0  # how many there are, understood or not

    @property
    def is_foreign(self) -> bool:
        """True of another text than a protocol: no head, and more lines not understood than understood."""
        return not self.head and len(self.unread) > max(FEW, self.rows / 2)


def read_protocol(text: str, known: Words | None = None) -> Protocol:
    """Read a protocol. known: the words, if not only those of Inband.

    >>> protocol = read_protocol("<h2>C-Achse</h2><table><tr><td>Lose</td><td>0,0021 °</td></tr></table>")
    >>> protocol.axes["C"].numbers
    {'backlash': 0.0021}
    """
    known = known or known_words()
    protocol = Protocol()
    rows, broken = rows_of(text.removeprefix("\ufeff"))
    protocol.rows = len(rows)
    protocol.unread += [Unread(line, "<") for line in broken]
    axis: AxisName | None = None
    columns: list[tuple[str, int]] = []
    side_by_side: list[AxisName] = []
    for row in rows:
        label, values = _split(row, known)
        named, words = known.without_axis(folded(label[:LONGEST_LABEL]))
        if named:
            axis = _named(named)
            protocol.axes.setdefault(axis, AxisProtocol())
        elif letter := _LETTER.fullmatch(_heading(words, label, values, known)):
            axis = _named(letter[1])
            continue
        if abreast := _abreast(row):
            side_by_side, columns = abreast, []
            continue
        if columns_found := _columns(row, known):
            axis, columns = columns_found
            continue
        if columns and axis is not None and _deviation(protocol, axis, columns, row):
            continue
        columns = []
        if not values and (known.is_title(words) or _CYCLE.search(words)):
            continue
        if side_by_side and len(values) == len(side_by_side):
            understood = [
                _take(protocol, known, axis_of_value, words, label, [value])
                for axis_of_value, value in zip(side_by_side, values, strict=True)
            ]
            if not all(understood):
                protocol.unread.append(Unread(row.line, row.text[:200], label[:LONGEST_LABEL]))
            continue
        if not _take(protocol, known, axis, words, label, values):
            protocol.unread.append(Unread(row.line, row.text[:200], label[:LONGEST_LABEL]))
    protocol.axes = {
        axis: columns_found for axis, columns_found in protocol.axes.items() if columns_found != AxisProtocol()
    }
    protocol.unread.sort(key=lambda axis_of_value: axis_of_value.line)
    return protocol


def _split(row: Row, known: Words) -> tuple[str, list[str]]:
    if len(row.cells) > 1:
        return row.cells[0].rstrip(":= "), list(row.cells[1:])
    text = row.cells[0]
    clock = _CLOCK.search(text)
    for mark in (":", "=", "\t"):
        at = text.find(mark)
        if at > 0 and not (mark == ":" and clock is not None and clock.start() < at < clock.end()):
            return text[:at].strip(), [text[at + 1 :].strip()] if text[at + 1 :].strip() else []
    if (parted := _by_blanks(text)) and known.key(folded(parted[0][:LONGEST_LABEL])) is not None:
        return parted[0], [parted[1]]
    return text.strip(), []


def _by_blanks(text: str) -> tuple[str, str] | None:
    """A label and its value where only blanks part them.

    >>> _by_blanks("Startwinkel  -90,000 °"), _by_blanks("Lose 0"), _by_blanks("45"), _by_blanks("Lose0")
    (('Startwinkel', '-90,000 °'), ('Lose', '0'), None, None)
    """
    words = _WORDS.match(text)
    end = words.end() if words else 0
    end -= text[:end].endswith("-")  # a sign
    label = text[:end].strip()
    if not text[:end][-1:].isspace() or not _LAST_WORD.search(label[-2:]) or not _VALUE.match(text, end):
        return None
    return label, text[end:]


def _heading(words: str, label: str, values: Sequence[str], known: Words) -> str:
    """Letter of an axis that is alone: beside the word for it, or as the whole of a heading; else nothing."""
    if not values:
        return label
    return values[0] if len(values) == 1 and known.is_axis(words) else ""


def _named(letter: str) -> AxisName:
    return "A" if letter in "aA" else "B" if letter in "bB" else "C"


def _abreast(row: Row) -> list[AxisName]:
    """The axes, if this row is the head of a table with a column for each."""
    letters = [_LETTER.fullmatch(cell) for cell in row.cells]
    named = [letter for letter in letters if letter is not None]
    if len(named) < 2 or len(named) < len(row.cells) - 1 or any(letter is None for letter in letters[1:]):
        return []
    return [_named(letter[1]) for letter in named]


def _take(
    protocol: Protocol, known: Words, axis: AxisName | None, words: str, label: str, values: Sequence[str]
) -> bool:
    """Keep what a row says; False when it is not understood."""
    text = " ".join(values)
    if (parameter := _PARAMETER.search(label)) is not None:
        name = parameter[1].upper()
        if name in {*SCALARS, *STRINGS} and text:
            protocol.parameters.append(f"{name} = {text}")
            return True
    if not words:
        return not values  # the heading of an axis
    if errors := _ERROR.findall(f"{label} {text}".replace("\N{MINUS SIGN}", "-")):
        owners = {name: owner for owner, names in ERRORS.items() for name in names}
        if all(name.upper() in owners for name, _value, _unit in errors):
            for name, value, unit in errors:
                axis_values = protocol.axes.setdefault(owners[name.upper()], AxisProtocol())
                axis_values.errors[name.upper()] = numbers_in(f"{value} {unit}")[0]
            return True
    key = known.key(words, folded(label[:LONGEST_LABEL].replace("(", " ")))
    if key is None:
        return False
    if key == "time":
        if "created" not in protocol.head or _CLOCK.search(protocol.head["created"]) or not _CLOCK.search(text):
            return False
        protocol.head["created"] += f" {text[:20]}"
        return True
    if key in HEAD_KEYS:
        if not text:
            return False
        protocol.head.setdefault(key, _WORD_BEFORE_TIME.sub(" ", text[:200]) if key == "created" else text[:200])
        return True
    return _number(protocol, axis, key, text, words)


def _number(protocol: Protocol, axis: AxisName | None, key: str, text: str, words: str) -> bool:
    numbers = numbers_in(text)
    if _THOUSANDS.search(text) and key != "angles" and not (key in VECTORS and len(numbers) == 3):
        return False
    if key == "ball_radius":
        if not numbers:
            return False
        protocol.ball_radius = numbers[0]
        return True
    if axis is None:
        if key == "incidence" and numbers:
            protocol.incidence = numbers[0]
            return True
        return False
    axis_values = protocol.axes.setdefault(axis, AxisProtocol())
    if key == "angles":
        if not numbers or re.search(r"\d", _NUMBER.sub("", text.replace("\N{MINUS SIGN}", "-"))):
            return False  # a list of which only a part can be read is not read
        axis_values.angles = tuple(numbers)
        return True
    if key in VECTORS:
        letter = next((at for at, coordinate in enumerate("xyz") if fits(words, f"={coordinate}")), None)
        vector = _vector(text)
        if vector is None and letter is not None and len(numbers) == 1:  # a row for each direction
            vector = axis_values.vectors.get(key, (0.0, 0.0, 0.0))
            vector = (*vector[:letter], numbers[0], *vector[letter + 1 :])  # type: ignore[assignment] # three again
        if vector is None:
            return False
        axis_values.vectors[key] = vector
        return True
    assert key in AXIS_KEYS
    if not numbers:
        return False
    if key == "scatter_before" and len(numbers) == 2:  # measured and optimised in one row
        axis_values.numbers.setdefault("scatter_after", numbers[1])
    return (
        axis_values.numbers.setdefault(key, numbers[0]) == numbers[0]
    )  # a second value for the same is not understood


def numbers_in(text: str) -> list[float]:
    """The numbers of a text, µm as mm; inches are nothing that a control writes here.

    >>> numbers_in("−90,000 ° 0 90.5°"), numbers_in("3,4 µm"), numbers_in("2 inch")
    ([-90.0, 0.0, 90.5], [0.0034], [])
    """
    if has_broken_number(text):
        return []  # one number would be read as two
    numbers = []
    for number, unit in _NUMBER.findall(plain(text)):
        value = float(number.replace(",", "."))
        if unit in {"inch", "in", '"'} or abs(value) > LARGEST:
            continue
        numbers.append(round(value / 1000, 12) if unit in {"um", "µm", "μm"} else value)
    return numbers


def _vector(text: str) -> Point | None:
    plain = text.replace("\N{MINUS SIGN}", "-")
    named = {letter.upper(): numbers_in(f"{number} {unit}")[:1] for letter, number, unit in _COORDINATE.findall(plain)}
    if named:
        x, y, z = ((named.get(letter) or [0.0])[0] for letter in "XYZ")
        return (x, y, z) if all(named.values()) else None
    numbers = numbers_in(plain)
    return (numbers[0], numbers[1], numbers[2]) if len(numbers) == 3 else None


def _columns(row: Row, known: Words) -> tuple[AxisName, list[tuple[str, int]]] | None:
    """The columns of the table behind a diagram, if this row is its head: (what, which of X Y Z)."""
    if len(row.cells) < 2:
        return None
    columns: list[tuple[str, int]] = []
    letters = set()
    for cell in row.cells:
        words = folded(cell[:LONGEST_LABEL].replace("(", " ").replace(")", " "))
        if (match := _DEVIATION.search(words)) is not None:
            letters.add(match[2].upper())
            columns.append(("optimised" if known.is_optimised(words) else "measured", "xyz".index(match[1])))
        elif any(word in words for word in ("richtung", "direction", "smer")):
            columns.append(("approach", 0))
        else:
            columns.append(("angle" if not any(kind == "angle" for kind, _at in columns) else "other", 0))
    deviations = [column for column in columns if column[0] in {"measured", "optimised"}]
    if len(letters) != 1 or ("angle", 0) not in columns or len(set(deviations)) < len(deviations):
        return None  # two columns for the same: which is which is not known
    return _named(letters.pop()), columns


def _deviation(protocol: Protocol, axis: AxisName, columns: Sequence[tuple[str, int]], row: Row) -> bool:
    if len(row.cells) != len(columns):
        return False
    by_kind: dict[str, list[float | None]] = {"measured": [None] * 3, "optimised": [None] * 3}
    angle, approach = None, 0
    for (kind, at), cell in zip(columns, row.cells, strict=True):
        numbers = numbers_in(cell)
        if kind == "approach":
            approach = SIGNS.get(
                folded(cell[:LONGEST_LABEL]) or cell.strip().replace("\N{MINUS SIGN}", "-"), 0
            ) or SIGNS.get(cell.strip(), 0)
        elif kind == "other":
            continue
        elif len(numbers) != 1:
            return False
        elif kind == "angle":
            angle = numbers[0]
        else:
            by_kind[kind][at] = numbers[0]
    if angle is None:
        return False
    x, y, z = by_kind["measured"]
    xo, yo, zo = by_kind["optimised"]
    axis_values = protocol.axes.setdefault(axis, AxisProtocol())
    axis_values.deviations.append(Deviation(angle, approach, (x, y, z), (xo, yo, zo)))
    return True
