"""One table of units for AQDEF, headers of columns and the bridge: no size becomes a silent millimetre."""

import pytest

from app.files.formats.units import LENGTHS, UnknownUnit, length_unit, unit_above, unit_in, unit_of_name


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
        ("Dev [µ m]", "um"), ("CIR1 [U]", None), ("CIR1 [x]", None), ("Point [12]", None), ("Size {in}", "in"), ("Actual «in»", "in"), ("寸法（インチ）", "in"), ('Maß "', "in"), ("Maß ″", "in"), ("D40 'in'", "in"), ("D40 [in.]", "in"),
        ("D40:in", "in"), ("Diamètre (pouces)", "in"), ("Prečnik u inčima", "in"), ("Диаметр в дюймах", "in"), ("Prečnik (mikrona)", "um"),
        ("BoreUm", "um"), ("D40-um", "um"), ("D40 mikron", "um"), ("D40 micro meter", "um"), ("valueMils", "mil"), ("D40 milli inch", "mil"),
        ("Ra micro inch", "uin"), ('Ra µ"', "uin"), ("Ø 40 ±0,01 mm", "mm"), ("Flatness 0.01 mm", "mm"), ("M8x100", None), ("Bohrung E-3", None),
        ("Diámetro (micras)", "um"), ("Desvio (mícrons)", "um"), ("Odchylka [mikronů]", "um"), ("Bicie mikronów", "um"), ("Scostamento (micrometri)", "um"),
        ("Medida (polegadas)", "in"), ("Wymiar (cale)", "in"), ("Mitta tuumaa", "in"), ("Mål (tommer)", "in"), ("Medida (milímetros)", "mm"), ("Misura micrometro 3", None), ("Décimal", None),
        ("Cale étalon 20", None), ("Cale 3", None), ("Palce chwytaka 2", None), ("Mikrometre ile", None), ("Micromètre 2", None), ("Mikrometr 3", None),
        ("Hauteur cale [mm]", "mm"), ("Rozměr [palce]", "in"), ("Ölçüm (mikrometre)", "um"), ("Wymiar w calach", "in"), ("Wymiar w mikronach", "um"),
        ("Rozměr v palcích", "in"), ("Rozměr v mikrometrech", "um"), ("Méret hüvelykben", "in"), ("Méret mikronban", "um"), ("Mitat tuumina", "in"), ("Ölçü inç", "in"), ("Mera inč", "in"),
        ("Écart en micromètre, D1", "um"), ("Deviation in micrometer, nest 1", "um"), ("Desvio em micrómetro", "um"), ("Mesuré au micromètre 2", None), ("Main micrometer 2", None),
        ("Micrometer reading", None), ("in_feed", None), ("Position in X", None), ("My size", None), ("CIRCLE1(Bore) X", None), ("Rectangle 1", None), ("Angle plate height", None), ("Max100", None), ('Bore "top"', None),
    ],
)  # fmt: skip
def test_the_unit_of_a_header(header: str, unit: str | None) -> None:
    assert unit_in(header) == (unit and length_unit(unit))


@pytest.mark.parametrize(
    "header",
    [
        "Torque [Nm]",
        "Moment (Nm)",
        "Angle [°]",
        "Run-out [furlong]",
        "Share (%)",
        "D [M]",
        "Force (kN)",
        "M8 Nm",
        "Winkel °",
    ]
    + [
        "BoreIn",
        "D40 mu",
        "20 my",
        "in_D40",
        "um_D40",
        "Bore {furlong}",
        "Bore (furlong)",
        "Maß Fuß",
        "Precnik col",
        "Actual imperial",
    ]
    + [
        "Maß [1/1000]",
        "Dev [u]",
        "Dev [x0.001]",
        "Dev [1e-3]",
        "Dev [e-3]",
        "Dev [0,001]",
        "Dev [1000]",
        "Dev [10^-3 mm]",
        "Dev [E-3 mm]",
        "0.0001in",
        'Value .001"',
        "Dev x1000",
        "tenths of mm",
        "10ths",
        "Écart en centièmes",
        "Scostamento (centesimi)",
        "Desvío en milésimas",
        "Dev (micros)",
        "Misura micrometro",
        "Ölçüm mikrometre",
        "Cote micromètre",
        "Hauteur cale",
        "Rozměr palce",
        "Odchylka v setiny",
    ]
    + [
        "Area [mm²]",
        "Area mm^2",
        "Feed mm/min",
        "CONE1(Inside) Angle",
        "Winkel_2",
        "Kegelwinkel 1",
        "Size (mm or in)",
        "Size mm/inch",
    ],
)
def test_a_unit_that_is_no_length_is_never_taken_for_mm(header: str) -> None:
    with pytest.raises(UnknownUnit):
        unit_in(header)


def test_a_gauge_block_beside_sizes_of_a_known_unit_is_no_inch() -> None:
    assert unit_of_name("Hauteur cale", "mm") is None


@pytest.mark.parametrize(
    ("title", "unit"),
    [
        ("UOM: in", "in"), ("Maßeinheit: Zoll", "in"), ("Unité : pouce", "in"), ("Toutes les cotes en pouces", "in"), ("単位：インチ", "in"),
        ("Mere u inčima", "in"), ("Language: English", None), ("Resolution: 0.001 mm", None), ("Probe diameter: 4 mm", None),
        ("Magnification x100", None), ("All parts measured in my shop", None), ("Unit: A7", None), ("Units: metric", None),
    ],
)  # fmt: skip
def test_the_unit_of_a_title(title: str, unit: str | None) -> None:
    assert unit_above([[title]]) == (unit and length_unit(unit))


@pytest.mark.parametrize(
    "title",
    [
        "Imperial units",
        "English units",
        "Units: English",
        "UNITS=ENGLISH",
        "US customary",
        "Values in 0.001 mm",
        "Unit 0.001 mm",
    ]
    + ["All values x 1000", "Units: 10^-3 mm", "Lengths in µ"],
)
def test_a_title_in_doubt_is_never_taken_for_mm(title: str) -> None:
    with pytest.raises(UnknownUnit):
        unit_above([[title]])
