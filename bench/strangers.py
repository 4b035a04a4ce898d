"""Machines that push while strangers load the server: their waiting time idle and under load, as a ratio; wanted is below 5.

Sixteen machines send a reading every 200 ms, one after the other. Nobody else is there, then, each after an idle time of its
own: 1,000 connections that are silent or keep half a head back, bodies that come ten bytes at a time, guesses of keys, passwords
and badges, two imports one after the other without end, 20 requests for reports, and three times all of them. The next idle time
begins when all reports are made. Everything is bounded in number and time and goes to this computer only; the strangers get
what time the processors have left, as they would use others of their own.

``python -m bench.strangers [--seconds 20]`` ends with 1 where the ratio is 5 or more.
"""

import argparse
import asyncio
import json
import os
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack, suppress
from typing import Any, NamedTuple

import httpx
import uvloop

from app.access import actions, devices
from app.db.engine import Database
from app.loop.tables import machines as _machines  # noqa: F401 - the table that devices refer to
from bench.plant import PARAMETERS, TARGET, Plant, median, plant

MACHINES = 16
PACE = 0.2  # s from one reading of a machine to its next
WANTED = 5.0
TURNS = 3  # of all strangers together: the median counts, as other programs of this computer come and go
SILENT, SLOW = 1000, 100  # connections
GUESSERS, IMPORTERS, REPORTS = 8, 2, 20
ROWS = 2000  # of the file that is imported
PAUSE = 1.0  # s until a stranger who was refused comes again
MOST_TIMES = 5000  # that one stranger does its thing
REPORTS_MOST = 300  # s that all reports may take
STRANGERS_MOST = 3.0  # s that ending all of them may take
HEAD = "POST /api/v1/notes HTTP/1.1\r\nHost: 127.0.0.1\r\n"


class Waited(NamedTuple):
    """Waiting times of readings (ms) at two quantiles, and the number of readings."""

    number: int
    median: float
    p99: float


def push(url: str, keys: list[str], seconds: float, run: str) -> Waited:
    """Let the machines push, in a process of their own."""
    words = [sys.executable, "-m", "bench.strangers", "--machines", url, str(seconds), run, *keys]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=seconds + 120)
    return Waited(*json.loads(done.stdout))


async def machines(url: str, seconds: float, run: str, keys: list[str]) -> None:
    """Push readings and print how long each waited for its answer."""
    waited: list[float] = []
    trust = httpx.create_ssl_context(trust_env=False)  # one for all: to make one takes as long as some readings

    async with AsyncExitStack() as open_clients:
        clients = [
            await open_clients.enter_async_context(
                httpx.AsyncClient(
                    base_url=f"{url}/api/v1", headers={"Authorization": f"Bearer {key}"}, timeout=60, verify=trust
                )
            )
            for key in keys
        ]

        async def send(number: int, sent: int) -> None:
            reading = {"characteristic": f"s{number}", "measured": TARGET, "key": f"{run}:{sent}"}
            (await clients[number].post("/readings", json=reading)).raise_for_status()

        async def machine(number: int, begin: float) -> None:
            for sent in range(round(seconds / PACE)):
                await asyncio.sleep(begin + PACE * (number / MACHINES + sent) - time.perf_counter())
                begun = time.perf_counter()
                await send(number, sent)
                waited.append((time.perf_counter() - begun) * 1000)

        for number in range(len(keys)):
            await send(number, -1)  # connects
        begin = time.perf_counter()
        await asyncio.gather(*(machine(number, begin) for number in range(len(keys))))
    waited.sort()
    print(json.dumps([len(waited), waited[len(waited) // 2], waited[int(len(waited) * 0.99)]]))


class Strangers:
    """Everybody else. got: the statuses that each kind was answered, or the error."""

    def __init__(self, url: str, engineer: str, tablet: tuple[str, str], file: str) -> None:
        self.url, self.engineer, self.tablet, self.file = url, engineer, tablet, file
        self.port = int(url.rpartition(":")[2])
        self.got: Counter[str] = Counter()

    async def load(self, which: str, seconds: float) -> None:
        """Load the server for so long, by this kind of them or by all."""
        everyone: list[tuple[str, Callable[[int], Awaitable[None]], int]] = [
            ("silent", self.silent, SILENT),
            ("slow", self.slow, SLOW),
            ("guesses", self.guess, GUESSERS),
            ("imports", self.bring, IMPORTERS),
            ("reports", self.ask, REPORTS),
        ]
        kinds = [(what, many) for name, what, many in everyone if which == "all" or name in which.split(",")]
        everybody = [asyncio.create_task(self.again(what, number)) for what, many in kinds for number in range(many)]
        await asyncio.sleep(seconds)
        for each in everybody:
            each.cancel()
        done, _late = await asyncio.wait(everybody, timeout=STRANGERS_MOST)
        for each in done:
            if not each.cancelled():
                each.result()  # raises what nobody expected

    async def again(self, what: Callable[[int], Awaitable[None]], number: int) -> None:
        """Do it again and again, reports once each."""
        for _time in range(1 if what == self.ask else MOST_TIMES):
            try:
                await what(number)
            except (OSError, httpx.HTTPError) as error:
                self.got[f"{what.__name__} {type(error).__name__}"] += 1
            await asyncio.sleep(PAUSE)

    async def silent(self, number: int) -> None:
        """Open a connection, say nothing or half a head, and keep it until the server closes it."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        try:
            if number % 2:
                writer.write(HEAD.encode())
            self.got["silent closed" if not await reader.read(1000) else "silent refused"] += 1
        finally:
            writer.close()

    async def slow(self, number: int) -> None:
        """Send a body ten bytes at a time; half of them with a key, so that it is read."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        try:
            key = f"Authorization: Bearer {self.engineer}\r\n" if number % 2 else ""
            writer.write(f"{HEAD}{key}Content-Type: application/json\r\nContent-Length: 900000\r\n\r\n".encode())
            answer = asyncio.create_task(reader.read(1000))
            for _piece in range(MOST_TIMES):
                if answer.done():
                    self.got[f"slow {answer.result()[9:12].decode() or 'closed'}"] += 1
                    return
                writer.write(b'"aaaaaaaa"')
                await asyncio.sleep(0.2)
        finally:
            writer.close()

    async def guess(self, number: int) -> None:
        """Guess a key, a password or a badge, ten times a second."""
        cookie, csrf = self.tablet
        async with httpx.AsyncClient(base_url=self.url, timeout=60) as client:
            for turn in range(100):
                code = f"{number}-{time.monotonic_ns()}"
                if turn % 3 == 0:
                    answer = await client.get("/api/v1/machines", headers={"Authorization": f"Bearer {code}"})
                elif turn % 3 == 1:
                    answer = await client.post("/sign-in", data={"name": "admin", "password": code})
                else:
                    form = {"csrf": csrf, "text": "note", "key": code, "badge": code}
                    answer = await client.post("/station/bench/note", data=form, headers={"Cookie": cookie})
                self.got[f"guess {('key', 'password', 'badge')[turn % 3]} {answer.status_code}"] += 1
                await asyncio.sleep(0.1)

    async def bring(self, _number: int) -> None:
        """Import a file, which is looked at and not stored."""
        body = {"name": "strange.dfq", "content": self.file, "characteristics": {"c1": "c1"}, "dry_run": True}
        answer = await self._as_engineer("/readings/aqdef", body)
        self.got[f"import {answer.status_code}"] += 1

    async def ask(self, _number: int) -> None:
        """Ask for a report of all characteristics."""
        answer = await self._as_engineer("/reports", {"machines": ["bench"]})
        self.got[f"report {answer.status_code}"] += 1

    async def _as_engineer(self, path: str, body: dict[str, Any]) -> httpx.Response:
        headers = {"Authorization": f"Bearer {self.engineer}"}
        async with httpx.AsyncClient(base_url=f"{self.url}/api/v1", headers=headers, timeout=120) as client:
            return await client.post(path, json=body)


def furnish(running: Plant) -> tuple[list[str], tuple[str, str], str]:
    """Make the machines: their keys, a tablet's cookie and token of its forms, and a file of readings."""
    headers = {"Authorization": f"Bearer {running.key}"}
    keys: list[str] = []
    with httpx.Client(base_url=f"{running.url}/api/v1", headers=headers, timeout=60) as client:
        for number in range(MACHINES):
            name = f"m{number}"
            client.post("/machines", json={"key": name, "name": name, "control": "other"}).raise_for_status()
            made = {"key": f"s{number}", "name": f"Seat {number}", "machine": name, "parameters": PARAMETERS}
            client.post("/characteristics", json=made).raise_for_status()
            keys.append(
                client.post(f"/machines/{name}/keys", json={"name": "control"}).raise_for_status().json()["secret"]
            )
        readings = [
            {"characteristic": "c1", "measured": TARGET + 0.0001 * (n % 19 - 9), "key": f"n{n}"} for n in range(ROWS)
        ]
        client.post("/readings/batch", json=readings).raise_for_status()
        file = client.get(f"/readings.dfq?characteristic=c1&last={ROWS}").raise_for_status().text
    database = Database(running.dsn, pool_size=1)
    with database.begin() as session:
        code = devices.make_code(session, "bench", "Tablet", "bench")
        actions.add_person(session, name="admin", role="admin", password="correct horse battery", actor="bench")
    database.close()
    with httpx.Client(base_url=running.url, timeout=60) as browser:
        browser.post("/station", data={"code": code})
        cookie = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
        found = re.search(r'name="csrf" value="([^"]+)"', browser.get("/station/bench/note").text)
    assert found is not None
    return keys, (cookie, found[1]), file


def beside(
    running: Plant, keys: list[str], given: str, which: str, seconds: float, run: str
) -> tuple[Waited, dict[str, int]]:
    """Let the machines push while strangers of this kind are there; what these were answered."""
    words = [sys.executable, "-m", "bench.strangers", "--strangers", running.url, which, str(seconds + 5)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as strangers:
        assert strangers.stdin is not None
        assert strangers.stdout is not None
        strangers.stdin.write(given)
        strangers.stdin.close()
        strangers.stdout.readline()  # they are there
        time.sleep(3.0)  # and have all come to something
        waited = push(running.url, keys, seconds, run)
        got: dict[str, int] = json.loads(strangers.stdout.read())
    return waited, got


def wait_for_reports(running: Plant) -> None:
    """Wait until every report that was asked for is made: the server is idle again."""
    headers = {"Authorization": f"Bearer {running.key}"}
    with httpx.Client(base_url=f"{running.url}/api/v1", headers=headers, timeout=60) as client:
        for _second in range(REPORTS_MOST):
            jobs = client.get("/reports").raise_for_status().json()["items"]
            if all(job["state"] == "done" for job in jobs):
                return
            time.sleep(1)
    raise TimeoutError(f"reports were still being made after {REPORTS_MOST} s")


def main(seconds: float) -> int:
    with plant(characteristics=10) as running:
        keys, tablet, file = furnish(running)
        push(running.url, keys, 3.0, "warm")
        given = json.dumps([running.key, tablet, file])
        print(f"{'':8} {'readings':>9} {'median':>9} {'p99':>9} {'p99 / idle':>10}  strangers were answered")
        ratios: list[float] = []
        for turn, which in enumerate(("silent", "slow", "guesses", "imports", "reports", *["all"] * TURNS)):
            idle = push(running.url, keys, seconds, f"idle-{turn}")
            waited, got = beside(running, keys, given, which, seconds, f"{which}-{turn}")
            ratios.append(waited.p99 / idle.p99)
            wait_for_reports(running)
            words = ", ".join(f"{what} × {many}" for what, many in sorted(got.items()))
            print(f"{'idle':8} {idle.number:9} {idle.median:6.1f} ms {idle.p99:6.1f} ms")
            print(
                f"{which:8} {waited.number:9} {waited.median:6.1f} ms {waited.p99:6.1f} ms {ratios[-1]:10.1f}  {words}"
            )
    ratio = median(ratios[-TURNS:])
    print(f"p99 with all of them / idle, median of {TURNS}: {ratio:.1f}, wanted below {WANTED:.0f}")
    return int(ratio >= WANTED)


async def load(url: str, which: str, seconds: float) -> None:
    if hasattr(os, "SCHED_IDLE"):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    else:
        os.nice(5)
    engineer, tablet, file = json.loads(sys.stdin.read())
    strangers = Strangers(url, engineer, tuple(tablet), file)
    print("begun", flush=True)
    await strangers.load(which, seconds)
    print(json.dumps(strangers.got))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--machines"]:
        uvloop.run(machines(sys.argv[2], float(sys.argv[3]), sys.argv[4], sys.argv[5:]))
    elif sys.argv[1:2] == ["--strangers"]:
        with suppress(asyncio.CancelledError):
            uvloop.run(load(sys.argv[2], sys.argv[3], float(sys.argv[4])))
    else:
        parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
        parser.add_argument("--seconds", type=float, default=10.0)
        sys.exit(main(parser.parse_args().seconds))
