"""Rules by the baseline in force: what they find is kept once, goes on, and says so when readings are taken out."""

from typing import Any

import pytest
from sqlalchemy import select

from app.loop.tables.characteristics import Characteristic
from app.quality.chart_signals import jobs
from app.quality.chart_signals.tables import Watching
from tests.quality.chart_signals.line import Line
from tests.shop import Person, Shop


def test_by_default_points_beyond_the_limits_are_kept_and_nobody_is_alarmed(shop: Shop) -> None:
    line = Line(shop)
    line.push([0.0, 6.5, 6.5, 0.0, -7.0])
    line.look()
    assert line.runs() == [("individuals", "nelson_1", 62, 63), ("individuals", "nelson_1", 65, 65)]
    assert [each["side"] for each in line.signals()] == ["above", "below"]
    assert line.signals()[0]["points"] == 2
    assert line.alarms("all") == []
    line.look()
    assert len(line.signals()) == 2


def test_a_run_that_goes_on_stays_one_signal_and_grows(shop: Shop) -> None:
    line = Line(shop)
    line.rules(main={"nelson_2": "watch"})
    line.push([0.5] * 9)
    line.look()
    (first,) = line.signals()
    line.push([0.5] * 4)
    line.look()
    (grown,) = line.signals()
    assert (first["id"], first["last_sequence"], first["points"]) == (grown["id"], 69, 9)
    assert (grown["first_sequence"], grown["last_sequence"], grown["points"]) == (61, 73, 13)
    assert grown["last_at"] > first["last_at"]
    line.push([-0.5] * 9)
    line.look()
    assert line.runs() == [("individuals", "nelson_2", 61, 73), ("individuals", "nelson_2", 74, 82)]


EVERY: dict[str, Any] = {
    "main": dict.fromkeys([f"nelson_{n}" for n in range(1, 9)] + ["western_4"], "watch"),
    **{place: {"nelson_1": "watch"} for place in ("scatter", "ewma", "moving_average", "cusum")},
}


def test_looking_often_finds_what_looking_once_finds(shop: Shop) -> None:
    values = [((n * 7919) % 97 - 48) / 7 + (2.0 if n > 60 else 0.0) for n in range(120)]
    often, once = Line(shop, "often"), Line(shop, "once")
    for line in (often, once):
        line.rules(**EVERY)
    for start in range(0, len(values), 7):
        often.push(values[start : start + 7])
        often.look()
    once.push(values)
    once.look()
    assert len(once.runs()) > 20
    assert {chart for chart, *_ in once.runs()} == {"individuals", "moving_range", "ewma", "moving_average", "cusum"}
    assert sorted(often.runs()) == sorted(once.runs())


def test_the_border_of_a_chunk_hides_no_signal(shop: Shop, monkeypatch: pytest.MonkeyPatch) -> None:
    """180 readings in all: chunks that end one before the last of them, with it, one behind it, and three with one left over."""
    values = [((n * 7919) % 97 - 48) / 7 + (2.0 if n > 60 else 0.0) for n in range(120)]
    told = []
    for chunk in (179, 180, 181, 59, 7):
        monkeypatch.setattr(jobs, "CHUNK", chunk)
        line = Line(shop, f"chunk-{chunk}")
        line.rules(**EVERY)
        line.push(values)
        line.look()
        told.append(sorted(line.runs()))
    assert len(told[0]) > 20
    assert all(found == told[0] for found in told)


def test_nothing_is_reported_before_the_baseline_or_the_rule_unless_asked(shop: Shop) -> None:
    line = Line(shop, baseline=False)
    line.push([7.0, 0.0, 0.0])
    line.freeze(1, 60)
    line.look()
    assert line.runs() == []
    line.push([8.0])
    line.look()
    assert line.runs() == [("individuals", "nelson_1", 64, 64)]
    line.rules(main={"nelson_1": "alarm", "nelson_5": "alarm"})
    line.push([5.0, 5.0])
    line.look()
    assert line.runs()[1:] == [("individuals", "nelson_5", 65, 66)]
    line.rules(main={"nelson_1": "alarm", "nelson_5": "alarm"}, look_back=True)
    line.look()
    assert ("individuals", "nelson_1", 61, 61) in line.runs()
    assert ("individuals", "nelson_5", 64, 66) in line.runs()
    assert len(line.runs()) == 3
    assert [alarm["data"]["signals"][0]["first"] for alarm in line.alarms()] == [64]


def test_an_excluded_reading_takes_its_signal_with_it(shop: Shop) -> None:
    line = Line(shop)
    line.rules(main={"nelson_1": "watch", "nelson_2": "watch"})
    line.push([0.5, 0.5, 9.0, *[0.5] * 7, -0.5])
    line.look()
    assert sorted(line.runs("open")) == [("individuals", "nelson_1", 63, 63), ("individuals", "nelson_2", 61, 70)]
    line.exclude(63)
    line.look()
    assert line.runs("withdrawn") == [("individuals", "nelson_1", 63, 63)]
    (run,) = line.signals("open")
    assert (run["points"], run["excluded"], run["first_sequence"], run["last_sequence"]) == (9, 1, 61, 70)
    line.exclude(64)
    line.look()
    assert line.signals("open") == []
    line.push([-7.0])
    line.look()
    assert line.runs("open") == [("individuals", "nelson_1", 72, 72)]


def test_another_baseline_judges_from_then_on_and_what_was_found_stays(shop: Shop) -> None:
    line = Line(shop)
    line.push([7.0])
    line.look()
    line.freeze(1, 40)
    line.push([7.0])
    line.look()
    assert [(each["first_sequence"], each["baseline"]) for each in line.signals()] == [(61, 1), (62, 2)]
    line.shop.call("POST", f"/characteristics/{line.key}/baselines/2/retire", reason="new toolholder")
    line.push([9.0])
    line.look()
    assert len(line.signals()) == 2


def test_rules_that_are_off_find_nothing_and_what_they_found_stays(shop: Shop) -> None:
    line = Line(shop)
    line.push([7.0])
    line.look()
    line.rules(main={})
    line.push([7.0, 7.0])
    line.look()
    assert line.runs() == [("individuals", "nelson_1", 61, 61)]
    line.rules(main={"nelson_1": "watch"})
    line.push([7.0])
    line.look()
    assert line.runs() == [("individuals", "nelson_1", 61, 61), ("individuals", "nelson_1", 64, 64)]


def test_subgroups_are_watched_when_they_are_complete(shop: Shop) -> None:
    line = Line(shop, chart="xbar_r", grouping="consecutive", group_size=3)
    line.rules(main={"nelson_1": "watch"}, scatter={"nelson_1": "watch"})
    line.push([9.0, 9.0])
    line.look()
    assert line.runs() == []
    line.push([9.0, 0.0, 0.0, 30.0, 0.0])
    line.look()
    assert line.runs() == [("xbar", "nelson_1", 61, 66), ("ranges", "nelson_1", 64, 66)]


def test_an_alarm_names_rule_chart_and_run_and_is_raised_once(shop: Shop) -> None:
    line = Line(shop)
    line.rules(main={"nelson_1": "watch", "nelson_2": "alarm"}, cusum={"nelson_1": "alarm"})
    line.push([0.5] * 10)
    line.look()
    (alarm,) = line.alarms()
    assert alarm["text"] == (
        "Nelson 2, Individuals, readings 61 to 70: 10 points in a row on one side of the centre, above."
    )
    assert (alarm["sequence"], alarm["last_sequence"], alarm["count"]) == (61, 70, 1)
    line.push([0.5, 0.5, -0.5] + [0.5] * 9 + [9.0] * 3)
    line.look()
    (again,) = line.alarms()
    assert again["id"] == alarm["id"]
    assert again["count"] == 3
    assert "the last of 2 since" in again["text"]
    assert "CUSUM" in again["text"]
    assert "Nelson 1" not in again["text"]
    assert {each["alarm"] for each in line.signals() if each["rule"] == "nelson_2"} == {alarm["id"]}
    shop.acknowledge(alarm["id"], "noted", comment="New batch of material")
    said = {each["state"] for each in line.signals() if each["alarm"] == alarm["id"]}
    assert said == {"explained"}
    assert {each["comment"] for each in line.signals("explained")} == {"New batch of material"}
    line.push([9.0])
    line.look()
    assert line.alarms() == []
    line.push([-9.0] + [0.5] * 9)
    line.look()
    assert len(line.alarms()) == 1


def test_a_false_reading_behind_a_signal_is_taken_out(shop: Shop) -> None:
    line = Line(shop)
    line.rules(main={"nelson_1": "alarm"})
    line.push([9.0, 0.0])
    line.look()
    (alarm,) = line.alarms()
    done = shop.acknowledge(alarm["id"], "false_reading", comment="Chip on the stylus")
    assert done["outcome"][0]["sequences"] == [61]
    line.look()
    assert [each["state"] for each in line.signals()] == ["withdrawn"]


def test_its_run_is_marked_on_its_chart(shop: Shop, viewer: Person) -> None:
    line = Line(shop)
    line.push([0.0, 9.0, 9.0])
    line.look()
    (signal,) = line.signals("open")
    path = f"/characteristics/{line.key}/figures/control?first=50&through=63&signal={signal['id']}"
    (box,) = [shape for shape in shop.call("GET", path)["layout"]["shapes"] if shape["type"] == "rect"]
    assert (box["x0"], box["x1"]) == (61.5, 63.5)
    shop.call("GET", f"/characteristics/{Line(shop, 'other').key}/figures/control?signal={signal['id']}", 404)
    page = viewer.open(f"/signals/{signal['id']}")
    assert f"signal={signal['id']}" in page


def test_what_a_signal_was_is_said_by_an_engineer_and_kept(shop: Shop) -> None:
    line = Line(shop)
    line.push([9.0])
    line.look()
    (signal,) = line.signals("open")
    assert shop.call("GET", f"/signals/{signal['id']}") == signal
    path = f"/signals/{signal['id']}/comment"
    operator = shop.server.client(shop.server.key("operator"))
    shop.call("POST", path, 403, operator, cause="material", comment="New batch")
    shop.call("POST", path, 200, cause="material", comment="New batch")
    said = shop.call("POST", path, 200, cause="probe", comment="A chip after all")
    assert (said["state"], said["cause"], said["comment"]) == ("explained", "probe", "A chip after all")
    assert line.signals("open") == []
    record = shop.call("GET", f"/audit?subject=signal/{signal['id']}")["items"]
    assert {entry["why"] for entry in record} == {"New batch", "A chip after all"}


def test_a_look_that_finds_nothing_new_writes_nothing(shop: Shop) -> None:
    line = Line(shop)
    line.push([0.0])
    line.look()

    def noted() -> list[Any]:
        with shop.server.database.begin() as session:
            rows = session.scalars(select(Watching).join(Characteristic).where(Characteristic.key == line.key))
            return [(row.characteristic_id, row.looked, row.at) for row in rows]

    before = noted()
    line.look()
    assert noted() == before


def test_pages_of_signals_go_on_where_the_one_before_ended(shop: Shop) -> None:
    line = Line(shop)
    line.push([9.0, 0.0] * 5)
    line.look()
    path = f"/signals?characteristic={line.key}&limit=2"
    seen, page = [], shop.call("GET", path)
    while True:
        seen += [each["first_sequence"] for each in page["items"]]
        if page["next"] is None:
            break
        page = shop.call("GET", f"{path}&before={page['next']}")
    assert seen == [69, 67, 65, 63, 61]
    assert [each["id"] for each in shop.call("GET", f"/signals?machine={shop.machine}&limit=1000")["items"]] == [
        each["id"] for each in reversed(line.signals())
    ]
    shop.call("GET", "/signals?characteristic=nothing-here", 404)
    shop.call("GET", "/signals/999999999", 404)


@pytest.mark.parametrize("chunk", [1, 13, 60, 61])
def test_what_is_read_in_chunks_finds_the_same_at_their_borders(
    shop: Shop, monkeypatch: pytest.MonkeyPatch, chunk: int
) -> None:
    values = [((n * 7919) % 97 - 48) / 7 + (2.0 if n > 30 else 0.0) for n in range(61)]
    whole, pieces = Line(shop, "whole"), Line(shop, "pieces")
    for line in (whole, pieces):
        line.rules(**EVERY)
    whole.push(values)
    whole.look()
    pieces.push(values)
    monkeypatch.setattr(jobs, "CHUNK", chunk)
    pieces.look()
    assert len(whole.runs()) > 10
    assert sorted(pieces.runs()) == sorted(whole.runs())
