"""Thermal expansion: stated once a characteristic, shown beside each reading, and no decision rests on it."""

from typing import Any

import pytest

from tests.shop import Person, Shop

STEEL: dict[str, Any] = {"coefficient": 11.5, "temperature_uncertainty": 0.5, "reason": "16MnCr5"}


def expands(shop: Shop, status: int = 200, characteristic: str | None = None, **given: Any) -> Any:
    return shop.call("PUT", f"/characteristics/{characteristic or shop.characteristic}/expansion", status, **given)


def at_20(shop: Shop, sequence: int = 1) -> Any:
    return shop.call("GET", f"/readings/{shop.characteristic}/{sequence}")["at_20"]


def test_it_is_stated_with_a_reason_and_a_state(shop: Shop) -> None:
    path = f"/characteristics/{shop.characteristic}/expansion"
    first = shop.admin.get(f"/api/v1{path}")
    assert set(first.json().values()) == {shop.characteristic, None}
    set_ = expands(shop, **STEEL)
    assert (set_["coefficient"], set_["temperature_uncertainty"], set_["reason"]) == (11.5, 0.5, "16MnCr5")
    assert shop.call("GET", path) == set_
    again = shop.admin.put(
        f"/api/v1{path}", json=STEEL | {"coefficient": 12}, headers={"If-Match": first.headers["ETag"]}
    )
    assert again.status_code == 412
    (entry,) = shop.call("GET", f"/audit?subject=characteristic/{shop.characteristic}&limit=1")["items"]
    assert entry["action"] == "thermal expansion set"
    assert (entry["before"]["coefficient"], entry["after"]["coefficient"]) == (None, 11.5)
    shop.call("PUT", path, 403, shop.machine_client, **STEEL)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"coefficient": 1.15e-5}, "in µm/(m K) it is 11.5"),
        ({"scale_coefficient": 8e-6}, "in µm/(m K) it is 8"),
        ({"coefficient": "steel"}, "coefficient"),
        ({"coefficient": 900}, "coefficient"),
        ({"temperature_uncertainty": -1}, "temperature_uncertainty"),
        ({"length": -1}, "length"),
    ],
)
def test_what_cannot_be_is_refused(shop: Shop, wrong: dict[str, Any], words: str) -> None:
    assert words in str(expands(shop, 422, **STEEL | wrong))


def test_a_reading_has_its_size_at_20_degrees_beside_the_measured_one(shop: Shop) -> None:
    shop.read(0.0, context={"part_temperature": 24.0, "machine_temperature": 22.0})
    shop.read(0.0)
    assert at_20(shop, 2) is None
    nothing = {"size": None, "correction": None, "uncertainty": None, "missing": "coefficient"}
    assert at_20(shop) == nothing | {"text": "No expansion coefficient is stated."}
    expands(shop, **STEEL)
    first = at_20(shop)
    assert first["correction"] == pytest.approx(-40 * 11.5e-6 * 4, abs=1e-6)
    assert first["size"] == pytest.approx(40 + first["correction"], abs=1e-9)
    assert first["uncertainty"] == pytest.approx(40 * 11.5e-6 * 0.5, abs=1e-6)
    page = Person(shop.server, "viewer").open(f"/characteristics/{shop.characteristic}/readings/1")
    assert "Size at 20 °C" in page
    assert "from the measured size, which the decision rests on" in page
    expands(shop, **STEEL, scale_coefficient=11.5)
    assert at_20(shop)["correction"] == pytest.approx(-40 * 11.5e-6 * 2, abs=1e-6)


def test_lists_and_reports_have_it_too(shop: Shop) -> None:
    expands(shop, **STEEL)
    shop.read(0.0, part="warm", context={"part_temperature": 24.0})
    shop.read(0.0, part="unknown")
    shop.read(1500, part="warm", context={"part_temperature": 24.0})  # a probe fault
    rows = shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
    assert rows[0]["at_20"] == at_20(shop)
    assert rows[0]["at_20"]["size"] == pytest.approx(39.99816, abs=1e-6)
    assert [row["at_20"] for row in rows[1:]] == [None, None]
    (decisions,) = shop.call("GET", f"/characteristics/{shop.characteristic}/report.json?section=decisions")["sections"]
    column = [each["key"] for each in decisions["table"]["columns"]].index("size_at_20")
    assert [row[column]["value"] for row in decisions["table"]["rows"]] == [None, None, rows[0]["at_20"]["size"]]
    viewer = Person(shop.server, "viewer")
    for page in (f"/characteristics/{shop.characteristic}", "/parts/warm"):
        assert viewer.open(page).count("20 °C: 39.9982") == 1


@pytest.mark.parametrize("broken", [-300, 900, 3276.7])
def test_a_temperature_that_cannot_be_true_costs_no_reading(shop: Shop, broken: float) -> None:
    expands(shop, **STEEL)
    assert shop.read(3.0, context={"part_temperature": broken})["zone"] == "average"
    detail = shop.call("GET", f"/readings/{shop.characteristic}/1")
    assert detail["context"]["part_temperature"] == broken
    assert (detail["at_20"]["size"], detail["at_20"]["missing"]) == (None, "not_believed")


def test_a_temperature_is_a_number(shop: Shop) -> None:
    about: dict[str, Any] = {"characteristic": shop.characteristic, "measured": 40.0}
    for wrong in ("21,5", "warm", [21.5], True):
        problem = shop.call("POST", "/readings", 422, **about, context={"part_temperature": wrong})
        assert "part_temperature is not right: a number in °C" in problem["detail"]


def test_decisions_are_the_same_with_temperatures_and_without(shop: Shop) -> None:
    """A part 30 K too warm is 13.8 µm too large: out of tolerance as it was measured, good at 20 °C."""
    warm = shop.another("warm", tool_memory=7, average_memory=7)
    expands(shop, characteristic=warm, **STEEL, scale_coefficient=8.0)
    deviations = [13.8, 0.0, 4.0, 4.0, -6.0, 2.0, 14.0, -3.0, 0.5, 9.0] * 2
    temperatures = [50.0, 20.0, -5.0, 90.0, 35.0] * 4
    contexts = [{"part_temperature": each, "machine_temperature": 45 - each / 2} for each in temperatures]
    plain = shop.push(deviations, answers=True)
    with_temperatures = shop.push(deviations, warm, answers=True, context=contexts)
    one_by_one = [
        shop.read(deviation, each, **more)
        for deviation, context in zip(deviations, contexts, strict=True)
        for each, more in ((shop.characteristic, {}), (warm, {"context": context}))
    ]
    names = ("zone", "action", "deviation", "decided_deviation", "average_before", "average_after", "size")
    for one, other in [
        *zip(plain, with_temperatures, strict=True),
        *zip(one_by_one[::2], one_by_one[1::2], strict=True),
    ]:
        assert [one[name] for name in names] == [other[name] for name in names]
        assert one["reason"]["code"] == other["reason"]["code"]
        amounts = [each and each["amount"] for each in (one["correction"], other["correction"])]
        assert amounts[0] == amounts[1]
    assert {"correct", "none"} <= {each["action"] for each in plain + one_by_one}
