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
        (406.575, "probe_fault", {"tolerance_width": 0.3, "confidence_limit": 0.4}, "406.575 µm", "+407 µm"),
        (6.128, "full_deviation", {}, "6.128 µm", "+6.1 µm"),
        (5.04, "full_deviation", {}, "5.04 µm", "+5.04 µm"),  # 5.0 would not lie beyond the limit of 5.0
        (-5.333, "full_deviation", {"averaging_limit": 0.0053333}, "5.333 µm", "5.33 µm"),
        (2.128, "full_deviation", {"tolerance_width": 0.004, "averaging_limit": 0.0015}, "2.128 µm", "+2.13 µm"),
    ],
)
def test_the_tolerance_says_how_many_decimals(
    deviation: float, code: str, changed: dict[str, float], exact: str, read: str
) -> None:
    answered, shown = said(deviation, code, **changed)
    assert exact in answered
    assert read in shown
    assert "limit +" not in shown


def test_pages_show_it_and_answers_stay_exact(shop: Shop, viewer: Person) -> None:
    answer = shop.read(6.128)
    assert answer["reason"] == shop.call("GET", f"/readings/{shop.characteristic}/1")["reason"]
    assert "6.128 µm" in answer["reason"]["text"]
    page = viewer.open(f"/characteristics/{shop.characteristic}/readings/1")
    assert "Deviation +6.1 µm" in page
    assert "6.128 µm" not in page


def test_amounts_have_the_same_decimals_as_the_sentences(shop: Shop, operator: Person) -> None:
    coarse = shop.another("flange", tolerance_width=0.4, averaging_limit=0.06, tool_memory=4, mode="approval")
    for deviation in (81.32, 160.5):  # the second counts as 79.18 after the first
        shop.read(deviation, coarse)
    amounts = [c["amount"] for c in shop.call("GET", f"/machines/{shop.machine}/corrections?tool_memory=4")["items"]]
    rounded = [f"−{-amount * 1000:.0f}\N{NO-BREAK SPACE}µm" for amount in (*amounts, sum(amounts))]
    assert amounts[0] == -0.08132
    asked = {
        f"/todo?machine={shop.machine}": rounded[:2],
        f"/station/{shop.machine}": rounded,
        f"/corrections?machine={shop.machine}": rounded[-1:],
        f"/plant/{shop.machine}": rounded[1:2],
        f"/characteristics/{coarse}": rounded[:2],
    }
    pages = {address: operator.open(address) for address in asked}
    assert {address: [each for each in words if each not in pages[address]] for address, words in asked.items()} == {
        address: [] for address in asked
    }
    assert [address for address, text in pages.items() if "−81.3" in text or '+79.2<span class="unit">' in text] == []
