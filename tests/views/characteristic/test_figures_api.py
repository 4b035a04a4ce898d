"""The figures over HTTP: every reading, every correction and every alarm is on them."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from tests.shop import Shop


def figure(shop: Shop, name: str, status: int = 200, **query: Any) -> Any:
    answer = shop.admin.get(f"/api/v1/characteristics/{shop.characteristic}/figures/{name}", params=query)
    assert answer.status_code == status, answer.text
    return answer.json()


def trace(found: Any, meta: str) -> Any:
    return next(trace for trace in found["data"] if trace.get("meta") == meta)


def test_every_reading_is_a_point_that_opens_it(shop: Shop) -> None:
    for deviation in (0.5, -0.5, 2.0, 6.5):
        shop.read(deviation)
    points = trace(figure(shop, "zones"), "readings")
    assert points["x"] == [1, 2, 3, 4]
    assert points["customdata"][2] == f"/characteristics/{shop.characteristic}/readings/3"
    assert trace(figure(shop, "zones", scale="true"), "readings")["y"] == pytest.approx([0.5, -0.5, 2.0, 6.5])
    assert "excluded" not in points["text"][3]
    shop.call("POST", f"/readings/{shop.characteristic}/4/exclude", reason="chip")
    assert "excluded" in trace(figure(shop, "zones"), "readings")["text"][3]


@pytest.mark.parametrize(
    ("query", "shown"),
    [
        ({"last": 2}, [4, 5]),
        ({"last": "all"}, [1, 2, 3, 4, 5]),
        ({"first": 2, "through": 3}, [2, 3]),
        ({"first": 4}, [4, 5]),
        ({"from": "2026-11-21T08:01:30Z", "to": "2026-11-21T08:03:00Z"}, [3]),  # without its end
    ],
)
def test_which_readings(shop: Shop, query: dict[str, Any], shown: list[int]) -> None:
    for minute in range(5):
        shop.read(0.1, measured_at=f"2026-11-21T08:0{minute}:00Z")
    assert trace(figure(shop, "zones", **query), "readings")["x"] == shown
    assert len(trace(figure(shop, "run", **query), "run")["x"]) == len(shown)
    assert sum(trace(figure(shop, "histogram", **query), "histogram")["x"]) == len(shown)


def test_corrections_alarms_and_tool_changes_are_on_it(shop: Shop) -> None:
    number = shop.read(6.0)["correction"]["number"]
    shop.correction(number, "applied")
    shop.read(9.5, correction_in_effect=number)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="new insert")
    shop.read(0.2)
    found = figure(shop, "zones")
    corrections = trace(found, "corrections")
    assert corrections["x"] == [1, 2]
    assert "−6.0" in corrections["text"][0]
    assert trace(found, "offset")["y"][-1] == 0  # the sum begins anew with the tool
    events = trace(found, "events")
    words = " ".join(events["text"])
    assert "Oversize" in words
    assert "T3 changed" in words
    assert events["x"] == [2, 3]


def test_a_point_lies_and_looks_like_its_raw_deviation(shop: Shop) -> None:
    shop.read(20.0)
    assert shop.read(20.0, correction_in_effect=0)["zone"] == "zero"
    assert trace(figure(shop, "zones"), "readings")["marker"]["symbol"] == ["triangle-up", "triangle-up"]


def test_nothing_measured_yet_is_said_so(shop: Shop) -> None:
    for name in ("zones", "run", "histogram"):
        words = [note["text"] for note in figure(shop, name, last="all")["layout"]["annotations"]]
        assert any("No readings yet" in text for text in words), name


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"last": "some"}, "last"),
        ({"last": 0}, "last"),
        ({"first": 9, "through": 2}, "first"),
        ({"from": "2026-11-21T08:00:00Z", "to": "2026-11-20T08:00:00Z"}, "from"),
        ({"from": "2026-11-21T08:00:00"}, "from"),
        ({"scale": "log"}, "scale"),
        ({"theme": "pink"}, "theme"),
        ({"width": "wide"}, "width"),
    ],
)
def test_a_wrong_choice_is_named(shop: Shop, query: dict[str, Any], field: str) -> None:
    problem = figure(shop, "zones", 422, **query)
    assert [error["field"] for error in problem["errors"]] == [field]


def test_a_long_history_over_time_is_summed_up_and_nothing_is_left_out(shop: Shop) -> None:
    begin = datetime(2026, 11, 2, 6, tzinfo=UTC)
    deviations = [0.5 if at % 2 else -0.5 for at in range(2_600)]
    deviations[3] = 7.5  # in the oldest of all blocks
    shop.push(deviations, measured_at=[(begin + timedelta(minutes=at)).isoformat() for at in range(2_600)])
    found = figure(shop, "run", last="all")
    highest, newest = trace(found, "maximum"), trace(found, "run")
    assert max(highest["y"]) == pytest.approx(40.0075)
    assert datetime.fromisoformat(highest["x"][0]) < begin + timedelta(hours=1)
    assert len(highest["x"]) * 32 + len(newest["x"]) == 2_600
    assert "2\u202f600 readings, summed up by 32" in found["layout"]["xaxis"]["title"]["text"]
    assert "summed up by 32" in figure(shop, "zones", last="all")["layout"]["xaxis"]["title"]["text"]
    assert "summed up" not in figure(shop, "run", last=2_000)["layout"]["xaxis"]["title"]["text"]
