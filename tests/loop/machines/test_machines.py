"""Machines over HTTP: setting up, changing, keys, and everything that can be wrong with a request."""

from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.loop.machines.queries import machines
from tests.shop import PARAMETERS, Shop

SERBIAN = "Струг „Морава” бр. 1 – 'А' \"Б\"; DROP TABLE machine;--"


def test_a_machine_comes_with_its_memories(shop: Shop) -> None:
    made = shop.call("POST", "/machines", 201, key="mill-7", name=SERBIAN, control="heidenhain")
    assert {name: made[name] for name in ("key", "name", "control")} == {
        "key": "mill-7",
        "name": SERBIAN,
        "control": "heidenhain",
    }
    assert shop.call("GET", "/machines/mill-7") == made
    with shop.server.database.begin() as session:
        counts = session.execute(
            text(
                "SELECT (SELECT array_agg(number ORDER BY number) FROM tool t WHERE t.machine_id = m.id),"
                " (SELECT array_agg(location ORDER BY location) FROM average_memory a WHERE a.machine_id = m.id),"
                " (SELECT last_correction FROM machine_state s WHERE s.machine_id = m.id)"
                " FROM machine m WHERE key = 'mill-7'"
            )
        ).one()
    assert tuple(counts) == (list(range(1, 33)), list(range(1, 21)), 0)


def test_a_taken_key_is_a_conflict(shop: Shop) -> None:
    problem = shop.call("POST", "/machines", 409, key=shop.machine, name="x", control="other")
    assert problem["errors"] == [{"field": "key", "message": "is taken"}]


def test_name_and_control_change_the_key_does_not(shop: Shop) -> None:
    shop.call("POST", "/machines", 201, key="grinder", name="Grinder", control="fanuc")
    changed = shop.call("PATCH", "/machines/grinder", key="grinder", name="Grinder, hall C")
    assert (changed["name"], changed["control"]) == ("Grinder, hall C", "fanuc")
    problem = shop.call("PATCH", "/machines/grinder", 422, key="other-key")
    assert problem["errors"][0]["field"] == "key"
    entries = shop.call("GET", "/audit?subject=machine/grinder")["items"]
    assert [(entry["action"], entry["before"], entry["after"]) for entry in entries] == [
        ("machine changed", {"name": "Grinder"}, {"name": "Grinder, hall C"}),
        ("machine added", None, {"key": "grinder", "name": "Grinder", "control": "fanuc"}),
    ]


def test_lists_go_on_page_by_page(shop: Shop) -> None:
    for number in range(3):
        shop.call("POST", "/machines", 201, key=f"zz-{number}", name="Z", control="other")
    keys: list[str] = []
    page: Any = {"next": "zz"}
    while page["next"] is not None:
        page = shop.call("GET", f"/machines?after={page['next']}&limit=2")
        keys += [item["key"] for item in page["items"]]
    assert keys == ["zz-0", "zz-1", "zz-2"]


@pytest.mark.parametrize("key", ["nowhere", "%00", "Lathe-1", "a" * 65, "%ff%fe", "../etc", "';--"])
def test_what_is_not_there_is_404(shop: Shop, key: str) -> None:
    answer = shop.admin.get(f"/api/v1/machines/{key}")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"


GOOD: dict[str, Any] = {"key": "never-made", "name": "Never made", "control": "other"}
BAD: dict[str, list[Any]] = {
    "key": [None, 1, "", "A", "ä", "a b", "-a", "a" * 65, "a\n", ["a"], {"a": 1}, "a\u0000"],
    "name": [None, 1, "", "   ", "x" * 201, "a\nb", "a\u0000b", "\u0007", [], {}],
    "control": [None, "", "siemens", "SINUMERIK", 840, [], True],
    "colour": ["grey"],
}


@pytest.mark.parametrize(("field", "bad"), [(field, bad) for field, values in BAD.items() for bad in values])
def test_every_bad_field_is_named_and_nothing_is_made(shop: Shop, field: str, bad: Any) -> None:
    problem = shop.call("POST", "/machines", 422, **(GOOD | {field: bad}))
    assert [error["field"] for error in problem["errors"]] == [field]
    shop.call("GET", "/machines/never-made", 404)


@pytest.mark.parametrize("field", GOOD)
def test_a_missing_field_is_named(shop: Shop, field: str) -> None:
    problem = shop.call("POST", "/machines", 422, **{name: value for name, value in GOOD.items() if name != field})
    assert problem["errors"] == [{"field": field, "message": "is missing"}]


class TestKeys:
    def test_the_secret_is_reported_once_and_works_until_revoked(self, shop: Shop) -> None:
        made = shop.call("POST", f"/machines/{shop.machine}/keys", 201, name="cell PC")
        assert set(made) == {"id", "name", "secret", "role"}
        machine = shop.server.client(made["secret"])
        assert machine.get(f"/api/v1/machines/{shop.machine}").status_code == 200
        listed = shop.call("GET", f"/machines/{shop.machine}/keys")["items"]
        assert made["secret"] not in str(listed)
        assert made["id"] in [key["id"] for key in listed if key["revoked_at"] is None]
        for _again in range(2):
            assert shop.admin.delete(f"/api/v1/machines/{shop.machine}/keys/{made['id']}").status_code == 204
        assert machine.get(f"/api/v1/machines/{shop.machine}").status_code == 401, "revoked in this process at once"

    def test_a_key_of_another_machine_cannot_be_revoked_here(self, shop: Shop) -> None:
        other = Shop(shop.server)
        made = shop.call("POST", f"/machines/{other.machine}/keys", 201, name="other")
        shop.call("DELETE", f"/machines/{shop.machine}/keys/{made['id']}", 404)
        assert other.server.client(made["secret"]).get(f"/api/v1/machines/{other.machine}").status_code == 200

    @pytest.mark.parametrize("body", [{}, {"name": ""}, {"name": 3}, {"name": "x", "role": "admin"}])
    def test_bad_requests_make_no_key(self, shop: Shop, body: dict[str, Any]) -> None:
        before = shop.call("GET", f"/machines/{shop.machine}/keys")
        assert shop.admin.post(f"/api/v1/machines/{shop.machine}/keys", json=body).status_code == 422
        assert shop.call("GET", f"/machines/{shop.machine}/keys") == before


def test_a_machine_has_a_type_and_locations_of_its_own(shop: Shop) -> None:
    made = shop.call("POST", "/machines", 201, key="vmc-1", name="VMC", control="fanuc", tool_locations=33)
    assert (made["type"], made["tool_locations"], made["average_locations"]) == ("other", 33, 20)
    changed = shop.call("PATCH", "/machines/vmc-1", type="mill", average_locations=21)
    assert (changed["type"], changed["average_locations"]) == ("mill", 21)
    assert len(shop.call("GET", "/machines/vmc-1/tools")["items"]) == 33
    assert len(shop.call("GET", "/machines/vmc-1/averages")["items"]) == 21
    shop.call("GET", "/machines/vmc-1/tools/34", 404)
    parameters = PARAMETERS | {"tool_memory": 33, "average_memory": 21}
    body: dict[str, Any] = {"key": "far-tool", "name": "x", "machine": "vmc-1", "parameters": parameters}
    warnings = shop.call("POST", "/characteristics", 201, **body)["warnings"]
    assert [(each["code"], each["field"]) for each in warnings] == [
        ("source_range", "parameters.tool_memory"),
        ("source_range", "parameters.average_memory"),
    ]
    answer = shop.call("POST", "/readings", 201, characteristic="far-tool", measured=40.007)
    assert answer["correction"]["tool_memory"] == 33
    shop.call("POST", "/corrections/vmc-1/1/applied")
    assert shop.call("GET", "/machines/vmc-1/tools/33")["offset"] == -0.007
    shop.call("PATCH", "/machines/vmc-1", tool_locations=40)
    problem = shop.call("PATCH", "/machines/vmc-1", 422, tool_locations=32, average_locations=20)
    assert [each["field"] for each in problem["errors"]] == ["tool_locations", "average_locations"]
    assert shop.call("PATCH", "/machines/vmc-1", tool_locations=33)["tool_locations"] == 33


def test_a_location_that_the_machine_does_not_have_is_refused(shop: Shop) -> None:
    body: dict[str, Any] = {"key": "no-tool", "name": "x", "machine": shop.machine}
    problem = shop.call("POST", "/characteristics", 422, **body, parameters=PARAMETERS | {"tool_memory": 33})
    assert "it has 32" in problem["errors"][0]["message"]
    shop.call("PATCH", f"/machines/{shop.machine}", tool_locations=48)
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters={"R10": 48}, reason="turret with 48")
    assert shop.read(7)["correction"]["tool_memory"] == 48
    shop.call("PATCH", f"/machines/{shop.machine}", 422, type="robot", tool_locations=0)


def test_lists_to_choose_from_leave_none_out(session: Session) -> None:
    session.execute(
        text(
            "INSERT INTO machine (key, name, control, type) "
            "SELECT 'lathe-' || n, 'Lathe ' || n, 'sinumerik', 'lathe' FROM generate_series(1, 1200) AS n"
        )
    )
    assert len(machines(session)) == 1200
    assert len(machines(session, limit=25)) == 25
