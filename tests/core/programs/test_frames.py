"""Work zeros and frames as text: what a control makes of it is the frame that was meant."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.geometry.frames import frame, from_angles, turned
from app.core.geometry.points import Floats
from app.core.programs import unit_check
from app.core.programs.frames import FrameText, ZeroText, offset_of, write_frame, write_restored, write_zero
from app.core.programs.ring_settings import TOOLS, Offsets, RingControl, RingError, RingSettings
from tests.core.programs.controls import Fanuc, Sinumerik, Stopped

angles = st.floats(-60, 60)
lengths = st.floats(-5000, 5000)


UNIT = {"sinumerik": unit_check.sinumerik, "fanuc": unit_check.fanuc, "heidenhain": unit_check.heidenhain}


def without_unit(control: str, text: str) -> list[str]:
    """The lines of a text without its check of the unit, which every text has."""
    check = "\n".join(UNIT[control]()) + "\n"
    assert text.count(check) == 1
    return text.replace(check, "").splitlines()


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
    x, y, z, rotation = (values.get(name) for name in ("x", "y", "z", "rotation"))
    text = write_zero(control, ZeroText("INBAND WORK ZERO 1 FOR M", place, x, y, z, rotation))
    return without_unit(control, text) if control in {"sinumerik", "fanuc"} else text.splitlines()


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
    assert without_unit("fanuc", write_frame("fanuc", FrameText("T", motion)))[1:] == [
        "G69",
        "G52 X0.1 Y-0.2 Z0.",
        "G68 X0. Y0. R0.5",
        "M99",
    ]
    assert without_unit("heidenhain", write_frame("heidenhain", FrameText("T", motion)))[1:] == [
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


@pytest.mark.parametrize(
    ("control", "stops"),
    [
        ("sinumerik", ["INBAND_STOP:", "M0", "GOTOB INBAND_STOP"]),
        ("fanuc", ["#3000=2(INBAND: POINTS EXCHANGED)"[:37]]),
        (
            "heidenhain",
            ['LBL "INBAND STOP"', "STOP ; INBAND: POINTS EXCHANGED", 'FN 9: IF +0 EQU +0 GOTO LBL "INBAND STOP"'],
        ),
        ("other", ["WARNING: POINTS EXCHANGED"]),
    ],
)
def test_warnings_stop_the_control_before_anything_is_set(control: str, stops: list[str]) -> None:
    text = FrameText("INBAND ALIGNMENT 7 FOR M", frame(np.eye(3), [1.0, 2.0, 3.0]))
    clean = write_frame(control, text)
    stopped = write_frame(control, text._replace(stop=("points_exchanged", "turned_far")))
    block = stopped.removesuffix(clean).splitlines()
    assert stopped.endswith(clean)
    assert [line for line in block if line in stops] == stops
    assert any("TURNED FAR" in line for line in block)


def test_a_heidenhain_zero_is_a_list_for_people_and_says_so_as_well() -> None:
    offset = offset_of("heidenhain", "preset 3")
    assert offset is not None
    lines = write_zero("heidenhain", ZeroText("INBAND WORK ZERO 1", offset, 1.0, 2.0, 3.0, None, ("turned_far",)))
    assert lines.splitlines()[1] == "WARNING: TURNED FAR"


def texts_with_a_base(control: str) -> list[ZeroText | FrameText]:
    offset = offset_of(control, "G55")
    assert offset is not None
    shift = frame(np.eye(3), [1.0, 2.0, 3.0])
    return [
        ZeroText("T", offset, 11.0, 22.0, 33.0, number=7),
        FrameText("T", shift, (offset, {"X": 10.0, "Y": 20.0, "Z": 30.0}), number=7),
    ]


@pytest.mark.parametrize("inch", [False, True])
@pytest.mark.parametrize("at", [0, 1])
@pytest.mark.parametrize("control", ["sinumerik", "fanuc"])
def test_run_on_a_control_the_old_offset_comes_back(control: str, at: int, inch: bool) -> None:
    """Set twice, then set back; in inch nothing happens. The simulated Sinumerik has no whole frames: they are set after."""
    text = texts_with_a_base(control)[at]
    machine = (Sinumerik if control == "sinumerik" else Fanuc)(inch=inch)
    places = [f"$P_UIFR[2,{axis},TR]" for axis in "XYZ"]
    old = {"X": -1.5, "Y": 2.5, "Z": -300.0}
    machine.wear = dict(zip(places, old.values(), strict=True))
    machine.variables = dict(zip((5241, 5242, 5243), old.values(), strict=True))

    def held() -> list[float]:
        return (
            [machine.wear[name] for name in places]
            if control == "sinumerik"
            else [machine.variables[n] for n in (5241, 5242, 5243)]
        )

    sets = write_zero(control, text) if isinstance(text, ZeroText) else write_frame(control, text)
    restores = write_restored(control, text)
    assert restores is not None
    if inch:
        for each in (sets, restores):
            with pytest.raises(Stopped, match=r"INCH|N8020"):
                machine.run(each)
        assert held() == [*old.values()]
        return
    with pytest.raises(Stopped):  # nothing is kept yet
        machine.run(restores)
    for _ in range(2):
        whole = next((line for line in sets.splitlines() if "CTRANS" in line), "")
        machine.run(sets.replace(whole, "") if whole else sets)
        machine.wear |= dict(zip(places, (11.0, 22.0, 33.0), strict=True)) if whole else {}
        assert held() == [11.0, 22.0, 33.0]
    machine.run(restores)
    assert held() == [*old.values()]
    with pytest.raises(Stopped):  # it came back once
        machine.run(restores)


@pytest.mark.parametrize(("control", "offsets"), [("fanuc", Offsets.LATHE), ("haas", Offsets.MILL)])
def test_no_text_writes_what_the_ring_programs_keep(control: str, offsets: Offsets) -> None:
    """The mark of work zero 1 would hold corrections back, a correction's number come back as a work offset."""
    text = texts_with_a_base("fanuc")[0]
    both = write_zero("fanuc", text) + (write_restored("fanuc", text) or "")  # type: ignore[arg-type]
    common = {int(number) for number in re.findall(r"#(\d+)", both) if 100 <= int(number) < 1000}
    assert len(common) == 4
    used = common | {number + 10_000 for number in common}  # a Haas has its #600 as #10600 too
    ring = RingSettings(RingControl(control), offsets)
    assert not used & {*range(ring.first_register, ring.first_effect + TOOLS + 1)}
    for number in common:
        with pytest.raises(RingError, match="taken"):
            RingSettings(RingControl(control), offsets, first_register=number)


def test_an_alignment_that_sets_no_work_offset_has_nothing_to_set_back() -> None:
    assert write_restored("sinumerik", FrameText("T", np.eye(4), number=7)) is None
    assert write_restored("heidenhain", texts_with_a_base("fanuc")[1]) is None


def test_the_old_offset_of_a_work_zero_is_not_that_of_an_alignment() -> None:
    zero, frame_ = texts_with_a_base("sinumerik")
    machine = Sinumerik()
    machine.run(write_zero("sinumerik", ZeroText("T", zero.offset, 1.0, None, None, number=7)))  # type: ignore[union-attr]
    restores = write_restored("sinumerik", frame_)
    assert restores is not None
    with pytest.raises(Stopped):
        machine.run(restores)
