"""Machines under load: each sends its readings one after the other and, as the contract says, sends again what was not answered."""

import json
import random
import threading
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPException
from typing import Any
from urllib.parse import urlsplit


@dataclass
class Sender:
    """One machine: its readings in order, each until it is answered."""

    url: str
    """Of the server, or of its plant."""
    key: str
    readings: Iterable[dict[str, Any]]
    patience: float = 60.0
    pause: float = 0.0
    answers: list[dict[str, Any]] = field(default_factory=list)
    again: int = 0
    """Readings that were sent more than once."""
    repeated: int = 0
    """Of those: readings that had been stored although the answer was lost (200)."""
    alone: bool = False
    """Nobody else sends readings of this characteristic: when its numbers go back, what was answered is sent again."""
    lost: int = 0
    """Readings that were answered, were gone afterwards, and have been stored anew."""
    longest: float = 0.0
    """Seconds that one reading took at most."""
    path: str = field(init=False)

    def run(self, stop: threading.Event | None = None) -> "Sender":
        """Send them all. An answer other than 200, 201 or 503 fails."""
        address = urlsplit(self.url)
        assert address.hostname is not None
        self.path = f"{address.path}/api/v1/readings"
        connection = HTTPConnection(address.hostname, address.port, timeout=20)
        for reading in self.readings:
            if stop is not None and stop.is_set():
                break
            answer = self._send(connection, reading)
            if self.alone and self.answers and answer["sequence"] <= self.answers[-1]["sequence"]:
                self._send_again(connection, answer["sequence"])
            self.answers.append(answer)
            if self.pause:
                time.sleep(self.pause)
        connection.close()
        return self

    def _send(self, connection: HTTPConnection, reading: dict[str, Any]) -> dict[str, Any]:
        """Send a reading until it is answered; the answer."""
        body, tries, begun = json.dumps(reading), 0, time.monotonic()
        while True:
            tries += 1
            status, text = 0, b""
            try:
                connection.request("POST", self.path, body, {"Authorization": f"Bearer {self.key}"})
                answer = connection.getresponse()
                status, text = answer.status, answer.read()
            except (OSError, HTTPException):
                connection.close()
            if status in {200, 201}:
                break
            assert status in {0, 503}, text
            assert time.monotonic() < begun + self.patience, "not answered in all this time"
            time.sleep(0.1)
        self.again += tries > 1
        self.repeated += status == 200
        self.longest = max(self.longest, time.monotonic() - begun)
        answered: dict[str, Any] = json.loads(text)
        return answered

    def _send_again(self, connection: HTTPConnection, gone_from: int) -> None:
        """The readings that were answered with this number or a higher one are gone: another server answers now, which lacks them."""
        gone = [answer for answer in self.answers if answer["sequence"] >= gone_from]
        kept = len(self.answers) - len(gone)
        self.answers[kept:] = [
            self._send(connection, {name: answer[name] for name in ("characteristic", "measured", "key")})
            for answer in gone
        ]
        self.lost += len(gone)


def all_at_once(senders: list[Sender], stop: threading.Event | None = None) -> list[Sender]:
    """Run every sender in a thread of its own, to its end."""
    with ThreadPoolExecutor(len(senders)) as pool:
        return list(pool.map(lambda sender: sender.run(stop), senders))


def scattered(characteristic: str, count: int, seed: int, wide: float = 0.004) -> Iterator[dict[str, Any]]:
    """Readings about 40 mm, some beyond the averaging limit and a few out of tolerance; keys that name them."""
    chance = random.Random(seed)
    for number in range(count):
        measured = round(40 + chance.gauss(0, wide), 6)
        yield {"characteristic": characteristic, "measured": measured, "key": f"{seed}:{number}"}


def ndjson(readings: list[dict[str, Any]]) -> bytes:
    """One reading per line."""
    return "\n".join(json.dumps(reading) for reading in readings).encode()
