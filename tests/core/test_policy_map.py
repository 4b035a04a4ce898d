"""The best region of a map of settings."""

from app.core.policy_map import Criterion, best_region, in_order, with_settings
from app.core.replay import Figures
from tests.core.conftest import SEAT


def cell(**numbers: float | None) -> Figures:
    nothing = dict.fromkeys(Figures._fields, 0)
    return Figures(**(nothing | {"readings": 1000, "inner": 1000} | numbers))  # type: ignore[arg-type]


def test_the_best_region_holds_what_cannot_be_distinguished_from_the_best() -> None:
    cells = [cell(ppk=1.5), cell(ppk=1.49), cell(ppk=1.2), None, cell(ppk=None)]
    found = best_region(cells, Criterion.PPK)
    assert (found.best, found.inside) == (0, (True, True, False, False, False))
    few = best_region([cell(rejects=4), cell(rejects=7), cell(rejects=9)], Criterion.REJECTS)
    assert few.inside == (True, True, False)
    assert best_region([None], Criterion.PPK).best is None


def test_the_fewest_corrections_are_not_those_of_a_loop_that_sleeps() -> None:
    today = cell(corrections=80, rejects=2, ppk=1.5)
    cells = [
        cell(corrections=0, rejects=50, ppk=0.7),
        cell(corrections=5, rejects=2, ppk=1.2),
        cell(corrections=30, rejects=2, ppk=1.49),
        cell(corrections=60, rejects=1, ppk=1.6),
    ]
    assert best_region(cells, Criterion.CORRECTIONS, today).best == 2
    assert best_region(cells, Criterion.CORRECTIONS).best == 0


def test_of_settings_as_good_as_the_best_one_corrects_least() -> None:
    cells = [cell(ppk=1.5, corrections=900), cell(ppk=1.49, corrections=90), cell(ppk=1.0, corrections=9)]
    found = best_region(cells, Criterion.PPK)
    assert (found.best, found.calmest) == (0, 1)


def test_settings_out_of_order_are_reported() -> None:
    assert in_order(SEAT)
    assert not in_order(with_settings(SEAT, zero_range=0.0053))
    assert not in_order(with_settings(SEAT, averaging_limit=0.0081))
    assert with_settings(SEAT, weighting_factor=3).weighting_factor == 3
