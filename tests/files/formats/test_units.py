"""One table of units for AQDEF, headers of columns and the bridge: no size becomes a silent millimetre."""

import pytest

from app.files.formats.units import LENGTHS, UnknownUnit, length_unit, unit_in


@pytest.mark.parametrize(
    ("word", "mm"),
    [
        ("mm", 1.0), ("MM", 1.0), ("[mm]", 1.0), ("um", 1e-3), ("µm", 1e-3), ("μm", 1e-3), ("мкм", 1e-3), ("nm", 1e-6), ("CM", 10.0),
        ("m", 1000.0), ("in", 25.4), ("Inch", 25.4), ('"', 25.4), ("mil", 0.0254), ("thou", 0.0254), ("tenths", 0.00254), ("µin", 25.4e-6),
    ],
)  # fmt: skip
def test_a_unit_of_length_by_every_name(word: str, mm: float) -> None:
    unit = length_unit(word)
    assert unit is not None
    assert LENGTHS[unit] == pytest.approx(mm, rel=1e-15)


@pytest.mark.parametrize(
    "word", ["Nm", "NM", "nM", "M", "mM", "Mm", "N", "kN", "Ncm", "°", "deg", "%", "", "furlong", "m/s"]
)
def test_what_is_no_length_is_none(word: str) -> None:
    assert length_unit(word) is None


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("Run-out [mil]", "mil"), ("Run-out (thou)", "thou"), ("D40 (in)", "inch"), ("Ø [mm]", "mm"), ("D [A] (µm)", "um"), ("Wert_um", "um"),
        ("Deviation (X)", None), ("Diameter (actual)", None), ("D40 (D12)", None), ("Value", None), ("minimum", None), ("Werte [1]", None),
    ],
)  # fmt: skip
def test_the_unit_of_a_header(header: str, unit: str | None) -> None:
    assert unit_in(header) == (unit and length_unit(unit))


@pytest.mark.parametrize(
    "header", ["Torque [Nm]", "Moment (Nm)", "Angle [°]", "Run-out [furlong]", "Share (%)", "D [M]", "Force (kN)"]
)
def test_a_unit_that_is_no_length_is_never_taken_for_mm(header: str) -> None:
    with pytest.raises(UnknownUnit):
        unit_in(header)
