"""Memory of the server in a long run: readings at a steady rate, open live events, pages, charts and reports.

A line every STEP seconds with the resident memory of the server process, and at the end the growth per minute over the last
half of the run: it must come to rest. ``python -m bench.soak [--minutes 20] [--rate 100]``
"""

import argparse
import asyncio
import itertools
import random
import time
from collections import Counter

import httpx

from bench.load import TARGET
from bench.memory import resident
from bench.plant import Plant, plant

CHARACTERISTICS = 20
STEP = 30.0  # s between two lines
WANTED = 1.0  # MB a minute over the last half
STREAMS = 6  # live events that stay open for LISTENING seconds each, as pages do
LISTENING = 20.0
VIEWERS = 3  # people who open one page after the other
PAUSE = 0.2  # s between two pages of one of them

PAGES = (
    "/", "/overview", "/overview?by=ppk", "/plant/bench", "/alarms", "/alarms/history", "/corrections", "/tools",
    "/characteristics/{c}", "/characteristics/{c}?last=all", "/characteristics/{c}/readings/1",
    "/characteristics/{c}/control", "/characteristics/{c}/rules", "/characteristics/{c}/what-if",
    "/characteristics/{c}/capability", "/characteristics/{c}/report?last=all", "/proof", "/calibration", "/setup",
    "/api/v1/characteristics/{c}/figures/zones", "/api/v1/characteristics/{c}/figures/run",
    "/api/v1/characteristics/{c}/figures/histogram", "/api/v1/characteristics/{c}/figures/control",
    "/api/v1/characteristics/{c}/figures/capability", "/api/v1/characteristics/{c}/figures/wear",
    "/api/v1/characteristics/{c}/statistics", "/api/v1/readings?characteristic={c}&limit=1000", "/metrics",
    "/api/v1/openapi.json",
)  # fmt: skip
REPORTS = ("pdf", "xlsx", "csv", "json")


class Soak:
    """Load on one server until the time is up."""

    def __init__(self, at: Plant, rate: float, until: float) -> None:
        self.at = at
        self.rate = rate
        self.until = until
        self.answers: Counter[str] = Counter()

    async def run(self) -> None:
        """Everything at once."""
        limits = httpx.Limits(max_connections=None)
        headers = {"Authorization": f"Bearer {self.at.key}"}
        async with httpx.AsyncClient(base_url=self.at.url, headers=headers, timeout=120, limits=limits) as client:
            await asyncio.gather(
                self._readings(client),
                *(self._listen(client) for _ in range(STREAMS)),
                *(self._view(client, number) for number in range(VIEWERS)),
                self._reports(client),
                self._print(),
            )

    async def _get(self, client: httpx.AsyncClient, path: str) -> None:
        answer = await client.get(path)
        kind = path.partition("?")[0].replace("/api/v1", "").strip("/").split("/")
        self.answers[f"{answer.status_code}"] += 1
        if answer.status_code >= 400:
            print(f"{path}: {answer.status_code} {kind} {answer.text[:200]}", flush=True)

    async def _readings(self, client: httpx.AsyncClient) -> None:
        chance = random.Random(1)
        for number in itertools.count():
            if time.monotonic() > self.until:
                return
            begun = time.monotonic()
            reading = {
                "characteristic": f"c{number % CHARACTERISTICS + 1}",
                "measured": round(TARGET + chance.gauss(0, 0.0015), 4),
                "key": f"soak {number}",
                "part": f"SN-{number}",
            }
            (await client.post("/api/v1/readings", json=reading)).raise_for_status()
            self.answers["readings"] += 1
            await asyncio.sleep(max(0.0, 1 / self.rate - (time.monotonic() - begun)))

    async def _listen(self, client: httpx.AsyncClient) -> None:
        while time.monotonic() < self.until:
            ending = time.monotonic() + LISTENING
            async with client.stream("GET", "/api/v1/events") as stream:
                async for _part in stream.aiter_bytes():
                    self.answers["parts of events"] += 1
                    if time.monotonic() > ending:
                        break

    async def _view(self, client: httpx.AsyncClient, number: int) -> None:
        chance = random.Random(number)
        while time.monotonic() < self.until:
            for page in chance.sample(PAGES, len(PAGES)):
                await self._get(client, page.format(c=f"c{chance.randint(1, CHARACTERISTICS)}"))
                await asyncio.sleep(PAUSE)
                if time.monotonic() > self.until:
                    return

    async def _reports(self, client: httpx.AsyncClient) -> None:
        chance = random.Random(99)
        for form in itertools.cycle(REPORTS):
            if time.monotonic() > self.until:
                return
            c = f"c{chance.randint(1, CHARACTERISTICS)}"
            await self._get(client, f"/api/v1/characteristics/{c}/report.{form}")
            await asyncio.sleep(2)

    async def _print(self) -> None:
        begun = time.monotonic()
        curve: list[tuple[float, float]] = []
        while time.monotonic() < self.until:
            minutes, size = (time.monotonic() - begun) / 60, resident(self.at.process.pid)
            curve.append((minutes, size))
            answers = ", ".join(f"{count:,} {what}" for what, count in sorted(self.answers.items()))
            print(f"{minutes:6.1f} min  {size:6.1f} MB   {answers}", flush=True)
            await asyncio.sleep(STEP)
        half = curve[len(curve) // 2 :]
        growth = slope(half)
        print(f"from {curve[0][1]:.0f} to {curve[-1][1]:.0f} MB, at most {max(size for _, size in curve):.0f}")
        print(f"growth over the last half {growth:+.2f} MB a minute (wanted <= {WANTED})")


def slope(curve: list[tuple[float, float]]) -> float:
    """Of the straight line through the points."""
    n = len(curve)
    mean_x, mean_y = sum(x for x, _ in curve) / n, sum(y for _, y in curve) / n
    across = sum((x - mean_x) ** 2 for x, _ in curve)
    return sum((x - mean_x) * (y - mean_y) for x, y in curve) / across if across else 0.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--rate", type=float, default=100, help="readings a second")
    arguments = parser.parse_args()
    with plant(CHARACTERISTICS) as at:
        asyncio.run(Soak(at, arguments.rate, time.monotonic() + 60 * arguments.minutes).run())


if __name__ == "__main__":
    main()
