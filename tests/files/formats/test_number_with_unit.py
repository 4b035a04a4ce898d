"""A number and the unit behind it are read the same way at every door that takes tables."""

from collections.abc import Callable
from pathlib import Path

import pytest

from app.bridge.fields import Form
from app.files.formats.number_with_unit import agreed_unit, in_mm, number_and_unit, number_before_unit
from app.loop.readings.importing import drawn
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines
from app.quality.gauge_studies.table_reader import sizes_in_mm


def _import(text: str, folder: Path) -> float | None:
    path = folder / "a.csv"
    path.write_text(f"actual;part\n{text};1\n")
    wishes = Wishes(mapping={"measured": "actual"}, decimal="," if "," in text else ".")
    (found,) = lines(path, look(path, wishes), "x")
    assert isinstance(found, Line), found
    return found.reading.measured


def _nominal(text: str, folder: Path) -> float | None:
    path = folder / "a.csv"
    path.write_text(f"Feature;Nominal;Upper deviation;Lower deviation;Actual\nA;{text};{text};-{text};{text}\n")
    (found,) = drawn.contents(look(path, Wishes()))
    assert not found.not_new, found.not_new
    return found.nominal


DOORS: dict[str, Callable[[str, Path], float | None]] = {
    "import": _import,
    "nominal size of an import": _nominal,
    "pasted table": lambda text, _folder: float(sizes_in_mm(None, [[text]])[0][0]),
    "bridge": lambda text, _folder: float(Form(1.0, "," if "," in text else ".").value("measured", text)),
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(
    ("text", "mm"),
    [("40,001 mm", 40.001), ("0.3 µm", 0.0003), ("1.5 thou", 0.0381), ('0.5"', 12.7), ("12.003mm", 12.003), ("2 tenths", 0.00508)],
)  # fmt: skip
def test_every_door_reads_a_number_with_its_unit_alike(door: str, text: str, mm: float, tmp_path: Path) -> None:
    assert DOORS[door](text, tmp_path) == pytest.approx(mm, abs=1e-9)


def test_the_parts() -> None:
    assert number_and_unit("25 Nm") == ("25 Nm", "")
    assert number_before_unit("−0.5 µm") == -0.5
    assert agreed_unit("um", "micron") == "um"
    assert in_mm([1.0, None], "inch") == [25.4, None]
