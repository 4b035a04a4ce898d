"""Affected parts of an alarm, set aside, and decided one by one: over REST and on the pages, by role, on record."""

import csv
import io
import re
from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg

from tests.servers import Server
from tests.shop import Person, Shop

BEGAN = datetime(2026, 11, 20, 8, tzinfo=UTC)


def at(minute: float) -> str:
    return (BEGAN + timedelta(minutes=minute)).isoformat()


def cut(shop: Shop, micrometres: float, minute: float, part: str | None = None, **more: Any) -> Any:
    """A part that was measured in this minute."""
    named = {} if part is None else {"part": part}
    return shop.read(micrometres, measured_at=at(minute), **named, **more)


def affected(shop: Shop, alarm: int, query: str = "") -> Any:
    return shop.call("GET", f"/alarms/{alarm}/affected-parts{query}")


def names(found: Any) -> list[Any]:
    return [part["part"] for each in found["stretches"] for part in each["parts"]]


def states(server: Server, number: int) -> list[str]:
    """What live pages heard of a quarantine."""
    with psycopg.connect(server.database.dsn) as connection:
        events = [
            change for (changes,) in connection.execute("SELECT changes FROM event ORDER BY id") for change in changes
        ]
    return [each["state"] for each in events if (each["kind"], each.get("id")) == ("quarantine", number)]


def worn(shop: Shop) -> int:
    """Parts of which one in three is measured; the edge breaks. The alarm."""
    cut(shop, 1.0, 1, "SN-0001")
    cut(shop, 0.5, 4, "SN-0004", context={"order": "A-77"})
    cut(shop, 350.0, 7, "SN-0007", context={"order": "A-77"})
    (alarm,) = shop.alarms()
    return int(alarm["id"])


def test_parts_since_the_last_good_one_are_listed_with_what_they_were_cut_with(shop: Shop) -> None:
    alarm = worn(shop)
    found = affected(shop, alarm)
    (stretch,) = found["stretches"]
    assert names(found) == ["SN-0005", "SN-0006", "SN-0007"]
    assert [part["found"] for part in stretch["parts"]] == ["not_measured", "not_measured", "bad"]
    assert stretch["since"]["part"] == "SN-0004"
    assert stretch["until"] is None
    assert stretch["open"]
    assert not stretch["unnumbered"]
    assert {part["order"] for part in stretch["parts"]} == {"A-77"}
    assert [part["offset"] for part in stretch["parts"]] == [0.0, 0.0, 0.0]
    assert found["count"] == 3
    assert found["quarantine"] is None

    cut(shop, 0.0, 2.5, "SN-0002")  # late, and cut before the last good one: nothing changes
    assert names(affected(shop, alarm)) == ["SN-0005", "SN-0006", "SN-0007"]
    cut(shop, 0.0, 5, "SN-0005")  # late, and cut after it: the list begins later
    assert names(affected(shop, alarm)) == ["SN-0006", "SN-0007"]
    shop.acknowledge(alarm, "tool_replaced", offset=0.0)
    cut(shop, 9.0, 9, "SN-0009")  # another edge; nobody knows which has cut the eighth
    found = affected(shop, alarm)
    assert names(found) == ["SN-0006", "SN-0007", "SN-0008"]
    assert [part["offset"] for part in found["stretches"][0]["parts"]] == [0.0, 0.0, None]
    assert not found["stretches"][0]["open"]


def test_parts_without_a_reading_at_a_tool_change_are_listed_and_no_later_ones(shop: Shop) -> None:
    """One in five is measured here, every part of another characteristic; the worn edge is changed between two readings."""
    other = shop.another("length", tool_memory=7)

    def others(*parts: int) -> None:
        for part in parts:
            cut(shop, 0.0, part, f"X-{part}", characteristic=other)

    cut(shop, 0.0, 5, "A-5")
    cut(shop, 350.0, 10, "A-10")
    (alarm,) = shop.alarms()
    shop.acknowledge(alarm["id"], "tool_replaced", offset=0.0)
    others(11, 13)
    cut(shop, 40.0, 15, "A-15")  # the new edge is set wrong
    others(17)
    cut(shop, 0.0, 20, "A-20")
    others(21, 22)
    assert set(names(affected(shop, alarm["id"]))) == {*(f"A-{part}" for part in range(6, 15)), "X-11", "X-13"}
    (oversize,) = (each for each in shop.alarms() if each["kind"] == "oversize")
    wrong = {*(f"A-{part}" for part in range(11, 20)), "X-11", "X-13", "X-17"}
    assert set(names(affected(shop, oversize["id"]))) == wrong


def test_offset_and_a_correction_that_came_too_late_are_said_of_each_part(shop: Shop) -> None:
    """Corrected by -6 µm, which is confirmed only after the bad part: it was cut without it."""
    cut(shop, 0.0, 1, "P1")
    number = cut(shop, 6.0, 2, "P2")["correction"]["number"]
    cut(shop, 14.0, 3, "P3", correction_in_effect=0)
    shop.correction(number, "applied")
    cut(shop, 12.0, 4, "P4")
    (alarm,) = shop.alarms()
    third, fourth = affected(shop, alarm["id"])["stretches"][0]["parts"]
    assert (third["offset"], third["cut_without"]) == (0.0, [number])
    page = Person(shop.server, "viewer").open(f"/alarms/{alarm['id']}/affected")
    assert "Cut without correction: numbers of the corrections that were issued before the part was cut" in page
    assert (fourth["offset"], fourth["cut_without"][:1]) == (-0.006, [third_correction(shop, 3)])


def third_correction(shop: Shop, sequence: int) -> Any:
    """The correction that a reading asked for."""
    return shop.call("GET", f"/readings/{shop.characteristic}/{sequence}")["correction"]["number"]


def test_probe_fault_found_late_believes_only_the_hand(shop: Shop) -> None:
    for number in range(1, 6):
        cut(shop, 0.2, number, f"P{number}")
    shop.call("POST", f"/readings/{shop.characteristic}/2/by-hand", 201, measured=40.0005, comment="micrometer")
    cut(shop, 1500.0, 6, "P6")
    (alarm,) = shop.alarms()
    assert names(affected(shop, alarm["id"])) == ["P6"]
    assert names(affected(shop, alarm["id"], "?by_hand_only=true")) == ["P3", "P4", "P5", "P6"]
    cut(shop, 0.0, 7, "P7")  # while the fault is not looked at the probe proves nothing
    assert names(affected(shop, alarm["id"])) == ["P6", "P7"]


def test_guard_narrows_what_is_certainly_good(shop: Shop) -> None:
    cut(shop, 0.0, 1, "P1")
    cut(shop, 7.5, 2, "P2")
    cut(shop, 30.0, 3, "P3")
    (alarm,) = shop.alarms()
    assert names(affected(shop, alarm["id"])) == ["P3"]
    assert names(affected(shop, alarm["id"], "?guard=0.001")) == ["P2", "P3"]
    shop.call("GET", f"/alarms/{alarm['id']}/affected-parts?guard=-1", 422)


def test_alarm_of_a_tool_concerns_what_was_not_measured_about_its_moment(shop: Shop) -> None:
    """The control reports another offset: parts cut with it that were not measured are affected, of each characteristic."""
    cut(shop, 0.0, 1, "P1")
    number = cut(shop, 6.0, 2, "P2")["correction"]["number"]
    shop.correction(number, "applied", offset_after=0.4)
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "offset_differs"
    cut(shop, 3.0, 5, "P5")
    found = affected(shop, alarm["id"])
    assert names(found) == ["P3", "P4"]
    assert found["stretches"][0]["until"]["part"] == "P5"


def test_parts_are_set_aside_and_decided_one_by_one(shop: Shop, server: Server) -> None:
    alarm = worn(shop)
    operator = server.client(server.key("operator"))
    viewer = server.client(server.key("viewer"))
    asked: dict[str, Any] = {"alarm": alarm, "reason": "Edge broken"}
    shop.call("POST", "/quarantines", 403, client=viewer, **asked)
    made = shop.call("POST", "/quarantines", 201, client=operator, **asked)
    assert [part["part"] for part in made["parts"]] == ["SN-0005", "SN-0006", "SN-0007"]
    assert (made["state"], made["open"]) == ("open", 3)
    assert affected(shop, alarm)["quarantine"] == made["id"]
    assert shop.call("POST", "/quarantines", 200, client=operator, **asked)["open"] == 3  # sent twice

    cut(shop, 20.0, 8, "SN-0008")
    cut(shop, 19.0, 5, "SN-0005")  # measured late, and bad
    more = shop.call("POST", "/quarantines", 200, client=operator, **asked)
    assert [(part["number"], part["part"], part["found"]) for part in more["parts"]] == [
        (1, "SN-0005", "bad"),
        (2, "SN-0006", "not_measured"),
        (3, "SN-0007", "bad"),
        (4, "SN-0008", "bad"),
    ]
    here = f"/quarantines/{made['id']}"
    shop.call("POST", f"{here}/parts/1/release", 403, client=operator, reason="It fits")
    assert shop.call("POST", f"{here}/parts/1/release", reason="Concession")["status"] == "released"
    late = shop.call("POST", f"{here}/parts/1/scrap", 409, client=operator, reason="Bad")
    assert "released" in late["detail"]
    good = shop.call("POST", f"{here}/parts/2/measure", client=operator, measured=40.004, reason="Micrometer")
    assert (good["status"], good["remeasured"]) == ("released", 40.004)
    bad = shop.call("POST", f"{here}/parts/3/measure", client=operator, measured=40.35, reason="Micrometer")
    assert bad["status"] == "scrapped"
    assert shop.call("GET", here)["state"] == "open"
    shop.call("POST", f"{here}/parts/4/scrap", client=operator, reason="Out of tolerance")
    assert states(server, made["id"])[-2:] == ["open", "closed"], "live pages hear of the last decision"
    assert (shop.call("GET", here)["state"], shop.call("GET", here)["scrapped"]) == ("closed", 2)
    assert shop.call("GET", f"/quarantines?state=open&machine={shop.machine}")["items"] == []
    assert len(shop.call("GET", f"/quarantines?machine={shop.machine}")["items"]) == 1
    shop.call("POST", f"{here}/parts/5/scrap", 404, reason="Bad")
    entries = shop.call("GET", f"/audit?subject=quarantine/{made['id']}/2")["items"]
    assert entries[0]["why"] == "Micrometer"


def test_a_part_that_is_decided_stays_as_it_was_decided(shop: Shop) -> None:
    asked: dict[str, Any] = {"alarm": worn(shop), "reason": "Edge broken"}
    here = f"/quarantines/{shop.call('POST', '/quarantines', 201, **asked)['id']}"
    shop.call("POST", f"{here}/parts/2/scrap", reason="Looks bad")
    cut(shop, 19.0, 6, "SN-0006")
    again = shop.call("POST", "/quarantines", 200, **asked)
    assert [(part["part"], part["found"], part["status"]) for part in again["parts"]] == [
        ("SN-0005", "not_measured", "open"),
        ("SN-0006", "not_measured", "scrapped"),
        ("SN-0007", "bad", "open"),
    ]


def test_quarantine_is_handed_on_as_a_file(shop: Shop) -> None:
    alarm = worn(shop)
    made = shop.call("POST", "/quarantines", 201, alarm=alarm, reason="=1+1", guard=0.001)
    file = f"/api/v1/quarantines/{made['id']}/file"
    answer = shop.admin.get(file)
    rows = list(csv.DictReader(io.StringIO(answer.content.decode("utf-8-sig"))))
    assert [row["part"] for row in rows] == ["SN-0005", "SN-0006", "SN-0007"]
    assert (rows[2]["measured"], rows[2]["offset"], rows[2]["order"]) == ("40.35", "0.0", "A-77")
    for form, magic in (("xlsx", b"PK"), ("pdf", b"%PDF")):
        assert shop.admin.get(f"{file}?format={form}").content.startswith(magic)
    measure = f"/quarantines/{made['id']}/parts/1/measure"
    shop.call("POST", measure, 422, measured=40.0075, reason="Micrometer")  # within the uncertainty of the limit
    for other_unit in (1.5748, 40_000.5):  # a good part would be scrap for ever
        assert "mm" in shop.call("POST", measure, 422, measured=other_unit, reason="Micrometer")["detail"]
    report = shop.call("GET", f"/characteristics/{shop.characteristic}/report.json?section=quarantine&last=all")
    assert "SN-0006" in str(report)


def test_pages_lead_from_the_alarm_to_each_part(shop: Shop, server: Server) -> None:
    alarm = worn(shop)
    operator = Person(server, "operator")
    assert f"/alarms/{alarm}/affected" in operator.open(f"/alarms/{alarm}")
    shown = operator.open(f"/alarms/{alarm}/affected")
    assert "SN-0006" in shown
    assert "SN-0004" in shown
    assert f'href="/alarms/{alarm}/affected"' not in shown, "a page does not lead to itself"
    wrong = operator.send(f"/alarms/{alarm}/affected", 422, guard="x", reason="Edge broken")
    assert "SN-0006" in wrong
    made = operator.post(f"/alarms/{alarm}/affected", guard="0,5", reason="Edge broken").headers["location"]
    page = operator.open(made)
    number = re.search(r"/quarantines/(\d+)", made)
    assert number
    assert "SN-0006" in page
    assert "parts/1/measure" in page
    assert "parts/1/release" not in page
    here = f"/quarantines/{number[1]}"
    assert here in operator.open("/todo")
    assert here in operator.open(f"/quarantines?machine={shop.machine}")
    assert "SN-0005" in operator.open(f"{here}/parts/1/measure")
    operator.post(f"{here}/parts/1/measure", measured="40,001", reason="Micrometer")
    refused = operator.send(f"{here}/parts/2/measure", 422, measured="", reason="Micrometer")
    assert "SN-0006" in refused
    operator.post(f"{here}/parts/2/scrap", reason="Out of tolerance")
    assert (
        "late=2" in operator.post(f"{here}/parts/2/measure", measured="40.0", reason="Micrometer").headers["location"]
    )
    page = operator.open(here)
    assert "40.0010" in page
    assert "Out of tolerance" in page
    viewer = Person(server, "viewer")
    assert "parts/3/scrap" not in viewer.open(here)
    viewer.post(f"{here}/parts/3/scrap", 403, reason="Out of tolerance")
