"""Numbers of parts as people say them, and the sentences about a loop."""

from math import inf

import pytest

from app.core.forecast import NO_RECORD, PUBLIC_WIDENING, Forecast, Record
from app.core.hunting import Remedy
from app.quality.wear.queries import NEAR, PLANNED, next_event, record_of
from app.quality.wear.tables import Outlook
from app.quality.wear.wording import about_interval, parts_left, remedy_sentence

SETTINGS = {"zero_range": 0.0002, "averaging_limit": 0.005, "weighting_factor": 1.0, "tolerance_width": 0.016}


@pytest.mark.parametrize(
    ("forecast", "said"),
    [
        (Forecast(143.2, 91.0, 258.0), "≈ 140 (91–260)"),
        (Forecast(7.4, 0.0, 21.0), "≈ 7 (0–21)"),
        (Forecast(900, 400, inf), "≈ 900 (400–more)"),
        (Forecast(0.0, 0.0, 3.0), "reached"),
        (Forecast(12_345, 9_000, 20_000), "more than 10 000"),
    ],
)
def test_parts_left(forecast: Forecast, said: str) -> None:
    assert parts_left(forecast).replace("\xa0", " ").replace("\u202f", " ") == said


def test_the_interval_says_how_often_it_held_and_whose_width_it_has() -> None:
    none, few, many = (about_interval(record) for record in (NO_RECORD, Record(1, 4, 3, 1.9), Record(9, 36, 35, 0.7)))
    assert "No forecast tested here yet: no earlier edge. Until 8 edges are over" in none
    assert "3 of 4 forecasts held here, on 1 earlier edge. Until 8 edges are over" in few
    assert "35 of 36 forecasts held here, on 9 earlier edges. It is as wide as these edges needed." in many


def test_a_note_of_an_earlier_version_is_widened_too() -> None:
    """It learnt by a formula without a steep end, and had 1 where nothing was missed."""
    old = Outlook(towards="wear", parts=100.0, hunting="quiet", lives=2, tested=8, held=8, widening=1.0)
    assert record_of(old) == Record(2, 8, 8, PUBLIC_WIDENING)
    assert record_of(None) == record_of(Outlook(lives=0, tested=0, held=0, widening=0.0)) == NO_RECORD


def outlook(parts: float | None, high: float | None = 200.0, towards: str | None = "wear") -> Outlook:
    return Outlook(towards=towards, parts=parts, parts_low=10.0, parts_high=high, hunting="quiet")


def test_the_plant_page_is_quiet_about_what_is_far_and_marks_what_is_near() -> None:
    assert next_event(None) is None
    assert next_event(outlook(None, None, None)) is None
    assert next_event(outlook(PLANNED + 1.0)) is None
    far, near = next_event(outlook(PLANNED - 1.0)), next_event(outlook(NEAR - 1.0, None))
    assert far is not None
    assert not far.near
    assert near is not None
    assert near.near
    assert "more" in near.parts
    assert near.towards == "parts to R37"
    assert near.held == "No forecast tested here yet: no earlier edge."


@pytest.mark.parametrize(
    ("remedy", "said"),
    [
        (
            Remedy(4.0, 0.0025, None, 0.0),
            "With R33 at 2.5 µm instead of 0.2 µm, or k at 4 instead of 1 scatter alone would",
        ),
        (
            Remedy(None, 0.0025, None, 0.0),
            "With R33 at 2.5 µm instead of 0.2 µm (k alone is not enough) scatter alone would",
        ),
        (
            Remedy(4.0, None, None, 0.0),
            "With k at 4 instead of 1 (R33 alone is not enough) scatter alone would",
        ),
        (
            Remedy(None, 0.006, 0.007, 0.0),
            "With R34 at 7.0 µm instead of 5.0 µm and R33 at 6.0 µm instead of 0.2 µm scatter alone would",
        ),
        (Remedy(None, 0.011, 0.012, 0.0), "No setting helps: the process scatters too much for this tolerance."),
        (Remedy(None, 0.0031, None, 0.0031), "R33 is not below 3.1 µm, the uncertainty of the probe's signal path."),
    ],
)
def test_the_remedy_in_words(remedy: Remedy, said: str) -> None:
    text = remedy_sentence({"state": "hunting", "remedy": remedy._asdict()}, SETTINGS)
    assert said in text.replace("\xa0", " ")
    # What is worked out for scatter alone is no advice yet: wear and warming up are in the replay only.
    assert ("what-if page" in text) == ("No setting" not in text)


def test_swinging_is_sent_elsewhere() -> None:
    assert "factor" in remedy_sentence({"state": "swinging", "remedy": None}, SETTINGS)
