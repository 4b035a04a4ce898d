"""ETag and If-Match: two people edit one thing, and the second hears of the first."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest

from tests.shop import Shop


def tag(shop: Shop, path: str) -> str:
    answer = shop.admin.get(f"/api/v1{path}")
    assert answer.status_code == 200, answer.text
    return answer.headers["ETag"]


def edit(shop: Shop, method: str, path: str, body: dict[str, Any], if_match: str | None = None) -> httpx.Response:
    headers = {} if if_match is None else {"If-Match": if_match}
    return shop.admin.request(method, f"/api/v1{path}", json=body, headers=headers)


EDITS: dict[str, Callable[[Shop, int], tuple[str, str, dict[str, Any]]]] = {
    "machine": lambda shop, n: ("PATCH", f"/machines/{shop.machine}", {"name": f"Lathe {n}"}),
    "characteristic": lambda shop, n: (
        *("PATCH", f"/characteristics/{shop.characteristic}"),
        {"parameters": {"R29": 2 + n}, "reason": "tried"},
    ),
    "tool": lambda shop, n: ("PUT", f"/machines/{shop.machine}/tools/3", {"offset": 0.01 * n, "reason": "tried"}),
    "sister": lambda shop, n: ("PATCH", f"/machines/{shop.machine}/tools/3", {"planned_parts": 100 + n}),
    "average": lambda shop, n: (
        *("PUT", f"/machines/{shop.machine}/averages/5"),
        {"empirical_value": 0.001 * n, "reason": "tried"},
    ),
    "kinematics": lambda shop, n: (
        *("PUT", f"/machines/{shop.machine}/kinematics"),
        {"max_modification": 0.1 * n, "reason": "tried"},
    ),
}


@pytest.mark.parametrize("kind", EDITS)
def test_a_change_of_what_has_changed_since_is_412(shop: Shop, kind: str) -> None:
    method, path, first = EDITS[kind](shop, 1)
    _method, _path, second = EDITS[kind](shop, 2)
    seen = tag(shop, path)
    assert edit(shop, method, path, first, seen).status_code == 200
    stale = edit(shop, method, path, second, seen)
    assert stale.status_code == 412
    problem = stale.json()
    assert problem["type"] == "urn:inband:problem:changed-meanwhile"
    assert tag(shop, path) in problem["detail"]
    assert edit(shop, method, path, second, tag(shop, path)).status_code == 200
    assert edit(shop, method, path, first).status_code == 200, "without If-Match nothing is compared"


def test_tags_of_proxies_lists_and_any(shop: Shop) -> None:
    method, path, body = EDITS["machine"](shop, 1)
    seen = tag(shop, path)
    assert edit(shop, method, path, body, '"other"').status_code == 412
    assert edit(shop, method, path, body, "*").status_code == 200
    for if_match in (f"W/{tag(shop, path)}", f'"other", {tag(shop, path)}'):
        assert edit(shop, method, path, body, if_match).status_code == 200
    assert tag(shop, path) != seen


def test_of_two_who_edit_at_once_one_is_first(shop: Shop) -> None:
    seen = tag(shop, f"/characteristics/{shop.characteristic}")

    def change(n: int) -> int:
        return edit(shop, *EDITS["characteristic"](shop, n), seen).status_code

    with ThreadPoolExecutor(2) as pool:
        assert sorted(pool.map(change, (1, 2))) == [200, 412]


def test_it_tells_nobody_what_is_not_theirs(shop: Shop) -> None:
    path = f"/machines/{shop.machine}"
    other = Shop(shop.server).machine_client
    headers = {"If-Match": '"x"'}
    body = {"offset": 0.0, "reason": "tried"}
    assert other.put(f"/api/v1{path}/tools/3", json=body, headers=headers).status_code == 403
    assert shop.admin.patch("/api/v1/machines/nowhere", json={"name": "x"}, headers=headers).status_code == 404
