"""Form as a characteristic: each reading that has the result brings one, decided, kept and counted like any other."""

from typing import Any

import pytest

from tests.servers import Server
from tests.shop import Person, Shop

ROUND = {"variant": "round", "points": 4, "index": 90, "average_memory": 0}


def form(shop: Shop, source: str, result: str, key: str, status: int = 201, limit: float = 0.006, **more: Any) -> Any:
    of = {"characteristic": source, "result": result}
    body: dict[str, Any] = {
        "key": key,
        "name": key,
        "machine": shop.machine,
        "form_of": of,
        "parameters": {"R40": limit} | more,
    }
    return shop.call("POST", "/characteristics", status, **body)


def test_roundness_is_kept_judged_and_counted_beside_the_diameter(shop: Shop) -> None:
    bore = f"{shop.characteristic}-bore"
    shop.add(bore, **ROUND)
    made = form(shop, bore, "out_of_roundness", f"{bore}-round")
    assert made["form_of"] == {"characteristic": bore, "result": "out_of_roundness"}
    assert (made["parameters"]["target"], made["parameters"]["natural_limit"]) == (0.0, "lower")
    sent: dict[str, Any] = {"characteristic": bore, "key": "part-1", "part": "p1", "context": {"nest": 2}}
    first = shop.call("POST", "/readings", 201, touches=[[40.0], [40.002], [39.999], [39.998]], **sent)
    assert shop.call("POST", "/readings", 200, touches=[[40.0], [40.002], [39.999], [39.998]], **sent) == first
    shop.call("POST", "/readings", 201, characteristic=bore, touches=[[40.0], [40.008], [40.0], [40.0]])
    shop.call("POST", "/readings", 201, characteristic=bore, touches=[[40.0], [40.001], [40.0], []])  # a probe fault
    readings = shop.call("GET", f"/readings?characteristic={bore}-round")["items"]
    assert [(r["measured"], r["zone"], r["action"], r["key"], r["part"]) for r in readings] == [
        (0.004, "average", "none", "part-1", "p1"),
        (0.008, "oversize", "none", None, None),
    ]
    (alarm,) = shop.call("GET", f"/alarms?characteristic={bore}-round")["items"]
    assert (alarm["kind"], alarm["count"]) == ("oversize", 1)
    detail = shop.call("GET", f"/readings/{bore}-round/1")
    assert (detail["context"]["nest"], detail["measured_at"]) == (2, first["measured_at"])
    counted = shop.call("GET", f"/characteristics/{bore}-round/statistics")
    assert (counted["count"], counted["mean"]) == (2, pytest.approx(0.006))


def test_a_size_sent_to_the_form_itself_never_stops_the_reading(shop: Shop) -> None:
    bore = f"{shop.characteristic}-own"
    shop.add(bore, **ROUND)
    shop.call("POST", "/readings", 201, characteristic=bore, touches=[[40.0]] * 4)
    form(shop, bore, "out_of_roundness", f"{bore}-round")
    shop.call("POST", "/readings", 201, characteristic=f"{bore}-round", measured=0.003, key="k")
    for key, count in (("k", 1), ("l", 2)):
        shop.call("POST", "/readings", 201, characteristic=bore, touches=[[40.0], [40.001], [40.0], [40.0]], key=key)
        assert shop.call("GET", f"/characteristics/{bore}-round/statistics")["count"] == count


@pytest.mark.parametrize(
    ("result", "more", "says"),
    [
        ("taper", {}, "have no taper, but out_of_roundness"),
        ("out_of_roundness", {"R10": 3, "mode": "automatic", "factor": -1}, "measure_only"),
        ("out_of_roundness", {"natural_limit": "none"}, "no form is below 0"),
        ("out_of_roundness", {"R27": 2}, "without repeats"),
        ("out_of_roundness", {"R40": -0.01}, "a length above 0"),
    ],
)
def test_what_cannot_be_form_is_refused_in_words(shop: Shop, result: str, more: dict[str, Any], says: str) -> None:
    bore = f"{shop.characteristic}-no"
    shop.add(bore, **ROUND)
    problem = form(shop, bore, result, f"{bore}-form", 422, **more)
    assert says in str(problem)
    assert shop.call("GET", f"/characteristics/{bore}-form", 404)


def test_form_has_one_characteristic_and_stays_form(shop: Shop, server: Server) -> None:
    bore = f"{shop.characteristic}-one"
    shop.add(bore, **ROUND)
    form(shop, bore, "out_of_roundness", f"{bore}-round")
    assert "is the characteristic" in form(shop, bore, "out_of_roundness", f"{bore}-again", 409)["detail"]
    assert "Ask for the program of that one" in str(shop.call("GET", f"/characteristics/{bore}-round/program", 422))
    assert "itself the form" in str(form(shop, f"{bore}-round", "out_of_roundness", f"{bore}-deep", 422))
    assert "no characteristic" in str(form(shop, "nowhere", "out_of_roundness", f"{bore}-lost", 422))
    assert "have no form" in str(form(shop, shop.characteristic, "taper", f"{bore}-single", 422))
    change: dict[str, Any] = {"parameters": {"R40": 0.009}, "reason": "drawing c"}
    changed = shop.call("PATCH", f"/characteristics/{bore}-round", **change)
    assert (changed["parameters"]["tolerance_width"], changed["form_of"]["characteristic"]) == (0.009, bore)
    change = {"parameters": {"R10": 3, "mode": "automatic", "natural_limit": "none"}, "reason": "wrong"}
    assert "measure_only" in str(shop.call("PATCH", f"/characteristics/{bore}-round", 422, **change))


def test_set_up_makes_form_of_a_result_and_says_where_its_readings_come_from(shop: Shop, server: Server) -> None:
    bore, person = f"{shop.characteristic}-page", Person(server, "engineer")
    shop.add(bore, **ROUND)
    page = person.open(f"/setup/characteristics/{bore}")
    assert "Out-of-roundness" in page
    fields: dict[str, Any] = {"result": "out_of_roundness", "limit": "0", "name": "Roundness", "key": f"{bore}-round"}
    page = person.send(f"/setup/characteristics/{bore}/forms", 422, **fields)
    assert "R40 is the limit of the form deviation" in page
    assert f'value="{bore}-round"' in page
    page = person.send(f"/setup/characteristics/{bore}/forms", **fields | {"limit": "0,005"})
    assert "each of its readings brings one here" in page
    assert "at most 5 µm" in person.open(f"/setup/characteristics/{bore}")
    shop.call("PATCH", f"/characteristics/{bore}", parameters={"R25": 0, "R23": 1}, reason="one point")
    assert "nothing comes here" in person.open(f"/setup/characteristics/{bore}-round")
    shop.call("POST", "/readings", 201, characteristic=bore, touches=[[40.0]])
    assert shop.call("GET", f"/characteristics/{bore}-round/statistics")["count"] == 0
