"""Every page of the house, opened as people open it: no console error, no foreign request, nothing wider than the screen.

The list is held against the routes of the application, so a new page is in it or the test fails.
"""

from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from fastapi.routing import APIRoute
from playwright.sync_api import Browser, Page, expect

from app.main import ROUTERS
from app.web.openapi import example_of
from tests.conftest import Server
from tests.geometry.alignment.test_alignments import SIX
from tests.geometry.geometric_form.test_forms import BORE
from tests.geometry.rotary_axes.bench import axis
from tests.quality.control_charts.line import Line
from tests.shop import Person, Shop

SIZES = {"desk": (1280, 800), "large": (1920, 1080), "panel": (800, 1280), "phone": (390, 844)}
# Zoomed to 200 %, a screen has letters of twice the size and half as many pixels of the page (WCAG 1.4.4).
SIZES |= {"desk-zoomed": (640, 400), "phone-zoomed": (195, 422)}

SMALLEST = min(width for width, _ in SIZES.values())
SHARES = 3  # that workers may share

# By the address of the route: how it is opened, as a function of the shop.
PAGES = {
    "/": ["/", "/?show=attention"],
    "/overview": ["/overview", "/overview?by=ppk&machine={machine}"],
    "/plant/{machine}": ["/plant/{machine}"],
    "/connections": ["/connections"],
    "/machines/{machine}/connection": ["/machines/{machine}/connection"],
    "/machines/{machine}/touch-tests/{number}": ["/machines/{machine}/touch-tests/{touch_test}"],
    "/station/{machine}": ["/station/{machine}", "/station/{machine}?tool=3"],
    "/station/{machine}/alarms/{number}": ["/station/{machine}/alarms/{alarm}?action=noted"],
    "/station/{machine}/corrections/{number}": ["/station/{machine}/corrections/{waiting}?do=approve"],
    "/station/{machine}/note": ["/station/{machine}/note"],
    "/notes": ["/notes", "/notes?machine={machine}", "/notes?characteristic={characteristic}"],
    "/notes/new": ["/notes/new?machine={machine}", "/notes/new?characteristic={characteristic}&sequence=3"],
    "/notes/{number}": ["/notes/{note}"],
    "/station/{machine}/tools/{number}/change": ["/station/{machine}/tools/3/change"],
    "/characteristics/{characteristic}": [
        "/characteristics/{characteristic}",
        "/characteristics/{characteristic}?last=50&scale=true",
        "/characteristics/{characteristic}?last=all&scale=time",
        "/characteristics/{characteristic}?first=2&through=5&before=5",
    ],
    "/characteristics/{characteristic}/readings/{sequence}": ["/characteristics/{characteristic}/readings/3"],
    "/characteristics/{characteristic}/control": [
        "/characteristics/{characteristic}/control",
        "/characteristics/{characteristic}-watched/control?last=200",
        "/characteristics/{characteristic}-watched/control?last=all&chart=cusum&baseline=1",
        "/characteristics/{characteristic}-empty/control",
    ],
    "/characteristics/{characteristic}/control/freeze": [
        "/characteristics/{characteristic}-empty/control/freeze",
        "/characteristics/{characteristic}-watched/control/freeze?last=200",
        "/characteristics/{characteristic}-watched/control/freeze?first_sequence=1&last_sequence=60&excluded=7%20chip",
    ],
    "/characteristics/{characteristic}/rules": [
        "/characteristics/{characteristic}/rules",
        "/characteristics/{characteristic}-watched/rules?set=nelson&last=200",
    ],
    "/characteristics/{characteristic}/signals": ["/characteristics/{characteristic}-watched/signals?state=open"],
    "/signals/{number}": ["/signals/{signal}"],
    "/characteristics/{characteristic}/report": [
        "/characteristics/{characteristic}/report?last=all&timezone=Europe/Belgrade",
        "/characteristics/{characteristic}-empty/report?section=numbers&section=capability",
    ],
    "/reports": ["/reports?characteristic={characteristic}"],
    "/characteristics/{characteristic}/capability": [
        "/characteristics/{characteristic}/capability",
        "/characteristics/{characteristic}-watched/capability?last=all&side=upper",
        "/characteristics/{characteristic}-empty/capability",
    ],
    "/gauges": ["/gauges", "/gauges?machine={machine}", "/gauges?characteristic={characteristic}"],
    "/gauges/new": [
        "/gauges/new",
        "/gauges/new?kind=type_one&characteristic={characteristic}",
        "/gauges/new?kind=grr",
        "/gauges/new?kind=linearity&machine={machine}",
    ],
    "/gauges/{number}": ["/gauges/{crossed}", "/gauges/{repeated}"],
    "/gauges/{number}/correct": ["/gauges/{crossed}/correct", "/gauges/{repeated}/correct"],
    "/characteristics/{characteristic}/what-if": [
        "/characteristics/{characteristic}/what-if",
        "/characteristics/{characteristic}/what-if?k=3&r33=2.5&goal=corrections#replay",
        "/characteristics/{characteristic}-watched/what-if?r34=6",
        "/characteristics/{characteristic}-empty/what-if",
    ],
    "/proposals": ["/proposals", "/proposals?status=all"],
    "/proposals/{number}": ["/proposals/{proposal}"],
    "/alarms": ["/alarms", "/alarms?machine={machine}"],
    "/alarms/history": ["/alarms/history"],
    "/alarms/{number}": ["/alarms/{alarm}", "/alarms/{alarm}?action=keep_cutting"],
    "/corrections": ["/corrections", "/corrections?machine={machine}"],
    "/corrections/{machine}/tools/{tool}": ["/corrections/{machine}/tools/5"],
    "/todo": ["/todo", "/todo?machine={machine}&mine=true"],
    "/search": ["/search", "/search?q=shaft"],
    "/parts": ["/parts", "/parts?part=SN-1"],
    "/parts/{part:path}": ["/parts/SN%201/2"],
    "/machines": ["/machines"],
    "/machines/{machine}": ["/machines/{machine}"],
    "/machines/{machine}/geometry": ["/machines/{machine}/geometry"],
    "/tools": ["/tools"],
    "/machines/{machine}/tools/{number}": ["/machines/{machine}/tools/3", "/machines/{machine}/tools/32"],
    "/machines/{machine}/tools": ["/machines/{machine}/tools?tool=3"],
    "/machines/{machine}/corrections/program": [
        "/machines/{machine}/corrections/program",
        "/machines/{machine}/corrections/program?form=list",
    ],
    "/machines/{machine}/corrections/{number}": ["/machines/{machine}/corrections/1"],
    "/machines/{machine}/tools/{number}/{what}": [
        "/machines/{machine}/tools/3/edit",
        "/machines/{machine}/tools/3/change",
        "/machines/{machine}/tools/3/sister",
    ],
    "/machines/{machine}/averages/{location}/edit": ["/machines/{machine}/averages/5/edit"],
    "/calibration": ["/calibration"],
    "/calibration/probes": ["/calibration/probes?machine={machine}&tool=32"],
    "/calibration/{machine}/{memory}/{location}": [
        "/calibration/{machine}/averages/5",
        "/calibration/{machine}/averages/6",
        "/calibration/{machine}/probes/32",
    ],
    "/calibration/{machine}/{memory}/{location}/{what}/{number}": [
        "/calibration/{machine}/averages/5/accept/1",
        "/calibration/{machine}/averages/6/suggestion/0",
    ],
    "/alignments": ["/alignments", "/alignments?machine={machine}"],
    "/alignments/new": [
        "/alignments/new",
        "/alignments/new?found=measured&like={alignment}",
        "/alignments/new?kind=two_points",
        "/alignments/new?kind=two_holes",
    ],
    "/alignments/pallets/new": ["/alignments/pallets/new?part={alignment}"],
    "/alignments/history": ["/alignments/history?machine={machine}&name=pallet%204"],
    "/alignments/{number}": ["/alignments/{alignment}"],
    "/forms": ["/forms"],
    "/forms/new": ["/forms/new", "/forms/new?example=printed", "/forms/new?from={form}"],
    "/work-zeros": ["/work-zeros", "/work-zeros?machine={machine}"],
    "/work-zeros/new": ["/work-zeros/new", "/work-zeros/new?kind=corner", "/work-zeros/new?like={zero}"],
    "/work-zeros/{number}": ["/work-zeros/{zero}"],
    "/work-zeros/fixtures/{machine}/{fixture}": [
        "/work-zeros/fixtures/{machine}/vice-with-a-name-as-long-as-people-give-them"
    ],
    "/forms/{form}": ["/forms/{form}", "/forms/{form}?section=2"],
    "/forms/features/{machine}/{feature}": ["/forms/features/{machine}/bore-d56?kind=axis_straightness"],
    "/kinematics": ["/kinematics"],
    "/kinematics/measuring-plan": ["/kinematics/measuring-plan"],
    "/setup/jobs": ["/setup/jobs"],
    "/kinematics/new": [
        "/kinematics/new",
        "/kinematics/new?way=positions",
        "/kinematics/new?example=1&machine={machine}",
    ],
    "/kinematics/machines/{machine}": [
        "/kinematics/machines/{machine}",
        "/kinematics/machines/{machine}?value=backlash.C&before={run}",
    ],
    "/kinematics/machines/{machine}/backups/{version}": ["/kinematics/machines/{machine}/backups/1"],
    "/kinematics/runs/{run}": ["/kinematics/runs/{run}"],
    "/kinematics/runs/{run}/protocol": ["/kinematics/runs/{run}/protocol"],
    "/kinematics/runs/{run}/{what}": ["/kinematics/runs/{run}/enter"],
    "/kinematics/compare": ["/kinematics/compare?run={run}"],
    "/setup": ["/setup"],
    "/setup/characteristics": ["/setup/characteristics"],
    "/setup/characteristics/new": ["/setup/characteristics/new"],
    "/setup/characteristics/{characteristic}": ["/setup/characteristics/{characteristic}"],
    "/setup/programs": ["/setup/programs"],
    "/setup/characteristics/{characteristic}/program": [
        "/setup/characteristics/{characteristic}/program",
        "/setup/characteristics/{characteristic}/program?kind=calibration&gauge=199.852&control=fanuc",
        "/setup/characteristics/{characteristic}/program?kind=ring&control=haas&number=7",
    ],
    "/setup/machines": ["/setup/machines"],
    "/setup/machines/new": ["/setup/machines/new"],
    "/setup/machines/{machine}": ["/setup/machines/{machine}", "/setup/machines/new?like={machine}"],
    "/setup/parameters": [
        "/setup/parameters",
        "/setup/parameters?parameter=zero_range&value=0.002&on={characteristic}",
    ],
    "/setup/people": ["/setup/people"],
    "/setup/stations": ["/setup/stations"],
    "/setup/audit": ["/setup/audit"],
    "/station": ["/station"],
    "/account": ["/account"],
    "/import": ["/import"],
    "/api/docs": ["/api/docs"],
    "/compare": ["/compare", "/compare?of={characteristic}&by=version"],
    "/proof": ["/proof"],
}
SIGNED_OUT = {"/sign-in", "/invitation/{token}"}
OPENED_ELSEWHERE = {"/import/{token}"}  # needs a file that was sent; tests/loop/readings/importing
PARTS = {  # only ever fetched into a page
    "/plant-summary",
    "/todo/count",
    "/setup/fit",
    "/station/{machine}/events",
    "/characteristics/{characteristic}/readings/{sequence}/panel",
}

HEARTBEAT: dict[str, Any] = {
    "version": "0.2.0.dev17+g1cbe8a9",
    "state": "control_away",
    "detail": "ConnectionRefusedError: opc.tcp://192.168.214.1:4840 does not answer; the next attempt is made in 30 s",
    "waiting": 1204,
    "oldest_waiting_at": "2026-11-01T08:00:00Z",
    "quarantined": 27,
    "quarantine": [
        {
            "key": f"a-machine-with-a-long-key:123456:{number}",
            "characteristic": "shaft-with-a-long-key",
            "reason": "There is no characteristic shaft-with-a-long-key. GET /api/v1/characteristics lists them.",
            "at": "2026-11-01T08:00:00Z",
        }
        for number in range(3)
    ],
    "clock_offset": -3605.2,
    "kind": "opcua",
    "mapping": "5b8c1f0e5b8c1f0e",
    "hold_all": True,
    "identity": "ZA6-1207 840D sl",
    "locations": [
        {"tool_memory": 3, "mapping": "77d09a12", "proved_at": "2026-11-01T08:00:00Z", "offset": -0.0123},
        {"tool_memory": 13, "mapping": "1c2d3e4f", "proved_at": None, "offset": None},
        {"tool_memory": 14, "mapping": "9a8b7c6d", "proved_at": None, "offset": 0.25, "touch_test_by_page": True},
    ],
}


def routes_of(router: Any) -> Iterator[APIRoute]:
    """All routes of a router, those of the routers it includes too."""
    for route in router.routes:
        if isinstance(route, APIRoute):
            yield route
        elif hasattr(route, "original_router"):
            yield from routes_of(route.original_router)


def pages_of_the_house() -> set[str]:
    """The addresses that answer with a page: GET routes that are not for programs."""
    found = {route.path for router in ROUTERS for route in routes_of(router) if "GET" in (route.methods or ())}
    return {path for path in found if not path.startswith(("/api/v1/", "/health/", "/metrics"))}


def test_no_page_is_forgotten() -> None:
    assert pages_of_the_house() == set(PAGES) | SIGNED_OUT | OPENED_ELSEWHERE | PARTS


def furnished(server: Server) -> Shop:
    """A machine with something of everything: a worn tool, held and pending corrections, a long name, no data."""
    made = Shop(server)
    for deviation in (0.4, 3.0, 6.1, -12.5, 2.0, 0.2, 350.0):
        made.read(deviation)
    made.add(f"{made.characteristic}-empty", tool_memory=4)
    made.add(f"{made.characteristic}-approval", tool_memory=5, average_memory=6, mode="approval")
    made.read(6.0, f"{made.characteristic}-approval")
    made.read(-12.0, f"{made.characteristic}-approval")
    made.call(
        "PATCH",
        f"/machines/{made.machine}/tools/3",
        name="Finishing tool with a name as long as tool lists have them",
        edge="D1",
        planned_parts=400,
        sister=13,
    )
    made.call("POST", f"/machines/{made.machine}/heartbeat", **HEARTBEAT)
    tests = f"/machines/{made.machine}/touch-tests"
    test = made.call("POST", tests, 201, tool_memory=14)["id"]
    made.call("POST", f"{tests}/{test}/report", **example_of("TouchTestReport"))
    calibrations = f"/machines/{made.machine}/calibrations"
    limits: dict[str, Any] = {"zero_range": 0.001, "averaging_limit": 0.01, "confidence_limit": 1.0}
    for touches in ([199.8553], [201.9]):
        made.call("POST", calibrations, 201, average_memory=5, gauge_size=199.852, touches=touches, **limits)
    ring: dict[str, Any] = {"nominal": 30.0, "upper_deviation": 0.01, "lower_deviation": -0.01, "radius_term": 6.0}
    sections = [{"plus": 24.012, "minus": -23.988}] * 3
    made.call("POST", f"{calibrations}/ring", 201, tool_memory=32, sections=sections, **ring)
    for difference in (0.002, 0.0025, 0.0022, 0.0024, 0.0045):
        pair: dict[str, Any] = {"machine_value": 40.0 + difference, "external_value": 40.0, "instrument": "CMM, hall C"}
        made.call("POST", f"/machines/{made.machine}/averages/6/pairs", 201, **pair)
    made.call("POST", "/alignments", 201, machine=made.machine, touches=SIX, name="pallet 4", repeatability=0.002)
    bore = BORE | {"feature": "bore-d56", "machine": made.machine}
    made.call("POST", "/forms", 201, **bore)
    turned: dict[str, Any] = {"axes": [axis(both=True, backlash=0.002)], "machine": made.machine}
    first = made.call("POST", "/kinematics/runs", 201, **turned)["run"]
    made.call("POST", f"/kinematics/runs/{first}/enter", reason="Monthly check")
    made.call("POST", "/kinematics/runs", 201, **turned)
    vice = "vice-with-a-name-as-long-as-people-give-them"
    web: dict[str, Any] = {
        "kind": "web",
        "tip": 6.0,
        "fixture": vice,
        "repeatability": 0.001,
        "z_touched": -200.0,
        "part": "SN-0008127731-B",
    }
    for shift in (0.0, 0.02):
        sides = [{"x": -1053.0 + shift, "y": 0, "approach": "+X"}, {"x": -947.0 + shift, "y": 0, "approach": "-X"}]
        ends = [{"x": -1040, "y": -833.0, "approach": "+Y"}, {"x": -960, "y": -832.2, "approach": "+Y"}]
        top = {"x": -1000, "y": -763.0, "approach": "-Y"}
        made.call("POST", "/work-zeros", 201, machine=made.machine, touches=[*sides, *ends, top], **web)
    watched: dict[str, Any] = {"warning": 0.01, "alarm": 0.03, "reason": "It creeps"}
    made.call("PUT", f"/work-zeros/fixtures/{made.machine}/{vice}", **watched)
    line = Line(made, "watched")
    line.push([9.0, 0.0, -7.0])
    line.look()
    about: dict[str, Any] = {
        "machine": made.machine,
        "characteristic": made.characteristic,
        "gauge": "Probe T8, ruby 2 mm",
    }
    cells = [
        {"part": str(part), "operator": operator, "values": [40 + part / 1000, 40.0003 + part / 1000, 40.0001]}
        for part in range(10)
        for operator in ("Jovanović-Đorđević", "Živković", "third")
    ]
    made.call("POST", "/gauge-studies", 201, kind="grr", rows=cells, **about)
    repeats = [{"values": [40.0 + n % 7 / 10_000 for n in range(50)]}]
    made.call("POST", "/gauge-studies", 201, kind="type_one", reference=40.0, rows=repeats, **about)
    made.call(
        "POST",
        f"/characteristics/{made.characteristic}/proposals",
        201,
        zero_range=0.002,
        reason="Half as many corrections",
    )
    made.call(
        "PATCH",
        f"/characteristics/{made.characteristic}-empty",
        name="Concentric recess with a name as long as drawings have them Ø118.750 P7/h6",
        parameters={"zero_range": 0.0015},
        reason="A reason that somebody took the time to write down in full, with everything that matters.",
    )
    made.call(
        "POST", "/notes", 201, machine=made.machine, text="Coolant changed\n" + "Kühlschmierstoffkonzentration" * 4
    )
    made.call("POST", "/notes", 201, characteristic=made.characteristic, sequence=3, text="New batch of bars")
    return made


@pytest.fixture(scope="module")
def shop(server: Server) -> Shop:
    return furnished(server)


@pytest.fixture(scope="module")
def admin(server: Server) -> Person:
    return Person(server, "admin")


@pytest.fixture(params=SIZES)
def sized(request: pytest.FixtureRequest, page: Page) -> Page:
    width, height = SIZES[request.param]
    page.set_viewport_size({"width": width, "height": height})
    return page


def addresses(shop: Shop) -> list[str]:
    alarm = shop.alarms()[0]["id"]
    signal = shop.call("GET", f"/signals?machine={shop.machine}")["items"][0]["id"]
    studies = shop.call("GET", f"/gauge-studies?machine={shop.machine}")["items"]
    values: dict[str, Any] = {
        "machine": shop.machine,
        "characteristic": shop.characteristic,
        "alarm": alarm,
        "waiting": shop.call("GET", f"/machines/{shop.machine}/corrections?status=awaiting_approval")["items"][0][
            "number"
        ],
        "proposal": shop.call("GET", f"/characteristics/{shop.characteristic}/proposals")["items"][0]["id"],
        "signal": signal,
        "note": shop.call("GET", f"/notes?machine={shop.machine}")["items"][-1]["id"],
        **dict(zip(("repeated", "crossed"), (each["id"] for each in studies), strict=True)),
        "touch_test": shop.call("GET", f"/machines/{shop.machine}/touch-tests")["items"][0]["id"],
        "zero": shop.call("GET", f"/work-zeros?machine={shop.machine}")["items"][0]["id"],
        "alignment": shop.call("GET", f"/alignments?machine={shop.machine}")["items"][0]["id"],
        "form": shop.call("GET", f"/forms?machine={shop.machine}")["items"][0]["id"],
        "run": shop.call("GET", f"/kinematics/runs?machine={shop.machine}")["items"][-1]["run"],
    }
    return [address.format(**values) for opened in PAGES.values() for address in opened]


def test_a_key_in_place_of_a_sign_in_meets_no_fault(server: Server, shop: Shop) -> None:
    for key in (server.key("viewer"), server.key(machine=shop.machine)):
        with server.client(key) as client:
            answers = {address: client.get(address).status_code for address in addresses(shop)}
        assert {address: status for address, status in answers.items() if status >= 500} == {}


def too_wide(page: Page) -> int:
    """Pixels by which the page is wider than the screen."""
    return int(page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth"))


def fits(page: Page) -> bool:
    """Tell if the page becomes no wider than the screen; a chart may take a moment for that."""
    for _ in range(30):
        if too_wide(page) <= 0:
            return True
        page.wait_for_timeout(100)
    return False


def opened(page: Page, address: str) -> None:
    """Open a page that has to be in order, and wait for its charts."""
    answer = page.goto(address)
    assert answer is not None
    assert answer.status == 200, address
    expect(page.locator("main")).to_be_visible()
    for chart in page.locator("plotly-chart").all():
        expect(chart.locator(".main-svg").first).to_be_attached()


@pytest.mark.parametrize("part", range(SHARES))
def test_every_page_opens_in_order(page: Page, shop: Shop, admin: Person, part: int) -> None:
    """Opened on the smallest screen, then made larger: a chart that is drawn anew is waited for."""
    admin.sign_in(page)
    wide = []
    for address in addresses(shop)[part::SHARES]:
        for name, (width, height) in sorted(SIZES.items(), key=lambda size: size[1]):
            page.set_viewport_size({"width": width, "height": height})
            if width == SMALLEST:
                opened(page, address)
                expect(page.locator("h1")).to_have_count(1)
            if not fits(page):
                wide.append((address, name, too_wide(page)))
    assert wide == []


def test_pages_before_signing_in(sized: Page, shop: Shop) -> None:
    invitation = shop.call("POST", "/people/invitations", 201, role="viewer")["url"]
    for address in ("/sign-in", urlsplit(invitation).path):
        sized.goto(address)
        expect(sized.locator("h1")).to_have_count(1)
        assert too_wide(sized) <= 0, address


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_letters_can_be_read_in_both_themes(
    browser: Browser, server: Server, shop: Shop, admin: Person, scheme: Any
) -> None:
    """WCAG AA: 4.5 : 1 for words on their ground, wherever a page sets a colour of its own."""
    context = browser.new_context(base_url=server.url, color_scheme=scheme, viewport={"width": 1280, "height": 800})
    page = context.new_page()
    admin.sign_in(page)
    for address in (
        "/",
        f"/characteristics/{shop.characteristic}",
        f"/characteristics/{shop.characteristic}/readings/7",
    ):
        page.goto(address)
        expect(page.locator("h1")).to_be_visible()
        assert page.evaluate(CONTRAST) == [], address
    context.close()


# Visible words whose colour is too near to the first opaque ground behind them.
CONTRAST = """() => {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = colour; canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data];
  };
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4).reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const colour = rgba(getComputedStyle(at).backgroundColor);
      if (colour[3] > 250) return colour;
    }
    return [255, 255, 255, 255];
  };
  const poor = new Set();
  for (const element of document.querySelectorAll("main *")) {
    const words = [...element.childNodes].filter((n) => n.nodeType === 3 && n.data.trim()).map((n) => n.data.trim()).join(" ");
    if (!words || !element.checkVisibility({ visibilityProperty: true }) || element.closest("svg, .visually-hidden")) continue;
    const [a, b] = [light(rgba(getComputedStyle(element).color)), light(ground(element))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) poor.add(`${words.slice(0, 40)}: ${ratio.toFixed(2)}`);
  }
  return [...poor];
}"""
