"""Pictures at the steps of reaction plans: over REST, in the form of a plan, on the alarm and at the station."""

import re
from typing import Any

import httpx

from tests.pictures import as_json, picture
from tests.servers import Server
from tests.shop import Person, Shop, unique

ALT = "An insert with a chip out of its edge"


def plan(shop: Shop, status: int, *steps: dict[str, Any], **more: Any) -> Any:
    body: dict[str, Any] = {"name": "Edge", "characteristic": shop.characteristic, "reason": "New"}
    return shop.call("POST", "/reactions/plans", status, **body | {"steps": list(steps)} | more)


def sent(person: Person, path: str, picture: dict[str, bytes], **fields: str) -> httpx.Response:
    files = {name: ("any name.svg", content) for name, content in picture.items()}
    return person.browser.post(path, data={"csrf": person.csrf(), **fields}, files=files)


def test_a_step_shows_its_picture_wherever_the_plan_is_followed(server: Server, shop: Shop) -> None:
    drawing = as_json(picture())
    made = shop.call("POST", "/reactions/pictures", 201, **drawing)
    assert (made["media_type"], made["width"], made["height"]) == ("image/png", 48, 32)
    assert shop.call("POST", "/reactions/pictures", 200, **drawing)["digest"] == made["digest"], "sent twice it is one"
    shown = {"text": "Look at the edge.", "picture": {"digest": made["digest"], "alt": ALT}}
    assert plan(shop, 201, shown)["steps"] == [shown]
    shop.read(20.0)
    viewer, path = Person(server, "viewer"), f"/api/v1/reactions/pictures/{made['digest']}"
    page = viewer.open(f"/alarms/{shop.alarms()[0]['id']}")
    assert f'<img src="{path}" alt="{ALT}">' in page
    at_station = f"/station/{shop.machine}/pictures/{made['digest']}"
    assert f'<img src="{at_station}" alt="{ALT}">' in viewer.open(f"/station/{shop.machine}")
    for address in (path, at_station):
        answer = viewer.browser.get(address)
        assert answer.headers["content-type"] == "image/png"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert "immutable" in answer.headers["cache-control"]
        assert answer.content.startswith(b"\x89PNG")
        again = viewer.browser.get(address, headers={"If-None-Match": answer.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
    assert server.client().get(path).status_code == 401


def test_a_picture_is_named_as_it_is_there_and_says_what_it_shows(shop: Shop) -> None:
    nowhere: dict[str, Any] = {"text": "Look.", "picture": {"digest": "0" * 64, "alt": ALT}}
    wrong = plan(shop, 422, {"text": "Stop."}, nowhere)
    assert [error["field"] for error in wrong["errors"]] == ["steps[1].picture.digest"]
    nowhere["picture"]["alt"] = " "
    assert plan(shop, 422, nowhere)["errors"][0]["field"] == "steps[0].picture.alt"
    operator = shop.server.client(shop.server.key("operator"))
    shop.call("POST", "/reactions/pictures", 403, operator, **as_json(picture()))


def test_a_step_without_a_picture_is_what_it_was_before_there_were_any(shop: Shop) -> None:
    made = plan(shop, 201, {"text": "Stop."})
    body = {name: made[name] for name in ("name", "characteristic", "kind", "rule", "receivers", "steps")}
    assert body["steps"] == [{"text": "Stop.", "picture": None}]
    same = shop.call("PUT", f"/reactions/plans/{made['id']}", **body, reason="Nothing new")
    assert same["version"] == 1


def test_an_engineer_adds_replaces_and_takes_away_a_picture_in_the_form(server: Server, shop: Shop) -> None:
    engineer, name = Person(server, "engineer"), unique("Edge")
    fields: dict[str, Any] = {
        "name": name,
        "characteristic": shop.characteristic,
        "reason": "New",
        "step-1": "Stop.",
        "step-3": "Look.",
    }
    refused = sent(engineer, "/setup/reactions/new", {"picture-3": picture()}, **fields)
    assert refused.status_code == 422, "it is not said what it shows"
    digest = re.search(r'name="digest-3" value="([0-9a-f]{64})"', refused.text)
    assert digest is not None, "the picture has not to be chosen again"
    assert re.search(r'id="f-alt-3"[^>]*aria-invalid', refused.text)
    assert engineer.browser.get(f"/api/v1/reactions/pictures/{digest[1]}").status_code == 200
    fields |= {"digest-3": digest[1], "alt-3": ALT}
    engineer.send("/setup/reactions/new", **fields)
    made = next(each for each in shop.call("GET", "/reactions/plans?limit=1000")["items"] if each["name"] == name)
    assert [step["picture"] for step in made["steps"]] == [None, {"digest": digest[1], "alt": ALT}]
    path = f"/setup/reactions/{made['id']}"
    kept = fields | {"step-3": "", "digest-3": "", "step-2": "Look.", "digest-2": digest[1], "alt-2": ALT}
    none = sent(engineer, path, {"picture-2": b"<svg onload='alert(1)'/>"}, **kept)
    assert none.status_code == 422
    assert "No PNG, JPEG or WebP" in none.text or "no PNG, JPEG or WebP" in none.text
    more = engineer.send(path, **kept, do="more", shown="5")
    assert 'name="step-8"' in more
    assert f'value="{digest[1]}"' in more, "nothing that was typed is lost"
    engineer.send(path, **kept | {"reason": "Not needed", "without-2": "true"})
    assert [step["picture"] for step in shop.call("GET", f"/reactions/plans/{made['id']}")["steps"]] == [None, None]
