"""Takes the pictures of `docs/images` from a demonstration that runs: `python -m docs.pictures [--only NAME] [--data-dir FOLDER]`.

Start it first, with a past, in a folder of its own (`inband demo --past 14 --data-dir FOLDER`), and wait until it is live. The
pictures have few colours, so that a wheel with all of them stays small.
"""

import argparse
import io
import json
import shutil
import sys
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from app import HOUSE

IMAGES = HOUSE / "docs" / "images"
COLOURS = 112  # of a picture
LONGEST = 60  # s that the charts of a page may take
DRAWN = "() => [...document.querySelectorAll('plotly-chart')].every((chart) => chart.drawn)"


class Picture(NamedTuple):
    """A picture: address of the page, the part of it that is shown, and the size of the screen.

    newest: a list of the API; `{id}` in the address is the number of its first item.
    """

    address: str
    part: str = "main"
    size: tuple[int, int] = (1180, 760)
    person: str = "engineer"
    newest: str = ""


PICTURES = {
    "zone-chart": Picture("/characteristics/flange-d62?last=200", "plotly-chart.zones > .plot", (1240, 1120)),
    "alarms": Picture("/alarms", size=(1000, 620)),
    "approvals": Picture("/corrections", size=(1000, 620)),
    "station": Picture("/station/lathe-2", "body", (1000, 660)),
    "sizes-by-hand": Picture("/station/lathe-1/sizes", "body", (1000, 720)),
    "set-up": Picture("/setup/characteristics/new", size=(1180, 800)),
    "six-pack": Picture("/characteristics/shaft-d40/six-pack", size=(1240, 800)),
    "what-if-map": Picture("/characteristics/plate-d30/what-if#map", "#map"),
    "wear-curve": Picture("/characteristics/shaft-d40", "#wear-curve", (1180, 1500)),
    "shift": Picture("/shift"),
    "notifications": Picture("/setup/notifications", size=(1180, 640), person="admin"),
    "groups": Picture("/setup/notifications", "section.card:has(#groups)", (1180, 1600), "admin"),
    "days-off": Picture("/setup/notifications/days-off", size=(1180, 700), person="admin"),
    "own-notifications": Picture("/account/notifications", "#browser", (1000, 1200), "operator"),
    "reaction-plan": Picture("/alarms/{id}", size=(1000, 1240), newest="/api/v1/alarms?kind=tool_worn&limit=1"),
    "wall-screen": Picture("/wall#{wall screen}", "body", (1280, 720)),
    "alarm-load": Picture("/alarms/load", size=(1180, 760)),
    "causes": Picture("/alarms/causes", size=(1000, 560)),
    "quarantine": Picture("/quarantines/2", size=(1180, 760)),
    "control-plan": Picture("/characteristics/flange-t18/control-plan", size=(1180, 900)),
    "nests": Picture("/characteristics/plate-p48?last=200&by=nest", "plotly-chart.zones > .plot", (1240, 1120)),
    "temperature": Picture("/characteristics/shaft-l120/temperature", size=(1180, 860)),
    "ledger": Picture("/ledger", size=(1180, 760)),
    "shadow-trial": Picture("/characteristics/flange-t18/trial", size=(1180, 760)),
}


def taken(browser: Browser, url: str, people: dict[str, str], picture: Picture) -> bytes:
    """The picture as PNG."""
    width, height = picture.size
    page = browser.new_page(
        base_url=url, viewport={"width": width, "height": height}, color_scheme="light", permissions=["notifications"]
    )
    _sign_in(page, picture.person, people[picture.person])
    known = people | (page.request.get(picture.newest).json()["items"][0] if picture.newest else {})
    page.goto(picture.address.format_map(known))
    if picture.address.startswith("/wall"):
        page.locator(".wall-machines").wait_for()
    for _tenth in range(LONGEST * 10):  # the page's policy lets no string be evaluated in it again and again
        if page.evaluate(DRAWN):
            break
        page.wait_for_timeout(100)
    else:
        raise SystemExit(f"{picture.address}: a chart is not drawn after {LONGEST} s")
    part = page.locator(picture.part)
    part.scroll_into_view_if_needed()
    box = part.bounding_box()
    assert box is not None, picture
    top = max(0.0, box["y"])
    shown = {"x": box["x"], "y": top, "width": box["width"], "height": min(box["y"] + box["height"], height) - top}
    raw = page.screenshot(clip=shown)  # type: ignore[arg-type]
    page.close()
    small = io.BytesIO()
    Image.open(io.BytesIO(raw)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(
        small, "PNG", optimize=True
    )
    return small.getvalue()


def _sign_in(page: Page, name: str, password: str) -> None:
    page.goto("/sign-in")
    page.get_by_label("Name").fill(name)
    page.get_by_label("Password").fill(password)
    page.locator("main button[type=submit]").click()
    page.wait_for_url(lambda at: not at.endswith("/sign-in"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--url", default="http://127.0.0.1:8000")
    parser.add_argument(
        "--data-dir", type=Path, default=Path("data"), help="of the demonstration: its passwords are there"
    )
    parser.add_argument("--only", action="append", choices=PICTURES)
    arguments = parser.parse_args()
    people = json.loads((arguments.data_dir / "demo.json").read_text())
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-headless-shell", "google-chrome"))), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for name in arguments.only or PICTURES:
            data = taken(browser, arguments.url, people, PICTURES[name])
            (IMAGES / f"{name}.png").write_bytes(data)
            sys.stdout.write(f"{name}.png {len(data) / 1000:.0f} kB\n")


if __name__ == "__main__":
    main()
