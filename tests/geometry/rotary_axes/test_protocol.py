"""The protocol of a run as page and files: everything that the control's own has."""

import csv
import io
from datetime import UTC, datetime, timedelta
from math import cos, pi, sin
from typing import Any

import openpyxl
import pypdf
import pytest

from app.core.rotary.drift import Trend
from app.geometry.rotary_axes.drift import Drift, Reached
from app.geometry.rotary_axes.run_history import days_left
from tests.geometry.rotary_axes.bench import axis, protocol
from tests.geometry.rotary_axes.walking import take
from tests.shop import Shop

EVERYTHING = (
    *("Start angle", "End angle", "Incidence angle", "Measuring points", "Measuring circle radius", "Backlash"),
    *(
        "Axis positions",
        "Standard deviation, measured",
        "Standard deviation, optimised",
        "Greatest deviation, measured",
    ),
    *("Angle error", "Mean positioning error", "correction in all axes", "before", "after", "NC program", "Tool"),
    *("Active kinematics", "Mode", "QS146", "Q143", "Q146", "EXC", "EYC", "EZC"),
)


def file_of(shop: Shop, run: int, form: str) -> bytes:
    answer = shop.admin.get(f"/api/v1/kinematics/runs/{run}/protocol.{form}")
    assert answer.status_code == 200, answer.text
    assert "attachment" in answer.headers["content-disposition"]
    return answer.content


class TestFiles:
    def test_the_pdf_has_everything(self, shop: Shop) -> None:
        run = take(shop, protocol=protocol("de"))
        document = pypdf.PdfReader(io.BytesIO(file_of(shop, run, "pdf")))
        text = " ".join(" ".join(page.extract_text() for page in document.pages).split())
        assert [name for name in EVERYTHING if name not in text] == []
        for value in ("TOUCH_PROBE", "MILL5_AC", "+12.3", "250.0123", "13.40", "−90°, 0°, 90°, 180°", "Huber"):
            assert value in text, value

    def test_an_axis_of_twelve_angles_has_one_too(self, shop: Shop) -> None:
        around = [{"angle": 30.0 * n, "centre": [180 * cos(pi * n / 6), 180 * sin(pi * n / 6), 40]} for n in range(12)]
        run = take(shop, axes=[axis() | {"positions": around}])
        assert len(pypdf.PdfReader(io.BytesIO(file_of(shop, run, "pdf"))).pages) > 1

    def test_spreadsheet_lines_and_json_say_the_same(self, shop: Shop) -> None:
        run = take(shop, axes=[axis(both=True, backlash=0.002)])
        made: Any = shop.call("GET", f"/kinematics/runs/{run}/protocol.json")
        facts = {fact["key"]: fact for section in made["sections"] for fact in section["facts"]}
        workbook = openpyxl.load_workbook(io.BytesIO(file_of(shop, run, "xlsx")))
        cells = {cell.value for sheet in workbook for row in sheet.iter_rows() for cell in row}
        lines = list(csv.reader(io.StringIO(file_of(shop, run, "csv").decode("utf-8-sig"))))
        written = {value for line in lines for value in line}
        assert facts["EX0C"]["unit"] == "µm"
        assert any(isinstance(cell, float) and cell == pytest.approx(facts["EX0C"]["value"]) for cell in cells)
        assert "EX0C" in written
        assert [section["charts"] for section in made["sections"] if section["charts"]] == [["EXC", "EYC", "EZC"]]

    def test_strangers_get_none(self, shop: Shop) -> None:
        run = take(shop, axes=[axis()])
        other = Shop(shop.server)
        assert other.machine_client.get(f"/api/v1/kinematics/runs/{run}/protocol.pdf").status_code == 403
        assert shop.admin.get("/api/v1/kinematics/runs/999999/protocol.pdf").status_code == 404
        assert shop.admin.get(f"/api/v1/kinematics/runs/{run}/protocol.docx").status_code in {404, 422}


def drift(value: float, slope: float, *, low: float, high: float, limit: float | None = 0.01) -> Drift:
    at = datetime(2026, 11, 1, tzinfo=UTC)
    points = [Reached(n, at + timedelta(days=n), value, value, None) for n in range(4)]
    return Drift("EX0C", limit, points, Trend(slope, low, high, 4))


class TestForesight:
    def test_days_until_the_limit_on_either_side(self) -> None:
        assert days_left(drift(0.004, 0.0002, low=0.0001, high=0.0003)) == pytest.approx(30)
        assert days_left(drift(0.004, -0.0002, low=-0.0003, high=-0.0001)) == pytest.approx(70)

    @pytest.mark.parametrize(
        "case",
        [
            drift(0.004, 0.0002, low=-0.0001, high=0.0003),  # no trend to be seen
            drift(0.004, 0.00001, low=0.000005, high=0.00002),  # further off than a year
            drift(0.02, 0.0002, low=0.0001, high=0.0003),  # beyond already
            drift(0.004, 0.0002, low=0.0001, high=0.0003, limit=None),
            Drift("EX0C", 0.01, [], None),
        ],
    )
    def test_else_nothing_is_foretold(self, case: Drift) -> None:
        assert days_left(case) is None
