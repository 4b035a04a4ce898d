"""Temperatures in and out of files, and the size at 20 °C in the zone chart beside the measured one."""

import csv
import io
from typing import Any

import pytest

from app.loop.readings import exporting, queries
from tests.shop import Shop

STEEL: dict[str, Any] = {"coefficient": 11.5, "reason": "16MnCr5"}
TABLE = "measured;measured_at;Teiltemperatur [°C];machine temperature\n40,001;2026-03-02 06:00;24,5;\n40,002;2026-03-02 06:01;;22\n"


def test_columns_of_a_table_are_circumstances(shop: Shop) -> None:
    key = shop.characteristic
    about: dict[str, Any] = {"name": "a.csv", "content": TABLE, "characteristic": key, "timezone": "UTC"}
    done = shop.call("POST", "/readings/table", **about)
    assert (done["stored"], done["ignored"]) == (2, [])
    contexts = [shop.call("GET", f"/readings/{key}/{number}")["context"] for number in (1, 2)]
    stated = [{name: value for name, value in each.items() if value is not None} for each in contexts]
    assert stated == [{"part_temperature": 24.5}, {"machine_temperature": 22.0}]
    wrong = about | {"content": TABLE.replace("24,5", "warm")}
    assert "Teiltemperatur" in str(shop.call("POST", "/readings/table", 422, **wrong))


@pytest.mark.parametrize("scale", ["[°F]", "(K)", "_F"])
def test_a_column_in_another_scale_is_never_taken_for_degrees_celsius(shop: Shop, scale: str) -> None:
    column = TABLE.replace(" [°C]", f" {scale}".replace(" _", "_"))
    about: dict[str, Any] = {"name": "a.csv", "content": column, "characteristic": shop.characteristic}
    done = shop.call("POST", "/readings/table", **about)
    assert (done["stored"], len(done["ignored"])) == (2, 1)
    assert (shop.call("GET", f"/readings/{shop.characteristic}/1")["context"] or {}).get("part_temperature") is None
    name = column.partition("\n")[0].split(";")[2]
    wrong = shop.call("POST", "/readings/table", 422, **about, map={"part_temperature": name})
    assert "another scale" in str(wrong)


def test_exports_have_both_sizes(shop: Shop) -> None:
    shop.call("PUT", f"/characteristics/{shop.characteristic}/expansion", **STEEL)
    shop.read(1.0, context={"part_temperature": 24.0, "machine_temperature": 22.0})
    shop.read(1.0)
    with shop.server.database.begin() as session:
        entry = queries.entry_of(session, shop.characteristic)
        assert entry is not None
        text, lines = io.StringIO(newline=""), io.StringIO()
        exporting.write_csv(exporting.rows(session, entry), text)
        exporting.write_ndjson(exporting.rows(session, entry), lines)
    first, second = csv.DictReader(text.getvalue().splitlines())
    assert (first["part_temperature"], first["machine_temperature"]) == ("24.0", "22.0")
    assert float(first["corrected_size"]) == 40.001
    assert float(first["size_at_20"]) == pytest.approx(40.001 - 40.001 * 11.5e-6 * 4, abs=1e-6)
    assert (second["part_temperature"], second["size_at_20"]) == ("", "")
    assert ["size_at_20" in line for line in lines.getvalue().splitlines()] == [True, False]


def test_the_zone_chart_has_a_second_series_where_it_is_asked_for(shop: Shop) -> None:
    path = f"/characteristics/{shop.characteristic}/figures/zones"
    shop.push([1.0, 2.0, 3.0], context=[{"part_temperature": 22.0}, {"part_temperature": 900.0}, {"nest": 1}])

    def second(query: str = "") -> list[Any]:
        return [trace for trace in shop.call("GET", path + query)["data"] if trace.get("meta") == "at-20"]

    assert second("?at_20=true") == [], "no coefficient is stated"
    shop.call("PUT", f"/characteristics/{shop.characteristic}/expansion", **STEEL)
    assert second() == []
    (trace,) = second("?at_20=true")
    assert trace["x"] == [1]
