"""Opening pages in a real browser whose cache is empty: time to the first byte, time until usable, and what comes over the wire.

Usable is a page whose first chart is drawn, or whose words all stand where it has no chart. With ``--against`` a folder in
which another version is checked out, with a ``.venv`` of its own, both versions serve the same plant and are opened in turn;
printed are this one, that one, and the ratio of the medians (below 1: this one is better).
``python -m bench.pages [--rounds 5] [--readings 300] [--against ../first-version] [--page plant --page "control chart"]``
"""

import argparse
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import httpx
from playwright.sync_api import Browser, StorageState, sync_playwright

from bench.plant import PARAMETERS, TARGET, free_port, median, wait_until_ready

HOUSE = Path(__file__).parents[1]
PYTHON = Path(".venv/bin/python")
PASSWORD = "correct horse battery"
CHARACTERISTICS = 6
# What a page is called, and its addresses: the second one where a version does not have the first. All pages that the first
# version has are here but those of what this plant does not hold: a signal, a proposal, a study, a run, a form, an alignment.
MACHINE, CHARACTERISTIC = "/machines/bench", "/characteristics/c1"
PAGES = {
    "plant": ["/"],
    "plant, a machine": ["/plant/bench"],
    "station": ["/station/bench", "/plant/bench"],
    "to do": ["/todo", "/alarms"],
    "alarms": ["/alarms"],
    "alarm": ["/alarms/1"],
    "alarms, history": ["/alarms/history"],
    "approvals": ["/corrections"],
    "proposals": ["/proposals"],
    "characteristic": [CHARACTERISTIC],
    "reading": [f"{CHARACTERISTIC}/readings/3"],
    "control chart": [f"{CHARACTERISTIC}/control"],
    "control, freeze": [f"{CHARACTERISTIC}/control/freeze"],
    "rules": [f"{CHARACTERISTIC}/rules"],
    "signals": [f"{CHARACTERISTIC}/signals"],
    "capability": [f"{CHARACTERISTIC}/capability"],
    "what if": [f"{CHARACTERISTIC}/what-if"],
    "report": [f"{CHARACTERISTIC}/report"],
    "reports": ["/reports"],
    "overview": ["/overview"],
    "proof": ["/proof"],
    "gauge studies": ["/gauges"],
    "gauge study, new": ["/gauges/new?kind=grr"],
    "tools": [f"{MACHINE}/tools"],
    "tool": [f"{MACHINE}/tools/1"],
    "tool, edit": [f"{MACHINE}/tools/1/edit"],
    "tool, change": [f"{MACHINE}/tools/1/change"],
    "average, edit": [f"{MACHINE}/averages/1/edit"],
    "correction": [f"{MACHINE}/corrections/1"],
    "program text": [f"{MACHINE}/corrections/program"],
    "calibration": ["/calibration"],
    "calibrated place": ["/calibration/bench/averages/1"],
    "import": ["/import"],
    "set-up list": ["/setup/characteristics"],
    "set-up, new": ["/setup/characteristics/new"],
    "machine, new": ["/setup/machines/new"],
    "people": ["/setup/people"],
    "audit": ["/setup/audit"],
    "account": ["/account"],
    "alignments": ["/alignments"],
    "alignment, new": ["/alignments/new"],
    "forms": ["/forms"],
    "form, new": ["/forms/new"],
    "rotary axes": ["/kinematics"],
    "rotary axes, new": ["/kinematics/new"],
    "axes of a machine": ["/kinematics/machines/bench"],
    "work zeros": ["/work-zeros"],
    "work zero, new": ["/work-zeros/new"],
    "API": ["/api/docs"],
}
QUIET = 0.5  # s without an open request until everything has come
PATIENCE = 120.0  # s
FIRST_DRAWN = 'addEventListener("drawn", () => { window.firstDrawn ??= performance.now(); }, { once: true })'
TIMES = """() => {
  const [{ responseStart, domContentLoadedEventEnd }] = performance.getEntriesByType("navigation");
  return { ttfb: responseStart, usable: document.querySelector("plotly-chart") ? window.firstDrawn : domContentLoadedEventEnd };
}"""


class Opened(NamedTuple):
    """What one opening of a page took: milliseconds and kB."""

    ttfb: float
    usable: float
    size: float


@dataclass
class Version:
    """A running server of one version, with its plant."""

    url: str
    signed_in: StorageState
    opened: dict[str, list[Opened]] = field(default_factory=lambda: defaultdict(list))

    def address(self, name: str) -> str:
        """The first address of this page that the version has."""
        with httpx.Client(base_url=self.url, cookies=_cookies(self.signed_in), timeout=60) as client:
            return next(each for each in PAGES[name] if client.get(each).status_code == httpx.codes.OK)

    def row(self, name: str) -> Opened:
        """The medians of a page."""
        ttfb, usable, size = (median(list(each)) for each in zip(*self.opened[name], strict=True))
        return Opened(ttfb, usable, size)


def _cookies(state: StorageState) -> dict[str, str]:
    return {each["name"]: each["value"] for each in state["cookies"]}


@contextmanager
def version(home: Path, readings: int, browser: Browser) -> Iterator[Version]:
    """The version that is checked out in a folder, serving a plant of its own."""
    python = sys.executable if home == HOUSE else str(home / PYTHON)
    with tempfile.TemporaryDirectory(prefix="inband-bench-") as folder:
        port, data = free_port(), ["--data-dir", str(Path(folder) / "data")]
        serve = [python, "-m", "app", "serve", "--port", str(port), *data]
        nowhere: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        process = subprocess.Popen(serve, cwd=home, **nowhere)
        try:
            url = f"http://127.0.0.1:{port}"
            wait_until_ready(url, process)

            def call(*command: str, said: str | None = None) -> str:
                run = [python, "-m", "app", *command, *data]
                return subprocess.run(run, cwd=home, input=said, text=True, check=True, capture_output=True).stdout

            call("user", "add", "bench", "--role", "admin", "--password-stdin", said=PASSWORD)
            fill(url, call("key", "add", "--role", "admin").split()[-1], readings)
            yield Version(url, signed_in(browser, url))
        finally:
            process.terminate()
            process.wait(60)


def fill(url: str, key: str, readings: int) -> None:
    """The same plant for every version: one machine whose first characteristic has the most readings, one per minute."""
    chance, now = random.Random(1), datetime.now(UTC)
    with httpx.Client(base_url=f"{url}/api/v1", headers={"Authorization": f"Bearer {key}"}, timeout=60) as client:
        client.post("/machines", json={"key": "bench", "name": "Bench", "control": "other"}).raise_for_status()
        for number in range(1, CHARACTERISTICS + 1):
            parameters = PARAMETERS | {"tool_memory": number, "average_memory": number}
            body = {"key": f"c{number}", "name": f"Bench {number}", "machine": "bench", "parameters": parameters}
            client.post("/characteristics", json=body).raise_for_status()
            count = readings if number == 1 else readings // 10
            pushed = [
                {
                    "characteristic": f"c{number}",
                    "measured": round(TARGET + chance.gauss(0, 0.002), 5),
                    "measured_at": (now - timedelta(minutes=count - each)).isoformat(),
                }
                for each in range(count)
            ]
            client.post("/readings/batch", json=pushed).raise_for_status()
        client.post("/readings", json={"characteristic": "c2", "measured": TARGET + 0.0125}).raise_for_status()


def signed_in(browser: Browser, url: str) -> StorageState:
    """Cookies of somebody who has signed in."""
    context = browser.new_context(base_url=url)
    page = context.new_page()
    page.goto("/sign-in")
    page.get_by_label("Name").fill("bench")
    page.get_by_label("Password").fill(PASSWORD)
    page.locator("main button[type=submit]").click()
    page.wait_for_url(lambda at: not at.endswith("/sign-in"))
    state = context.storage_state()
    context.close()
    return state


def cold(browser: Browser, of: Version, address: str) -> Opened:
    """Open a page with an empty cache, until everything that it asks for has come."""
    context = browser.new_context(base_url=of.url, storage_state=of.signed_in, viewport={"width": 1280, "height": 800})
    context.add_init_script(FIRST_DRAWN)
    page = context.new_page()
    wire, coming, came = context.new_cdp_session(page), set[str](), 0.0

    def begin(event: dict[str, Any]) -> None:
        if event.get("type") not in ("EventSource", "WebSocket"):  # live events never end
            coming.add(event["requestId"])

    def end(event: dict[str, Any]) -> None:
        nonlocal came
        came += event.get("encodedDataLength", 0)
        coming.discard(event["requestId"])

    wire.on("Network.requestWillBeSent", begin)
    wire.on("Network.loadingFinished", end)
    wire.on("Network.loadingFailed", end)
    wire.send("Network.enable")
    page.goto(address)
    begun = quiet_since = time.monotonic()
    while time.monotonic() - quiet_since < QUIET or (times := page.evaluate(TIMES))["usable"] is None:
        page.wait_for_timeout(50)
        if coming:
            quiet_since = time.monotonic()
        if time.monotonic() - begun > PATIENCE:
            raise SystemExit(f"{of.url}{address}: not usable within {PATIENCE:g} s")
    context.close()
    return Opened(times["ttfb"], times["usable"], came / 1000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--readings", type=int, default=300)
    parser.add_argument("--against", type=Path, help="a folder with another version and its .venv")
    parser.add_argument("--page", action="append", choices=PAGES, help="this page, not all; may be given several times")
    arguments = parser.parse_args()
    names: list[str] = arguments.page or list(PAGES)
    if arguments.against and not (arguments.against / PYTHON).exists():
        parser.error(f"{arguments.against / PYTHON} is missing: install that version into a .venv of its own first")
    homes = [HOUSE] + ([arguments.against.resolve()] if arguments.against else [])
    chromium = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chromium-headless-shell"))),
        None,
    )
    with sync_playwright() as playwright, ExitStack() as running:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        versions = [running.enter_context(version(home, arguments.readings, browser)) for home in homes]
        addresses = [{name: of.address(name) for name in names} for of in versions]
        for turn in range(arguments.rounds + 1):
            for name in names:
                for of, at in zip(versions, addresses, strict=True):
                    opened = cold(browser, of, at[name])
                    if turn:  # the first time the server reads templates and figures for the first time too
                        of.opened[name].append(opened)
        browser.close()
    against = arguments.against is not None
    titles = ("first byte, ms", "usable, ms", "over the wire, kB")
    print(f"{'':<18}" + "".join(f"{title:>{24 if against else 20}}" for title in titles))
    for name in names:
        rows = [of.row(name) for of in versions]
        cells = [
            f"{values[0]:>8.0f} {values[1]:>7.0f} {values[0] / values[1]:>7.2f}" if against else f"{values[0]:>20.0f}"
            for values in zip(*rows, strict=True)
        ]
        other = "" if not against or len({at[name] for at in addresses}) == 1 else f"  (there {addresses[1][name]})"
        print(f"{name:<18}" + "".join(cells) + other)


if __name__ == "__main__":
    main()
