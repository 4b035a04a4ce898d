"""Compared series: over the API and on the page."""

import re
from datetime import UTC, datetime, timedelta
from html import unescape
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

import pytest

from app.language.times import in_zone
from app.views.compare.series import begin_before
from tests.shop import Person, Shop

BERLIN = ZoneInfo("Europe/Berlin")


@pytest.fixture(scope="module")
def compared(common_shop: Shop) -> Shop:
    """Two characteristics; of the first three readings by version 1, a tool change, and two by version 2."""
    shop = common_shop
    shop.add(f"{shop.characteristic}-b", target=20.0, tolerance_width=0.032)
    shop.push([1.0, 2.0, 3.0])
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0, reason="new insert")
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters={"R33": 0.002}, reason="quieter probe")
    shop.push([-1.0, -2.0])
    shop.call("POST", "/readings", 201, characteristic=f"{shop.characteristic}-b", measured=20.008)
    return shop


def series(shop: Shop, query: str) -> list[list[float]]:
    figure = shop.call("GET", f"/compare/figure?{query}")
    return [[round(y, 3) for y in trace["y"]] for trace in figure["data"] if trace.get("meta") == "readings"]


def words(shop: Shop, query: str) -> set[str]:
    return {note["text"] for note in shop.call("GET", f"/compare/figure?{query}")["layout"]["annotations"]}


def test_characteristics_versions_tools_and_periods(compared: Shop) -> None:
    one, two = compared.characteristic, f"{compared.characteristic}-b"
    assert series(compared, f"of={one}&of={two}") == [[1, 2, 3, -1, -2], [8]]
    assert series(compared, f"of={one}&of={two}&of_tolerance=true")[1] == [50], "of half the tolerance, 16 µm"
    assert series(compared, f"of={one}&by=version") == [[1, 2, 3], [-1, -2]]
    assert series(compared, f"of={one}&by=tool") == [[1, 2, 3], [-1, -2]]
    assert series(compared, f"of={one}&by=period&last=2") == [[2, 3], [-1, -2]]
    figure = compared.call("GET", f"/compare/figure?of={one}&of={two}")["layout"]
    assert figure["yaxis"]["range"] == figure["yaxis2"]["range"], "one scale"
    assert words(compared, f"of={one}&of={two}") >= {"±8\xa0µm", "±16\xa0µm"}
    assert not words(compared, f"of={one}&of={two}&overlaid=true") & {"±8\xa0µm", "tolerance"}, "no limit of all"
    assert "tolerance" in words(compared, f"of={one}&of={two}&overlaid=true&of_tolerance=true")
    compared.call("GET", "/compare/figure?of=nobody", 404)
    compared.call("GET", f"/compare/figure?of={one}&by=size", 422)


def test_the_period_before_is_as_long_by_the_clock(viewer: Person, compared: Shop) -> None:
    def at(day: int) -> datetime:
        return datetime(2026, 10, day, tzinfo=BERLIN).astimezone(UTC)

    with in_zone(BERLIN):  # the clocks go back on the 25th
        assert begin_before(at(25), at(26)) == at(24)
        assert begin_before(at(26), at(27)) == at(25)
    key = compared.another("by-the-clock")
    begin = datetime(2026, 6, 2, 6, tzinfo=UTC)
    for deviation, moment in ((1.0, begin - timedelta(hours=3)), (2.0, begin), (3.0, begin + timedelta(hours=3))):
        compared.read(deviation, key, measured_at=moment.isoformat())
    until = begin + timedelta(hours=6)
    assert series(compared, urlencode({"of": key, "by": "period", "from": begin, "to": until})) == [[1], [2, 3]]
    viewer.open(f"/compare?of={key}&by=period&from=0001-01-01T00:00&to=9999-12-31T23:59")
    viewer.open(f"/compare?of={key}&by=period&from=0002-01-01T00:00")


def test_the_statistics_of_each_stand_below(viewer: Person, compared: Shop) -> None:
    text = unescape(viewer.open(f"/compare?of={compared.characteristic}&by=version"))
    assert f"Seat {compared.characteristic}, version 1" in text
    assert f"characteristics/{compared.characteristic}?first=4&through=5" in text
    assert "+2.00" in text  # the mean of version 1, µm
    assert "−1.50" in text  # of version 2
    assert "nobody" in viewer.open("/compare?of=nobody", 404)
    assert "Nothing to compare yet" in viewer.open("/compare")


def test_the_pages_own_button_compares_with_nothing_added(viewer: Person, compared: Shop) -> None:
    one = compared.characteristic
    text = unescape(viewer.open(f"/compare?of={one}&of=&by=tool"))
    assert "There is no characteristic" not in text
    assert text.count(f"Seat {one}, tool of ") == 1, "in the table"
    assert text.count("<span>tool of ") == 1, "as a box to tick, under the name of its characteristic"
    problem = viewer.open("/compare?of=nobody", 404)
    assert "Check the key." in problem
    assert "/api/v1/characteristics" not in problem.split("<footer")[0], "no page tells a person to call the API"


def test_tools_are_chosen_and_cut_where_their_readings_arrived(compared: Shop, viewer: Person) -> None:
    """The parts were measured three weeks ago; the tools were changed as the readings came in."""
    key = compared.another("by-tool")
    begin = datetime(2026, 11, 2, 6, tzinfo=UTC)
    tool = f"/machines/{compared.machine}/tools/3"
    changes = [compared.call("GET", f"{tool}/lives")["lives"][0]["began_at"]]
    for life in range(3):
        moments = [(begin + timedelta(days=life, hours=hour)).isoformat() for hour in range(2)]
        compared.push([life + 1.0, life + 1.5], key, measured_at=moments)
        if life < 2:
            compared.call("POST", f"{tool}/change", offset=0, reason="new insert")
            changes.append(compared.call("GET", f"{tool}/lives")["lives"][0]["began_at"])
    assert series(compared, f"of={key}&by=tool") == [[1, 1.5], [2, 2.5], [3, 3.5]]
    assert series(compared, urlencode({"of": key, "by": "tool", "tool": changes[1]})) == [[2, 2.5]]
    page = unescape(viewer.open("/compare?" + urlencode({"of": key, "by": "tool", "tool": changes[2]})))
    boxes = re.findall(r'<input type="checkbox" name="tool" value="([^"]+)"( checked)?>', page)
    assert [(datetime.fromisoformat(at), bool(checked)) for at, checked in boxes] == [
        (datetime.fromisoformat(at), at == changes[2]) for at in reversed(changes)
    ]
    first = {"of": compared.characteristic, "by": "tool", "tool": "1900-01-01T00:00:00Z"}
    assert series(compared, urlencode(first)) == [[1, 2, 3]]


def test_a_tool_that_was_never_changed_is_named_so(compared: Shop, viewer: Person) -> None:
    key = compared.another("unchanged", tool_memory=31)
    compared.push([1.0, 2.0], key)
    assert f"Seat {key}, tool since the first reading" in unescape(viewer.open(f"/compare?of={key}&by=tool"))
