"""Work zeros and frames as text: what a control makes of it is the frame that was meant."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.geometry.frames import frame, from_angles, turned
from app.core.geometry.points import Floats
from app.core.programs.frames import FrameText, ZeroText, offset_of, write_frame, write_zero

angles = st.floats(-60, 60)
lengths = st.floats(-5000, 5000)


def numbers(line: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(r"([XYZIJKR]),?(-?\d*\.?\d+\.?)", line)}


def rpy(found: dict[str, float]) -> Floats:
    return from_angles(found.get("X", 0.0), found.get("Y", 0.0), found.get("Z", 0.0))


@pytest.mark.parametrize(
    ("control", "text", "number"),
    [
        ("sinumerik", "G54", 1),
        ("sinumerik", "g57", 4),
        ("sinumerik", "G505", 5),
        ("sinumerik", "G599", 99),
        ("sinumerik", "G58", None),
        ("sinumerik", "G54.1 P1", None),
        ("fanuc", "G59", 6),
        ("fanuc", "G54.1P300", 300),
        ("fanuc", "G54.1 P301", None),
        ("fanuc", "G55.1 P1", None),
        ("fanuc", "G505", None),
        ("heidenhain", "preset 12", 12),
        ("fanuc", "preset 12", None),
        ("fanuc", "G5", None),
        ("other", "", None),
    ],
)
def test_offsets_that_a_control_has(control: str, text: str, number: int | None) -> None:
    found = offset_of(control, text)
    assert (found.number if found else None) == number


def zero(control: str, offset: str, **values: float) -> list[str]:
    place = offset_of(control, offset)
    assert place is not None
    given = {"x": None, "y": None, "z": None, "rotation": None} | values
    return write_zero(control, ZeroText("INBAND WORK ZERO 1 FOR M", place, **given)).splitlines()


def test_fanuc_sets_absolutely() -> None:
    assert zero("fanuc", "G55", x=12.3456789, y=-4.0) == [
        "(INBAND WORK ZERO 1 FOR M: G55)",
        "(RUN TWICE IT CHANGES NOTHING)",
        "G90 G10 L2 P2 X12.345679 Y-4.",
        "M99",
    ]
    assert "G90 G10 L20 P7 X1. Y2. Z3." in zero("fanuc", "G54.1 P7", x=1.0, y=2.0, z=3.0)
    assert zero("fanuc", "G54", x=1.0, y=2.0, rotation=-0.1234567)[3:6] == ["G54", "G69", "G68 X0. Y0. R-0.1234567"]


def test_sinumerik_leaves_alone_what_was_not_measured() -> None:
    lines = zero("sinumerik", "G54", x=12.5, rotation=1.0)
    assert "$P_UIFR[1,X,TR]=12.5" in lines
    assert "$P_UIFR[1,Z,RT]=1" in lines
    assert not any("CTRANS" in line or "Y," in line for line in lines)


def test_the_others_get_a_list() -> None:
    assert zero("heidenhain", "preset 3", x=1.5, z=-2.0)[1:] == ["X = 1.5", "Z = -2"]


@given(angles, angles, angles, lengths, lengths, lengths)
def test_a_sinumerik_frame_reads_as_the_motion(a: float, b: float, c: float, x: float, y: float, z: float) -> None:
    motion = frame(from_angles(a, b, c), [x, y, z])
    for base in (None, {"X": 100.0, "Y": -20.0, "Z": 3.0}):
        place = offset_of("sinumerik", "G54")
        assert place is not None
        text = write_frame("sinumerik", FrameText("T", motion, (place, base) if base else None))
        line = next(line for line in text.splitlines() if "CTRANS" in line)
        assert line.startswith("$P_UIFR[1]=" if base else "$P_PFRAME=")
        shift, _colon, rotation = line.partition(":")
        told = numbers(shift.partition("CTRANS")[2])
        expected = motion[:3, 3] + (np.array([*base.values()]) if base else 0.0)
        assert [told["X"], told["Y"], told["Z"]] == pytest.approx(expected, abs=1e-6)
        assert np.abs(rpy(numbers(rotation.partition("CROT")[2])) - motion[:3, :3]).max() < 1e-8


@given(angles, angles, angles)
def test_a_fanuc_conversion_turns_about_its_axis(a: float, b: float, c: float) -> None:
    motion = frame(from_angles(a, b, c), [1.0, 2.0, 3.0])
    lines = write_frame("fanuc", FrameText("T", motion)).splitlines()
    turn = [line for line in lines if line.startswith("G68")]
    rotation = np.eye(3)
    if turn:
        told = numbers(turn[0])
        axis = [told.get(name, 0.0) for name in "IJK"] if "I" in told else [0.0, 0.0, 1.0]
        rotation = turned(np.radians(told["R"]) * np.array(axis) / np.linalg.norm(axis))
    assert np.abs(rotation - motion[:3, :3]).max() < 2e-7


@given(angles, angles, angles, lengths, lengths, lengths)
def test_each_control_takes_every_word(a: float, b: float, c: float, x: float, y: float, z: float) -> None:
    """Fanuc: alarm 003 for more than eight digits in a word. Heidenhain: four decimals in cycles 7 and 10."""
    place = offset_of("fanuc", "G54")
    assert place is not None
    for motion in (frame(from_angles(a, b, c), [x, y, z]), frame(from_angles(0, 0, c), [x, y, z])):
        table = ("C", 10 * c)
        frames = [FrameText("T", motion, base, table) for base in (None, (place, {"X": 4000.0, "Y": x, "Z": z}))]
        texts = [
            write_zero("fanuc", ZeroText("T", place, x, y, z, c)),
            *(write_frame("fanuc", each) for each in frames),
        ]
        for word in re.findall(r"[A-Z](-?[\d.]+)", "\n".join(texts)):
            assert sum(each.isdigit() for each in word) <= 8, word
        for word in re.findall(r"[A-Z][+-](\d+\.?\d*)", write_frame("heidenhain", frames[0])):
            assert len(word.partition(".")[2]) <= 4, word


def test_in_the_plane_each_control_says_it_its_way() -> None:
    motion = frame(from_angles(0, 0, 0.5), [0.1, -0.2, 0.0])
    assert write_frame("fanuc", FrameText("T", motion)).splitlines()[1:] == [
        "G69",
        "G52 X0.1 Y-0.2 Z0.",
        "G68 X0. Y0. R0.5",
        "M99",
    ]
    assert write_frame("heidenhain", FrameText("T", motion)).splitlines()[1:] == [
        "CYCL DEF 7.0 DATUM SHIFT",
        "CYCL DEF 7.1 X+0.1",
        "CYCL DEF 7.2 Y-0.2",
        "CYCL DEF 7.3 Z+0",
        "CYCL DEF 10.0 ROTATION",
        "CYCL DEF 10.1 ROT+0.5",
    ]
    assert "Z = 0.5" in write_frame("other", FrameText("T", motion))


def test_the_table_goes_to_a_place_not_by_an_amount() -> None:
    table = FrameText("T", np.eye(4), table=("C", 360.25))
    assert "G0 C=DC(0.25)" in write_frame("sinumerik", table)
    assert "G90 G0 C360.25" in write_frame("fanuc", table)
    assert "L C+360.25 FMAX" in write_frame("heidenhain", table)
    assert "TABLE C TO 360.25" in write_frame("other", table)
