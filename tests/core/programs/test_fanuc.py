"""The macro variables of the lathe line: read, written, and the whole source passed through."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.parameters import Parameters, read
from app.core.programs import fanuc
from app.core.programs.lines import Program, ProgramError, ProgramKind, Verdict
from tests.core.programs.conftest import parameter_sets

# The modules of the source, as it prints them.
MACRO = """G98; 进入分进给模式
M5 S0;
M9;
G28 U0 W0;
T0832;
#130=#505+#506;
#131=#505+#507;
G0 X#500 Z#501;
X0;
M55;
Z5;
G31 Z-15 F500 P1 L999;
G31 X[#505+#503*COS[12.5]-1] F#504;
#2 = #5041;
#510 = #2+#502;
IF[#510 GT #130] GOTO1000;
IF[#510 LT #131] GOTO1000;
#121=1;
N1000
#121=0;
#513=#513+1;
GOTO1003;
N1005
G0 X0;
Z#501;
#[2700+#1]=#[2700+#1]+[[#505+[#506+#507]/2]-[#510+#511+#512]/3];
G[FUP[#100]]
F#107
T[FUP[#109]];
G65 H99 P0(/measure by hand and confirm);
"""
BORE = """(BORE)
#500=60. #501=5.
#502=3.
#503=2.5
#504=150
#505=40. (NOMINAL)
#506 = 0.025 ; ES
#507=0
G65 P9011 A3.
"""


def program_of(text: str) -> Program:
    program = fanuc.read(text).program
    assert program is not None
    return program


def test_the_macro_of_the_source_is_passed_over_line_by_line() -> None:
    text = fanuc.read(MACRO)
    assert {line.verdict for line in text.lines} == {Verdict.IGNORED}
    assert text.programs == ()


def test_the_variables_make_the_lathe_line() -> None:
    program = program_of(BORE)
    assert program.kind is ProgramKind.MEASURING
    assert program.parameters == {
        "nominal": 40.0,
        "upper_deviation": 0.025,
        "lower_deviation": 0.0,
        "tool_memory": 3,
        "variant": "along",
        "points": 3,
        "zero_range": 0.0,
        "weighting_factor": 1.0,
        "factor": -1.0,
        "accept": {"n": 2, "m": 3},
        "feature": "inside",
        "wear_limit": 0.3,
        "confidence_limit": 1.0,
    }
    assert program.values == {"#500": 60.0, "#501": 5.0, "#502": 3.0, "#503": 2.5, "#504": 150.0}
    assert [note.code for note in program.notes] == ["macro", "assumed", "assumed"]
    parameters, _warnings = read(program.parameters)
    assert (parameters.target, parameters.tolerance_width) == (40.0125, 0.025)


def test_a_wide_tolerance_moves_the_assumed_limits_out() -> None:
    program = program_of("#505=100. #506=1. #507=-1.5")
    assert (program.parameters["wear_limit"], program.parameters["confidence_limit"]) == (1.25, 1.25)
    read(program.parameters)


def test_results_become_the_touches_of_a_reading() -> None:
    program = program_of("#510=40.012\n#511=40.013\n#512=40.011\n#513=1.")
    assert program.kind is ProgramKind.RESULTS
    assert program.parameters == {}
    assert fanuc.touches(program.results) == [[40.012], [40.013], [40.011]]
    assert fanuc.touches({"#510": 40.0}) is None


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("#505=#500+1", "expression"),
        ("#505=40.0.1", "expression"),
        ("#505=", "no_value"),
        ("#505=" + "9" * 400, "too_large"),
        ("bore", "unknown"),
        ("X[#500", "unknown"),
        ("(INBAND ACCEPT=three)", "bad_setting"),
        ("y" * 1500, "too_long"),
    ],
)
def test_what_is_not_understood_is_named(text: str, code: str) -> None:
    found = fanuc.read(text)
    assert found.lines[0].verdict is Verdict.NOT_UNDERSTOOD
    assert code in [note.code for note in found.lines[0].notes]


def test_the_last_assignment_counts_and_a_calculation_leaves_nothing_standing() -> None:
    text = fanuc.read("#505=40.\n#505=41.")
    assert [note.code for note in text.lines[1].notes] == ["again", "assigned"]
    assert program_of("#505=40.\n#505=41.").parameters["nominal"] == 41.0
    assert "nominal" not in program_of("#505=40.\n#505=#1+2\n#506=1.").parameters


VALUES = st.dictionaries(st.sampled_from(["#500", "#501", "#502", "#503", "#504"]), st.floats(-999, 999))


@given(parameter_sets(), VALUES)
def test_a_characteristic_survives_its_macro_text(parameters: Parameters, values: dict[str, float]) -> None:
    text = fanuc.write_measuring(parameters, {"characteristic": "bore-d40", "name": "Bore (Ø40); 100 %"}, values)
    found = fanuc.read(text)
    assert text.isascii()
    assert not [line for line in found.lines if line.verdict is Verdict.NOT_UNDERSTOOD]
    program = program_of(text)
    assert program.about == {"characteristic": "bore-d40", "name": "Bore (Ø40); 100 %"}
    assert program.values == values
    again, _warnings = read(program.parameters)
    assert again == parameters
    assert fanuc.write_measuring(again, program.about, program.values) == text


def test_the_lathe_line_needs_few_comments() -> None:
    parameters, _warnings = read(program_of(BORE).parameters)
    text = fanuc.write_measuring(parameters, {}, program_of(BORE).values)
    assert text.splitlines() == [
        "(MEASURING, LATHE LINE)",
        "(INBAND AVERAGING_LIMIT=0.008333333)",
        "(INBAND WEAR_LIMIT=0.3)",
        "(INBAND CONFIDENCE_LIMIT=1)",
        "#500=60. (START X)",
        "#501=5. (START Z)",
        "#502=3. (PROBE RADIUS TERM)",
        "#503=2.5 (RADIUS)",
        "#504=150. (PROBING FEED)",
        "#505=40. (NOMINAL)",
        "#506=0.025 (UPPER DEVIATION ES)",
        "#507=0. (LOWER DEVIATION EI)",
        "G65 P9011 A3. (MEASURING MACRO, A: OFFSET OF THE TOOL)",
        "M99",
    ]


def test_the_ring_is_a_calibration() -> None:
    program = program_of(fanuc.write_calibration(40.002, {"name": "Ring"}, {"#504": 150.0}))
    assert program.kind is ProgramKind.CALIBRATION
    assert program.parameters == {"gauge": 40.002, "upper_deviation": 0.01, "lower_deviation": -0.01}


@st.composite
def mutilated(draw: st.DrawFn) -> str:
    text: Any = BORE + MACRO
    for _ in range(draw(st.integers(1, 6))):
        at, to = sorted(draw(st.tuples(st.integers(0, len(text)), st.integers(0, len(text)))))
        cut = [text[:at] + text[to:], text[to:] + text[:to], text[:at] + draw(st.text(max_size=8)) + text[at:]]
        text = draw(st.sampled_from(cut))
    return str(text)


@given(st.one_of(mutilated(), st.text(), st.text("#0123456789=.[]()+-*/GXZNIFO;% \n\r")))
def test_nothing_breaks_the_reader_and_nothing_is_dropped(text: str) -> None:
    try:
        found = fanuc.read(text)
    except ProgramError:
        return
    assert [line.number for line in found.lines] == list(range(1, len(found.lines) + 1))
    assert all(line.notes for line in found.lines)


def test_much_of_anything_is_answered_quickly() -> None:
    for piece in ("#505=#", "X[", "[[[[", "IF", "G65P1A1.", "#[1]=", "(", "#5 = ", "N1 "):
        text = "\n".join(piece * (900 // len(piece)) for _ in range(60))
        assert len(fanuc.read(text).lines) == 60


def test_a_text_that_names_no_tool_says_that_nothing_would_be_corrected() -> None:
    drawing = "#505=25.\n#506=0.021\n#507=0.\n"
    for text, said in ((drawing, True), (f"{drawing}G65 P9011 A4.", False)):
        program = fanuc.read(text).program
        assert program is not None
        assert ("no_tool" in [note.code for note in program.notes]) is said
