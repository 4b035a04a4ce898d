"""Work zeros and frames as program text. Everything is set to a value, nothing is added, so a text may be run twice.

Sinumerik has settable frames ``$P_UIFR[n]`` (1 to 4 are G54 to G57, 5 to 99 are G505 to G599), whole or one component at
a time, and the programmable frame ``$P_PFRAME``. Fanuc sets offsets with ``G10 L2`` (G54 to G59) and ``G10 L20`` (G54.1 Pn)
and turns with ``G68``, in the plane or, with I, J, K, about any axis in space. Angles of a frame are taken about Z, then
the new Y, then the new X. Heidenhain's datum shift and rotation are cycles 7 and 10. Lengths mm, angles degrees.

Numbers are as fine as the control takes them: Fanuc stops at a word of more than eight digits (alarm 003), Heidenhain's
cycles have four decimals.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from math import degrees, sqrt
from typing import NamedTuple

from app.core.geometry.frames import angles_of, vector_of
from app.core.geometry.points import Floats
from app.core.programs.fanuc import pointed
from app.core.programs.lines import written

PLACES = 6  # of a length: whole nanometres
DEGREE_PLACES = 7  # of an angle: at a metre from the axis two nanometres
FANUC_DIGITS = 8  # of a word, before and behind the point
HEIDENHAIN_PLACES = 4
_OFFSET = re.compile(r"G\s*(\d{2,3})(?:\s*\.\s*1\s*P\s*(\d{1,3}))?|PRESET\s*(\d{1,4})", re.IGNORECASE | re.ASCII)


class Offset(NamedTuple):
    """A place where a control keeps a work zero: its word, and its number there. extended: Fanuc's G54.1 Pn."""

    word: str
    number: int
    extended: bool = False


def offset_of(control: str, text: str) -> Offset | None:
    """The work offset that is meant on this control; None for one that it has not.

    >>> offset_of("sinumerik", "G505"), offset_of("fanuc", "g54.1 p12").word, offset_of("sinumerik", "G58")
    (Offset(word='G505', number=5, extended=False), 'G54.1 P12', None)
    """
    found = _OFFSET.fullmatch(text.strip())
    if found is None:
        return None
    if found[3]:
        return Offset(f"preset {int(found[3])}", int(found[3])) if control in {"heidenhain", "other"} else None
    number, extended = int(found[1]), found[2]
    if extended:
        fits = control in {"fanuc", "other"} and number == 54 and 1 <= int(extended) <= 300
        return Offset(f"G54.1 P{int(extended)}", int(extended), extended=True) if fits else None
    if 54 <= number <= (57 if control == "sinumerik" else 59):
        return Offset(f"G{number}", number - 53)
    if control in {"sinumerik", "other"} and 505 <= number <= 599:
        return Offset(f"G{number}", number - 500)
    return None


class ZeroText(NamedTuple):
    """What is written of a work zero; what is None stays as it is on the control."""

    title: str  # INBAND WORK ZERO 12 FOR MILL-1
    offset: Offset
    x: float | None
    y: float | None
    z: float | None
    rotation: float | None = None

    @property
    def axes(self) -> dict[str, float]:
        """The axes that are known, rounded."""
        return {
            name: round(value, PLACES) + 0.0
            for name, value in (("X", self.x), ("Y", self.y), ("Z", self.z))
            if value is not None
        }

    @property
    def angle(self) -> float | None:
        """The rotation, rounded."""
        return None if self.rotation is None else round(self.rotation, DEGREE_PLACES) + 0.0


def write_zero(control: str, zero: ZeroText) -> str:
    """The text that sets the work zero.

    >>> g54 = offset_of("sinumerik", "G54")
    >>> print(write_zero("sinumerik", ZeroText("INBAND WORK ZERO 12", g54, 3.0, -1.5, -270.35, 0.25)))
    ; INBAND WORK ZERO 12: G54
    ; RUN TWICE IT CHANGES NOTHING. IT TAKES EFFECT WITH THE NEXT G54.
    $P_UIFR[1]=CTRANS(X,3,Y,-1.5,Z,-270.35):CROT(Z,0.25)
    M17
    <BLANKLINE>
    """
    return "\n".join(_ZEROS.get(control, _zero_list)(zero)) + "\n"


def _sinumerik_zero(zero: ZeroText) -> Iterator[str]:
    frame = f"$P_UIFR[{zero.offset.number}"
    yield f"; {zero.title}: {zero.offset.word}"
    yield f"; RUN TWICE IT CHANGES NOTHING. IT TAKES EFFECT WITH THE NEXT {zero.offset.word}."
    if len(zero.axes) == 3:
        if zero.angle is None:
            yield "; A ROTATION THAT STOOD THERE BECOMES 0."
        yield f"{frame}]={_ctrans(zero.axes)}" + (f":CROT(Z,{written(zero.angle)})" if zero.angle is not None else "")
    else:  # a whole frame would set what was not measured to 0
        yield "; WHAT IS NOT NAMED STAYS; A FINE OFFSET STAYS AND ADDS."
        for name, value in zero.axes.items():
            yield f"{frame},{name},TR]={written(value)}"
        if zero.angle is not None:
            yield f"{frame},Z,RT]={written(zero.angle)}"
    yield "M17"


def _fanuc_zero(zero: ZeroText) -> Iterator[str]:
    yield f"({zero.title}: {zero.offset.word})"
    yield "(RUN TWICE IT CHANGES NOTHING)"
    yield _g10(zero.offset, zero.axes)
    if zero.angle is not None:
        yield zero.offset.word
        yield "G69"
        yield f"G68 X0. Y0. R{_fanuc(zero.angle)}"
    yield "M99"


def _zero_list(zero: ZeroText) -> Iterator[str]:
    """For people: what to type into the table of work zeros."""
    yield f"{zero.title}: {zero.offset.word.upper()}"
    for name, value in zero.axes.items():
        yield f"{name} = {written(value)}"
    if zero.angle is not None:
        yield f"ROTATION ABOUT Z = {written(zero.angle)} DEGREES"


class FrameText(NamedTuple):
    """What is written of an alignment. base: the work zero that it was measured in, if the text is to set it anew.

    table: axis and position that take the turn about Z; motion is then what is left.
    """

    title: str
    motion: Floats
    base: tuple[Offset, Mapping[str, float]] | None = None
    table: tuple[str, float] | None = None

    @property
    def shift(self) -> dict[str, float]:
        """X, Y, Z, rounded; from the machine's zero where there is a base."""
        before = self.base[1] if self.base else {}
        return {
            name: round(float(value) + before.get(name, 0.0), PLACES) + 0.0
            for name, value in zip("XYZ", self.motion[:3, 3], strict=True)
        }

    @property
    def angles(self) -> dict[str, float]:
        """About X, Y, Z in the order Z, Y', X'', rounded."""
        found = angles_of(self.motion[:3, :3])
        return {name: round(value, DEGREE_PLACES) + 0.0 for name, value in zip("XYZ", found, strict=True)}

    @property
    def tilted(self) -> bool:
        """Whether it turns about more than Z."""
        return bool(self.angles["X"] or self.angles["Y"])


def write_frame(control: str, text: FrameText) -> str:
    """The text that puts the frame where the part lies."""
    return "\n".join(_FRAMES.get(control, _frame_list)(text)) + "\n"


def _sinumerik_frame(text: FrameText) -> Iterator[str]:
    yield f"; {text.title}"
    if text.table is not None:
        yield "; RETRACT THE TOOL BEFORE THE TABLE TURNS."
        yield f"G0 {text.table[0]}=DC({written(round(text.table[1] % 360.0, DEGREE_PLACES) % 360.0)})"
    angles = ",".join(f"{name},{written(value)}" for name, value in text.angles.items() if value)
    frame = _ctrans(text.shift) + (f":CROT({angles})" if angles else "")
    if text.base is not None:
        yield f"; RUN TWICE IT CHANGES NOTHING. IT TAKES EFFECT WITH THE NEXT {text.base[0].word}."
        yield f"$P_UIFR[{text.base[0].number}]={frame}"
    else:
        yield "; IN THE PART PROGRAM, AFTER ITS WORK ZERO; IN PLACE OF TRANS AND ROT."
        yield f"$P_PFRAME={frame}"
    yield "M17"


def _fanuc_frame(text: FrameText) -> Iterator[str]:
    yield f"({text.title})"
    if text.table is not None:
        yield "(RETRACT THE TOOL BEFORE THE TABLE TURNS)"
        yield f"G90 G0 {text.table[0]}{_fanuc(text.table[1])}"
    yield "G69"
    at = text.shift
    if text.base is not None:
        yield _g10(text.base[0], text.shift)
        yield text.base[0].word
        at = dict.fromkeys("XYZ", 0.0)
    if text.tilted:
        vector = vector_of(text.motion[:3, :3])
        angle = sqrt(float(vector @ vector))
        # A direction has no length: a metre long, it is as exact as eight digits can say it.
        i, j, k = (_fanuc(1000 * float(each) / angle) for each in vector)
        yield "(THREE-DIMENSIONAL COORDINATE CONVERSION)"
        yield f"G68 {_words(at)} I{i} J{j} K{k} R{_fanuc(degrees(angle))}"
    else:
        if text.base is None:
            yield f"G52 {_words(at)}"
        if text.angles["Z"]:
            yield f"G68 X0. Y0. R{_fanuc(text.angles['Z'])}"
    yield "M99"


def _heidenhain_frame(text: FrameText) -> Iterator[str]:
    yield f"; {text.title}"
    if text.table is not None:
        yield "; RETRACT THE TOOL BEFORE THE TABLE TURNS."
        yield f"L {text.table[0]}{_signed(text.table[1])} FMAX"
    if text.base is not None:
        yield f"; {text.base[0].word.upper()} BECOMES"
        for name, value in text.shift.items():
            yield f"; {name} = {written(value)}"
    else:
        yield "CYCL DEF 7.0 DATUM SHIFT"
        for number, (name, value) in enumerate(text.shift.items(), 1):
            yield f"CYCL DEF 7.{number} {name}{_signed(value)}"
    if text.tilted:
        yield "; THE PART IS TILTED: TURN THE PLANE ABOUT Z, THEN Y, THEN X"
        for name in "ZYX":
            yield f"; {name} {_signed(text.angles[name])} DEGREES"
    elif text.angles["Z"]:
        yield "CYCL DEF 10.0 ROTATION"
        yield f"CYCL DEF 10.1 ROT{_signed(text.angles['Z'])}"


def _frame_list(text: FrameText) -> Iterator[str]:
    yield text.title
    if text.table is not None:
        yield f"TABLE {text.table[0]} TO {written(round(text.table[1], DEGREE_PLACES))}"
    yield "SHIFT" if text.base is None else f"{text.base[0].word.upper()} BECOMES"
    for name, value in text.shift.items():
        yield f"{name} = {written(value)}"
    yield "THEN TURN ABOUT Z, THEN Y, THEN X, DEGREES"
    for name in "ZYX":
        yield f"{name} = {written(text.angles[name])}"


def _ctrans(axes: Mapping[str, float]) -> str:
    return f"CTRANS({','.join(f'{name},{written(value)}' for name, value in axes.items())})"


def _g10(offset: Offset, axes: Mapping[str, float]) -> str:
    return f"G90 G10 {'L20' if offset.extended else 'L2'} P{offset.number} {_words(axes)}"


def _words(axes: Mapping[str, float]) -> str:
    return " ".join(f"{name}{_fanuc(value)}" for name, value in axes.items())


def _fanuc(value: float) -> str:
    """A word's number with as many decimals as eight digits leave room for; zeros in front count.

    >>> _fanuc(-1143.7292341), _fanuc(0.0170453), _fanuc(12.34567891), _fanuc(-4.0)
    ('-1143.7292', '0.0170453', '12.345679', '-4.')
    """
    places = FANUC_DIGITS - len(str(int(abs(value))))
    return pointed(round(value, min(places, DEGREE_PLACES)) + 0.0)


def _signed(value: float) -> str:
    rounded = round(value, HEIDENHAIN_PLACES) + 0.0
    return f"{'-' if rounded < 0 else '+'}{written(abs(rounded))}"


_ZEROS: dict[str, Callable[[ZeroText], Iterator[str]]] = {"sinumerik": _sinumerik_zero, "fanuc": _fanuc_zero}
_FRAMES: dict[str, Callable[[FrameText], Iterator[str]]] = {
    "sinumerik": _sinumerik_frame,
    "fanuc": _fanuc_frame,
    "heidenhain": _heidenhain_frame,
}
