"""Work zeros and frames as program text. Everything is set to a value, nothing is added, so a text may be run twice.

Sinumerik has settable frames ``$P_UIFR[n]`` (1 to 4 are G54 to G57, 5 to 99 are G505 to G599), whole or one component at
a time, and the programmable frame ``$P_PFRAME``. Fanuc sets offsets with ``G10 L2`` (G54 to G59) and ``G10 L20`` (G54.1 Pn)
and turns with ``G68``, in the plane or, with I, J, K, about any axis in space. Angles of a frame are taken about Z, then
the new Y, then the new X. Heidenhain's datum shift and rotation are cycles 7 and 10. Lengths mm, angles degrees.

The text keeps the work offset that it replaces on the control, once, and a second text sets it back (`write_restored`).

Numbers are as fine as the control takes them: Fanuc stops at a word of more than eight digits (alarm 003), Heidenhain's
cycles have four decimals.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import degrees, sqrt
from typing import NamedTuple

from app.core.geometry.frames import angles_of, vector_of
from app.core.geometry.points import Floats
from app.core.programs import unit_check
from app.core.programs.fanuc import pointed
from app.core.programs.lines import written

PLACES = 6  # of a length: whole nanometres
DEGREE_PLACES = 7  # of an angle: at a metre from the axis two nanometres
FANUC_DIGITS = 8  # of a word, before and behind the point
FANUC_MESSAGE = 26  # characters of a message of #3000
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
    match = _OFFSET.fullmatch(text.strip())
    if match is None:
        return None
    if match[3]:
        return Offset(f"preset {int(match[3])}", int(match[3])) if control in {"heidenhain", "other"} else None
    number, extended = int(match[1]), match[2]
    if extended:
        fits = control in {"fanuc", "other"} and number == 54 and 1 <= int(extended) <= 300
        return Offset(f"G54.1 P{int(extended)}", int(extended), extended=True) if fits else None
    if 54 <= number <= (57 if control == "sinumerik" else 59):
        return Offset(f"G{number}", number - 53)
    if control in {"sinumerik", "other"} and 505 <= number <= 599:
        return Offset(f"G{number}", number - 500)
    return None


class ZeroText(NamedTuple):
    """Content of a work zero's text; what is None stays as it is on the control."""

    title: str  # INBAND WORK ZERO 12 FOR MILL-1
    offset: Offset
    x: float | None
    y: float | None
    z: float | None
    rotation: float | None = None
    stop: tuple[str, ...] = ()  # codes of warnings that are not acknowledged: the text does not run
    number: int = 0  # of the work zero: the offset before it is kept under this number; 0: it is not kept

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
    >>> print(write_zero("sinumerik", ZeroText("INBAND WORK ZERO 12", g54, 3.0, -1.5, -270.35, 0.25)))  # doctest: +ELLIPSIS
    ; INBAND WORK ZERO 12: G54
    ; RUN TWICE IT CHANGES NOTHING. IT TAKES EFFECT WITH THE NEXT G54.
    ; LENGTHS ARE MM: IT STOPS WHERE THE CONTROL WORKS IN INCH.
    ...
    INBAND_MM:
    $P_UIFR[1]=CTRANS(X,3,Y,-1.5,Z,-270.35):CROT(Z,0.25)
    M17
    <BLANKLINE>
    """
    read_by = control if control in _ZEROS else "other"  # others get a list for people
    return "\n".join([*stop_block(read_by, zero.title, zero.stop), *_ZEROS.get(control, _zero_list)(zero)]) + "\n"


def _sinumerik_zero(zero: ZeroText) -> Iterator[str]:
    frame = f"$P_UIFR[{zero.offset.number}"
    yield f"; {zero.title}: {zero.offset.word}"
    yield f"; RUN TWICE IT CHANGES NOTHING. IT TAKES EFFECT WITH THE NEXT {zero.offset.word}."
    yield from unit_check.sinumerik()
    yield from _sinumerik_kept(zero.offset, WORK_ZERO, zero.number)
    if len(zero.axes) == 3:
        if zero.angle is None:
            yield "; A ROTATION SET THERE BECOMES 0."
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
    yield from unit_check.fanuc()
    yield from _fanuc_kept(zero.offset, WORK_ZERO, zero.number)
    yield _g10(zero.offset, zero.axes)
    if zero.angle is not None:
        yield zero.offset.word
        yield "G69"
        yield f"G68 X0. Y0. R{_fanuc(zero.angle)}"
    yield "M99"


# --- the offset before, kept and restored

_KEPT = {"X": 1, "Y": 2, "Z": 3}  # R91 to R93, and behind KEPT_MARK on a Fanuc
KEPT_MARK = 600
"""The variable of a Fanuc that holds the number of the text whose old offset the three behind it keep.

The ring programs have #700 to #899 on a Fanuc, and on a Haas #10800 to #10999, which are its #800 to #999 as well.
"""
_TURNED = {"X": 95, "Y": 96, "Z": 94}  # R parameters that keep the rotation
WORK_ZERO, ALIGNMENT = "WORK ZERO", "ALIGNMENT"


def _mark(kind: str, number: int) -> int:
    """Return the number under which the old offset is kept: of an alignment below 0, so that it is no work zero's."""
    return -number if kind == ALIGNMENT else number


def _sinumerik_kept(offset: Offset, kind: str, number: int) -> Iterator[str]:
    """Yield the lines that keep the offset once, before it is set; none without a number."""
    if not number:
        return
    frame, mark = f"$P_UIFR[{offset.number}", _mark(kind, number)
    yield f"; THE OLD {offset.word} IS KEPT IN R91 TO R96 FOR {kind} {number}, THE NUMBER IN R90"
    yield f"IF R90=={mark} GOTOF INBAND_KEPT"
    for name, place in _KEPT.items():
        yield f"R9{place}={frame},{name},TR]"
    for name, place in _TURNED.items():
        yield f"R{place}={frame},{name},RT]"
    yield f"R90={mark}"
    yield "INBAND_KEPT:"


def _fanuc_kept(offset: Offset, kind: str, number: int) -> Iterator[str]:
    if not number:
        return
    mark = _mark(kind, number)
    yield f"(THE OLD {offset.word} IS KEPT IN #{KEPT_MARK + 1} TO #{KEPT_MARK + 3} FOR {kind} {number}, THE NUMBER IN #{KEPT_MARK})"
    yield f"IF[#{KEPT_MARK}EQ{mark}]GOTO8010"
    for name, place in _KEPT.items():
        yield f"#{KEPT_MARK + place}=#{_first_variable(offset) + place - 1} ({name})"
    yield f"#{KEPT_MARK}={mark}"
    yield "N8010"


def _first_variable(offset: Offset) -> int:
    """The system variable that holds X of a work offset on a Fanuc; Y and Z follow.

    >>> _first_variable(Offset("G54", 1)), _first_variable(Offset("G54.1 P2", 2, extended=True))
    (5221, 7021)
    """
    if not offset.extended:
        return 5201 + 20 * offset.number
    return (7001 if offset.number <= 48 else 14001) + 20 * (offset.number - 1)


def write_restored(control: str, text: "ZeroText | FrameText") -> str | None:
    """The text that sets the work offset back to what it was before this text; None where none is kept.

    It stops, and changes nothing, where the control does not hold the offset that this text replaced.
    """
    offset = text.offset if isinstance(text, ZeroText) else text.base[0] if text.base else None
    if offset is None or not text.number or control not in {"sinumerik", "fanuc"}:
        return None
    kind = WORK_ZERO if isinstance(text, ZeroText) else ALIGNMENT
    restored = _sinumerik_restored if control == "sinumerik" else _fanuc_restored
    return "\n".join(restored(text, offset, _mark(kind, text.number))) + "\n"


def _sinumerik_restored(text: "ZeroText | FrameText", offset: Offset, mark: int) -> Iterator[str]:
    frame = f"$P_UIFR[{offset.number}"
    yield f"; {text.title}: {offset.word} AS IT WAS BEFORE"
    yield "; SHIFT AND ROTATION COME BACK; FINE OFFSET, SCALE AND MIRROR ARE NOT KEPT, A TABLE STAYS WHERE IT IS."
    yield from unit_check.sinumerik()
    yield f"IF R90<>{mark} GOTOF INBAND_OTHER"
    for name, place in _KEPT.items():
        yield f"{frame},{name},TR]=R9{place}"
    for name, place in _TURNED.items():
        yield f"{frame},{name},RT]=R{place}"
    yield "R90=0"
    yield "M17"
    yield "INBAND_OTHER:"
    yield 'MSG("INBAND: THE OLD WORK OFFSET IS NOT KEPT HERE. NOTHING WAS CHANGED")'
    yield "M0"
    yield "M17"


def _fanuc_restored(text: "ZeroText | FrameText", offset: Offset, mark: int) -> Iterator[str]:
    turned = text.angle is not None if isinstance(text, ZeroText) else any(text.angles.values())
    yield f"({text.title}: {offset.word} AS IT WAS BEFORE)"
    if isinstance(text, FrameText) and text.table is not None:
        yield "(THE TABLE STAYS WHERE IT IS)"
    yield from unit_check.fanuc()
    yield f"IF[#{KEPT_MARK}NE{mark}]GOTO9999"
    if turned:
        yield "G69 (ENDS THE ROTATION OF THE TEXT)"
    kept = " ".join(f"{name}#{KEPT_MARK + place}" for name, place in _KEPT.items())
    yield f"G90 G10 {'L20' if offset.extended else 'L2'} P{offset.number} {kept}"
    yield f"#{KEPT_MARK}=0"
    yield "M99"
    yield "N9999 #3000=1(INBAND OLD WORK OFFSET NOT KEPT)"
    yield "M99"


def _zero_list(zero: ZeroText) -> Iterator[str]:
    """For people: what to type into the table of work zeros."""
    yield f"{zero.title}: {zero.offset.word.upper()}, LENGTHS IN MM"
    for name, value in zero.axes.items():
        yield f"{name} = {written(value)}"
    if zero.angle is not None:
        yield f"ROTATION ABOUT Z = {written(zero.angle)} DEGREES"


class FrameText(NamedTuple):
    """Content of an alignment's text. base: the work zero that it was measured in, if the text is to set it again.

    table: axis and position that take the turn about Z; motion is then the rest.
    """

    title: str
    motion: Floats
    base: tuple[Offset, Mapping[str, float]] | None = None
    table: tuple[str, float] | None = None
    stop: tuple[str, ...] = ()  # codes of warnings that are not acknowledged: the text does not run
    number: int = 0  # of the alignment: the offset before it is kept under this number; 0: it is not kept

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
        angles = angles_of(self.motion[:3, :3])
        return {name: round(value, DEGREE_PLACES) + 0.0 for name, value in zip("XYZ", angles, strict=True)}

    @property
    def tilted(self) -> bool:
        """Tell if the rotation is about more than Z."""
        return bool(self.angles["X"] or self.angles["Y"])


def write_frame(control: str, text: FrameText) -> str:
    """The text that puts the frame where the part lies."""
    return "\n".join([*stop_block(control, text.title, text.stop), *_FRAMES.get(control, _frame_list)(text)]) + "\n"


def _sinumerik_frame(text: FrameText) -> Iterator[str]:
    yield f"; {text.title}"
    yield from unit_check.sinumerik()
    if text.base is not None:
        yield from _sinumerik_kept(text.base[0], ALIGNMENT, text.number)
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
    yield from unit_check.fanuc()
    if text.base is not None:
        yield from _fanuc_kept(text.base[0], ALIGNMENT, text.number)
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
        i, j, k = (_fanuc(1000 * float(component) / angle) for component in vector)
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
    yield from unit_check.heidenhain()
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
    yield f"{text.title}, LENGTHS IN MM"
    if text.table is not None:
        yield f"TABLE {text.table[0]} TO {written(round(text.table[1], DEGREE_PLACES))}"
    yield "SHIFT" if text.base is None else f"{text.base[0].word.upper()} BECOMES"
    for name, value in text.shift.items():
        yield f"{name} = {written(value)}"
    yield "THEN TURN ABOUT Z, THEN Y, THEN X, DEGREES"
    for name in "ZYX":
        yield f"{name} = {written(text.angles[name])}"


def stop_block(control: str, title: str, codes: Sequence[str]) -> Iterator[str]:
    """Yield the lines that stop the control for good while warnings are not acknowledged; none without a code.

    A cycle start does not go past them: they are in a loop, or raise an alarm that only a reset ends.

    >>> print(*stop_block("fanuc", "INBAND ALIGNMENT 7 FOR MILL-1", ["turned_far"]), sep="\\n")
    (INBAND ALIGNMENT 7 FOR MILL-1)
    (WARNING: TURNED FAR)
    (DOES NOT RUN UNTIL THE WARNINGS ARE ACKNOWLEDGED IN INBAND)
    #3000=2(INBAND: TURNED FAR)
    """
    if not codes:
        return
    named = [code.replace("_", " ").upper() for code in dict.fromkeys(codes)]
    comments = [
        title,
        *(f"WARNING: {name}" for name in named),
        "DOES NOT RUN UNTIL THE WARNINGS ARE ACKNOWLEDGED IN INBAND",
    ]
    match control:
        case "sinumerik":
            yield from (f"; {line}" for line in comments)
            yield "INBAND_STOP:"
            yield f'MSG("INBAND: {named[0]}. ACKNOWLEDGE IT IN INBAND AND FETCH THE TEXT AGAIN")'
            yield "M0"
            yield "STOPRE"
            yield "GOTOB INBAND_STOP"
        case "fanuc":
            yield from (f"({line})" for line in comments)
            yield f"#3000=2({f'INBAND: {named[0]}'[:FANUC_MESSAGE]})"
        case "heidenhain":
            yield from (f"; {line}" for line in comments)
            yield 'LBL "INBAND STOP"'
            yield f"STOP ; INBAND: {named[0]}"
            yield 'FN 9: IF +0 EQU +0 GOTO LBL "INBAND STOP"'
        case _:
            yield from comments


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
