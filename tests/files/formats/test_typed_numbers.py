"""Numbers that people type, paste or send as files are read the same way at every door."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.number_text import NotANumber, NumberFault, number_or_none, read_number
from app.errors import Invalid
from app.files.formats.cell_values import Unreadable
from app.files.formats.cell_values import number as of_a_file
from app.files.formats.rotary_protocol import numbers_in
from app.geometry.alignment.form_reader import line as alignment_line
from app.geometry.geometric_form.form_reader import points
from app.geometry.rotary_axes.form_reader import run
from app.geometry.work_zero.form_reader import _line as work_zero_line
from app.quality.gauge_studies.table_reader import number as of_a_table
from app.quality.what_if.form_reader import number as of_the_what_if
from app.views.set_up.parameter_form import number as of_a_parameter
from app.web.forms import length


def _or_none(read: Callable[[str], Any]) -> Callable[[str], float | None]:
    def reader(text: str) -> float | None:
        try:
            value = read(text)
        except Unreadable:
            return None
        return float(value) if isinstance(value, int | float) else None

    return reader


DOORS = {
    "form": _or_none(length),
    "parameter": _or_none(of_a_parameter),
    "what-if": _or_none(of_the_what_if),
    "file": _or_none(lambda text: of_a_file(text, "," if "," in text else ".")),
    "table": of_a_table,
    "core": number_or_none,
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("40,002", 40.002),
        (" 40.002\u00a0", 40.002),
        ("−0.016", -0.016),
        ("–0,016", -0.016),
        ("- 0.016", None),
        ("0. 001", None),
        ("40 001", None),
        ("0.\u202f001", None),
        ("1 234,5", None),
        ("1.234,5", None),
        ("1,234,567", None),
        ("1'234.5", None),
        ("0.0.1", None),
        ("nan", None),
        ("1_000", None),
        ("٣", None),
    ],
)
def test_every_door_reads_a_number_alike(door: str, text: str, value: float | None) -> None:
    assert DOORS[door](text) == value


def test_the_fault_is_named() -> None:
    for text, fault in (
        ("0. 001", "blank"),
        ("- 0.016", "blank"),
        ("1.234,5", "thousands"),
        ("", "empty"),
        ("3 mm", "not_a_number"),
    ):
        with pytest.raises(NotANumber) as caught:
            read_number(text)
        assert caught.value.fault is NumberFault(fault)
    with pytest.raises(Unreadable, match="blank inside"):
        of_a_file("0. 001", ".")


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["-", "−", "–"]))
def test_a_number_is_read_as_it_is_written(value: float, minus: str) -> None:
    text = repr(value).replace("e-", "e~").replace("-", minus).replace("~", "-")
    assert read_number(text) == value
    assert read_number(text.replace(".", ",")) == value


def test_one_number_is_never_read_as_two() -> None:
    """A blank behind the decimal point used to make a second coordinate of the decimals."""
    with pytest.raises(Invalid):
        work_zero_line("-X -353. 012", 1)
    with pytest.raises(Invalid):
        points("12. 5", "touches")
    with pytest.raises(Invalid):
        alignment_line("10 10 0 +Z 0. 012 1 2", 1)
    with pytest.raises(Invalid):
        run({"as": "positions", "positions": "C 90 0 1 2\n0.02 179. 99 40"})
    assert numbers_in("-90. 001 mm") == []
