"""The way of the probe's signal: what it leaves uncertain, where it is said, and that a finer R33 is warned of."""

from typing import Any

import pytest

from tests.servers import Server
from tests.shop import Person, Shop


def test_a_machine_is_wired_directly_until_somebody_says_otherwise(shop: Shop) -> None:
    machine = shop.call("GET", f"/machines/{shop.machine}")
    assert (machine["signal_path"], machine["signal_delay"], machine["probing_feed"]) == ("direct", 0.25, 150.0)
    assert (machine["position_uncertainty"], machine["zero_range_floor"]) == (0.0, 0.0)


def test_through_the_plc_the_position_error_is_feed_times_delay(shop: Shop) -> None:
    """150 mm/min x 0.25 ms = 0.625 µm; of which 0.1 ms vary: 0.25 µm. The history says who said so."""
    changed = shop.call("PATCH", f"/machines/{shop.machine}", signal_path="plc")
    assert (changed["position_uncertainty"], changed["zero_range_floor"]) == (0.000625, 0.000625)
    changed = shop.call("PATCH", f"/machines/{shop.machine}", signal_jitter=0.1, probing_feed=300)
    assert (changed["position_uncertainty"], changed["zero_range_floor"]) == (0.00125, 0.0005)
    changed = shop.call("PATCH", f"/machines/{shop.machine}", signal_jitter=None)
    assert (changed["signal_jitter"], changed["zero_range_floor"]) == (None, 0.00125)
    entries = shop.call("GET", f"/audit?subject=machine/{shop.machine}")["items"]
    assert entries[0]["before"] == {"signal_jitter": 0.1}
    assert entries[0]["after"] == {"signal_jitter": None}


def test_a_zero_range_finer_than_the_signal_path_is_warned_of_and_taken(shop: Shop) -> None:
    shop.call("PATCH", f"/machines/{shop.machine}", signal_path="plc", signal_delay=0.5)
    path = f"/characteristics/{shop.characteristic}"
    (warning,) = shop.call("PATCH", path, parameters={"zero_range": 0.00124}, reason="t")["warnings"]
    assert warning["field"] == "parameters.zero_range"
    assert "R33 zero range 0.00124 mm is finer than the probe tells" in warning["text"]
    assert "0.00125 mm" in warning["text"]
    assert shop.call("PATCH", path, parameters={"zero_range": 0.00125}, reason="t")["warnings"] == []
    shop.call("PATCH", f"/machines/{shop.machine}", signal_path="direct")
    assert shop.call("PATCH", path, parameters={"zero_range": 0.0001}, reason="t")["warnings"] == []


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(("signal_path", value) for value in ("wireless", 1, "")),
        *(("signal_delay", value) for value in (-0.1, 1e9, "fast")),
        *(("signal_jitter", value) for value in (-1, "x")),
        *(("probing_feed", value) for value in (0, -150, 1e9)),
    ],
)
def test_what_has_no_meaning_is_refused_by_name(shop: Shop, field: str, value: Any) -> None:
    problem = shop.call("PATCH", f"/machines/{shop.machine}", 422, **{field: value})
    assert [error["field"] for error in problem["errors"]] == [field]


def test_the_pages_say_it(shop: Shop, server: Server) -> None:
    engineer = Person(server, "engineer")
    address = f"/setup/machines/{shop.machine}"
    page = engineer.send(
        address, name="L", control="fanuc", signal_path="plc", signal_delay="0,25", signal_jitter="", probing_feed="150"
    )
    assert "0.625 µm" in page
    assert "below 0.625 µm makes no sense on this machine" in engineer.open(
        f"/setup/characteristics/{shop.characteristic}"
    )
    assert "150 mm/min × 0.25 ms" in engineer.open(f"/characteristics/{shop.characteristic}")
    shown = engineer.send(
        address,
        422,
        name="L",
        control="fanuc",
        signal_path="plc",
        signal_delay="a lot",
        signal_jitter="",
        probing_feed="",
    )
    assert "a lot" in shown
