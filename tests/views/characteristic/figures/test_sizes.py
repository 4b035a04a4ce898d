"""Sizes as the drawing counts them: whatever empirical value is taken off, every chart, table and file has the same limits."""

import csv
import io
import re
from typing import Any

import pytest

from tests.shop import Person, Shop
from tests.views.characteristic.test_figures_api import figure, trace


@pytest.fixture
def shaft(shop: Shop) -> Shop:
    """A shaft 40 0/−16 µm: an asymmetric tolerance, target 39.992, with an empirical value of +1.4 µm."""
    shop.characteristic = f"{shop.characteristic}-d40"
    shop.add(
        shop.characteristic,
        target=None,
        tolerance_width=None,
        nominal=40.0,
        upper_deviation=0.0,
        lower_deviation=-0.016,
    )
    set_empirical_value(shop, 0.0014)
    return shop


def set_empirical_value(shaft: Shop, value: float) -> None:
    shaft.call("PUT", f"/machines/{shaft.machine}/averages/5", empirical_value=value, reason="micrometer")


def read(shaft: Shop, measured: float) -> Any:
    return shaft.call("POST", "/readings", 201, characteristic=shaft.characteristic, measured=measured)


def lines(found: Any) -> list[float]:
    return sorted(shape["y0"] for shape in found["layout"]["shapes"] if shape.get("xref") == "paper")


def title(found: Any) -> str:
    text: str = found["layout"]["yaxis"]["title"]["text"]
    return text


def test_every_chart_has_the_limits_of_the_drawing(shaft: Shop) -> None:
    answer = read(
        shaft, 39.98535
    )  # 8.05 µm below the target, once 1.4 µm are taken off: undersize, though the machine reads more
    assert (answer["zone"], answer["deviation"], answer["size"]) == ("undersize", -0.00805, 39.98395)
    over_time = figure(shaft, "run")
    assert lines(over_time) == pytest.approx([39.984, 39.992, 40.0])
    assert trace(over_time, "run")["y"] == [39.98395]  # outside the line at 39.984
    for scale in ("zones", "true"):
        zones = figure(shaft, "zones", scale=scale)
        assert {"<b>39.9840</b>", "<b>39.9920</b>", "<b>40.0000</b>"} <= set(zones["layout"]["yaxis"]["ticktext"])
        for found, meta in ((zones, "readings"), (over_time, "run")):
            assert title(found) == "Size, mm (empirical value +1.4\xa0µm)"
            (text,) = trace(found, meta)["text"]
            assert "size 39.9840\xa0mm" in text or "size 39.9839\xa0mm" in text
            assert re.search(r"machine reading 39\.985[34]\xa0mm, empirical value \+1\.4\xa0µm taken off", text)


def test_each_reading_by_its_own_empirical_value(shaft: Shop) -> None:
    read(shaft, 39.9934)
    set_empirical_value(shaft, 0.003)
    read(shaft, 39.995)
    for name in ("run", "zones"):
        assert title(figure(shaft, name)) == ("Size, mm (empirical value +1.4\xa0µm to +3.0\xa0µm)")
        assert title(figure(shaft, name, last=1)).endswith("(empirical value +3.0\xa0µm)")
    assert trace(figure(shaft, "run"), "run")["y"] == [39.992, 39.992]


def test_a_change_of_the_target_is_said(shaft: Shop) -> None:
    read(shaft, 39.9934)
    changes = {"R40": 0.004, "R41": -0.012}
    shaft.call("PATCH", f"/characteristics/{shaft.characteristic}", parameters=changes, reason="drawing changed")
    for name, meta in (("run", "run"), ("zones", "readings")):
        found = figure(shaft, name)
        assert title(found).endswith("the target changed in this view: each about its own")
        assert "size 39.9920\xa0mm" in trace(found, meta)["text"][0]


def test_nothing_is_named_where_nothing_is_taken_off(shaft: Shop) -> None:
    set_empirical_value(shaft, 0.0)
    read(shaft, 39.993)
    assert title(figure(shaft, "run")) == title(figure(shaft, "zones")) == "Size, mm"
    assert "machine reading" not in trace(figure(shaft, "run"), "run")["text"][0]


def test_of_a_long_history_the_blocks_tell_it_too(shaft: Shop) -> None:
    """More readings than are drawn one by one; the empirical value changes inside the blocks."""

    def batch(first: int, count: int, measured: float) -> None:
        readings = [
            {"characteristic": shaft.characteristic, "measured": measured, "key": f"{shaft.characteristic}:{n}"}
            for n in range(first, first + count)
        ]
        assert shaft.admin.post("/api/v1/readings/batch", json=readings).status_code == 201

    batch(1, 1_000, 39.9934)
    set_empirical_value(shaft, 0.002)
    batch(1_001, 2_000, 39.994)
    found = figure(shaft, "zones", last="all")
    assert trace(found, "maximum")["x"]
    assert title(found) == "Size, mm (empirical value +1.4\xa0µm to +2.0\xa0µm)"


def test_pages_and_files_have_the_same_size(shaft: Shop, server: Any) -> None:
    read(shaft, 39.98535)
    viewer = Person(server, "operator")
    for path in (f"/characteristics/{shaft.characteristic}", f"/characteristics/{shaft.characteristic}/readings/1"):
        page = viewer.open(path)
        assert '<span class="value">39.9840<span class="unit">mm</span></span>' in page.replace("39.9839", "39.9840")
        assert re.search(r"machine reading 39\.985[34]\xa0mm", page)
    viewer.send(f"/characteristics/{shaft.characteristic}/readings/1/by-hand", measured="39.98395", verdict="bad")
    assert "machine</small>" in viewer.open(f"/characteristics/{shaft.characteristic}/readings/1").replace(
        "machine +0.0 µm", "machine"
    )
    rows = shaft.admin.get(f"/api/v1/characteristics/{shaft.characteristic}/report.json").json()
    decisions = next(each for each in rows["sections"] if each["key"] == "decisions")["table"]
    names = [column["key"] for column in decisions["columns"]]
    row = dict(zip(names, decisions["rows"][0], strict=True))
    assert (row["size"]["value"], row["measured"]["value"]) == (39.98395, 39.98535)


def test_the_export_has_it_beside_what_was_measured(shaft: Shop) -> None:
    from app.loop.readings import exporting
    from app.loop.readings import queries as readings

    read(shaft, 39.98535)
    with shaft.server.database.begin() as session:
        entry = readings.entry_of(session, shaft.characteristic)
        assert entry is not None
        file = io.StringIO()
        exporting.write_csv(exporting.rows(session, entry), file)
    (row,) = csv.DictReader(io.StringIO(file.getvalue()))
    assert (row["measured"], row["corrected_size"], row["deviation"]) == ("39.98535", "39.98395", "-0.00805")


def test_a_probe_fault_does_not_press_the_chart_over_time_into_a_line(shaft: Shop) -> None:
    for deviation in (2.0, -3.0, 2000.0, 1.0):
        shaft.read(deviation)
    chart = figure(shaft, "run")
    low, high = chart["layout"]["yaxis"]["range"]
    assert high - low < 4 * 0.016
    assert all(low < size < high for size in trace(chart, "run")["y"])
    assert "+2006.6" in trace(chart, "run")["text"][2]
    assert [note["text"] for note in chart["layout"]["annotations"] if "µm" in note["text"]] == ["<b>+2007\xa0µm</b>"]
