"""Photos of what was found at an alarm: who may send, see and remove them, and an acknowledgement that waits for none."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from app.access.callers import Caller
from app.errors import Conflict
from app.files.pictures import Picture
from app.loop.alarm_response import photo_actions as photos
from app.loop.alarm_response import queries
from app.loop.tables.alarms import AlarmPhoto
from app.web.limits import MEGABYTE
from tests.pictures import as_json, picture
from tests.shop import Person, Shop

ANA = Caller("key", "ana", role="operator")


def alarm(shop: Shop) -> int:
    shop.read(20.0)
    number: int = shop.alarms()[-1]["id"]
    return number


def kept(shop: Shop, number: int, content: bytes = b"points") -> int:
    """A photo as it is kept, without the process that draws it again."""
    with shop.server.database.begin() as session:
        return photos.add_photo(session, number, Picture(content, "image/jpeg", 40, 30), ANA).id


def stored(shop: Shop, number: int, photo: int) -> tuple[int, int]:
    """The key of a photo."""
    with shop.server.database.begin() as session:
        return queries.alarm(session, number).alarm.machine_id, photo


def test_an_operator_sends_a_viewer_sees_and_it_goes_with_the_alarm(shop: Shop, viewer: Person) -> None:
    number, photo = alarm(shop), as_json(picture("JPEG"))
    path, operator = f"/alarms/{number}/photos", shop.server.client(shop.server.key("operator"))
    assert shop.call("GET", path)["items"] == []
    made = shop.call("POST", path, 201, operator, **photo)
    assert (made["media_type"], made["width"], made["removed_at"]) == ("image/jpeg", 48, None)
    shop.call("POST", path, 403, viewer.browser, **photo)
    assert shop.call("POST", path, 422, operator, content="bm8=")["errors"][0]["field"] == "content"
    shop.call("POST", "/alarms/999999999/photos", 404, operator, **photo)
    assert shop.call("GET", path, client=shop.machine_client)["items"] == [made]
    shop.call("GET", path, 403, Shop(shop.server).machine_client)
    audit = shop.call("GET", f"/audit?subject=alarm/{number}")["items"][0]
    assert (audit["action"], audit["after"]["digest"]) == ("photo added", made["digest"])
    shop.acknowledge(number, "noted")
    page = viewer.open(f"/alarms/{number}")
    address = f"/api/v1/alarms/{number}/photos/{made['id']}"
    assert f'<img src="{address}" alt="Photo 1 of alarm {number}" width="48" height="32"' in page
    answer = viewer.browser.get(address)
    assert (answer.headers["content-type"], answer.headers["cache-control"]) == ("image/jpeg", "private, no-cache")
    assert answer.content.startswith(b"\xff\xd8\xff")
    assert viewer.browser.get(address, headers={"If-None-Match": answer.headers["etag"]}).status_code == 304
    assert f'<a href="/alarms/{number}#photos">1 photo</a>' in viewer.open(f"/alarms/history?machine={shop.machine}")
    report = shop.admin.get(f"/api/v1/characteristics/{shop.characteristic}/report.json?section=alarms").json()
    table = report["sections"][0]["table"]
    assert (table["columns"][-1]["key"], table["rows"][0][-1]["value"]) == ("photos", 1)


def test_without_scripts_photos_are_added_on_the_page_of_the_alarm(
    shop: Shop, operator: Person, viewer: Person
) -> None:
    number = alarm(shop)
    path = f"/alarms/{number}/photos"
    files = [("photo", ("a.jpg", picture("JPEG"))), ("photo", ("b.png", picture()))]
    answer = operator.browser.post(path, data={"csrf": operator.csrf()}, files=files)
    assert answer.status_code == 200, answer.text
    assert answer.text.count("<img src") == 2
    assert "f-photo" in answer.text
    assert "f-photo" not in viewer.open(f"/alarms/{number}")
    wrong = operator.browser.post(path, data={"csrf": operator.csrf()}, files={"photo": ("c.jpg", b"<svg/>")})
    assert (wrong.status_code, "no PNG, JPEG or WebP" in wrong.text) == (422, True)
    many = [("photo", (f"{n}.png", picture())) for n in range(13)]
    refused = operator.browser.post(path, data={"csrf": operator.csrf()}, files=many)
    assert (refused.status_code, "more than 12 pictures at once" in refused.text) == (422, True)
    assert len(shop.call("GET", path)["items"]) == 2
    large = operator.browser.post(
        path, data={"csrf": operator.csrf()}, files={"photo": ("d.jpg", bytes(10 * MEGABYTE))}
    )
    assert (large.status_code, "Send smaller pictures, or fewer at once." in large.text) == (413, True)


def test_one_that_must_not_be_there_is_removed_and_that_it_was_stays(
    shop: Shop, operator: Person, viewer: Person
) -> None:
    number = alarm(shop)
    photo = kept(shop, number)
    path = f"/alarms/{number}/photos/{photo}"
    shop.call("POST", f"{path}/remove", 403, operator.browser, reason="x")
    engineer = Person(shop.server, "engineer")
    assert "Remove for ever" in engineer.open(f"/alarms/{number}")
    assert "Remove for ever" not in viewer.open(f"/alarms/{number}")
    page = engineer.send(f"{path}/remove", reason="A face")
    assert f"removed by {engineer.name}, “A face”" in page
    assert "A face" in shop.call("GET", path, 404)["detail"]
    shop.call("POST", f"{path}/remove", 409, reason="Again")
    (left,) = shop.call("GET", f"/alarms/{number}/photos")["items"]
    assert (left["id"], left["removed_by"], left["removed_why"]) == (photo, engineer.name, "A face")
    key = stored(shop, number, photo)
    with shop.server.database.begin() as session:
        assert session.get_one(AlarmPhoto, key).content is None
    with (
        pytest.raises(Exception, match="is refused: what it says is a fact"),
        shop.server.database.begin() as session,
    ):
        session.get_one(AlarmPhoto, key).content = b"another"
        session.flush()


def test_an_alarm_takes_twelve(shop: Shop) -> None:
    number = alarm(shop)
    for n in range(photos.MOST_PHOTOS):
        kept(shop, number, b"points %d" % n)
    with pytest.raises(Conflict, match="has 12 photos already"):
        kept(shop, number, b"one more")
    assert kept(shop, number, b"points 3"), "one that is there is no more than before"


@pytest.mark.browser
def test_a_photo_that_cannot_be_sent_loses_no_acknowledgement(
    shop: Shop, operator: Person, page: Page, complaints: list[str]
) -> None:
    number = alarm(shop)
    operator.sign_in(page)
    page.route(f"**/alarms/{number}/photos", lambda route: route.abort(), times=1)
    page.goto(f"/alarms/{number}?action=noted")
    box = page.locator("photo-box")
    large = picture("JPEG", (2400, 1200))
    files: list[Any] = [
        {"name": f"{n}.jpg", "mimeType": "image/jpeg", "buffer": each}
        for n, each in enumerate([large, picture("JPEG")])
    ]
    box.locator("input").set_input_files(files)
    expect(box.locator("li")).to_have_count(2)
    expect(box.locator("li").first).to_contain_text("kB")
    box.locator("li").last.get_by_role("button", name="Remove").click()
    expect(box.locator("li")).to_have_count(1)
    page.get_by_role("button", name="Noted").click()
    expect(box).to_contain_text("The alarm is acknowledged. A photo was not sent: The server does not answer.")
    assert shop.alarms("acknowledged")[-1]["id"] == number
    assert [line.partition(": ")[2] for line in complaints] == ["Failed to load resource: net::ERR_FAILED"]
    complaints.clear()
    page.get_by_role("button", name="Send again").click()
    expect(page.locator(".acknowledged").first).to_contain_text(operator.name)
    (made,) = shop.call("GET", f"/alarms/{number}/photos")["items"]
    assert (made["width"], made["height"], made["made_by"]) == (1600, 800, operator.name)
