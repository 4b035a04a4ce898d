"""Offsets that a machine reports without confirming a correction, and the mapping that a confirmation names."""

from typing import Any

from tests.shop import Person, Shop


def report(shop: Shop, offset: float, status: int = 200, tool: int = 3) -> Any:
    path = f"/machines/{shop.machine}/tools/{tool}/reported"
    return shop.call("POST", path, status, client=shop.machine_client, offset=offset)


def pending(shop: Shop, micrometres: float = 20.0) -> int:
    return int(shop.read(micrometres)["correction"]["number"])


def questions(shop: Shop) -> list[Any]:
    """The active alarms that ask for the true offset."""
    return [alarm for alarm in shop.alarms() if alarm["kind"] == "offset_differs"]


def test_the_known_offset_changes_nothing(shop: Shop) -> None:
    answer = report(shop, 0.0004)
    assert (answer["differs"], answer["explained_by"], answer["paused_by"]) == (False, [], None)
    assert shop.tool()["offset"] == 0
    assert questions(shop) == []


def test_another_offset_pauses_the_tool_until_a_person_answers(shop: Shop) -> None:
    number = pending(shop)
    answer = report(shop, 0.05)
    assert (answer["differs"], answer["superseded"], answer["offset"]) == (True, [number], 0.05)
    (alarm,) = questions(shop)
    assert alarm["id"] == answer["paused_by"]
    assert alarm["text"].startswith("The machine holds 0.0500")
    assert shop.correction(number)["status"] == "superseded"
    assert shop.read(20)["reason"]["code"] == "paused"
    again = report(shop, 0.05)
    assert (again["differs"], again["paused_by"]) == (False, alarm["id"])
    report(shop, 0.06)
    (asked,) = questions(shop)
    assert (asked["count"], asked["data"]["expected"], asked["data"]["reported"]) == (2, 0, 0.06)
    shop.acknowledge(alarm["id"], "offset_set", offset=0.06, changed_by="Ana")
    assert (shop.tool()["offset"], shop.tool()["paused_by"]) == (0.06, None)


def test_an_edit_that_hits_a_pending_offset_is_seen_by_who_knows_better(shop: Shop) -> None:
    number = pending(shop, 20)
    offset = shop.correction(number)["offset_expected"]
    path = f"/machines/{shop.machine}/tools/3/reported"
    answer = shop.call("POST", path, client=shop.machine_client, offset=offset, none_applied=True)
    assert (answer["differs"], answer["superseded"]) == (True, [number])


def test_of_an_offset_that_was_only_assumed_nobody_is_asked_who_changed_it(shop: Shop) -> None:
    report(shop, 0.05)
    assert "No offset of this tool was entered before, and 0 was assumed" in questions(shop)[0]["text"]
    report(shop, 0.06)
    assert "was assumed" in questions(shop)[0]["text"], "still the first question"
    shop.acknowledge(questions(shop)[0]["id"], "offset_set", offset=0.06, changed_by="Ana")
    report(shop, 0.07)
    assert "Who changed it at the control" in questions(shop)[0]["text"]


def test_nor_with_the_first_correction(shop: Shop) -> None:
    shop.correction(pending(shop), "applied", offset_after=-0.1061)
    (asked,) = questions(shop)
    assert "was assumed" in asked["text"]
    assert shop.tool()["paused_by"] == asked["id"]
    shop.acknowledge(asked["id"], "offset_set", offset=-0.1061, changed_by="Ana")
    shop.correction(pending(shop), "applied", offset_after=0.5)
    assert "Who changed it at the control" in questions(shop)[0]["text"]


def test_pending_corrections_may_explain_it(shop: Shop) -> None:
    first, second = pending(shop, 20), pending(shop, 50)
    expected = shop.correction(second)["offset_expected"]
    answer = report(shop, expected)
    assert (answer["differs"], answer["explained_by"]) == (False, [first, second])
    assert report(shop, shop.correction(first)["offset_expected"])["explained_by"] == [first]
    assert questions(shop) == []
    assert shop.correction(first)["status"] == "pending"
    shop.correction(first, "applied", offset_after=expected)
    assert shop.correction(second)["status"] == "applied"
    assert report(shop, expected)["explained_by"] == []
    assert questions(shop) == []


def test_the_step_stands_in_the_history_of_the_tool(shop: Shop, server: Any) -> None:
    report(shop, 0.05)
    page = Person(server, "viewer").open(f"/machines/{shop.machine}/tools?tool=3")
    assert "Reported offset" in page


def test_who_may_not_and_what_is_no_offset_are_refused(shop: Shop, server: Any) -> None:
    other = Shop(server)
    path = f"/machines/{other.machine}/tools/3/reported"
    shop.call("POST", path, 403, client=shop.machine_client, offset=0.1)
    assert report(shop, 0.0, 404, tool=33)["detail"]
    assert report(shop, 1e9, 422)["errors"][0]["field"] == "offset"


def test_a_confirmation_names_the_mapping(shop: Shop, server: Any) -> None:
    first, second = pending(shop, 20), pending(shop, 50)
    last = shop.correction(second)["offset_expected"]
    shop.correction(first, "applied", offset_after=last, mapping="77d09a12")
    assert [shop.correction(number)["mapping"] for number in (first, second)] == ["77d09a12"] * 2
    assert shop.correction(first, "applied", mapping="other")["mapping"] == "77d09a12"
    page = Person(server, "viewer").open(f"/machines/{shop.machine}/corrections/{first}")
    assert "77d09a12" in page
    by_reading = pending(shop, 20)
    shop.read(1, correction_in_effect=by_reading)
    assert shop.correction(by_reading)["mapping"] is None
    assert shop.correction(by_reading, "applied", mapping="0815")["mapping"] == "0815"
    assert shop.correction(pending(shop), "applied", 422, mapping="x" * 65)["errors"][0]["field"] == "mapping"
