"""Reaction plans over HTTP, at every door of acknowledging; each test keeps to its own characteristic of the shared server."""

import re
from typing import Any

import pytest

from app.loop.alarm_response.reaction_queries import Handled, Reactions
from app.loop.notifications.sending import _of_plans
from app.loop.tables.reactions import ReactionPlan
from tests.servers import Server
from tests.shop import Person, Shop, unique


def entry(shop: Shop, sort: str = "cause") -> tuple[int, str]:
    name = unique("Chip on the stylus")
    return shop.call("POST", "/reactions/catalogue", 201, sort=sort, name=name)["id"], name


def plan(shop: Shop, status: int = 201, **more: Any) -> Any:
    body: dict[str, Any] = {
        "name": "Seat oversize",
        "characteristic": shop.characteristic,
        "steps": [{"text": "Set the part aside."}, {"text": "Measure it with the micrometer."}],
        "reason": "First version",
    }
    return shop.call("POST", "/reactions/plans", status, **body | more)


def alarm(shop: Shop) -> Any:
    shop.read(20.0)
    return shop.alarms()[-1]


def test_what_the_plan_asks_for_is_refused_until_it_is_chosen(shop: Shop) -> None:
    (cause, name), (action, done) = entry(shop), entry(shop, "action")
    made = plan(shop, cause_needed=True, action_needed=True)
    raised = alarm(shop)
    assert raised["reaction_plan"] == {
        "plan": made["id"], "version": 1, "name": "Seat oversize", "cause_needed": True, "action_needed": True,
    }  # fmt: skip
    refused = shop.acknowledge(raised["id"], "noted", 422)
    assert [error["field"] for error in refused["errors"]] == ["cause", "corrective_action"]
    assert "choose one" in refused["errors"][0]["message"]
    assert "/reactions/catalogue" in refused["what_to_do"]
    wrong = shop.acknowledge(raised["id"], "noted", 422, cause=action, corrective_action=10**9)
    assert [error["field"] for error in wrong["errors"]] == ["cause", "corrective_action"]
    assert shop.call("GET", f"/alarms/{raised['id']}")["state"] == "active"
    answer = shop.acknowledge(raised["id"], "noted", cause=cause, corrective_action=action)
    assert answer["cause"] == {"id": cause, "name": name}
    assert answer["corrective_action"] == {"id": action, "name": done}
    audit = shop.call("GET", f"/audit?subject=alarm/{raised['id']}")["items"][0]
    assert (audit["after"]["cause"], audit["after"]["corrective_action"]) == (name, done)


def test_an_alarm_keeps_the_version_that_it_was_handled_with(shop: Shop) -> None:
    made, raised = plan(shop), alarm(shop)
    shop.acknowledge(raised["id"], "noted")
    path = f"/reactions/plans/{made['id']}"
    body = {name: made[name] for name in ("name", "characteristic", "kind", "rule", "receivers")}
    changed = shop.call("PUT", path, **body, steps=[{"text": "Stop the machine."}], reason="Too late before")
    assert (changed["version"], changed["cause_needed"]) == (2, False)
    again = shop.call("PUT", path, **body, steps=[{"text": "Stop the machine."}], reason="Nothing new")
    assert again["version"] == 2, "what is the same makes no version"
    assert shop.call("GET", f"/alarms/{raised['id']}")["reaction_plan"]["version"] == 1
    assert shop.call("GET", f"{path}?version=1")["steps"] == made["steps"]
    gone = shop.call("POST", f"{path}/withdraw", reason="Covered elsewhere")
    assert (gone["version"], gone["ended"], gone["steps"]) == (3, True, changed["steps"])
    shop.call("POST", f"{path}/withdraw", 409, reason="Again")
    assert alarm(shop)["reaction_plan"] is None
    assert [each["version"] for each in shop.call("GET", f"{path}/versions")["items"]] == [3, 2, 1]
    page = Person(shop.server, "viewer").open(f"/alarms/{raised['id']}")
    assert "Set the part aside." in page
    assert "Stop the machine." not in page
    with pytest.raises(Exception, match="is refused: what it says is a fact"), shop.server.database.begin() as session:
        session.get(ReactionPlan, (made["id"], 1)).name = "Another"
        session.flush()


@pytest.mark.parametrize("action", ["tool_replaced", "keep_cutting", "false_reading", "sister_tool", "noted"])
def test_what_follows_from_an_alarm_leaves_its_plan_with_it(shop: Shop, action: str) -> None:
    made = plan(shop)
    shop.call("PATCH", f"/machines/{shop.machine}/tools/3", sister=13)
    shop.read(350.0)  # wear reached: its correction is held
    done = shop.acknowledge(shop.alarms()[0]["id"], action)
    assert (done["state"], done["action"]) == ("acknowledged", action)
    assert (done["reaction_plan"]["plan"], done["reaction_plan"]["version"]) == (made["id"], 1)


def test_a_plan_is_for_what_is_there_and_for_alarms_that_have_none(shop: Shop) -> None:
    plan(shop)
    plan(shop, 409)
    plan(shop, kind="oversize")
    assert plan(shop, 422, kind="nonsense")["errors"][0]["field"] == "kind"
    plan(shop, 404, characteristic="nowhere")
    plan(shop, 404, kind="tool_worn", receivers=[10**9])
    plan(shop, 422, kind="tool_worn", rule="nelson_1")
    assert plan(shop, rule="nelson_1")["kind"] == "signal"
    assert alarm(shop)["reaction_plan"]["name"] == "Seat oversize"
    operator = shop.server.client(shop.server.key("operator"))
    shop.call("POST", "/reactions/plans", 403, operator, name="x", steps=[{"text": "x"}], reason="x")


def test_a_change_of_what_somebody_else_changed_is_refused(shop: Shop) -> None:
    path = f"/api/v1/reactions/plans/{plan(shop)['id']}"
    tag = shop.admin.get(path).headers["ETag"]
    body = {"name": "Seat", "characteristic": shop.characteristic, "steps": [{"text": "Look."}], "reason": "Shorter"}
    assert shop.admin.put(path, json=body, headers={"If-Match": tag}).status_code == 200
    assert shop.admin.put(path, json=body | {"name": "x"}, headers={"If-Match": tag}).status_code == 412


def test_an_entry_is_retired_and_its_name_stays(shop: Shop) -> None:
    number, name = entry(shop)
    shop.call("POST", "/reactions/catalogue", 409, sort="cause", name=name.upper())
    shop.call("POST", "/reactions/catalogue", 201, sort="action", name=name)
    raised = alarm(shop)
    shop.acknowledge(raised["id"], "noted", cause=number)
    assert shop.call("PATCH", f"/reactions/catalogue/{number}", retired=True)["retired_at"]
    assert shop.call("GET", f"/alarms/{raised['id']}")["cause"]["name"] == name
    shop.acknowledge(alarm(shop)["id"], "noted", 422, cause=number)


def test_nothing_is_asked_for_that_nobody_can_answer() -> None:
    reactions = Reactions(None)  # type: ignore[arg-type]
    reactions.__dict__["_entries"] = {}
    asks = ReactionPlan(cause_needed=True, action_needed=False)
    assert not reactions.needs(asks, "cause")
    assert Handled() == (None, None)


def test_causes_are_counted_with_their_times(shop: Shop) -> None:
    (cause, name), raised = entry(shop), alarm(shop)
    shop.acknowledge(raised["id"], "noted", cause=cause)
    path = f"/reactions/causes?characteristic={shop.characteristic}"
    (share,) = shop.call("GET", path)["causes"]
    assert (share["cause"], share["name"], share["alarms"], share["sum"]) == (cause, name, 1, 1.0)
    assert share["acknowledged"] >= 0
    assert (share["recovered"], share["recovering"]) == (None, 0), "no reading since"
    shop.read(0.0)
    (share,) = shop.call("GET", path)["causes"]
    assert share["recovering"] == 1
    assert share["recovered"] >= share["acknowledged"]
    report = shop.admin.get(f"/api/v1/characteristics/{shop.characteristic}/report.json?section=causes").json()
    assert name in str(report), report
    text = Person(shop.server, "viewer").open(f"/alarms/causes?machine={shop.machine}")
    assert name in text


def test_an_alarm_that_the_machine_ends_is_none_without_a_cause(shop: Shop) -> None:
    path, where = f"/machines/{shop.machine}/faults", f"/reactions/causes?machine={shop.machine}"
    shop.call("POST", path, 201, client=shop.machine_client, kind="battery_low")
    shop.call("POST", path, client=shop.machine_client, kind="battery_low", active=False)
    [ended] = shop.alarms("acknowledged")
    assert ended["acknowledged_by"] != "inband"
    assert shop.call("GET", where)["causes"] == []
    shop.call("POST", path, 201, client=shop.machine_client, kind="battery_low")
    shop.acknowledge(shop.alarms()[-1]["id"], "noted")
    assert [share["alarms"] for share in shop.call("GET", where)["causes"]] == [1], "a person answered this one"


def test_those_whom_a_plan_names_are_notified_of_its_alarms_alone(shop: Shop) -> None:
    receiver = shop.call(
        "POST", "/notifications/receivers", 201, name=unique("Anna"), means="mail", address="anna@example.com"
    )["id"]
    plan(shop, kind="oversize", receivers=[receiver])
    shop.call("DELETE", f"/notifications/receivers/{receiver}", 409)
    raised = alarm(shop)
    shop.read(-20.0)
    with shop.server.database.begin() as session:
        (route,) = [route for route in _of_plans(session) if route.steps[0].receivers == (receiver,)]
    assert route.only == frozenset({raised["id"]}), "undersize has no such plan"


def test_engineers_write_plans_and_operators_follow_them_at_the_pages(server: Server, shop: Shop) -> None:
    engineer, operator = Person(server, "engineer"), Person(server, "operator")
    name = unique("Insert chipped")
    engineer.send("/setup/reactions/catalogue", sort="cause", name=name)
    assert "already" in engineer.send("/setup/reactions/catalogue", 409, sort="cause", name=name)
    cause = next(each for each in shop.call("GET", "/reactions/catalogue?limit=1000")["items"] if each["name"] == name)
    text = engineer.send("/setup/reactions/new", 422, name="Seat", characteristic=shop.characteristic, reason="New")
    assert "steps" in text or "at least" in text.lower()
    title = unique("Seat")
    fields: dict[str, Any] = {
        "name": title,
        "characteristic": shop.characteristic,
        "cause_needed": "true",
        "reason": "New",
    }
    fields |= {"step-1": "Look at the edge.", "step-4": "Wipe it."}
    assert title in engineer.send("/setup/reactions/new", **fields)
    made = next(each for each in shop.call("GET", "/reactions/plans?limit=1000")["items"] if each["name"] == title)
    assert [step["text"] for step in made["steps"]] == ["Look at the edge.", "Wipe it."]
    form = engineer.open(f"/setup/reactions/{made['id']}")
    assert re.search(r'name="cause_needed" value="true" checked', form)
    raised = alarm(shop)
    path = f"/alarms/{raised['id']}"
    page = operator.open(path)
    assert page.index("Look at the edge.") < page.index("alarm-text"), "the steps come first"
    assert "Look at the edge." in operator.open(f"/station/{shop.machine}")
    assert name in operator.open(f"{path}?action=noted")
    assert "asks for a cause" in operator.send(f"{path}/acknowledge", 422, action="noted", comment="Seen")
    at_station = f"/station/{shop.machine}{path}"
    assert "asks for a cause" in operator.send(at_station, 422, action="noted", comment="Seen")
    operator.send(at_station, action="noted", comment="Seen", cause=str(cause["id"]))
    assert name in operator.open(path)
    engineer.send(f"/setup/reactions/{made['id']}", do="withdraw", **fields)
    assert shop.call("GET", f"/reactions/plans/{made['id']}")["ended"]
    engineer.send(f"/setup/reactions/catalogue/{cause['id']}", retired="true")
    assert "not offered any more" in engineer.open("/setup/reactions")
