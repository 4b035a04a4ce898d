"""The sampling that readings allow: over REST and on its page."""

from typing import Any

from app.loop.characteristics.queries import characteristic_named
from app.quality.sampling.queries import Sampling, sampling_of
from tests.quality.closed_loop import scatter
from tests.shop import Person, Shop


def sampling(shop: Shop, query: str = "", status: int = 200) -> Any:
    return shop.call("GET", f"/characteristics/{shop.characteristic}/sampling{query}", status)


def test_it_is_proposed_from_the_stored_readings(shop: Shop) -> None:
    assert "too few" in sampling(shop, status=422)["detail"]
    here = f"/characteristics/{shop.characteristic}/sampling"
    viewer = Person(shop.server, "viewer")
    assert "No proposal yet" in viewer.open(here)
    shop.push([value * 0.4 for value in scatter(300, wear=0.0)])
    found = sampling(shop, "?most_ppm=20000&seconds=12")
    assert found["stable"]
    assert (found["hindrances"], found["planned"], found["readings"]) == ([], None, 300)
    assert found["every"] > 1
    chosen = next(risk for risk in found["risks"] if risk["every"] == found["every"])
    assert 0 < chosen["ppm"] <= 20_000
    assert chosen["seconds_saved"] == 12_000 * (1 - 1 / found["every"])
    assert sampling(shop, "?most_ppm=1")["every"] == 1
    page = viewer.open(f"{here}?most_ppm=20000&seconds=12")
    assert f"Measure 1 in {found['every']} parts" in page
    shop.push([9.0, 9.0, 9.0])
    now = sampling(shop, "?most_ppm=20000")
    assert now["every"] == 1
    assert now["jumps"] == 1
    assert {"unstable", "not_capable"} & set(now["hindrances"])
    assert "Measure every part" in viewer.open(f"{here}?most_ppm=20000")


def test_the_weighting_of_the_running_average_counts(shop: Shop) -> None:
    slow = shop.another("slow", weighting_factor=4)
    shop.push([value * 0.4 for value in scatter(300, wear=0.0)], slow)
    with shop.server.database.begin() as session:
        found = sampling_of(session, characteristic_named(session, slow))
    assert isinstance(found, Sampling)
    assert found.process.weighting == 4
    page = Person(shop.server, "viewer").open(f"/characteristics/{slow}/sampling")
    assert "R29 = 4.0" in page
