"""Permissions: every set-up route with every kind of caller."""

import re
from typing import Any

import httpx
import pytest

from tests.servers import Server
from tests.shop import PARAMETERS, Shop

ROLES = ["nobody", "machine", "other machine", "viewer", "operator", "engineer", "admin"]


@pytest.fixture(scope="module")
def callers(server: Server, common_shop: Shop) -> dict[str, httpx.Client]:
    return {
        "nobody": server.client(),
        "machine": common_shop.machine_client,
        "other machine": Shop(server).machine_client,
        **{role: server.client(server.key(role)) for role in ROLES[3:]},
    }


NEW_MACHINE = {"key": "fresh", "name": "Fresh", "control": "none"}
NEW_CHARACTERISTIC = {"key": "fresh", "name": "Fresh", "machine": "nowhere", "parameters": PARAMETERS}
# method, path, body, who may (from this role on), may the machine's own key, status for those who may
ROUTES: list[tuple[str, str, Any, str, bool, int]] = [
    ("GET", "/machines", None, "viewer", True, 200),
    ("GET", "/machines/{machine}", None, "viewer", True, 200),
    ("POST", "/machines", NEW_MACHINE, "engineer", False, 422),
    ("PATCH", "/machines/{machine}", {"name": "Lathe"}, "engineer", False, 200),
    ("GET", "/machines/{machine}/keys", None, "engineer", False, 200),
    ("POST", "/machines/{machine}/keys", {"name": "k"}, "engineer", False, 201),
    ("DELETE", "/machines/{machine}/keys/2000000000", None, "engineer", False, 404),
    ("GET", "/characteristics", None, "viewer", True, 200),
    ("GET", "/characteristics?machine={machine}", None, "viewer", True, 200),
    ("GET", "/characteristics/{characteristic}", None, "viewer", True, 200),
    ("GET", "/characteristics/{characteristic}/parameters", None, "viewer", True, 200),
    ("POST", "/characteristics", NEW_CHARACTERISTIC, "engineer", False, 422),
    ("PATCH", "/characteristics/{characteristic}", {"part": "p"}, "engineer", False, 200),
    ("GET", "/people", None, "admin", False, 200),
    ("GET", "/people/2000000000", None, "admin", False, 404),
    ("PATCH", "/people/2000000000", {"role": "viewer"}, "admin", False, 404),
    ("POST", "/people/invitations", {"role": "viewer"}, "admin", False, 201),
    ("GET", "/keys", None, "admin", False, 200),
    ("POST", "/keys", {"name": "k", "role": "viewer"}, "admin", False, 201),
    ("DELETE", "/keys/2000000000", None, "admin", False, 404),
    ("GET", "/audit", None, "engineer", False, 200),
]


@pytest.mark.parametrize(("method", "path", "body", "role", "own", "status"), ROUTES)
def test_every_caller_gets_what_the_role_may(
    common_shop: Shop,
    callers: dict[str, httpx.Client],
    method: str,
    path: str,
    body: Any,
    role: str,
    own: bool,
    status: int,
) -> None:
    path = path.format(machine=common_shop.machine, characteristic=common_shop.characteristic)
    own_list = own and path in {"/machines", "/characteristics"}  # a machine sees its own part of it
    expected = {"nobody": 401, "machine": status if own else 403, "other machine": status if own_list else 403}
    expected |= {each: status if ROLES.index(each) >= ROLES.index(role) else 403 for each in ROLES[3:]}
    answers = {who: client.request(method, f"/api/v1{path}", json=body) for who, client in callers.items()}
    assert {who: answer.status_code for who, answer in answers.items()} == expected
    for who, answer in answers.items():
        if answer.status_code >= 400:
            assert answer.headers["content-type"] == "application/problem+json", who
            assert answer.json()["what_to_do"], who
        assert ("www-authenticate" in answer.headers) == (answer.status_code == 401), who


def test_a_machine_sees_itself_alone_in_lists(common_shop: Shop, callers: dict[str, httpx.Client]) -> None:
    shop = common_shop
    machines = callers["machine"].get("/api/v1/machines").json()["items"]
    assert [machine["key"] for machine in machines] == [shop.machine]
    characteristics = callers["machine"].get("/api/v1/characteristics").json()["items"]
    assert {characteristic["machine"] for characteristic in characteristics} == {shop.machine}


def test_the_key_of_another_machine_sees_nothing_of_this_one(server: Server, callers: dict[str, httpx.Client]) -> None:
    """Every address that shows something of a machine, as far as there is something: the number of what is asked is right."""
    shop = Shop(server)
    key = shop.another("bore", max_total=0.5, tool_memory=4, average_memory=6)
    number = shop.read(12.0, key)["correction"]["number"]
    shop.call("POST", f"/readings/{key}/1/by-hand", 201, measured=40.01)
    shop.call("POST", f"/machines/{shop.machine}/heartbeat", version="1", state="online", waiting=0)
    note = shop.call("POST", "/notes", 201, text="Chips", machine=shop.machine)["id"]
    known = {"machine": shop.machine, "characteristic": key, "tool": 4, "location": 6, "version": 1, "sequence": 1}
    known |= {"alarm": shop.alarms()[0]["id"], "note": note, "number": number}
    asked = {
        f"{path.format(**known)}{query}"
        for path, methods in shop.admin.get("/api/v1/openapi.json").json()["paths"].items()
        if "get" in methods
        and path.startswith("/api/v1/")
        and "/events" not in path
        and set(re.findall(r"{(\w+)}", path)) <= set(known)
        for query in ("", f"?machine={shop.machine}", f"?characteristic={key}", f"?of={key}", f"?q={key}")
        if not query or "{" not in path
    }
    of_it = re.compile(rf"\b({shop.machine}|{key})\b")
    shown = [path for path in sorted(asked) if of_it.search(path) or of_it.search(shop.admin.get(path).text)]
    shown += [f"/api/v1/alarms/{known['alarm']}", f"/api/v1/notes/{note}"]
    assert len(shown) > 40
    for path in shown:
        answer = callers["other machine"].get(path)
        told = answer.status_code < 400 and (of_it.search(answer.text) or (of_it.search(path) and "?" not in path))
        assert not told, f"{path}: {answer.text}"


@pytest.mark.parametrize(
    "header", ["", "Bearer", "Basic YTpi", "Bearer nothing-we-know", "bearer inband_" + "x" * 5000]
)
def test_unknown_ways_to_sign_in_are_401(server: Server, header: str) -> None:
    answer = server.client().get("/api/v1/machines", headers={"Authorization": header})
    assert answer.status_code == 401
    assert "Bearer" in answer.headers["www-authenticate"]


@pytest.mark.parametrize("path", ["/setup", "/setup/machines/new", "/account", "/setup/people?x=1"])
def test_people_are_asked_to_sign_in_and_brought_back(server: Server, path: str) -> None:
    answer = server.client().get(path)
    assert answer.status_code == 303
    assert answer.headers["location"] == f"/sign-in?next={path.replace('?', '%3F').replace('=', '%3D')}"
