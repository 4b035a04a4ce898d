"""Drift by temperature: from stored readings over REST, on its page and in its chart."""

from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pytest

from tests.quality.closed_loop import cut
from tests.shop import Person, Shop

BEGIN = datetime(2026, 3, 2, 6, tzinfo=UTC)


def study(shop: Shop, query: str = "", status: int = 200, characteristic: str | None = None) -> Any:
    return shop.call("GET", f"/characteristics/{characteristic or shop.characteristic}/temperature{query}", status)


def mornings(count: int = 240, *, per_kelvin: float = 1.2, warming: float = 0.1, wear: float = 0.01) -> Any:
    """Deviations (µm) of mornings of 60 readings, with what is sent beside them."""
    rng = np.random.default_rng(7)
    at = np.arange(count)
    degrees = 22 + 3 * np.sin(at / 23) + rng.normal(size=count) / 4
    warm = np.minimum(at % 60, 20)
    sizes = per_kelvin * (degrees - 22) + warming * warm + wear * at + rng.normal(size=count) * 0.4
    moments = [BEGIN + timedelta(days=int(n) // 60, minutes=2 * (int(n) % 60)) for n in at]
    more = {
        "measured_at": [each.isoformat() for each in moments],
        "context": [{"part_temperature": round(float(each), 2)} for each in degrees],
    }
    return sizes.tolist(), more


def test_each_effect_is_found_beside_the_others_behind_the_loop(shop: Shop) -> None:
    """The loop corrects these readings all the time; what temperature did is found all the same."""
    sizes, more = mornings()
    answers = cut(shop, sizes, **more)
    assert sum(answer["action"] == "correct" for answer in answers) > 20
    found = study(shop)
    assert (found["of"], found["without"], found["unbelieved"], found["rebuilt"]) == ("part", 0, 0, True)
    assert (found["pauses"], found["pause"]) == (4, 10.0)
    for name, true in (("temperature", 0.0012), ("since_pause", 0.0001), ("wear", 0.00001)):
        assert found[name]["low"] <= true <= found[name]["high"], name
        assert not found[name]["collinear"]
    assert found["temperature"]["share"] > 0.3
    assert found["temperature"]["share"] <= found["explained"] <= 1
    assert any("µm/K" in sentence for sentence in found["text"])


def test_a_broken_tool_hides_nothing(shop: Shop) -> None:
    key = shop.another("broken", tool_memory=0, average_memory=0)
    sizes, more = mornings()
    sizes[100:104] = [400.0, 410.0, 420.0, 415.0]
    shop.push(sizes, key, **more)
    found = study(shop, characteristic=key)
    assert (found["readings"], found["worn"]) == (236, 4)
    assert found["temperature"]["low"] <= 0.0012 <= found["temperature"]["high"]
    assert found["temperature"]["share"] > 0.2
    assert "4 readings of worn or broken tools are left out." in found["text"]


@pytest.fixture
def warm(shop: Shop) -> str:
    """A characteristic that only measures, with its mornings."""
    key = shop.another("warm", tool_memory=0, average_memory=0)
    sizes, more = mornings(120)
    shop.push(sizes, key, **more)
    return key


def test_the_page_says_what_was_found_and_what_is_stated(shop: Shop, warm: str) -> None:
    here = f"/characteristics/{warm}/temperature"
    engineer = Person(shop.server, "engineer")
    page = engineer.open(here)
    assert "no temperature is applied to them" in page
    assert "µm/K" in page
    assert "Warming up after a pause" in page
    engineer.send(here, coefficient="11,5", reason="16MnCr5")
    assert "The part alone would expand by +0.46" in engineer.open(here)
    assert study(shop, characteristic=warm)["expected"] == pytest.approx(40 * 11.5e-6)
    refused = engineer.send(here, 422, coefficient="0.0000115", reason="16MnCr5")
    assert "in µm/(m K) it is 11.5" in refused
    assert "0.0000115" in refused, "what was typed is kept"
    viewer = Person(shop.server, "viewer")
    assert "Engineers state the expansion" in viewer.open(here)
    viewer.send(here, 403, coefficient="12", reason="Guess")


def test_its_chart_has_the_readings_and_both_lines(shop: Shop, warm: str) -> None:
    shop.call("PUT", f"/characteristics/{warm}/expansion", coefficient=11.5, reason="16MnCr5")
    traces = shop.call("GET", f"/characteristics/{warm}/figures/temperature")["data"]
    by_meta = {trace["meta"]: trace for trace in traces}
    assert {"readings", "line", "expected", "band"} <= set(by_meta)
    assert len(by_meta["readings"]["x"]) == 120
    assert by_meta["line"]["name"].endswith("µm/K")


def test_too_few_temperatures_are_said_in_words(shop: Shop) -> None:
    shop.push([1.0, 2.0, 3.0], context=[{"machine_temperature": 21.0 + at} for at in range(3)])
    assert "3 readings have a temperature that is believed" in study(shop, status=422)["detail"]
    assert "Too few temperatures yet" in Person(shop.server, "viewer").open(
        f"/characteristics/{shop.characteristic}/temperature"
    )
    study(shop, "?of=hall", 422)
    study(shop, "?pause=0", 422)


def test_broken_sensors_are_counted_and_left_out(shop: Shop, warm: str) -> None:
    shop.push([1.0, 2.0], warm, context=[{"part_temperature": 3276.7}, {"machine_temperature": 21.0}])
    found = study(shop, characteristic=warm)
    assert (found["readings"], found["without"], found["unbelieved"]) == (120, 1, 1)
    assert any("check the sensor" in sentence for sentence in found["text"])
    assert "1 reading has a temperature" in study(shop, "?of=machine", 422, warm)["detail"]
