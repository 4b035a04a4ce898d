"""Every problem the core can find has a sentence of its own."""

import re
from pathlib import Path

import pytest

from app.core import parameters, unusual
from app.core.parameters import FIELDS, ParameterError, Problem, read
from app.loop.characteristics import wording

SOURCES = "\n".join(Path(str(module.__file__)).read_text(encoding="utf-8") for module in (parameters, unusual))
CODES = set(re.findall(r'Problem\(\s*[\w.\[\]"]+,\s*"(\w+)"', SOURCES))


def test_the_codes_were_found() -> None:
    assert {"required", "order", "target_missing", "source_range"} <= CODES
    assert len(CODES) >= 14


@pytest.mark.parametrize(
    "code",
    sorted(
        CODES
        - {
            "order",
            "range",
            "source_range",
            "target_twice",
            "out_of_reach",
            "limits_as_sizes",
            "tolerance_sign",
            "averages_never",
        }
    ),
)
def test_every_code_has_words(code: str) -> None:
    data = {"choices": ("a", "b"), "other": "R33", "value": 1.5, "limit": 0.0, "name": "Run-out"}
    sentence = wording.sentence(Problem("zero_range", code, data))
    assert sentence != code
    assert " " in sentence


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_every_field_and_choice_has_a_name(field: parameters.Field) -> None:
    assert wording.label(field.name) != field.name
    for choice in field.choices:
        assert wording.choice(field.name, choice) != choice or field.name == "axis"


def test_target_and_drawing_that_disagree() -> None:
    with pytest.raises(ParameterError) as refused:
        read(
            {
                "nominal": 10,
                "upper_deviation": 0,
                "lower_deviation": -0.004,
                "target": 10,
                "zero_range": 0.0001,
                "wear_limit": 0.3,
                "confidence_limit": 1,
            }
        )
    (error,) = wording.field_errors(refused.value.problems)
    assert error.field == "parameters.target"
    assert error.message == (
        "R32 target 10.0000 mm does not agree with nominal and deviations, which give 9.9980 mm; say only one of the two"
    )


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("index", {"index": 90.0, "variant": "round"}, "90°"),
        ("index", {"index": -25.5, "variant": "along"}, "−25.5 mm"),
        ("wait", {"wait": 1.5}, "1.5 s"),
        ("zero_range", {"zero_range": 0.001}, "0.001 mm"),
        ("path_factor", {"path_factor": 2.0}, "2"),
    ],
)
def test_a_value_has_its_unit(name: str, values: dict[str, object], words: str) -> None:
    assert wording.worded(name, values) == words
