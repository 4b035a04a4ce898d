"""The reason on a page: its numbers have the decimals that the tolerance deserves, and say what was decided all the same."""

from typing import Any

import pytest

from app.core.parameters import Parameters
from app.loop.readings.records import Record
from app.loop.readings.wording import as_read, reason
from tests.shop import PARAMETERS, Person, Shop


def said(deviation: float, code: str, **changed: float) -> tuple[str, str]:
    """What the answer says and what the page does, of a reading that deviates by so many µm."""
    parameters = Parameters(**PARAMETERS | changed)
    length = deviation / 1000
    values: dict[str, Any] = dict.fromkeys(Record.__struct_fields__)
    values |= {"code": code, "zone": "full", "deviation": length, "decided": length, "average_before": 0.0}
    record = Record(**values | {"measured": parameters.target + length, "late": False})
    return reason(record, parameters)["text"], as_read(record, parameters)


@pytest.mark.parametrize(
    ("deviation", "code", "changed", "exact", "read"),
    [
        (406.575, "probe_fault", {"tolerance_width": 0.3, "confidence_limit": 0.4}, "406.575 µm", "407 µm"),
        (6.128, "full_deviation", {}, "6.128 µm", "6.1 µm"),
        (5.04, "full_deviation", {}, "5.04 µm", "5.04 µm"),  # 5.0 would not lie beyond the limit of 5.0
        (-5.333, "full_deviation", {"averaging_limit": 0.0053333}, "5.333 µm", "5.33 µm"),
        (2.128, "full_deviation", {"tolerance_width": 0.004, "averaging_limit": 0.0015}, "2.128 µm", "2.13 µm"),
    ],
)
def test_the_tolerance_says_how_many_decimals(
    deviation: float, code: str, changed: dict[str, float], exact: str, read: str
) -> None:
    answered, shown = said(deviation, code, **changed)
    assert exact in answered
    assert read in shown


def test_pages_show_it_and_answers_stay_exact(shop: Shop, viewer: Person) -> None:
    answer = shop.read(6.128)
    assert answer["reason"] == shop.call("GET", f"/readings/{shop.characteristic}/1")["reason"]
    assert "6.128 µm" in answer["reason"]["text"]
    page = viewer.open(f"/characteristics/{shop.characteristic}/readings/1")
    assert "Deviation 6.1 µm" in page
    assert "6.128 µm" not in page
