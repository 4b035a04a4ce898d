"""Correction texts, run on simulated controls: twice, out of order, and with the power going between any two blocks."""

import re
from contextlib import nullcontext

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.parameters import Axis
from app.core.programs.correction_forms import FORMS, Form
from app.core.programs.corrections import OffsetStep, PendingCorrection, steps, write
from tests.core.programs.controls import Control, Fanuc, Sinumerik, Stopped

GUARDED = (Form.TURNING, Form.MILLING, Form.WEAR_VARIABLES, Form.WEAR_VARIABLES_2000, Form.G10)
CHECKED = (Form.TURNING, Form.MILLING, Form.WEAR_VARIABLES, Form.WEAR_VARIABLES_2000)
LAST = {Form.TURNING: 99, Form.MILLING: 99}
# Whole tenths of a µm from 2 µm on: what a control with four decimals keeps, and larger than its tolerance.
amounts = st.integers(20, 3000).flatmap(lambda n: st.sampled_from([n / 10_000, -n / 10_000]))


def control_for(form: Form) -> Control:
    return Sinumerik() if form in {Form.TURNING, Form.MILLING} else Fanuc()


def address(form: Form, tool: int) -> str | int:
    if form in {Form.TURNING, Form.MILLING}:
        return f"$TC_DP{12 if form is Form.TURNING else 15}[{tool},1]"
    return (2700 if form is Form.WEAR_VARIABLES else 2000) + tool


def offset(control: Control, form: Form, tool: int) -> float:
    where = address(form, tool)
    held = control.wear.get(where, 0.0) if isinstance(where, str) else control.variables.get(where, 0.0)
    return round(held, 6)


def put(control: Control, form: Form, tool: int, value: float) -> None:
    where = address(form, tool)
    if isinstance(where, str):
        control.wear[where] = value
    else:
        control.variables[where] = value


def last_applied(control: Control, form: Form) -> float:
    return control.variables.get(LAST.get(form, 599), 0)


def chain_of(changes: list[tuple[int, float]], offsets: dict[int, float], first: int = 1) -> list[OffsetStep]:
    wanted = [PendingCorrection(number, tool, amount, Axis.X) for number, (tool, amount) in enumerate(changes, first)]
    return steps(wanted, offsets, first - 1, first - 1)


@pytest.mark.parametrize("form", GUARDED)
@given(changes=st.lists(st.tuples(st.sampled_from([3, 5]), amounts), min_size=1, max_size=6), data=st.data())
def test_a_text_that_is_run_again_and_again_changes_nothing_more(
    form: Form, changes: list[tuple[int, float]], data: st.DataObject
) -> None:
    chain = chain_of(changes, {3: 0.0, 5: 0.0})
    text, control = write(form, "lathe-1", chain), control_for(form)
    for _ in range(data.draw(st.integers(1, 3))):
        control.run(text)
    for tool in (3, 5):
        assert offset(control, form, tool) == pytest.approx(sum(a for t, a in changes if t == tool), abs=1e-9)
    assert last_applied(control, form) == len(changes)


@pytest.mark.parametrize("form", CHECKED)
@given(changes=st.lists(st.tuples(st.sampled_from([3, 5]), amounts), min_size=1, max_size=4), data=st.data())
def test_the_power_may_go_between_any_two_blocks(
    form: Form, changes: list[tuple[int, float]], data: st.DataObject
) -> None:
    text, control = write(form, "lathe-1", chain_of(changes, {3: 0.0, 5: 0.0})), control_for(form)
    for _ in range(3):
        control.run(text, blocks=data.draw(st.integers(0, len(text.splitlines()))))
    control.run(text)
    for tool in (3, 5):
        assert offset(control, form, tool) == pytest.approx(sum(a for t, a in changes if t == tool), abs=1e-9)


@given(changes=st.lists(st.tuples(st.sampled_from([3, 5]), amounts), min_size=1, max_size=4), data=st.data())
def test_g10_never_applies_a_correction_twice_even_then(changes: list[tuple[int, float]], data: st.DataObject) -> None:
    chain = [step._replace(amount=abs(step.amount)) for step in chain_of(changes, {3: 0.0, 5: 0.0})]
    text, control = write(Form.G10, "lathe-1", chain), Fanuc()
    for _ in range(4):
        control.run(text, blocks=data.draw(st.integers(0, len(text.splitlines()))))
        for tool in (3, 5):
            assert offset(control, Form.G10, tool) <= sum(abs(a) for t, a in changes if t == tool) + 1e-9


@pytest.mark.parametrize("form", GUARDED)
@given(changes=st.lists(st.tuples(st.sampled_from([3, 5]), amounts), min_size=2, max_size=6), data=st.data())
def test_an_older_text_after_a_newer_one_changes_nothing(
    form: Form, changes: list[tuple[int, float]], data: st.DataObject
) -> None:
    """Fetched, fetched again with one more, run in any order: every correction is in once, or the control stops and asks."""
    chain = chain_of(changes, {3: 0.0, 5: 0.0})
    shorter = chain[: data.draw(st.integers(1, len(chain) - 1))]
    older, newer, control = write(form, "m", shorter), write(form, "m", chain), control_for(form)
    for text in data.draw(st.lists(st.sampled_from([older, newer]), max_size=4)):
        try:
            control.run(text)
        except Stopped:  # the older one, after the newer: the offset is further on than it knows
            assert text == older
    control.run(newer)
    for tool in (3, 5):
        assert offset(control, form, tool) == pytest.approx(sum(a for t, a in changes if t == tool), abs=1e-9)


@pytest.mark.parametrize("form", GUARDED)
def test_a_stale_text_is_passed_over_where_the_offset_has_come_back_by_chance(form: Form) -> None:
    """+20, +10, −30 µm leads back to 0. The offset alone would let the first text run again."""
    first = chain_of([(3, 0.02), (3, 0.01)], {3: 0.0})
    second = steps([PendingCorrection(3, 3, -0.03, Axis.X)], {3: 0.03}, 2, 2)
    control = control_for(form)
    for chain in (first, second):
        control.run(write(form, "m", chain))
    assert offset(control, form, 3) == 0
    try:
        control.run(write(form, "m", first))
    except Stopped:
        assert form in CHECKED
    assert offset(control, form, 3) == 0


@pytest.mark.parametrize("form", GUARDED)
@pytest.mark.parametrize("times", [1, 3])
def test_a_correction_that_was_released_late_is_applied_once(form: Form, times: int) -> None:
    """17 was held until 18 was applied: it has the lower number, and comes after."""
    control = control_for(form)
    control.run(write(form, "m", steps([PendingCorrection(18, 5, 0.01, Axis.X)], {3: 0.0, 5: 0.0}, 16, 16)))
    late = write(form, "m", steps([PendingCorrection(17, 3, -0.02, Axis.X)], {3: 0.0, 5: 0.01}, 18, 18))
    for _ in range(times):
        control.run(late)
    assert (offset(control, form, 3), offset(control, form, 5)) == (-0.02, 0.01)
    assert last_applied(control, form) == 17
    control.run(write(form, "m", steps([PendingCorrection(19, 3, 0.005, Axis.X)], {3: -0.02, 5: 0.01}, 18, 17)))
    with nullcontext() if form is Form.G10 else pytest.raises(Stopped):
        control.run(late)
    assert (offset(control, form, 3), last_applied(control, form)) == (-0.015, 19)


@pytest.mark.parametrize("form", GUARDED)
def test_a_late_one_joins_a_text_that_is_out_already(form: Form) -> None:
    """18 was fetched and run; before anybody confirmed it, 17 was released. The next text holds both, 18 first."""
    control, offsets = control_for(form), {3: 0.0, 5: 0.0}
    control.run(write(form, "m", steps([PendingCorrection(18, 5, 0.01, Axis.X)], offsets, 16, 16)))
    both = [PendingCorrection(18, 5, 0.01, Axis.X), PendingCorrection(17, 3, -0.02, Axis.X)]
    for _ in range(2):
        control.run(write(form, "m", steps(both, offsets, 16, 16)))
    assert (offset(control, form, 3), offset(control, form, 5)) == (-0.02, 0.01)


@pytest.mark.parametrize("form", CHECKED)
def test_an_offset_that_somebody_has_changed_stops_the_text(form: Form) -> None:
    control = control_for(form)
    put(control, form, 3, 0.05)
    with pytest.raises(Stopped):
        control.run(write(form, "m", chain_of([(3, -0.01), (5, 0.01)], {3: 0.0, 5: 0.0})))
    assert (offset(control, form, 3), offset(control, form, 5), last_applied(control, form)) == (0.05, 0.0, 0)


def test_what_a_control_rounds_is_not_a_difference() -> None:
    control = Fanuc()
    control.decimals = 3
    control.run(write(Form.WEAR_VARIABLES, "m", chain_of([(3, -0.0061), (3, -0.0056)], {3: 0.0})))
    assert control.variables[2703] == -0.012  # -0.0117, as a control with three decimals keeps it
    assert control.variables[599] == 2


@pytest.mark.parametrize("form", GUARDED)
def test_a_control_in_inch_stops_before_anything_is_changed(form: Form) -> None:
    text = write(form, "m", chain_of([(3, -0.0061)], {3: 0.0}))
    control = (Sinumerik if form in {Form.TURNING, Form.MILLING} else Fanuc)(inch=True)
    with pytest.raises(Stopped, match=r"INCH|N8020"):
        control.run(text)
    assert (control.variables, control.wear) == ({}, {})


def test_where_a_control_cannot_be_asked_the_text_says_mm() -> None:
    for form in (Form.G10_ABSOLUTE, Form.LIST):
        assert " MM" in "".join(write(form, "m", chain_of([(3, -0.0061)], {3: 0.0})).splitlines()[:2])


def test_absolute_g10_needs_no_guard() -> None:
    text, control = write(Form.G10_ABSOLUTE, "m", chain_of([(3, -0.0061), (3, -0.0054)], {3: 0.0})), Fanuc()
    for _ in range(3):
        control.run(text)
    assert control.variables == {2003: -0.0115}


def test_the_axis_says_which_offset() -> None:
    along = steps([PendingCorrection(1, 7, 0.01, Axis.Z)], {7: 0.0}, 0, 0)
    for form, words in (
        (Form.TURNING, "$TC_DP13[7,1]=0.01"),
        (Form.MILLING, "$TC_DP12[7,1]=0.01"),
        (Form.WEAR_VARIABLES, "#[2800+7]=0.01"),
        (Form.WEAR_VARIABLES_2000, "#[2100+7]=0.01"),
        (Form.G10, "G10 P7 W0.01"),
        (Form.G10_ABSOLUTE, "G10 P7 Z0.01"),
        (Form.LIST, "TOOL 7 Z: 0 + 0.01 = 0.01 (CORRECTION 1)"),
    ):
        assert any(line.endswith(words) for line in write(form, "m", along).splitlines()), form


def test_numbers_have_no_exponent_and_comments_no_lower_case() -> None:
    tiny = steps([PendingCorrection(1, 3, 1e-6, Axis.X)], {3: 0.0}, 0, 0)
    for form in Form:
        text = write(form, "lathe-1", tiny)
        assert "0.000001" in text
        assert "e-" not in text.lower().replace("lathe-1", "")
        assert text.isascii()


def test_every_control_has_a_form() -> None:
    assert set(FORMS) == {"sinumerik", "fanuc", "heidenhain", "other"}
    assert {form for forms in FORMS.values() for form in forms} == set(Form)
    for form in Form:
        assert write(form, "m", []).count("NONE") == 1


@pytest.mark.parametrize("form", [form for form in Form if form is not Form.LIST])
def test_a_mean_of_three_has_no_more_digits_than_a_control_takes(form: Form) -> None:
    """The lathe line corrects by the mean of three sections; a word of more than eight digits is refused by controls."""
    chain = chain_of([(3, -0.011833333), (3, -0.051333334), (3, 0.000333333), (3, 0.000333333)], {3: 1.012166667})
    text = write(form, "lathe-1", chain)
    words = re.findall(r"\d*\.\d+", text)
    assert words
    assert max(len(word) - 1 for word in words) <= 8
    assert all(len(word.split(".")[1]) <= 6 for word in words)
    if form is Form.G10:  # increments add up to where the offsets lead
        increments = [float(value) for value in re.findall(r"G10 P3 U(\S+)", text)]
        assert round(1.012167 + sum(increments), 9) == round(chain[-1].after, 6)
