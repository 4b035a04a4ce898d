"""Every page by the rules of axe-core (WCAG 2.2 A and AA, best practices), wide and narrow, light and dark; targets beside the machine."""

from collections import defaultdict
from typing import Any, Literal

import pytest
from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Page, expect

from app.access import devices
from tests.conftest import Server
from tests.pages.test_every_page import addresses, furnished, opened
from tests.shop import Person, Shop

PARTS = 3  # so that several workers share the pages
DESK, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
ALL, COLOURS = None, "color-contrast"  # what else axe looks at is the same in other colours
STATES: list[tuple[Any, Literal["light", "dark"], str | None]] = [
    (DESK, "light", ALL),
    (DESK, "dark", COLOURS),
    (PHONE, "dark", ALL),
    (PHONE, "light", COLOURS),
]

# Every rule that is on by default, and the size of targets (WCAG 2.5.8: 24 px, or as far from the next one); or one rule.
AXE = """async (only) => {
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));  // boxes have seen their new size
  const rules = only ? { runOnly: [only] } : { rules: { "target-size": { enabled: true } } };
  const { violations } = await axe.run({ ...rules, resultTypes: ["violations"], preload: false });
  return violations.flatMap(({ id, nodes }) => nodes.map(({ target, html }) => `${id}: ${target.flat().join(" ")} ${html.slice(0, 160)}`));
}"""


@pytest.fixture(scope="module")
def shop(server: Server) -> Shop:
    return furnished(server)


@pytest.fixture(scope="module")
def admin(server: Server) -> Person:
    return Person(server, "admin")


def violations(page: Page) -> dict[str, str]:
    """What axe finds on the open page, and in which of the four states first."""
    found: dict[str, str] = {}
    page.evaluate(AXE_SCRIPT)
    for size, scheme, rule in STATES:
        page.set_viewport_size(size)
        page.emulate_media(color_scheme=scheme)
        for violation in page.evaluate(AXE, rule):
            found.setdefault(violation, f"{size['width']} px, {scheme}")
    return found


@pytest.mark.parametrize("part", range(PARTS))
def test_axe_finds_nothing(page: Page, shop: Shop, admin: Person, part: int) -> None:
    admin.sign_in(page)
    found: dict[str, list[str]] = defaultdict(list)
    for address in addresses(shop)[part::PARTS]:
        opened(page, address)
        for violation, state in violations(page).items():
            found[violation].append(f"{address} at {state}")
    assert dict(found) == {}


def test_axe_finds_nothing_before_signing_in(page: Page, shop: Shop) -> None:
    page.goto("/sign-in")
    expect(page.locator("h1")).to_be_visible()
    assert violations(page) == {}


# Pages that are worked beside the machine, with gloves. Reading 3 has the dialog of a measurement by hand.
OPERATOR_PAGES = [
    "/",
    "/plant/{machine}",
    "/station/{machine}",
    "/station/{machine}/alarms/{alarm}?action=measured_by_hand",
    "/station/{machine}/tools/3/change",
    "/alarms",
    "/alarms/{alarm}",
    "/alarms/{alarm}?action=keep_cutting",
    "/alarms/history",
    "/todo",
    "/connections",
    "/machines/{machine}/connection",
    "/machines/{machine}/touch-tests/{touch_test}",
    "/corrections",
    "/corrections/{machine}/tools/5",
    "/machines/{machine}/tools/3/change",
    "/characteristics/{characteristic}/readings/3",
    "/account",
]
FINGER = 44  # px

# Everything that reacts, smaller than a finger: by itself, by its label, or by the row that its ::after covers. Links in sentences may be
# as high as their line, and what is seen only with the keyboard may have any size.
SMALL = """(least) => {
  const REACTS = "a[href], button, input:not([type=hidden]), select, textarea, summary, [role=button]";
  const inSentence = (at) => {
    if (getComputedStyle(at).display !== "inline") return false;
    const words = [...at.parentElement.childNodes].filter((n) => n !== at && !n.matches?.(REACTS)).map((n) => n.textContent).join("");
    return words.trim().length > 20;
  };
  const boxOf = (at) => {
    const after = getComputedStyle(at, "::after");
    if (after.content !== "none" && after.position === "absolute" && after.inset === "0px") {
      let row = at;
      while (getComputedStyle(row).position === "static") row = row.parentElement;
      return row.getBoundingClientRect();
    }
    const label = at.matches("[type=checkbox], [type=radio]") ? at.closest("label") : null;
    return (label ?? at).getBoundingClientRect();
  };
  const small = [];
  for (const at of document.querySelectorAll(REACTS)) {
    if (!at.checkVisibility({ visibilityProperty: true, opacityProperty: false }) || at.disabled || at.closest(".skip-link") || inSentence(at)) continue;
    const { width, height } = boxOf(at);
    if (Math.round(width) < least || Math.round(height) < least)
      small.push(`${Math.round(width)} × ${Math.round(height)} ${at.outerHTML.replace(/\\s+/g, " ").slice(0, 140)}`);
  }
  return small;
}"""


def small_targets(page: Page) -> list[str]:
    """What reacts and is smaller than a finger, dialogs of the page included."""
    page.evaluate("document.querySelectorAll('dialog').forEach((dialog) => dialog.show())")
    return [str(target) for target in page.evaluate(SMALL, FINGER)]


@pytest.mark.parametrize("width", [390, 800, 1280])
def test_targets_beside_the_machine_are_as_large_as_a_finger(
    page: Page, shop: Shop, admin: Person, server: Server, width: int
) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    with server.database.begin() as session:
        code = devices.make_code(session, shop.machine, "Tablet", "tests")
    small = {}

    def look(address: str) -> None:
        opened(page, address)
        if found := small_targets(page):
            small[address] = found

    values = {"machine": shop.machine, "characteristic": shop.characteristic, "alarm": shop.alarms()[0]["id"]}
    values["touch_test"] = shop.call("GET", f"/machines/{shop.machine}/touch-tests")["items"][0]["id"]
    look("/sign-in")
    look(f"/station?code={code}")
    page.get_by_role("button", name="Bind").click()
    expect(page.locator(".station-page")).to_be_visible()
    look(f"/station/{shop.machine}/alarms/{values['alarm']}?action=noted")  # by PIN or badge
    page.context.clear_cookies()
    admin.sign_in(page)
    for address in OPERATOR_PAGES:
        look(address.format(**values))
    assert small == {}


def test_contrast_themes_of_the_system_show_what_is_chosen(page: Page, shop: Shop, admin: Person) -> None:
    page.emulate_media(forced_colors="active")
    admin.sign_in(page)
    opened(page, f"/characteristics/{shop.characteristic}")
    for choice in page.locator("nav.choice").all():
        grounds = choice.locator("a").evaluate_all(
            "links => links.map((link) => getComputedStyle(link).backgroundColor + (link.ariaCurrent ? ' chosen' : ''))"
        )
        assert len(set(grounds)) == 2, grounds
    chart = page.locator("plotly-chart").first  # marks and bands on their own ground
    assert chart.evaluate("chart => getComputedStyle(chart).forcedColorAdjust") == "none"
