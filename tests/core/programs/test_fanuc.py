"""The macro variables of the lathe line: read, written, and the whole source passed through."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.parameters import Axis, Parameters, read
from app.core.programs import fanuc
from app.core.programs.correction_forms import Form
from app.core.programs.corrections import PendingCorrection, steps, write
from app.core.programs.lines import LineVerdict, Program, ProgramError, ProgramKind, ProgramText
from app.loop.programs.wording import note
from tests.chance import examples
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


def step_lines(text: ProgramText) -> dict[int, list[str]]:
    return {
        line.number: [note.data["step"] for note in line.notes if note.code == "step"]
        for line in text.lines
        if any(note.code == "step" for note in line.notes)
    }


def test_the_macro_of_the_source_is_read_step_by_step() -> None:
    text = fanuc.read(MACRO)
    assert LineVerdict.NOT_UNDERSTOOD not in {line.verdict for line in text.lines}
    assert text.programs == ()
    found = step_lines(text)
    assert [found.get(number) for number in (6, 7, 12, 13, 14, 15, 16, 26, 30)] == [
        ["limit_size"],
        ["limit_size"],
        ["not_a_bore"],
        ["probing_target"],
        ["touch"],
        ["measured"],
        ["compared"],
        ["corrected"],
        ["alarm"],
    ]


def test_the_probing_target_is_computed_where_its_variables_stand() -> None:
    text = fanuc.read("#505=40.\n#503=2.5\nG31 X[#505+#503*COS[12.5]-1] F#504\nG31 X[-[#505+#503*COS[12.5]-1]] F#504")
    assert [line.notes[0].data["step"] for line in text.lines[2:]] == ["probing_target", "probing_target"]
    assert [line.notes[0].data["value"] for line in text.lines[2:]] == [41.44074, -41.44074]


EDGE_FINDER = """O0999
N1 #1=54.
#2=0.1
IF [#2 LT 0] GOTO2
IF [#1 EQ 54] GOTO54
#3000 =1(YOU INPUT ERR, INPUT 54-55)
N2 #3000=2(YOU INPUT ERR, INPUT 0.0-1.0)
N54 M3 S60
M00
#501 =#5021
#502 =#5021
#503 =[#501+#502]/2
#801 =#5221
#5221 =#503
#504 =#5022
#505=#5022
#506 =[#504+#505]/2
#802 =#5222
#5222 =#506
#508 =#5023
#509 =#508-#2-#[11000+#4120]
#803 =#5223
#5223 =#509
#510=2*SQRT[[#5021-#5221]*[#5021-#5221]+[#5022-#5222]*[#5022-#5222]]+ 6
#511=ABS[#502-#501]-6
#512=ABS[#505-#504]-6
N100 #3006=1(D=#510 L=#511 W=#512)
GOTO 200
N200 M30
"""


def test_the_choice_of_a_work_offset_is_no_tool() -> None:
    fragment = fanuc.read("#1=54.\n#2=0.\nIF [#1 EQ 54] GOTO54\nN54 M3 S60")
    assert fragment.programs == ()


def test_the_choice_of_a_work_offset_says_what_it_is_used_for() -> None:
    for compared in ("IF [#1 EQ 54] GOTO54", "IF[#1EQ54]GOTO54"):
        text = fanuc.read(f"#1=54.0\n{compared}\nN54M3S60")
        assert text.programs == ()  # no tool 54
        (chosen,) = text.lines[0].notes
        assert note(chosen) == "#1: G54, the work offset that the macro sets"


def test_words_need_no_blanks_between_them() -> None:
    text = fanuc.read("M3S60\nG0X10Z5\nG1X10.Y20.\nX#101Y#102\nG31Z-15F500P1L1000\nG90G20\n#505=2.G65P9011A3.M99")
    assert LineVerdict.NOT_UNDERSTOOD not in {line.verdict for line in text.lines}
    assert text.program is not None
    assert (text.program.parameters["nominal"], text.program.parameters["tool_memory"]) == (50.8, 3)


def test_a_remark_beside_a_block_leaves_it_understood() -> None:
    text = fanuc.read("#505=40.0 nominal\n#506=0.02\tupper limit\n#507=0.01 inch")
    assert [line.verdict.value for line in text.lines] == ["understood", "understood", "not_understood"]
    assert [note.code for note in text.lines[1].notes] == ["assigned", "remark"]


def test_the_edge_finder_macro_of_the_source_is_read() -> None:
    text = fanuc.read(EDGE_FINDER)
    assert LineVerdict.NOT_UNDERSTOOD not in {line.verdict for line in text.lines}
    (program,) = text.programs
    assert program.kind is ProgramKind.WORK_ZERO
    assert program.parameters == {
        "work_offset": "G54",
        "axes": "XYZ",
        "tip": 6.0,
        "feeler": 0.1,
        "old_kept": "X #801, Y #802, Z #803",
    }
    assert program.notes == ()


@pytest.mark.parametrize(
    ("head", "feeler", "tip", "warned"),
    [("#2=5.", 5.0, 6.0, True), ("G20\n#2=0.01", 0.254, 152.4, False), ("#2=-0.1", -0.1, 6.0, True)],
)
def test_the_feeler_of_the_edge_finder_is_held_to_the_range_of_the_source(
    head: str, feeler: float, tip: float, warned: bool
) -> None:
    """The macro takes 0 to 1 mm and raises an alarm outside; in a text in inch, tip and feeler are inches as well."""
    program = program_of(EDGE_FINDER.replace("#2=0.1", head))
    assert (program.parameters["feeler"], program.parameters["tip"]) == (feeler, tip)
    assert ["feeler_range"] * warned == [note.code for note in program.notes]


def test_the_alarm_of_a_correction_text_is_read_as_one() -> None:
    chain = steps([PendingCorrection(18, 3, -0.0061, Axis.X)], {3: -0.0081}, 17, 17)
    lathe_line, fanuc_lathe = (
        write(form, "lathe-1", chain) for form in (Form.WEAR_VARIABLES, Form.WEAR_VARIABLES_2000)
    )
    assert "N9999 G65 H99 P0(/INBAND OFFSET NOT AS EXPECTED)" in lathe_line
    assert "N9999 #3000=1(INBAND OFFSET NOT AS EXPECTED)" in fanuc_lathe
    for text in (lathe_line, fanuc_lathe):
        assert ["alarm"] in step_lines(fanuc.read(text)).values()


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
        ("#505=40.0.1", "no_number"),
        ("#505=40. 001", "blank_in_number"),
        ("#511=40. 001", "blank_in_number"),
        ("G65 P9011 A1 2.", "blank_in_number"),
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
    assert found.lines[0].verdict is LineVerdict.NOT_UNDERSTOOD
    assert code in [note.code for note in found.lines[0].notes]


def test_the_last_assignment_counts_and_a_calculation_leaves_nothing_standing() -> None:
    text = fanuc.read("#505=40.\n#505=41.")
    assert [note.code for note in text.lines[1].notes] == ["again", "assigned"]
    assert program_of("#505=40.\n#505=41.").parameters["nominal"] == 41.0
    assert "nominal" not in program_of("#505=40.\n#505=#1+2\n#506=1.").parameters


def test_a_number_with_a_blank_leaves_nothing_standing() -> None:
    assert "nominal" not in program_of("#505=40.\n#505=40. 001\n#506=1.").parameters
    assert "tool_memory" not in program_of("#505=40.\nG65 P9011 A3.\nG65 P9011 A1 2.").parameters
    assert fanuc.touches(program_of("#510=40.\n#511=40.\n#512=40.\n#512=4 0.").results) is None


def test_a_minus_is_a_minus_however_it_is_printed() -> None:
    assert program_of("#505=40.\n#507=−0.016\n#506 = - 0.004").parameters["lower_deviation"] == -0.016


@pytest.mark.parametrize("word", ["G20", "N1 G70", "G20 G99"])
def test_inches_become_mm(word: str) -> None:
    program = program_of(f"{word}\n#504=10.\n#505=1.5\n#506=0.001\n#507=0.\n#510=1.5004\nG65 P9011 A3.")
    assert program.inch
    assert (program.parameters["nominal"], program.parameters["upper_deviation"]) == (38.1, 0.0254)
    assert (program.values["#504"], program.results["#510"]) == (254.0, 38.11016)
    assert program.parameters["tool_memory"] == 3


def test_roughing_and_finishing_cycles_are_no_unit() -> None:
    for block in ("G70 P10 Q20", "G71 U2. R0.5", "G71 P10 Q20 U0.4 W0.1"):
        assert program_of(f"{block}\n#505=40.\nG65 P9011 A3.").parameters["nominal"] == 40.0
    mixed = fanuc.read("#505=1.5748\nG20\nG65 P9011 A3.")
    assert mixed.program is not None
    assert "nominal" not in mixed.program.parameters
    assert "unit_mixed" in [note.code for note in mixed.lines[0].notes]


VALUES = st.dictionaries(st.sampled_from(["#500", "#501", "#502", "#503", "#504"]), st.floats(-999, 999))


@examples(50)
@given(parameter_sets(), VALUES)
def test_a_characteristic_survives_its_macro_text(parameters: Parameters, values: dict[str, float]) -> None:
    text = fanuc.write_measuring(parameters, {"characteristic": "bore-d40", "name": "Bore (Ø40); 100 %"}, values)
    found = fanuc.read(text)
    assert text.isascii()
    assert not [line for line in found.lines if line.verdict is LineVerdict.NOT_UNDERSTOOD]
    program = program_of(text)
    assert program.about == {"characteristic": "bore-d40", "name": "Bore (Ø40); 100 %"}
    assert program.values == values
    again, _warnings = read(program.parameters)
    assert again == parameters
    assert fanuc.write_measuring(again, program.about, program.values) == text


def test_the_whole_tolerance_lies_on_one_side_of_a_natural_limit() -> None:
    given = {"target": 0, "tolerance_width": 0.8, "natural_limit": "lower", "zero_range": 0, "wear_limit": 1}
    text = fanuc.write_measuring(read(given | {"confidence_limit": 1})[0], {}, {})
    assert "#506=0.8 (UPPER DEVIATION ES)" in text
    assert "#507=0. (LOWER DEVIATION EI)" in text
    foreign = program_of("#505=0.\n#506=0.8\n#507=0.\nG65 P9011 A0.").parameters
    assert read(foreign)[0].wear_limit == 0.8  # no limit of wear lies inside the tolerance


def test_the_lathe_line_needs_few_comments() -> None:
    parameters, _warnings = read(program_of(BORE).parameters)
    text = fanuc.write_measuring(parameters, {}, program_of(BORE).values)
    assert text.splitlines() == [
        "(MEASURING, LATHE LINE)",
        "(LENGTHS ARE MM: IT STOPS WHERE THE CONTROL WORKS IN INCH)",
        "IF[#4006EQ20]GOTO8020",
        "IF[#4006NE70]GOTO8021",
        "N8020 G65 H99 P0(/INBAND: CONTROL IS IN INCH)",
        "M99",
        "N8021",
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
