"""A number that is read beside a limit is never rounded across it."""

from dataclasses import replace
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.spc.capability import CAPABLE, VERY_CAPABLE
from app.files.documents.content import Value
from app.files.documents.files.sheets import _shape
from app.language.formatting import beside, probability
from app.quality.capability import wording as capability
from app.quality.gauge_studies import wording as gauge
from app.views.overview.ranking import AttentionReason
from tests.views.overview.test_ranking import CALM


@given(st.integers(-2000, 2000), st.integers(-99_999, 99_999), st.integers(0, 3))
def test_on_the_side_where_it_lies(limit: int, away: int, decimals: int) -> None:
    edge, value = limit / 100, limit / 100 + away * 1e-7
    written = float(beside(value, decimals, edge).replace("\N{MINUS SIGN}", "-"))
    assert (written > edge) - (written < edge) == (value > edge) - (value < edge)
    assert abs(written - value) <= 0.5 * 10**-decimals + 1e-9


def test_no_more_digits_than_it_takes() -> None:
    assert beside(12.34, 1, 10.0, 30.0) == "12.3"
    assert beside(1.0, 2, 1.0) == "1.00"


@pytest.mark.parametrize(
    ("percent", "shown", "word"),
    [(9.96, "9.96", "good"), (10.0, "10.0", "usable with care"), (30.04, "30.04", "not acceptable")],
)
def test_a_gauge_verdict_contradicts_no_limit(percent: float, shown: str, word: str) -> None:
    found = gauge._aiag("GRR", percent)
    assert (found.value, found.word) == (f"{shown}\N{NARROW NO-BREAK SPACE}%", word)


@pytest.mark.parametrize(
    ("index", "shown", "word"),
    [
        (1.329, "1.329", "Barely capable"),
        (1.33, "1.33", "Capable"),
        (1.6667, "1.667", "Capable"),
        (1.67, "1.67", "Very capable"),
        (0.9996, "0.9996", "Not capable"),
        (1.451, "1.45", "Capable"),
    ],
)
def test_an_index_reads_as_its_verdict_and_as_the_overview_ranks_it(index: float, shown: str, word: str) -> None:
    assert capability.index(index) == shown
    assert capability.verdict(index)[0] == word
    reasons = replace(CALM, ppk=index).reasons
    assert (AttentionReason.BARELY_CAPABLE in reasons) == (word == "Barely capable")
    assert (AttentionReason.NOT_CAPABLE in reasons) == (word == "Not capable")
    assert (CAPABLE, VERY_CAPABLE) == (1.33, 1.67), "as scales, reports and how-tos write them"


def test_p_values_stay_on_their_side_of_a_level() -> None:
    assert probability(0.0496, "= ") == "= 0.0496"
    assert probability(0.00496) == "0.00496"
    assert Value("probability", 0.00499999, 4).words(ZoneInfo("UTC")) == "0.00499999"
    assert Value("probability", 0.2, 4).words(ZoneInfo("UTC")) == "0.2000"


def test_a_share_in_a_sheet_is_not_all_while_one_is_missing() -> None:
    assert _shape(Value("share", 0.999996)) == "0.0000"
    assert _shape(Value("share", 1.0)) == "0.000"
    assert _shape(Value("share", 0.000001)) == "0.0000"
    assert _shape(Value("share", 958 / 960)) == "0.000"
