"""The parameter form: what people type, as text, to parameters and back."""

import json
import re
from typing import Any

import pytest

from app.core.parameters import read
from app.loop.characteristics import wording
from app.views.set_up import parameter_form
from tests.shop import PARAMETERS


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("0,0053", 0.0053),
        ("0.0053", 0.0053),
        ("−0.016", -0.016),
        ("+0.018", 0.018),
        (" 40 ", 40),
        ("1e-3", 0.001),
        ("", None),
        ("  ", None),
        ("3 mm", "3 mm"),
        ("1.000,5", "1.000,5"),
        ("0x10", "0x10"),
        ("1_000", "1_000"),
        ("٣", "٣"),
        ("9" * 41, "9" * 41),
    ],
)
def test_numbers_as_people_type_them(typed: str, meant: Any) -> None:
    assert parameter_form.number(typed) == meant


@pytest.mark.parametrize("not_finite", ["nan", "inf", "-Infinity", "1e999"])
def test_what_is_not_finite_is_left_to_the_core(not_finite: str) -> None:
    value = parameter_form.number(not_finite)
    assert not isinstance(value, int)
    assert parameter_form.diagram({"zero_range": not_finite}).limits["zero_range"] is None


@pytest.mark.parametrize(
    "given",
    [
        PARAMETERS,
        {**PARAMETERS, "factor": 0.25, "max_step": 0.01, "accept": {"n": 2, "m": 3}, "rejected_may_correct": True},
        {
            "R42": 40,
            "R40": 0,
            "R41": -0.016,
            "R33": 0.001,
            "R37": 0.3,
            "R36": 1,
            "R25": 3,
            "R23": 4,
            "R26": 12.5,
            "R04": 0.5,
            "R30": 2,
            "R31": 1,
            "mode": "measure_only",
            "wear_policy": "release",
        },
    ],
)
def test_a_set_goes_through_the_form_unharmed(given: dict[str, Any]) -> None:
    parameters = read(given)[0]
    typed = parameter_form.typed_from(parameters.as_dict())
    assert all(isinstance(text, str) for text in typed.values())
    assert read(parameter_form.parameters_from(typed))[0] == parameters


def test_an_averaging_limit_left_to_the_tolerance_stays_so() -> None:
    parameters = read({name: value for name, value in PARAMETERS.items() if name != "averaging_limit"})[0]
    assert parameter_form.typed_from(parameters.as_dict())["averaging_limit"] == ""


def test_a_new_form_chooses_no_factor() -> None:
    """A wrong sign makes every part worse: nobody may get one by not looking."""
    assert parameter_form.typed_defaults()["factor"] == ""


def test_the_diagram_follows_the_drawing() -> None:
    typed = {"nominal": "40", "upper_deviation": "0", "lower_deviation": "-0,016", "zero_range": "0.001", "target": "x"}
    diagram = parameter_form.diagram(typed)
    assert (diagram.target, diagram.width, diagram.limits["tolerance"]) == (39.992, 0.016, 0.008)
    assert diagram.limits["averaging_limit"] == pytest.approx(0.016 / 3)
    assert diagram.limits["wear_limit"] is None


def test_micrometres_beside_a_length() -> None:
    assert parameter_form.micrometres("zero_range", "0,001") == "1\xa0µm"
    assert parameter_form.micrometres("lower_deviation", "-0.016") == "−16\xa0µm"
    assert parameter_form.micrometres("zero_range", "x") == ""


def test_differences_in_words() -> None:
    old = read(PARAMETERS)[0].as_dict()
    new = read(PARAMETERS | {"zero_range": 0.002, "mode": "approval", "accept": {"n": 2, "m": 3}, "max_step": 0.01})[0]
    found = [tuple(difference) for difference in wording.differences(old, new.as_dict())]
    assert found == [
        ("Zero range", "R33", "0.001 mm", "0.002 mm"),
        ("Mode", None, "Automatic", "Approval by a person"),
        ("Largest step", None, "–", "0.01 mm"),
        ("Acceptance", None, "1 of 1", "2 of 3"),
    ]


def test_the_page_gets_the_same_sentences_as_the_api() -> None:
    sentences = parameter_form.sentences()
    assert len(json.dumps(sentences)) > 100
    for sentence in sentences:
        assert set(re.findall(r"\{(\w+)\}", sentence["text"])) == {"smaller", "larger"}
