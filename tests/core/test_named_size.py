"""Sizes that names tell, and names that only look as if they told one."""

import pytest

from app.core.named_size import size_in_name


@pytest.mark.parametrize(
    "name",
    ["Bore 30", "Bohrung 30 mm", "Ø30", "Bore 30 inside", "Durchmesser 30", "Bore 30 B2", "Premer 30,0", "Ø 30.00"],
)
def test_a_nominal_size_alone_is_proposed(name: str) -> None:
    assert size_in_name(name) == {"nominal": 30.0}


@pytest.mark.parametrize(
    ("name", "nominal"),
    [("Bore 30 H7", 30.0), ("Bearing seat Ø40 h6, spindle 2", 40.0), ("Nest 3: bore 12 H7", 12.0), ("30 H7 in housing", 30.0),
     ("Hole 12 H8", 12.0), ("Ležajni sedež „levi“ 25 k6", 25.0)],
)  # fmt: skip
def test_a_tolerance_class_is_proposed_with_its_size(name: str, nominal: float) -> None:
    found = size_in_name(name)
    assert (found["nominal"], set(found)) == (nominal, {"nominal", "upper_deviation", "lower_deviation"})


@pytest.mark.parametrize(
    "name",
    [
        "Nest 3 B2", "Nest 3 H7", "Pos. 3 H7", "OP 20 C3", "Line 2 K5", "Pallet 2 N3", "Hole 12 D4", "Run 12 R5", "Cavity 12 H1",
        "Rev 3 A11", "Part 7 E6", "Bore 2", "Diameter 2", "Bore no. 30", "Bore 30-2", "Bore 12 and bore 14", "30 H7 / h6", "30 H7/g6",
    ],
)  # fmt: skip
def test_a_place_or_a_count_is_no_size(name: str) -> None:
    assert size_in_name(name) == {}


@pytest.mark.parametrize(
    "name",
    ["Bore 1.5 in", 'Ø1.5"', "Bore Ø1.5 in", "1.5 H7 inch", "Ø40 µm", "Ø1,000", "Ø2.500", "Ø 1 234", "Welle 2 Zoll"],
)
def test_another_unit_or_a_number_that_reads_in_two_ways_is_no_size(name: str) -> None:
    assert size_in_name(name) == {}


@pytest.mark.parametrize(
    "name",
    ["Bore 30 depth", "Depth at Ø40 H7", "Position Ø0.02", "Roundness Ø40", "Run-out seat 40 h6", "Koaxialität Ø0.02"],
)
def test_a_depth_or_a_form_is_no_diameter(name: str) -> None:
    assert size_in_name(name) == {}
