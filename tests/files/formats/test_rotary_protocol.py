"""The control's protocol in German, English and Slovene; what is missing, and what means no good."""

import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as some

from app.files.formats.markup import rows_of
from app.files.formats.rotary_protocol import Protocol, numbers_in, read_protocol
from app.files.formats.rotary_words import AXIS_KEYS, HEAD_KEYS, known_words

FOLDER = Path(__file__).parent / "protocols"


def sample(language: str) -> Protocol:
    return read_protocol((FOLDER / f"{language}.html").read_text(encoding="utf-8"))


@pytest.mark.parametrize("language", ["de", "sl"])
def test_the_same_table_in_two_languages(language: str) -> None:
    made = sample(language)
    assert set(made.axes) == {"C"}
    axis = made.axes["C"]
    expected = {
        "start_angle": -90.0,
        "end_angle": 180.0,
        "points": 4.0,
        "radius": 180.0125,
        "backlash": 0.0021,
        "scatter_before": 0.0134,
        "scatter_after": 0.0021,
        "greatest": 0.0256,
        "angle_error": 0.0008,
        "mean_error": 0.0019,
    }
    assert axis.numbers == pytest.approx(expected)
    assert axis.angles == (-90.0, 0.0, 90.0, 180.0)
    assert axis.vectors == {
        "correction": (0.0123, -0.0081, 0.0),
        "before": (250.0, 0.0, -120.0),
        "after": (250.0123, -0.0081, -120.0),
    }
    assert made.head["kinematics"] == "MILL5_AC"
    assert made.head["tool"] == "TOUCH_PROBE"
    assert made.head["created"].startswith("21.11.2026 06:42")


def test_german_table_with_its_diagram_and_a_line_of_the_house() -> None:
    made = sample("de")
    assert made.ball_radius == 12.5
    assert made.parameters == ["QS146 = 0.01230000 -0.0081000 0.00210000 -0.0013000"]
    points = made.axes["C"].deviations
    assert [point.angle for point in points] == [-90.0, 0.0, 90.0, 180.0]
    assert points[0].measured == (0.0042, 0.0204, -0.0031)
    assert points[3].optimised == (-0.0004, -0.0013, 0.0004)
    assert {point.approach for point in points} == {1}
    assert [each.text for each in made.unread] == ["Bediener der Nachtschicht: Huber"]
    assert made.unread[0].line == 14


def test_english_with_two_axes() -> None:
    made = sample("en")
    assert set(made.axes) == {"A", "C"}
    a, c = made.axes["A"], made.axes["C"]
    assert a.errors == {"EY0A": 0.005, "EZ0A": -0.002, "EB0A": 0.0011, "EC0A": 0.0004}
    assert a.vectors["correction"] == (0.0, 0.005, -0.002)
    assert (a.numbers["scatter_before"], a.numbers["scatter_after"]) == (0.0071, 0.0016)
    assert a.angles == (-30.0, 0.0, 30.0, 60.0, 90.0)
    assert c.numbers["backlash"] == 0.0018
    assert made.parameters == ["Q149 = 0.0005", 'QS146 = "0.00410000 -0.0023000 0.00060000 -0.0002000"']
    assert made.incidence == 0
    assert made.unread == []


def test_slovene_errors_and_incidence() -> None:
    made = sample("sl")
    assert made.axes["C"].errors == {"EX0C": 0.0123, "EY0C": -0.0081, "EA0C": 0.0021, "EB0C": -0.0013}
    assert made.incidence == 15
    assert made.unread == []


def test_what_is_missing_is_missing() -> None:
    made = read_protocol("<p>C axis</p><p>Start angle:</p><p>End angle: much</p><p>Backlash: 0.1</p>")
    assert made.axes["C"].numbers == {"backlash": 0.1}
    assert [each.text for each in made.unread] == ["Start angle:", "End angle: much"]
    assert read_protocol("").axes == {}
    assert read_protocol("<p>nothing of that kind</p>").unread[0].text == "nothing of that kind"


def test_a_value_before_any_axis_belongs_to_none() -> None:
    made = read_protocol("Start angle: 3\nC axis\nEnd angle: 4")
    assert made.axes["C"].numbers == {"end_angle": 4.0}
    assert [each.line for each in made.unread] == [1]


def test_every_value_has_words() -> None:
    assert {*AXIS_KEYS, *HEAD_KEYS} - {"scatter_before", "scatter_after"} <= set(known_words().meanings)


@pytest.mark.parametrize(
    "text",
    [
        "<" * 200_000,
        "<a " * 100_000,
        "<!--" * 100_000,
        "<![CDATA[" * 50_000,
        "&" * 200_000 + ";",
        "&#x" + "9" * 100_000 + ";",
        "<td>" * 100_000,
        "<table><tr>" * 50_000,
        "<svg>" * 50_000 + "Start angle: 1",
        "C-Achse: " + "9" * 200_000,
        "EXC " * 50_000,
        "<p>C axis</p>" + "<p>Position before: " + "X 1 " * 50_000 + "</p>",
        "\x00<p>\x00C\x00</p>",
        "<script>C-Achse</script " * 1000,
        "<p>" + "x:" * 100_000 + "</p>",
        "<!DOCTYPE html [ <!ENTITY a 'aaaa'> <!ENTITY b '&a;&a;'> ]><p>&b;</p>",
    ],
    ids=range(16),
)
def test_hostile_markup_is_read_in_no_time(text: str) -> None:
    began = time.process_time()
    made = read_protocol(text)
    assert time.process_time() - began < 5
    assert not made.axes or set(made.axes) <= {"A", "B", "C"}


def test_scripts_are_not_words() -> None:
    rows, broken = rows_of("<script>var a = '<p>C-Achse</p>';</script><style>p{}</style><p onclick='x()'>Lose</p>")
    assert [row.text for row in rows] == ["Lose"]
    assert broken == []


@given(some.text())
def test_any_text_is_read(text: str) -> None:
    read_protocol(text)
    read_protocol(f"<p>C axis</p><table><tr><td>Backlash</td><td>{text}</td></tr></table>")
    numbers_in(text)


def test_lines_of_a_text_with_blanks_between() -> None:
    made = read_protocol(
        "Achse C\nStartwinkel      -90,000 °\nStandardabweichung (optimiert)   1,2 µm\nMax. Abweichung 3,2 µm\nSeite 1 von 2\n"
    )
    assert made.axes["C"].numbers == {"start_angle": -90.0, "scatter_after": 0.0012, "greatest": 0.0032}
    assert [each.text for each in made.unread] == ["Seite 1 von 2"]


@pytest.mark.parametrize(
    "line",
    [
        "Messkreisradius: 1.212,3344 mm",
        "Messkreisradius: 1 212,3344 mm",
        "Messkreisradius: 1.2e-05 mm",
        "Messkreisradius: 1'212.3344 mm",
        "Position vor: X 1 345,6789 Y 0 Z 1",
        "Position vor: X=-1.345,6789 Y=0 Z=1",
        "Achspositionen: -90,-30,30,90",
        "Achspositionen: -90.000; 1.030,5",
    ],
)
def test_half_of_a_number_is_none(line: str) -> None:
    """With a mark for the thousands, or commas both in and between numbers: told, not read as something else."""
    made = read_protocol(f"<h2>C-Achse</h2><p>Lose: 0,001 °</p><p>{line}</p>")
    assert made.axes["C"].numbers == {"backlash": 0.001}
    assert (made.axes["C"].vectors, made.axes["C"].angles) == ({}, ())
    assert [each.text for each in made.unread] == [line]


def test_blanks_between_numbers_part_them() -> None:
    axis = read_protocol("<h2>Axis C</h2><p>Axis positions: 0 120 240</p><p>Position before: 1 200 300</p>").axes["C"]
    assert (axis.angles, axis.vectors) == ((0.0, 120.0, 240.0), {"before": (1.0, 200.0, 300.0)})


def test_angles_with_commas_between() -> None:
    assert read_protocol("<h2>Axis C</h2><p>Axis positions: -90.0, -30.5,+30.0, 90.0</p>").axes["C"].angles == (
        *(-90.0, -30.5),
        *(30.0, 90.0),
    )


def test_a_title_of_such_words_says_nothing_that_could_be_missed() -> None:
    made = read_protocol(
        "<title>Messprotokoll Kinematik</title><h2>C-Achse</h2><p>Lose: 0,001 °</p><p>Kinematik Huber</p>"
    )
    assert [each.text for each in made.unread] == ["Kinematik Huber"]


def test_a_mark_of_the_byte_order_is_no_line() -> None:
    assert read_protocol("\ufeff<html><h2>Axis C</h2><p>Backlash: 0.001</p></html>").unread == []
