"""One parameter of many characteristics, and machines set up like another one, as plain posts."""

import re
from html import unescape
from typing import Any

from tests.shop import Person, Shop


def parameters(shop: Shop, key: str | None = None) -> dict[str, Any]:
    found: dict[str, Any] = shop.call("GET", f"/characteristics/{key or shop.characteristic}")
    return {**found["parameters"], "version": found["parameters_version"]}


def preview(engineer: Person, shops: list[Shop], **said: str) -> tuple[str, str]:
    """The page with the preview, and the versions that its form sends."""
    text = engineer.post("/setup/parameters", 200, **said, on=[shop.characteristic for shop in shops]).text
    versions = re.search(r'name="versions" value="([^"]*)"', text)
    return unescape(text), versions[1] if versions else ""


def test_many_get_a_new_version_each_with_one_reason(server: Any, engineer: Person) -> None:
    one, two = Shop(server), Shop(server)
    text, versions = preview(engineer, [one, two], parameter="zero_range", value="10", unit="share")
    assert text.count("0.0016 mm") == 2, "10 % of the tolerance width of 16 µm"
    said = {"parameter": "zero_range", "value": "10", "unit": "share", "versions": versions}
    refused = engineer.post("/setup/parameters", 422, **said, reason=" ").text
    assert re.search(r'<textarea id="f-reason"[^>]* aria-invalid="true"', refused)
    assert parameters(one)["version"] == parameters(two)["version"] == 1
    engineer.post("/setup/parameters", **said, reason="probe repeats within 1 µm")
    for shop in (one, two):
        assert (parameters(shop)["zero_range"], parameters(shop)["version"]) == (0.0016, 2)
        entry = shop.call("GET", f"/audit?subject=characteristic/{shop.characteristic}")["items"][0]
        assert entry["why"] == "probe repeats within 1 µm"


def test_more_can_be_chosen_than_an_address_holds(server: Any, engineer: Person) -> None:
    shop = Shop(server)
    keys = [*(f"{shop.characteristic}-{'x' * 40}-{n}" for n in range(2000)), shop.characteristic]
    text = engineer.post("/setup/parameters", 200, parameter="zero_range", value="0.002", on=keys).text
    assert f'name="versions" value="{shop.characteristic}:1"' in text


def test_one_that_cannot_be_changed_or_was_changed_meanwhile_stops_all(server: Any, engineer: Person) -> None:
    one, two = Shop(server), Shop(server)
    text, versions = preview(engineer, [one, two], parameter="zero_range", value="0.02")
    assert "must be smaller than R34" in text
    assert versions == "", "there is nothing to send"
    _text, versions = preview(engineer, [one, two], parameter="zero_range", value="0.002")
    two.call("PATCH", f"/characteristics/{two.characteristic}", parameters={"R29": 3}, reason="slower")
    said = {"parameter": "zero_range", "value": "0.002", "versions": versions}
    refused = unescape(engineer.post("/setup/parameters", 409, **said, reason="quieter").text)
    assert f"{two.characteristic}: " in refused
    assert parameters(one)["version"] == 1, "the first is not changed either"
    assert 'name="versions"' in refused, "the new preview can be sent"


def test_a_machine_is_copied_with_its_characteristics(server: Any, engineer: Person) -> None:
    shop = Shop(server)
    shop.call("PATCH", f"/machines/{shop.machine}", signal_path="plc", tool_locations=64)
    shop.read(3.0)
    form = engineer.open(f"/setup/machines/new?like={shop.machine}")
    lines = re.search(r'name="characteristics"[^>]*>([^<]*)<', form)
    assert lines
    assert lines[1].startswith(f"{shop.characteristic} = ")
    new = f"copy-of-{shop.machine}"
    said = {
        "key": new,
        "name": "Копија",
        "control": "fanuc",
        "type": "lathe",
        "tool_locations": "64",
        "average_locations": "20",
    }
    for wrong, words in (
        (f"{shop.characteristic} = {shop.characteristic}", "is taken"),
        (f"{shop.characteristic} = Bad Key", "Bad Key"),
        ("nobody-d1 = x", "is not on"),
        (shop.characteristic, "key at the copied machine = new key"),
    ):
        refused = unescape(
            engineer.post("/setup/machines/new", 422, **said, like=shop.machine, characteristics=wrong).text
        )
        assert words in refused, re.findall(r"-error.*?<span>(.*?)</span>", refused)
        shop.call("GET", f"/machines/{new}", 404)
    engineer.post(
        "/setup/machines/new", **said, like=shop.machine, characteristics=f"{shop.characteristic} = {new}-d40\n"
    )
    machine = shop.call("GET", f"/machines/{new}")
    assert (machine["name"], machine["control"], machine["signal_path"], machine["tool_locations"]) == (
        "Копија",
        "fanuc",
        "plc",
        64,
    )
    assert parameters(shop, f"{new}-d40") == parameters(shop) | {"version": 1}
    assert shop.call("GET", f"/readings?characteristic={new}-d40")["items"] == []
