"""ETag and If-Match: two people edit one thing, and the second hears of the first."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest

from tests.shop import Person, Shop
from tests.web.api_operations import operations
from tests.web.good_bodies import BODIES


def tag(shop: Shop, path: str) -> str:
    answer = shop.admin.get(f"/api/v1{path}")
    assert answer.status_code == 200, answer.text
    return answer.headers["ETag"]


def edit(shop: Shop, method: str, path: str, body: dict[str, Any], if_match: str | None = None) -> httpx.Response:
    headers = {} if if_match is None else {"If-Match": if_match}
    return shop.admin.request(method, f"/api/v1{path}", json=body, headers=headers)


Edit = tuple[str, dict[str, Any]]
WHY = {"reason": "tried"}


def _fixture(shop: Shop, n: int) -> Edit:
    if n == 1:
        shop.call(
            "POST", "/work-zeros", 201, **BODIES["POST /api/v1/work-zeros"] | {"machine": shop.machine, "key": None}
        )
    return f"/work-zeros/fixtures/{shop.machine}/vice", {"basis": "first", "warning": 0.01 * n} | WHY


def _study(shop: Shop, n: int) -> Edit:
    body = {
        name: value for name, value in BODIES["PUT /api/v1/gauge-studies/{study}"].items() if name != "seen_revision"
    }
    if n == 1:
        made = {name: value for name, value in body.items() if name != "reason"} | {
            "kind": "grr",
            "machine": shop.machine,
        }
        shop.call("POST", "/gauge-studies", 201, **made)
    study = shop.call("GET", f"/gauge-studies?machine={shop.machine}")["items"][-1]["id"]
    return f"/gauge-studies/{study}", body | {"resolution": 0.0001 * (n + 1)}


def _person(shop: Shop, n: int) -> Edit:
    name = f"person-{shop.machine}"
    if n == 1:
        shop.server.person(name, "viewer")
    person = next(each for each in shop.call("GET", "/people?limit=1000")["items"] if each["name"] == name)
    return f"/people/{person['id']}", {"role": ("operator", "engineer")[n - 1]}


def _reaction(shop: Shop, n: int) -> Edit:
    of = {"characteristic": shop.characteristic, "kind": "hunting"}
    body = BODIES["PUT /api/v1/reactions/plans/{plan}"] | of
    if n == 1:
        shop.call("POST", "/reactions/plans", 201, **body)
    plans = shop.call("GET", "/reactions/plans?limit=1000")["items"]
    plan = next(each for each in plans if each["characteristic"] == shop.characteristic)
    return f"/reactions/plans/{plan['id']}", body | {"name": f"Hunting {n}"}


def _route(shop: Shop, n: int) -> Edit:
    name = f"route-{shop.machine}"
    if n == 1:
        anna: dict[str, Any] = {"name": name, "means": "mail", "address": "anna@example.com"}
        steps = [{"receivers": [shop.call("POST", "/notifications/receivers", 201, **anna)["id"]]}]
        shop.call("POST", "/notifications/routes", 201, name=name, enabled=False, steps=steps)
    routes = shop.call("GET", "/notifications/routes?limit=1000")["items"]
    route = next(each for each in routes if each["name"] == name)
    return f"/notifications/routes/{route['id']}", {
        "name": name,
        "enabled": False,
        "steps": route["steps"],
        "repeat": n,
    }


def _receiver(shop: Shop, n: int) -> Edit:
    name = f"receiver-{shop.machine}"
    if n == 1:
        shop.call("POST", "/notifications/receivers", 201, name=name, means="mail", address="anna@example.com")
    receivers = shop.call("GET", "/notifications/receivers?limit=1000")["items"]
    number = next(each["id"] for each in receivers if each["name"] == name)
    return f"/notifications/receivers/{number}", {"address": f"anna-{n}@example.com"}


def _group(shop: Shop, n: int) -> Edit:
    name = f"group-{shop.machine}"
    if n == 1:
        anna: dict[str, Any] = {"name": name, "means": "mail", "address": "anna@example.com"}
        members = [shop.call("POST", "/notifications/receivers", 201, **anna)["id"]]
        shop.call("POST", "/notifications/groups", 201, name=name, members=members)
    groups = shop.call("GET", "/notifications/groups?limit=1000")["items"]
    group = next(each for each in groups if each["name"] == name)
    turn = {"receivers": group["members"], "days": [n]}
    return f"/notifications/groups/{group['id']}", {"name": name, "members": group["members"], "rota": [turn]}


def _entry(shop: Shop, n: int) -> Edit:
    name = f"Chip at {shop.machine}"
    if n == 1:
        shop.call("POST", "/reactions/catalogue", 201, sort="cause", name=name)
    entries = shop.call("GET", "/reactions/catalogue?limit=1000")["items"]
    return f"/reactions/catalogue/{next(each['id'] for each in entries if each['name'] == name)}", {"retired": n == 1}


EDITS: dict[str, Callable[[Shop, int], Edit]] = {
    "PATCH /machines/{machine}": lambda shop, n: (f"/machines/{shop.machine}", {"name": f"Name {n}"}),
    "PATCH /characteristics/{characteristic}": lambda shop, n: (
        f"/characteristics/{shop.characteristic}",
        {"parameters": {"R29": 2 + n}} | WHY,
    ),
    "PUT /characteristics/{characteristic}/rules": lambda shop, n: (
        f"/characteristics/{shop.characteristic}/rules",
        {"rules": {"main": {f"nelson_{n + 1}": "watch"}}} | WHY,
    ),
    "PUT /machines/{machine}/tools/{tool}": lambda shop, n: (
        f"/machines/{shop.machine}/tools/3",
        {"offset": 0.01 * n} | WHY,
    ),
    "PATCH /machines/{machine}/tools/{tool}": lambda shop, n: (
        f"/machines/{shop.machine}/tools/3",
        {"planned_parts": 100 + n},
    ),
    "PUT /machines/{machine}/averages/{location}": lambda shop, n: (
        f"/machines/{shop.machine}/averages/5",
        {"empirical_value": 0.001 * n} | WHY,
    ),
    "PUT /machines/{machine}/kinematics": lambda shop, n: (
        f"/machines/{shop.machine}/kinematics",
        {"max_modification": 0.1 * n} | WHY,
    ),
    "PUT /work-zeros/fixtures/{machine}/{fixture}": _fixture,
    "PUT /gauge-studies/{study}": _study,
    "PATCH /people/{person}": _person,
    "PUT /notifications/routes/{route}": _route,
    "PUT /notifications/groups/{group}": _group,
    "PUT /notifications/calendar": lambda _shop, n: ("/notifications/calendar", {"days": [f"2031-01-0{n}"]}),
    "PUT /characteristics/{characteristic}/control-plan": lambda shop, n: (
        f"/characteristics/{shop.characteristic}/control-plan",
        {"every": 4 + n} | WHY,
    ),
    "PUT /reactions/plans/{plan}": _reaction,
    "PUT /characteristics/{characteristic}/expansion": lambda shop, n: (
        f"/characteristics/{shop.characteristic}/expansion",
        {"coefficient": 11.0 + n} | WHY,
    ),
    "PUT /machines/{machine}/averages/{location}/calibration-plan": lambda shop, n: (
        f"/machines/{shop.machine}/averages/5/calibration-plan",
        {"due_parts": 100 * n},
    ),
    "PUT /machines/{machine}/tools/{tool}/calibration-plan": lambda shop, n: (
        f"/machines/{shop.machine}/tools/3/calibration-plan",
        {"due_days": 7.0 * n, "acceptance": "automatic"},
    ),
    "PATCH /reactions/catalogue/{entry}": _entry,
    "PATCH /notifications/receivers/{receiver}": _receiver,
    "PUT /machines/{machine}/context": lambda shop, n: (f"/machines/{shop.machine}/context", {"order": f"47{n}"}),
}


OF_A_PERSON = {
    "PUT /notifications/me",
    "PUT /notifications/me/browser",
}  # below; the key that asks for the others is none


def test_every_edit_takes_if_match_and_is_tried_here() -> None:
    edits = {operation.name for operation in operations() if operation.name.startswith(("PUT ", "PATCH "))}
    assert {name.replace("/api/v1", "") for name in edits} == set(EDITS) | OF_A_PERSON
    taking = {
        operation.name.replace("/api/v1", "")
        for operation in operations()
        if any(parameter["name"].lower() == "if-match" for parameter in operation.declared.get("parameters", ()))
    }
    assert taking == set(EDITS) | OF_A_PERSON


@pytest.mark.parametrize("operation", EDITS)
def test_a_change_of_what_has_changed_since_is_412(shop: Shop, operation: str) -> None:
    method = operation.partition(" ")[0]
    path, first = EDITS[operation](shop, 1)
    _path, second = EDITS[operation](shop, 2)
    seen = tag(shop, path)
    for unknown in ('"other"', "other", f'{seen[:-2]}"', ""):
        assert edit(shop, method, path, first, unknown).status_code == 412, unknown
    assert tag(shop, path) == seen
    assert edit(shop, method, path, first, seen).status_code == 200
    stale = edit(shop, method, path, second, seen)
    assert stale.status_code == 412
    problem = stale.json()
    assert problem["type"] == "urn:inband:problem:changed-meanwhile"
    assert tag(shop, path) in problem["detail"]
    assert edit(shop, method, path, second, tag(shop, path)).status_code == 200
    assert edit(shop, method, path, first).status_code == 200, "without If-Match nothing is compared"


def test_the_quiet_hours_of_ones_browsers_are_guarded_too(shop: Shop) -> None:
    person, path = Person(shop.server, "viewer"), "/api/v1/notifications/me/browser"
    person.send("/account/notifications/browser")
    seen = person.browser.get(path).headers["ETag"]

    def set_quiet(begins: str) -> int:
        body = {"quiet": [{"days": [1], "begins": begins, "ends": "06:00"}]}
        return person.browser.put(
            path, json=body, headers={"X-CSRF-Token": person.csrf(), "If-Match": seen}
        ).status_code

    assert [set_quiet(begins) for begins in ("20:00", "21:00")] == [200, 412]


def test_of_two_windows_of_one_person_the_second_hears_of_the_first(shop: Shop) -> None:
    person, path = Person(shop.server, "viewer"), "/api/v1/notifications/me"

    def set_address(address: str, if_match: str) -> int:
        headers = {"X-CSRF-Token": person.csrf(), "If-Match": if_match}
        return person.browser.put(path, json={"address": address}, headers=headers).status_code

    assert set_address("anna@example.com", "*") == 404
    person.send("/account/notifications", address="anna@example.com")
    seen = person.browser.get(path).headers["ETag"]
    assert [set_address(f"{name}@example.com", seen) for name in ("bea", "cara")] == [200, 412]
    assert person.browser.get(path).json()["address"] == "bea@example.com"


def test_tags_of_proxies_lists_and_any(shop: Shop) -> None:
    path, body = EDITS["PATCH /machines/{machine}"](shop, 1)
    seen = tag(shop, path)
    assert edit(shop, "PATCH", path, body, "*").status_code == 200
    for if_match in (f"W/{tag(shop, path)}", f'"other", {tag(shop, path)}'):
        assert edit(shop, "PATCH", path, body, if_match).status_code == 200
    assert tag(shop, path) != seen


def test_of_two_who_edit_at_once_one_is_first(shop: Shop) -> None:
    seen = tag(shop, f"/characteristics/{shop.characteristic}")

    def change(n: int) -> int:
        return edit(shop, "PATCH", *EDITS["PATCH /characteristics/{characteristic}"](shop, n), seen).status_code

    with ThreadPoolExecutor(2) as pool:
        assert sorted(pool.map(change, (1, 2))) == [200, 412]


def test_it_tells_nobody_what_is_not_theirs(shop: Shop) -> None:
    path = f"/machines/{shop.machine}"
    other = Shop(shop.server).machine_client
    headers = {"If-Match": '"x"'}
    body = {"offset": 0.0, "reason": "tried"}
    assert other.put(f"/api/v1{path}/tools/3", json=body, headers=headers).status_code == 403
    assert shop.admin.patch("/api/v1/machines/nowhere", json={"name": "x"}, headers=headers).status_code == 404
