"""Published numbers, each with its source: what app/quality/proof/cases holds comes out of the engine."""

import json
from collections import Counter

import pytest

from app.quality.proof.cases import FOLDER, Basis, Case, cases
from app.quality.proof.engine import ENGINE
from app.quality.proof.queries import run
from app.quality.proof.wording import topics


@pytest.mark.parametrize("case", cases(), ids=lambda case: f"{case.kind}: {case.name}")
def test_it_comes_out_as_published(case: Case) -> None:
    (result,) = run([case]).results
    assert result.error is None
    assert [(check.name, check.expected, check.got) for check in result.checks if not check.passed] == []
    assert [check.name for check in result.checks] == list(case.expected)


def test_every_kind_has_an_example_and_a_place_on_the_page() -> None:
    assert {case.kind for case in cases()} == set(ENGINE)
    placed = Counter(kind for _heading, kinds in topics().values() for kind in kinds)
    assert placed == Counter(dict.fromkeys(ENGINE, 1))


def test_every_example_names_its_source_and_what_it_may_be_off_by() -> None:
    for case in cases():
        assert len(case.source) > 20
        assert set(case.tolerance) == set(case.expected)
        for name, expected in case.expected.items():
            tolerance = case.tolerance[name]
            if isinstance(tolerance, list):
                assert isinstance(expected, list)
                assert len(tolerance) == len(expected)


def test_what_nobody_published_says_so() -> None:
    """A citation is only for what was opened; everything else says in its source how the numbers came about."""
    for case in cases():
        said = case.source.lower()
        assert (case.basis is Basis.DERIVED) == said.startswith("derived by hand"), case.name
        assert (case.basis is Basis.SIMULATED) == said.startswith("simulated"), case.name
        assert ("computed independently" in said) >= (case.basis is Basis.COMPUTED), case.name
        assert case.basis is not Basis.PUBLISHED or not said.startswith(("computed", "not looked up")), case.name


def test_no_example_is_there_twice() -> None:
    assert max(Counter((case.kind, case.name) for case in cases()).values()) == 1
    described = [each for path in FOLDER.glob("*.json") for each in json.loads(path.read_text(encoding="utf-8"))]
    assert len(described) == len(cases()) >= 45
