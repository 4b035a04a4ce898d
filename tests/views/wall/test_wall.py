"""The wall screen: opened by its own key, which opens nothing else; it says when it is old, and goes on by itself."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import httpx
import pytest
from fastapi.routing import APIRoute
from playwright.sync_api import Browser, BrowserContext, expect
from sqlalchemy.orm import Session

from app.errors import TooManyRequests
from app.loop.machines import actions as machines
from app.loop.machines.schemas import MachineIn
from app.loop.maintenance.tables import Maintenance
from app.loop.tables.alarms import Alarm
from app.views.wall import queries
from app.views.wall.pages import MOST, WITHIN, Rate
from tests.servers import RunServer, Server
from tests.shop import Person, Shop, unique

pytestmark = pytest.mark.own_server  # what can be read from afar of all machines of other files fits on no screen

SHARES = 6
FOR_EVERYBODY = re.compile(
    r"/wall|/sign-in|/invitation/.*|/station|/health/.*|/metrics|/api/v1/openapi\.json|/api/docs|/static/.*|/favicon\.ico"
)


@pytest.fixture(scope="module")
def made(common_shop: Shop) -> tuple[int, str]:
    """A wall screen: its number and its key."""
    screen = common_shop.call("POST", "/wall-screens", 201, name=unique("Hall"))
    return screen["id"], screen["url"].partition("/wall#")[2]


@pytest.fixture
def wall(server: Server, made: tuple[int, str]) -> httpx.Client:
    """A screen without a session."""
    return server.client(made[1])


def test_it_shows_machines_alarms_and_parts(session: Session, wall: httpx.Client) -> None:
    machine = machines.add_machine(session, MachineIn(key="lathe-w", name="Lathe W", control="sinumerik"), "tests")
    session.add(Alarm(machine_id=machine.id, tool_memory=3, kind="tool_life"))
    session.flush()
    found = queries.wall(session)
    (tile,) = found.tiles
    assert (tile.name, tile.word, tile.parts) == ("Lathe W", found.alarms[0].word, 0)
    assert tile.tone != "steady"
    assert (found.active, found.alarms[0].where) == (1, "Lathe W")
    shown = wall.get("/wall/now")
    assert shown.status_code == 200
    assert "out of tolerance" in shown.text
    assert "<form" not in shown.text
    assert "<a " not in shown.text


def test_it_shows_maintenance_with_its_end_and_who_entered_it(session: Session) -> None:
    machine = machines.add_machine(session, MachineIn(key="lathe-w", name="Lathe W", control="sinumerik"), "tests")
    machines.add_machine(session, MachineIn(key="mill-w", name="Mill W", control="sinumerik"), "tests")
    now = datetime(2026, 11, 30, 9, tzinfo=UTC)
    for hours, of in ((3, machine.id), (30, None)):
        ends = now + timedelta(hours=hours)
        session.add(Maintenance(machine_id=of, begins=now - timedelta(hours=1), ends=ends, reason="Oil",
            stopping_anyway=True, entered_by="A. Novak"))  # fmt: skip
    session.flush()
    lathe, mill = (tile.maintenance for tile in queries.wall(session, now).tiles)
    assert lathe == mill
    assert re.fullmatch(r"Maintenance until 1 Dec 2026 \d\d:\d\d, A\. Novak", mill)
    assert re.fullmatch(
        r"Maintenance until \d\d:\d\d, A\. Novak", queries.wall(session, now + timedelta(hours=24)).tiles[0].maintenance
    )


@pytest.mark.parametrize("share", [0, *(pytest.param(share, marks=pytest.mark.long) for share in range(1, SHARES))])
def test_its_key_opens_no_other_route(made: tuple[int, str], wall: httpx.Client, share: int) -> None:
    """Every route of the application, each by its own method, as a key and as every cookie there is; a share in the short run."""
    from app.main import ROUTERS

    wall.headers["Cookie"] = f"inband_session={made[1]}; inband_station={made[1]}"
    tried = 0
    routes = [route for router in ROUTERS for route in router.routes]
    for route in routes[share::SHARES]:
        if not isinstance(route, APIRoute) or FOR_EVERYBODY.fullmatch(route.path) or route.path == "/wall/now":
            continue
        path = re.sub(r"\{[^}]*\}", "1", route.path)
        answer = wall.request(min(route.methods or ()), path, follow_redirects=False)
        to_sign_in = answer.status_code == 303 and answer.headers["location"].startswith(("/sign-in", "/station"))
        assert answer.status_code in (401, 403) or to_sign_in, f"{route.methods} {path}: {answer.status_code}"
        tried += 1
    assert tried > 250 // SHARES


def test_a_wrong_key_a_person_and_a_key_of_a_program_do_not_open_it(server: Server, viewer: Person) -> None:
    assert server.client().get("/wall/now", follow_redirects=False).status_code == 401
    assert server.client("inband_wall_guessed").get("/wall/now").status_code == 401
    assert server.client(server.key("admin")).get("/wall/now").status_code == 401
    assert viewer.browser.post("/api/v1/wall-screens", json={"name": "X"}).status_code == 403


def test_it_is_made_and_revoked_on_its_page_and_on_record(server: Server, admin: Person, common_shop: Shop) -> None:
    page = admin.send("/setup/screens", name=unique("Door"))
    key = re.search(r"/wall#(inband_wall_[\w-]+)", page)
    assert key is not None
    assert key[1] not in admin.open("/setup/screens")
    number = max(each["id"] for each in common_shop.call("GET", "/wall-screens?limit=1000")["items"])
    screen = server.client(key[1])
    assert screen.get("/wall/now").status_code == 200
    assert "revoked" in admin.send(f"/setup/screens/{number}/revoke")
    assert screen.get("/wall/now").status_code == 401
    entries = common_shop.call("GET", f"/audit?subject=wall-screen/{number}")["items"]
    assert {each["action"] for each in entries} == {"wall screen made", "wall screen revoked"}
    assert key[1] not in str(entries)
    common_shop.call("DELETE", "/wall-screens/999999", 404)


def test_its_looks_are_counted() -> None:
    rate = Rate()
    for number in range(MOST):
        rate.call("hall", float(number) / MOST)
    rate.call("another", 1.0)
    with pytest.raises(TooManyRequests):
        rate.call("hall", 1.0)
    rate.call("hall", 1.0 + WITHIN)


@pytest.fixture
def stranger(browser: Browser) -> Iterator[BrowserContext]:
    """A browser that nobody has signed in with."""
    context = browser.new_context(viewport={"width": 1920, "height": 1080})
    yield context
    context.close()


def test_it_is_never_blank_and_red_only_after_some_seconds(
    stranger: BrowserContext, common_shop: Shop, server: Server
) -> None:
    screen = common_shop.call("POST", "/wall-screens", 201, name=unique("Hall"))
    page = stranger.new_page()
    page.clock.install()
    page.route("**/wall/now", lambda _route: None)  # a server that is starting
    page.goto(f"{server.url}/wall#{screen['url'].partition('#')[2]}")
    trouble = page.locator(".wall-trouble")
    expect(trouble).to_contain_text("Connecting")
    quiet = trouble.evaluate("each => getComputedStyle(each).color")
    assert quiet == page.locator("body").evaluate("each => getComputedStyle(each).color")
    page.clock.fast_forward(6_000)
    expect(trouble).to_contain_text("No connection to the server")
    expect(trouble).not_to_have_css("color", quiet)


def test_it_loads_itself_again_after_an_update_only_where_that_answers(
    stranger: BrowserContext, common_shop: Shop, server: Server
) -> None:
    screen = common_shop.call("POST", "/wall-screens", 201, name=unique("Hall"))
    page = stranger.new_page()
    page.clock.install()
    page.goto(f"{server.url}/wall#{screen['url'].partition('#')[2]}")
    expect(page.locator(".wall-machines li").first).to_be_visible()
    page.locator("wall-screen").evaluate("each => each.setAttribute('version', '0.0.1')")
    page.route("**/wall", lambda route: route.abort())
    page.clock.fast_forward(6_000)
    page.clock.fast_forward(6_000)  # red only when it has failed for some seconds
    expect(page.locator(".wall-trouble")).to_contain_text("No connection since")
    page.unroute("**/wall")
    page.clock.fast_forward(6_000)
    expect(page.locator("wall-screen")).not_to_have_attribute("version", "0.0.1")
    expect(page.locator(".wall-machines li").first).to_be_visible()


def test_it_says_since_when_it_is_old_goes_on_and_ends_when_revoked(
    stranger: BrowserContext, common_shop: Shop, server: Server
) -> None:
    screen = common_shop.call("POST", "/wall-screens", 201, name=unique("Hall"))
    page = stranger.new_page()
    page.clock.install()
    page.goto(f"{server.url}/wall#{screen['url'].partition('#')[2]}")
    tile, trouble = page.locator(".wall-machines li").first, page.locator(".wall-trouble")
    expect(tile).to_be_visible()
    share = page.locator("body[style]").evaluate("each => Number(each.style.getPropertyValue('--fit'))")
    fits = "share => { document.body.style.setProperty('--fit', share); return document.documentElement.scrollHeight <= innerHeight; }"
    assert page.evaluate(fits, share), "nobody scrolls it"
    assert share == 1 or not page.evaluate(fits, share + 0.05), "letters are no smaller than they have to be"
    page.route("**/wall/now", lambda route: route.abort())
    page.clock.fast_forward(6_000)
    expect(trouble).to_be_hidden()
    page.clock.fast_forward(6_000)
    expect(trouble).to_contain_text("No connection since")
    expect(tile).to_be_visible()
    page.unroute("**/wall/now")
    page.clock.fast_forward(6_000)
    expect(trouble).to_be_hidden()
    expect(tile).to_be_visible()
    common_shop.call("DELETE", f"/wall-screens/{screen['id']}", 204)
    page.clock.fast_forward(6_000)
    expect(trouble).to_contain_text("revoked")
    expect(tile).to_be_hidden()


def test_machines_that_do_not_fit_are_counted_the_calm_ones_first(
    stranger: BrowserContext, run_server: RunServer
) -> None:
    """Nobody scrolls a screen on the wall, so what is below its edge is not seen."""
    with run_server() as server:
        shops = [Shop(server) for _machine in range(12)]
        shops[-1].read(12.0)
        screen = shops[0].call("POST", "/wall-screens", 201, name=unique("Hall"))
        page = stranger.new_page()
        page.set_viewport_size({"width": 1280, "height": 300})
        page.goto(f"{server.url}/wall#{screen['url'].partition('#')[2]}")
        expect(page.locator("#not-shown")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")
        shown = page.locator(".wall-machines li").count()
        assert shown + int(page.locator("#not-shown span").inner_text()) == len(shops)
        expect(page.locator('.wall-machines li[data-tone="attention"]')).to_contain_text("Oversize")
