"""What a page is looked at for: width, the rules of axe-core (WCAG 2.2 A and AA, best practices), targets, contrast."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any, Literal

from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Locator, Page, expect

from tests.waits import until

LIMIT = 20_000  # ms; charts are drawn anew, and the computer may have other work

SIZES = {"desk": (1280, 800), "large": (1920, 1080), "panel": (800, 1280), "phone": (390, 844)}
# Zoomed to 200 %, a screen has letters of twice the size and half as many pixels of the page (WCAG 1.4.4).
SIZES |= {"desk-zoomed": (640, 400), "phone-zoomed": (195, 422)}

ALL: dict[str, Any] = {"rules": {"target-size": {"enabled": True}}}
"""Every rule that is on by default, and the size of targets (WCAG 2.5.8: 24 px, or as far from the next one)."""
COLOURS: dict[str, Any] = {"runOnly": ["color-contrast"]}  # what else axe looks at is the same in other colours

State = tuple[str, Literal["light", "dark"], dict[str, Any]]
"""Size, colours, and which rules axe looks at."""
STATES: tuple[State, ...] = (
    ("desk", "light", ALL),
    ("desk", "dark", COLOURS),
    ("phone", "dark", ALL),
    ("phone", "light", COLOURS),
)


def opened(page: Page, address: str) -> None:
    """Open a page that has to be in order, and wait for its charts."""
    answer = page.goto(address) or page.reload()  # where only what is behind # differs, the page stays
    assert answer is not None
    assert answer.status == 200, address
    expect(page.locator("main")).to_be_visible()
    drawn(page)


def drawn(page: Page, charts: str = "plotly-chart") -> None:
    """Wait until these charts are drawn and hear what is done to them. Their first lines may be there before."""
    until(
        lambda: page.evaluate("charts => [...document.querySelectorAll(charts)].every((chart) => chart.drawn)", charts)
    )


def live(page: Page) -> None:
    """Wait until the page hears what happens."""
    expect(page.locator("live-status")).to_have_attribute("state", "live")


def until_shown(part: Locator, touch: Callable[[], None]) -> None:
    """Touch a place of the screen until this is seen. Between measuring and touching, what lies there may move."""

    def shown() -> bool:
        touch()
        with suppress(AssertionError):
            expect(part).to_be_visible(timeout=2_000)
            return True
        return False

    until(shown)


def resize(page: Page, size: str) -> None:
    """See the page on another screen."""
    width, height = SIZES[size]
    page.set_viewport_size({"width": width, "height": height})


def boxes(page: Page, parts: str) -> list[dict[str, float]]:
    """Where those that are seen are, all at one moment: what has just happened may have the page fetch its parts again.

    A locator would not do: what it finds may have been replaced when it is measured.
    """
    found: list[dict[str, float]] = page.evaluate(
        "parts => [...document.querySelectorAll(parts)].filter((part) => part.checkVisibility())"
        ".map((part) => part.getBoundingClientRect().toJSON())",
        parts,
    )
    return found


TOO_WIDE = """async (limit) => {
  const more = () => document.documentElement.scrollWidth - document.documentElement.clientWidth;
  const end = performance.now() + limit;
  while (more() > 0 && performance.now() < end) await new Promise(requestAnimationFrame);
  return Math.max(0, more());
}"""


def too_wide(page: Page) -> int:
    """Pixels by which the page stays wider than the screen; a chart may take a moment to become as narrow."""
    return int(page.evaluate(TOO_WIDE, LIMIT))


# Thirty lines of the ranking are on a desk's screen: 22 px each for a mouse, 44 for a finger. The name beside the button leads to the same.
AXE = """async (options) => {
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));  // boxes have seen their new size
  const bars = document.querySelectorAll(".confirm .actions, .sheet-actions");  // what lies under one is scrolled out from it
  for (const bar of bars) bar.style.position = "static";
  const { violations } = await axe.run({ ...options, resultTypes: ["violations"], preload: false });
  for (const bar of bars) bar.style.position = "";
  const dense = (id, target) => id === "target-size" && document.querySelector(target.flat().at(-1))?.matches(".ranking .why > button");
  return violations.flatMap(({ id, nodes }) => nodes.filter(({ target }) => !dense(id, target)).map(({ target, html }) => `${id}: ${target.flat().join(" ")} ${html.slice(0, 160)}`));
}"""


def violations(page: Page, states: tuple[State, ...] = STATES) -> dict[str, str]:
    """What axe finds on the open page, and in which of the states first."""
    found: dict[str, str] = {}
    if states and not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    for size, scheme, options in states:
        resize(page, size)
        page.emulate_media(color_scheme=scheme)
        for violation in page.evaluate(AXE, options):
            found.setdefault(violation, f"{size}, {scheme}")
    return found


FINGER = 44  # px

# Everything that reacts, smaller than a finger: by itself, by its label, or by the row that its ::after covers. Links in sentences may be
# as high as their line, and what is seen only with the keyboard may have any size. The sentence of a term is no act: with a mouse 24 px
# will do (2.5.8).
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
    const box = (label ?? at).getBoundingClientRect();
    if (after.content === "none" || after.position !== "absolute") return box;
    const [top, right, bottom, left] = ["top", "right", "bottom", "left"].map((side) => Math.max(0, -parseFloat(after[side])));
    return { width: box.width + left + right, height: box.height + top + bottom };
  };
  const small = [];
  for (const at of document.querySelectorAll(REACTS)) {
    if (!at.checkVisibility({ visibilityProperty: true, opacityProperty: false }) || at.disabled || at.closest(".skip-link, [aria-hidden=true]") || inSentence(at)) continue;
    const { width, height } = boxOf(at);
    const wanted = at.matches("[data-term]") && innerWidth > 1100 ? 24 : least;
    if (Math.round(width) < wanted || Math.round(height) < wanted)
      small.push(`${Math.round(width)} × ${Math.round(height)} ${at.outerHTML.replace(/\\s+/g, " ").slice(0, 140)}`);
  }
  return small;
}"""


def small_targets(page: Page) -> list[str]:
    """What reacts and is smaller than a finger, dialogs of the page included."""
    page.evaluate("document.querySelectorAll('dialog').forEach((dialog) => dialog.show())")
    return [str(target) for target in page.evaluate(SMALL, FINGER)]


def pale_words(page: Page) -> list[str]:
    """Words with too little contrast in either theme (WCAG AA: 4.5 : 1); axe knows more of it and takes ten times as long."""
    found = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        found += [f"{scheme}: {words}" for words in page.evaluate(CONTRAST)]
    return found


# Visible words whose colour is too near to the first opaque ground behind them.
CONTRAST = """() => {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const known = new Map();  // a page has some dozen colours and thousands of words
  const rgba = (colour) => {
    if (!known.has(colour)) {
      canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = colour; canvas.fillRect(0, 0, 1, 1);
      known.set(colour, [...canvas.getImageData(0, 0, 1, 1).data]);
    }
    return known.get(colour);
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
