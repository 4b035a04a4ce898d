"""The map as the page draws it, the address that says what is asked, and the grid about today's setting."""

from dataclasses import replace
from urllib.parse import parse_qsl, urlsplit

from hypothesis import given
from hypothesis import strategies as st

from app.core.policy_map import Criterion, best_region
from app.core.replay import Figures
from app.quality.what_if import form_reader, map_axes, wording
from app.quality.what_if.map_view import _edges
from tests.core.conftest import SEAT
from tests.core.test_policy_map import cell


def test_the_edge_of_the_region_runs_round_it() -> None:
    # Three columns; the second row stands above the first.
    inside = [True, True, False, False, True, False]
    assert [_edges(inside, at, 3) for at in range(6)] == ["tbl", "rb", "", "", "trl", ""]


@given(st.lists(st.booleans(), min_size=12, max_size=12))
def test_every_edge_has_a_cell_on_either_side_that_differs(inside: list[bool]) -> None:
    steps = {"t": 4, "b": -4, "r": 1, "l": -1}
    for at in range(12):
        for side in _edges(inside, at, 4):
            there = at + steps[side]
            within = 0 <= there < 12 and (side in "tb" or there // 4 == at // 4)
            assert inside[at]
            assert not within or not inside[there]


@given(
    st.integers(1, 6900).map(lambda n: n / 1e6),
    st.floats(1, 40).map(lambda k: round(k, 3)),
)
def test_todays_setting_is_on_the_grid(zero_range: float, k: float) -> None:
    today = replace(SEAT, zero_range=zero_range, averaging_limit=0.007, weighting_factor=k)
    ks, r33s = map_axes.weighting_factors(today), map_axes.zero_ranges(today, 0.007)
    assert map_axes.place(ks, k) is not None
    assert map_axes.place(r33s, zero_range) is not None
    assert ks == sorted(set(ks))
    assert r33s == sorted(set(r33s))
    assert len(ks) * len(r33s) <= 21 * 22
    assert map_axes.place(map_axes.coarser(r33s, zero_range), zero_range) is not None
    assert len(map_axes.coarser(ks, k)) <= len(ks) / 2 + 1.5


@given(st.dictionaries(st.sampled_from(["k", "r33", "r34", "factor", "delay", "goal", "to"]), st.text(max_size=12)))
def test_an_address_says_what_was_typed(query: dict[str, str]) -> None:
    typed = form_reader.typed_from(query)
    again = dict(parse_qsl(urlsplit(form_reader.address("shaft", typed)).query))
    assert form_reader.typed_from(again) == typed


def test_only_what_can_be_distinguished_is_called_better() -> None:
    today = cell(corrections=400, rejects=10, ppk=1.5, spread=0.001)
    noise = wording.gained(today, cell(corrections=390, rejects=9, ppk=1.51, spread=0.00101))
    assert [better for _text, better in noise if better is not None] == [True]  # corrections are counted, not estimated
    clear = wording.gained(today, cell(corrections=500, rejects=40, ppk=1.0, spread=0.002))
    assert {better for _text, better in clear if better is not None} == {False}
    assert len(clear) == len(wording.rows([today]))


def test_what_is_no_choice_is_not_compared() -> None:
    cells: list[Figures | None] = [cell(corrections=0, rejects=50), None, cell(corrections=30, rejects=1)]
    found = best_region(cells, Criterion.CORRECTIONS, cell(corrections=90, rejects=1))
    assert found.choice == (False, False, True)
