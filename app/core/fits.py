"""Tolerance classes of ISO 286 for sizes up to 500 mm: from `40 h6` to nominal size and deviations.

A class is a letter for the fundamental deviation (small: shaft, capital: hole) and a number for the standard tolerance grade.
Sources: ISO 286-1:2010, table 1 (grades IT1 to IT18), tables 2 to 5 (fundamental deviations) and clause 4.3.2.5 (the delta
rule of the holes K to ZC). The tables here hold the letters that drawings of machined parts use, without cd, ef, fg, v, y, za to
zc; what is not here is refused, never interpolated.
"""

import re
from bisect import bisect_left
from collections.abc import Mapping
from typing import Any, NamedTuple

from app.core.number_text import number_or_none

# Upper ends of the ranges of nominal sizes, mm: "over the one before, up to and including".
RANGES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
STEPS = (3, 6, 10, 14, 18, 24, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500)

# Standard tolerances IT1 to IT18 for each range, µm.
GRADES: dict[int, tuple[float, ...]] = {
    1: (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
    2: (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
    3: (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
    14: (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550),
    15: (400, 480, 580, 700, 840, 1000, 1200, 1400, 1600, 1850, 2100, 2300, 2500),
    16: (600, 750, 900, 1100, 1300, 1600, 1900, 2200, 2500, 2900, 3200, 3600, 4000),
    17: (1000, 1200, 1500, 1800, 2100, 2500, 3000, 3500, 4000, 4600, 5200, 5700, 6300),
    18: (1400, 1800, 2200, 2700, 3300, 3900, 4600, 5400, 6300, 7200, 8100, 8900, 9700),
}

# Distance of the zone of a shaft below the nominal size (-es), µm: one value a range, or one a step.
BELOW: dict[str, tuple[int, ...]] = {
    "a": (
        270, 270, 280, 290, 290, 300, 300, 310, 320, 340, 360, 380, 410, 460, 520, 580, 660, 740, 820, 920, 1050, 1200, 1350,
        1500, 1650,
    ),
    "b": (
        140, 140, 150, 150, 150, 160, 160, 170, 180, 190, 200, 220, 240, 260, 280, 310, 340, 380, 420, 480, 540, 600, 680,
        760, 840,
    ),
    "c": (
        60, 70, 80, 95, 95, 110, 110, 120, 130, 140, 150, 170, 180, 200, 210, 230, 240, 260, 280, 300, 330, 360, 400, 440, 480,
    ),
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}  # fmt: skip
# Distance of the zone of a shaft above the nominal size (ei), µm; 0 where the standard has none (t up to 24 mm).
ABOVE: dict[str, tuple[int, ...]] = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),  # IT4 to IT7; else 0
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
    "r": (
        10, 15, 19, 23, 23, 28, 28, 34, 34, 41, 43, 51, 54, 63, 65, 68, 77, 80, 84, 94, 98, 108, 114, 126, 132,
    ),
    "s": (
        14, 19, 23, 28, 28, 35, 35, 43, 43, 53, 59, 71, 79, 92, 100, 108, 122, 130, 140, 158, 170, 190, 208, 232, 252,
    ),
    "t": (
        0, 0, 0, 0, 0, 0, 41, 48, 54, 66, 75, 91, 104, 122, 134, 146, 166, 180, 196, 218, 240, 268, 294, 330, 360,
    ),
    "u": (
        18, 23, 28, 33, 33, 41, 48, 60, 70, 87, 102, 124, 144, 170, 190, 210, 236, 258, 284, 315, 350, 390, 435, 490, 540,
    ),
    "x": (
        20, 28, 34, 40, 45, 54, 64, 80, 97, 122, 146, 178, 210, 248, 280, 310, 350, 385, 425, 475, 525, 590, 660, 740, 820,
    ),
    "z": (
        26, 35, 42, 50, 60, 73, 88, 112, 136, 172, 210, 258, 310, 365, 415, 465, 520, 575, 640, 710, 790, 900, 1000, 1100, 1250,
    ),
}  # fmt: skip
# j and J are tabulated for each grade: lower deviation of the shaft below, upper deviation of the hole above, µm.
SHAFT_J: dict[int, tuple[int, ...]] = {
    5: (2, 2, 2, 3, 4, 5, 7, 9, 11, 13, 16, 18, 20),
    6: (2, 2, 2, 3, 4, 5, 7, 9, 11, 13, 16, 18, 20),
    7: (4, 4, 5, 6, 8, 10, 12, 15, 18, 21, 26, 28, 32),
}
HOLE_J: dict[int, tuple[int, ...]] = {
    6: (2, 5, 5, 6, 8, 10, 13, 16, 18, 22, 25, 29, 33),
    7: (4, 6, 8, 10, 12, 14, 18, 22, 26, 30, 36, 39, 43),
    8: (6, 10, 12, 15, 20, 24, 28, 34, 41, 47, 55, 60, 66),
}
_TEXT = re.compile(r"\s*+[ØøΦφ⌀]?\s*+([0-9.,]{1,20})\s*+([A-Za-z]{1,2})\s*+([1-9][0-9]?)\s*+")
"""IT0 and IT01 are grades of their own, so a leading zero is refused. Texts copied from documents have blanks of several kinds."""


class Fit(NamedTuple):
    """A dimension with its tolerance class; lengths in mm."""

    nominal: float
    upper_deviation: float
    lower_deviation: float


def fit_of(text: str) -> Fit | None:
    """Nominal and deviations of a size with a tolerance class; None for what is none, or not in these tables.

    >>> fit_of("40 h6"), fit_of("Ø25 H7"), fit_of("12,5 js9")
    (Fit(nominal=40.0, upper_deviation=0.0, lower_deviation=-0.016), Fit(nominal=25.0, upper_deviation=0.021, lower_deviation=0.0), Fit(nominal=12.5, upper_deviation=0.0215, lower_deviation=-0.0215))
    >>> fit_of("40"), fit_of("40 q6"), fit_of("600 h6")
    (None, None, None)
    """
    match = _TEXT.fullmatch(text)
    nominal = number_or_none(match[1]) if match else None
    if match is None or nominal is None or not 0 < nominal <= RANGES[-1]:
        return None
    letter, grade = match[2], int(match[3])
    if grade not in GRADES or (nominal <= 1 and _only_above_1(letter, grade)):
        return None
    width = _at(GRADES[grade], nominal)
    upper = width / 2 if letter.lower() == "js" else _shaft(letter, grade, nominal) if letter.islower() else None
    if upper is None and letter.isupper():
        upper = _hole(letter, grade, nominal)
    if upper is None:
        return None
    return Fit(nominal, round(upper / 1000, 7) + 0.0, round((upper - width) / 1000, 7) + 0.0)


def with_fit(given: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters with a tolerance class that is in the nominal size (R42) written as numbers.

    Deviations (R40, R41) that are said beside it stay: then the class is left as it is, for the refusal to name it.
    """
    names = {"R42": "nominal", "R40": "upper_deviation", "R41": "lower_deviation"}
    said = {names.get(raw.upper(), raw): value for raw, value in given.items()}
    fit = fit_of(said["nominal"]) if isinstance(said.get("nominal"), str) else None
    if fit is None or any(said.get(name) is not None for name in ("upper_deviation", "lower_deviation")):
        return dict(given)
    others = {raw: value for raw, value in given.items() if names.get(raw.upper(), raw) not in Fit._fields}
    return fit._asdict() | others


def _only_above_1(letter: str, grade: int) -> bool:
    """Tell if the standard has this class for sizes above 1 mm only."""
    return grade >= 14 or letter in "aAbB" or (letter == "N" and grade > 8)


def _at(values: tuple[float, ...], nominal: float) -> float:
    return values[bisect_left(RANGES if len(values) == len(RANGES) else STEPS, nominal)]


def _shaft(letter: str, grade: int, nominal: float) -> float | None:
    """Upper deviation of a shaft, µm."""
    width = _at(GRADES[grade], nominal)
    if letter in BELOW:
        return -_at(BELOW[letter], nominal)
    if letter == "j" and grade in SHAFT_J:
        return width - _at(SHAFT_J[grade], nominal)
    if letter == "k" and not 4 <= grade <= 7:
        return width
    above = _at(ABOVE[letter], nominal) if letter in ABOVE else 0
    return above + width if above or letter == "k" else None


def _hole(letter: str, grade: int, nominal: float) -> float | None:
    """Upper deviation of a hole, µm: the shaft's mirrored, from K on raised by delta = ITn - IT(n-1) in the fine grades."""
    width, shaft = _at(GRADES[grade], nominal), letter.lower()
    if shaft in BELOW:
        return _at(BELOW[shaft], nominal) + width
    if letter == "J":
        return _at(HOLE_J[grade], nominal) if grade in HOLE_J else None
    above = _at(ABOVE[shaft], nominal) if shaft in ABOVE else 0
    if not above and shaft != "k":
        return None
    fine = grade <= (8 if letter in "KMN" else 7)
    if nominal <= 3 or not fine:
        # Above 3 mm, K ends with grade 8, and N lies at the nominal size from grade 9 on.
        return None if letter == "K" and nominal > 3 else 0.0 if letter == "N" and nominal > 3 else -above
    if grade < 3:
        return None  # the standard gives no delta
    if letter == "M" and grade == 6 and 250 < nominal <= 315:
        return -9.0  # tabulated, 2 µm above the rule
    return width - _at(GRADES[grade - 1], nominal) - above
