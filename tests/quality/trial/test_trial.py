"""A shadow trial: a characteristic measures only, one page says what a loop would have done, one click lets it correct."""

from typing import Any

import pytest

from tests.quality.closed_loop import scatter
from tests.servers import Server
from tests.shop import Person, Shop


@pytest.fixture
def shy(shop: Shop) -> str:
    """A characteristic that only measures an edge that wears."""
    key = shop.another("shy", mode="measure_only", tool_memory=7, average_memory=7)
    shop.push(scatter(150, wear=0.1), key)
    return key


def trial(shop: Shop, key: str, query: str = "") -> Any:
    return shop.call("GET", f"/characteristics/{key}/trial{query}")


def test_side_by_side_and_one_step_to_automatic(shop: Shop, shy: str, server: Server) -> None:
    found = trial(shop, shy)
    without, today, proposed = found["without"], found["today"], found["proposed"]
    assert found["measures_only"]
    assert (without["readings"], without["corrections"]) == (150, 0)
    assert without["rejects"] > 40 > today["rejects"]
    assert today["corrections"] >= proposed["corrections"] > 0
    assert today["ppk"] > without["ppk"]
    # The same as a real loop would have it, set so: as What if has it of the stored readings.
    engineer = server.client(server.key("engineer"))
    start = f"/characteristics/{shy}/trial/start"
    named = found["settings"] | {"parameters_version": found["parameters_version"], "reason": "Looked at"}
    shop.call("POST", start, 403, client=server.client(server.key("operator")), **named)
    shop.call("POST", start, 409, client=engineer, **named | {"parameters_version": 99})
    changed = shop.call("POST", start, client=engineer, **named)
    assert (changed["mode"], changed["settings"]) == ("automatic", found["settings"])
    assert shop.call("GET", f"/characteristics/{shy}")["parameters"]["mode"] == "automatic"
    shop.call("POST", start, 409, client=engineer, reason="Again")
    assert not trial(shop, shy)["measures_only"]


def test_the_page_is_found_from_the_first_reading_on(shop: Shop, server: Server) -> None:
    key = shop.another("shy", mode="measure_only", tool_memory=7, average_memory=7)
    engineer = Person(server, "engineer")
    here = f"/characteristics/{key}/trial"
    assert here in engineer.open(f"/characteristics/{key}")
    assert here not in engineer.open(f"/characteristics/{shop.characteristic}")
    assert "begins with the second reading" in engineer.open(here)
    shop.push(scatter(150, wear=0.1), key)
    page = engineer.open(here)
    assert f"{here}/start" in page
    assert f"{here}/start" not in Person(server, "operator").open(here)
    asked = engineer.open(f"{here}/start")
    assert "without asking" in asked
    engineer.send(f"{here}/start", 422, parameters_version="1")
    answer = engineer.post(f"{here}/start", parameters_version="1", reason="Touch test made", zero_range="0.0015")
    assert answer.headers["location"].endswith("done=1")
    twice = engineer.post(f"{here}/start", parameters_version="1", reason="Touch test made")
    assert twice.headers["location"].endswith("done=1"), "what one person sends twice is done once"
    other = Person(server, "engineer").post(f"{here}/start", parameters_version="1", reason="Again")
    assert other.headers["location"].endswith("late=1")
    assert shop.call("GET", f"/characteristics/{key}")["parameters"]["zero_range"] == 0.0015
    assert "the trial is over" in engineer.open(here)


def test_without_a_tool_there_is_nothing_to_switch(shop: Shop) -> None:
    key = shop.another("gauge", tool_memory=0, average_memory=0)
    shop.push([1.0, 2.0, 1.5], key)
    assert trial(shop, key)["proposed"] is None
    shop.call("POST", f"/characteristics/{key}/trial/start", 422, reason="Looked at")
