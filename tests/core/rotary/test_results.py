"""Result parameters: the manual's example, damaged ones, and the way back."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as some

from app.core.rotary.results import WIDTH, Damage, read_results, read_string, write_number, write_string

CASES = json.loads((Path(__file__).parents[1] / "cases" / "rotary_axes.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_strings(case: dict[str, Any]) -> None:
    found = read_string(case["parameter"], case["text"])
    assert found.values == case["values"]
    assert [[flaw.number, flaw.damage.value] for flaw in found.flaws] == case["damage"]
    if not case["damage"]:
        assert write_string([value for value in found.values.values() if value is not None]) == case["text"]


@given(some.lists(some.floats(-9999, 9999), min_size=4, max_size=4))
def test_what_is_written_is_read_again(values: list[float]) -> None:
    text = write_string(values)
    assert len(text) == 4 * WIDTH + 3
    found = read_string("QS145", text)
    assert not found.flaws
    for value, again in zip(values, found.values.values(), strict=True):
        assert again is not None
        assert abs(again - value) < 5.1e-5 if abs(value) > 999 else abs(again - value) < 5.1e-6


@given(some.text(max_size=80))
def test_any_text_is_read_or_reported(text: str) -> None:
    found = read_string("QS146", text)
    assert len(found.values) == 4
    assert all(value is not None for value in found.values.values()) or found.flaws
    read_results(text)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e12, -1e6])
def test_what_does_not_fit_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="fit"):
        write_number(value)


def test_pasted_parameters() -> None:
    found = read_results(
        "Q143 = 0.0134\n q146: +0,0021 mm\nQ147=-0.002;\n\n"
        'QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"\nQ143 = 7\nQ999 = 1\nhello\nQ149 = x\n'
    )
    assert found.scalars == {"Q143": 0.0134, "Q146": 0.0021, "Q147": -0.002}
    assert found.errors == {"C": {"EX0C": 0.01234567, "EY0C": -0.0123456, "EA0C": 0.00123456, "EB0C": -0.0012345}}
    assert [(flaw.parameter, flaw.damage) for flaw in found.flaws] == [
        ("Q143", Damage.TWICE),
        ("", Damage.UNKNOWN),
        ("", Damage.UNKNOWN),
        ("Q149", Damage.NOT_A_NUMBER),
    ]


def test_pasted_side_by_side() -> None:
    text = 'Q141=0.01 Q142=0.02; 11 QS146="0.01234567 -0.0123456 0.00123456 -0.0012345" Q147 = -0.001'
    found = read_results(text)
    assert found.scalars == {"Q141": 0.01, "Q142": 0.02, "Q147": -0.001}
    assert found.errors["C"]["EB0C"] == -0.0012345
    assert not found.flaws


def test_a_standard_deviation_is_never_negative() -> None:
    found = read_results("Q143 = -0.0134\nQ147 = -0.0134")
    assert found.scalars == {"Q147": -0.0134}
    assert [flaw.damage for flaw in found.flaws] == [Damage.NEGATIVE]


def test_minus_one_is_an_axis_that_was_not_measured() -> None:
    found = read_results(
        "Q141 = -1\nQ144 = -1.0\nQ143 = 0.0134\nQ147 = -1\nQS146 = '0.01234567 -0.0123456 0.00123456 -0.0012345'"
    )
    assert found.scalars == {"Q143": 0.0134, "Q147": -1.0}
    assert not found.flaws
    assert read_string("QS146", '"0.01234567 -0.0123456 0.00123456 -0.0012345"').flaws == ()
