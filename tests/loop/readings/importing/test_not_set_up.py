"""Tables of which nothing can be set up, or that cannot be stored: the reason of each name, and what to say."""

import re
from pathlib import Path
from typing import Any

import pytest

from app.errors import Invalid
from app.loop.readings.importing import drawn
from app.loop.readings.importing.layout import Wishes, look
from tests.shop import Shop


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "Feature;Nominal;Top;Bottom;Actual\nA;10;0.1;-0.1;10.002\n",
            "the upper limit (--map upper=COLUMN) is missing",
        ),
        ("Feature;Nominal;Upper tol;Lower tol;Actual\nA;10;;;10.002\n", "the upper limit is missing"),
        (
            "Feature;Item;Nominal;Actual;+Tol;-Tol\n1 Bore;Ø;1;1.0015;0.002;0.001\n1 Bore;TP;0;0.003;0.005;0\n",
            "if another column tells them apart, --map characteristic=Feature+COLUMN",
        ),
    ],
)
def test_what_is_missing_is_said_with_the_argument(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    assert [reason in each.not_new for each in drawn.contents(look(path, Wishes()))] == [True]


def test_columns_aligned_by_blanks_are_thought_of(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("Plate: T-7\n\n  Meas X   Meas D\n -80.754    2.176\n -40.120    2.171\n")
    with pytest.raises(Invalid, match="parted by --delimiter blanks"):
        look(path, Wishes(mapping={"measured": "Meas D"}))


def test_where_nothing_can_be_set_up_each_reason_is_said(shop: Shop) -> None:
    body: dict[str, Any] = {"name": "a.csv", "create_missing": True, "machine": shop.machine}
    text = f"Feature,Nominal,Actual,Status\n{shop.machine}-1,0.325,0.327,OK\n{shop.machine}-2,0.5,0.505,NG\n"
    refused = shop.call("POST", "/readings/table", 422, content=text, **body)
    assert refused["detail"] == "None of the characteristics of the table can be set up."
    assert [each["field"] for each in refused["errors"]] == [f"{shop.machine}-1", f"{shop.machine}-2"]


def test_one_of_a_table_is_set_up_by_name(shop: Shop) -> None:
    text = f"Feature,Nominal,Actual,+Tol,-Tol\n{shop.machine}-N,12,12.001,0.01,0.01\n{shop.machine}-M,1,1,,\n"
    body: dict[str, Any] = {"name": "a.csv", "content": text, "machine": shop.machine}
    done = shop.call("POST", "/readings/table", characteristics={f"{shop.machine}-N": "+"}, **body)
    assert (done["stored"], done["characteristics"][0]["created"]) == (1, True)


def test_what_cannot_be_stored_is_named_by_its_characteristic(shop: Shop) -> None:
    other = shop.another("near")
    text = f"Feature,Actual\n{other},40.001\n{shop.characteristic},17\n"
    refused = shop.call("POST", "/readings/table", 422, name="a.csv", content=text)
    assert re.match(f"{shop.characteristic}: Every value lies more than", refused["detail"])
