"""Calls of the kinematics cycles: read as the control writes them, written, read again, and mutilated."""

from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.programs import heidenhain
from app.core.programs.lines import LineVerdict, Note, Program, ProgramError, ProgramKind
from app.core.rotary.axis import AXES
from app.core.rotary.measuring_plan import OF_AXIS, AxisPlan, MeasuringPlan, QValue, faults, positions, warnings
from tests.chance import examples

CALL = """0 BEGIN PGM HEAD MM
11 TOOL CALL "TOUCH_PROBE" Z
12 TCH PROBE 450 SAVE KINEMATICS ~
    Q410=+0    ;MODE ~
    QS409="AC"    ;MEMORY DESIGNATION
13 TCH PROBE 452 PRESET COMPENSATION ~
    Q407=+12.5    ;SPHERE RADIUS ~
    Q320=+0    ;SET-UP CLEARANCE ~
    Q408=+0    ;RETR. HEIGHT ~
    Q253=FMAX    ;F PRE-POSITIONING ~
    Q380=+0    ;REFERENCE ANGLE ~
    Q411=-90    ;START ANGLE A AXIS ~
    Q412=+90    ;END ANGLE A AXIS ~
    Q413=+0    ;INCID. ANGLE A AXIS ~
    Q414=+4    ;MEAS. POINTS A AXIS ~
    Q415=+0    ;START ANGLE B AXIS ~
    Q416=+0    ;END ANGLE B AXIS ~
    Q417=+0    ;INCID. ANGLE B AXIS ~
    Q418=+0    ;MEAS. POINTS B AXIS ~
    Q419=-90    ;START ANGLE C AXIS ~
    Q420=+180    ;END ANGLE C AXIS ~
    Q421=+0    ;INCID. ANGLE C AXIS ~
    Q422=+4    ;MEAS. POINTS C AXIS ~
    Q423=+4    ;NO. OF PROBE POINTS ~
    Q432=+0    ;BACKLASH, ANG. RANGE
14 QS0 = SUBSTR ( SRC_QS146 BEG11 LEN10 )
15 QL1 = TONUMB ( SRC_QS0 )
20 END PGM HEAD MM
"""


def codes(text: str, line: int) -> list[str]:
    return [note.code for note in heidenhain.read(text).lines[line - 1].notes]


def only(text: str) -> Program:
    (program,) = heidenhain.read(text).programs
    return program


def plan_of(cycle: Literal[451, 452], values: dict[str, QValue]) -> MeasuringPlan:
    """The plan that a call says; what it does not say is 0 there. Words stand for themselves."""

    def number(name: str) -> float:
        value = values.get(name, 0.0)
        return 0.0 if isinstance(value, str) else float(value)

    axes = tuple(
        AxisPlan(letter, number(start), number(end), number(incidence), int(number(points)))
        for letter, (start, end, incidence, points) in OF_AXIS.items()
    )
    feed, clearance = values.get("Q253", 0.0), values.get("Q320", 0.0)
    return MeasuringPlan(
        cycle=cycle,
        ball_radius=number("Q407"),
        axes=axes,
        clearance="PREDEF" if isinstance(clearance, str) else clearance,
        retract_height=number("Q408"),
        feed=feed,  # type: ignore[arg-type]
        reference_angle=number("Q380"),
        touches=int(number("Q423")),
        backlash_angle=number("Q432"),
        mode=int(number("Q406")),
        preset=int(number("Q431")),
    )


def test_the_calls_are_read_with_their_q_parameters() -> None:
    text = heidenhain.read(CALL)
    saved, call = text.programs
    assert saved.parameters == {"cycle": 450, "Q410": 0.0, "Q409": "AC"}
    assert (call.kind, call.first_line, call.last_line) == (ProgramKind.KINEMATICS, 6, 25)
    assert (call.parameters["Q407"], call.parameters["Q253"], call.parameters["Q411"]) == (12.5, "FMAX", -90.0)
    assert len(call.parameters) == 20
    assert call.notes == ()
    assert not [line for line in text.lines if line.verdict is LineVerdict.NOT_UNDERSTOOD]
    plan = plan_of(452, {name: value for name, value in call.parameters.items() if name != "cycle"})
    assert [axis.axis for axis in plan.order] == ["A", "C"]
    assert positions(plan.order[1]) == (-90.0, 0.0, 90.0, 180.0)


def test_numbers_are_cut_out_of_the_result_strings() -> None:
    lines = heidenhain.read(CALL).lines
    assert lines[25].notes[0] == Note("cut_out", {"name": "EY0C", "source": "QS146", "r": "QS0"})
    assert lines[26].notes[0] == Note("as_number", {"name": "EY0C", "r": "QL1"})
    assert codes("QS0 = SUBSTR ( SRC_QS146 BEG10 LEN10 )", 1) == ["cut_wrong"]


def test_iso_calls_and_results_are_read() -> None:
    assert only("N110 G452 Q407=+12.5 Q253=FAUTO Q422=+4 *").parameters == {
        "cycle": 452,
        "Q407": 12.5,
        "Q253": "FAUTO",
        "Q422": 4.0,
    }
    found = only('Q143 = 0.0134\nQS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"')
    assert found.kind is ProgramKind.RESULTS
    assert found.results == {
        "Q143": 0.0134,
        "EX0C": 0.01234567,
        "EY0C": -0.0123456,
        "EA0C": 0.00123456,
        "EB0C": -0.0012345,
    }


def test_an_inch_program_becomes_mm_its_angles_stay() -> None:
    program = only(
        "0 BEGIN PGM HEAD INCH\n12 TCH PROBE 452 PRESET COMPENSATION ~\n Q407=+0.5 ~\n Q253=+30 ~\n Q411=-90\n13 M30"
    )
    assert program.inch
    assert (program.parameters["Q407"], program.parameters["Q253"], program.parameters["Q411"]) == (12.7, 762.0, -90.0)


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("Q407=+12. 5", "blank_in_number"),
        ("Q407=Q1+2", "expression"),
        ("Q407=FMAX", "no_number"),
        ("Q999=+1", "unknown_q"),
        ("Q406=+1", "unknown_q"),
        ("Q411=+360", "q_range"),
        ("Q414=+13", "q_range"),
        ("Q407=+100", "q_range"),
    ],
)
def test_what_a_call_cannot_have_is_named(body: str, code: str) -> None:
    text = f"TCH PROBE 452 PRESET COMPENSATION ~\n {body} ~\n Q423=+4"
    assert code in codes(text, 2)
    if code not in {"q_range", "unknown_q"}:
        assert "Q407" not in only(text).parameters


@pytest.mark.parametrize(
    ("before", "code"),
    [("M128", "tcpm_active"), ("FUNCTION TCPM F TCP AXIS POS", "tcpm_active"), ("PLANE SPATIAL SPA+30 STAY", "tilted")]
    + [("CYCL DEF 10.1 ROT+12.5", "rotated")],
)
def test_what_must_be_off_before_is_looked_at(before: str, code: str) -> None:
    call = "TCH PROBE 452 PRESET COMPENSATION ~\n Q407=+12.5"
    assert code in codes(f"{before}\n{call}", 2)
    off = {"tcpm_active": "M129\nFUNCTION RESET TCPM", "tilted": "PLANE RESET STAY", "rotated": "CYCL DEF 10.1 ROT+0"}
    assert code not in [n.code for line in heidenhain.read(f"{before}\n{off[code]}\n{call}").lines for n in line.notes]


# --- plans

_ANGLES = st.floats(-359.9999, 359.9999).map(lambda value: round(value, 4))
_LENGTHS = st.floats(0.0001, 99.9999).map(lambda value: round(value, 4))


@st.composite
def plans(draw: st.DrawFn) -> MeasuringPlan:
    cycle: Any = draw(st.sampled_from([451, 452]))
    axes = tuple(
        AxisPlan(letter, draw(_ANGLES), draw(_ANGLES), draw(_ANGLES), draw(st.integers(0, 12))) for letter in AXES
    )
    return MeasuringPlan(
        cycle,
        draw(_LENGTHS),
        axes,
        draw(st.one_of(_LENGTHS, st.just("PREDEF"))),
        draw(_LENGTHS),
        draw(st.one_of(_LENGTHS, st.sampled_from(["FMAX", "FAUTO", "PREDEF"]))),
        draw(st.floats(0, 360).map(lambda value: round(value, 4))),
        draw(st.integers(3, 8)),
        draw(st.floats(-3, 3).map(lambda value: round(value, 4))),
        draw(st.integers(0, 3)) if cycle == 451 else 0,
        draw(st.integers(0, 3)) if cycle == 451 else 0,
    )


@examples(50)
@given(plans(), st.integers(0, 99))
def test_a_plan_survives_its_program(plan: MeasuringPlan, memory: int) -> None:
    text = heidenhain.write_plan(plan, memory)
    found = heidenhain.read(text)
    assert text.isascii()
    assert not [line for line in found.lines if line.verdict is LineVerdict.NOT_UNDERSTOOD]
    saved, call = found.programs
    assert saved.parameters == {"cycle": 450, "Q410": 0.0, "Q409": memory}
    values = {name: value for name, value in call.parameters.items() if name != "cycle"}
    assert plan_of(plan.cycle, values) == plan
    assert [n for line in found.lines for n in line.notes if n.code in {"q_range", "unknown_q", "cut_wrong"}] == []


def _checks(*axes: AxisPlan, **more: Any) -> tuple[list[str], list[str]]:
    plan = MeasuringPlan(452, 12.5, axes, **more)
    return [each.code for each in warnings(plan)], [each.code for each in faults(plan)]


def test_a_plan_is_checked() -> None:
    c = AxisPlan("C", -90.0, 180.0, 0.0, 4)
    assert _checks(c) == ([], [])
    assert _checks(c._replace(points=2)) == (["few_positions"], [])
    assert _checks(c._replace(end=-50.0)) == (["narrow_arc"], [])
    assert _checks(c._replace(start=0.0, end=360.0 - 1e-4, points=12)) == ([], [])
    assert _checks(c._replace(start=-180.0, end=180.0, points=5)) == (["measured_twice"], [])
    assert _checks(c._replace(points=0)) == (["no_axis"], [])
    assert _checks(c, feed=0.0) == (["feed_zero"], [])
    assert _checks(c._replace(encoder=False)) == (["travel_unknown"], [])
    assert _checks(c._replace(encoder=False, travel=(-91.0, 181.0))) == ([], [])
    assert _checks(c._replace(encoder=False, travel=(-90.9, 181.0))) == (["near_limit_switch"], [])
    assert _checks(c._replace(encoder=False, travel=(-91.0, 181.0)), backlash_angle=0.5) == (["near_limit_switch"], [])
    assert _checks(c._replace(travel=(-89.0, 181.0))) == ([], ["beyond_travel"])
    assert _checks(c._replace(teeth=3.0), retract_height=0.0) == ([], ["hirth_no_retract"])
    assert _checks(AxisPlan("A", -30.0, 90.0, 0.0, 4, teeth=3.0), retract_height=50.0) == (["moved_to_teeth"], [])


@examples(50)
@given(
    st.one_of(
        st.text(), st.text('QTCHPROBE 45012=+-.,~;"\n'), st.integers(0, len(CALL)).map(lambda at: CALL[at:] + CALL[:at])
    )
)
def test_nothing_breaks_the_reader_and_nothing_is_dropped(text: str) -> None:
    try:
        found = heidenhain.read(text)
    except ProgramError:
        return
    assert [line.number for line in found.lines] == list(range(1, len(found.lines) + 1))
    assert all(line.notes for line in found.lines)


def test_much_of_anything_is_answered_quickly() -> None:
    for piece in ("Q407=", "TCH PROBE 452 ", 'QS146 = "', "~", "Q1=Q", "SUBSTR ( ", "Q4=1 ~", "PLANE "):
        text = "\n".join(piece * (900 // len(piece)) for _ in range(60))
        assert len(heidenhain.read(text).lines) == 60
