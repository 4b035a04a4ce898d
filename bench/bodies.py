"""What large bodies hold up: every route that changes something gets some, while /health/live is asked beside it.

Bodies are lists in lists, 100,000 names of which the last is there twice, long numbers, long texts; strangers send them first,
then a key that may do everything. Printed is how much longer than idle /health/live took at worst, in ms, and beside what.
``python -m bench.bodies [--megabytes 1] [--only /api/v1/notes]``
"""

import argparse
import contextlib
import http.client
import json
import threading
import time
from collections.abc import Iterable, Iterator
from typing import NamedTuple, Self
from urllib.parse import urlsplit

from fastapi.routing import APIRoute

from app.main import ROUTERS
from app.web.deps import SAFE_METHODS
from app.web.limits import MEGABYTE
from bench.plant import plant

JSON, FORM, FILE = "application/json", "application/x-www-form-urlencoded", "multipart/form-data; boundary=b"
WANTED = 0.1  # s
IDLE = 3.0  # s of looking before anything is sent
TIMES = 5  # that a request which seems to hold it up is sent


class Request(NamedTuple):
    """A body on its way to a route."""

    method: str
    path: str
    name: str
    kind: str
    body: bytes


class Held(NamedTuple):
    """The longest that /health/live took, s: idle, and while bodies came in; during which request that was."""

    idle: float
    worst: float
    beside: str

    @property
    def more(self) -> float:
        """Seconds longer than idle."""
        return self.worst - self.idle


def bodies(size: int) -> Iterator[tuple[str, str, bytes]]:
    """Name, media type and bytes of each body, of this size or little less."""
    names = min(100_000, size // 13)
    yield "lists in lists", JSON, b"[" + b"[]," * (size // 3 - 2) + b"[]]"
    yield "lists 100,000 deep", JSON, b"[" * min(100_000, size)
    yield "100,000 names", JSON, b"{" + b",".join(b'"%x":1' % n for n in range(names)) + b',"z":1,"z":2}'
    yield "long numbers", JSON, b"[" + b",".join([b"9" * 4000] * (size // 4001)) + b"]"
    yield "one number", JSON, b"9" * size
    yield "a long text", JSON, json.dumps({"text": "\N{CYRILLIC SMALL LETTER ZHE}" * (size // 6 - 3)}).encode()
    yield "fields", FORM, b"&".join(b"f%d=1" % n for n in range(size // 9))
    yield "signs", FORM, b"text=" + b"%D0%96" * (size // 6 - 1)
    yield (
        "parts",
        FILE,
        b"".join(b'--b\r\nContent-Disposition: form-data; name="f%d"\r\n\r\n1\r\n' % n for n in range(size // 58)),
    )


def addresses() -> list[tuple[str, str]]:
    """Method and path of every route that changes something."""
    return sorted(
        {
            (method, route.path.replace("{", "").replace("}", "").replace(":path", ""))
            for router in ROUTERS
            for route in router.routes
            if isinstance(route, APIRoute)
            for method in (route.methods or set()) - SAFE_METHODS
        }
    )


class Watch:
    """Asks /health/live again and again, from a thread."""

    def __init__(self, url: str) -> None:
        self._url = urlsplit(url)
        self._ending, self._looked = threading.Event(), threading.Event()
        self._worst = 0.0

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._look)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()

    def longest(self) -> float:
        """The longest that it took since this was asked last, s; the answer that is under way now is waited for."""
        self._looked.clear()
        self._looked.wait()
        found, self._worst = self._worst, 0.0
        return found

    def _look(self) -> None:
        connection = http.client.HTTPConnection(self._url.hostname or "", self._url.port, timeout=120)
        while not self._ending.wait(0.002):
            began = time.perf_counter()
            connection.request("GET", "/health/live")
            connection.getresponse().read()
            self._worst = max(self._worst, time.perf_counter() - began)
            self._looked.set()
        connection.close()


def send(url: str, request: Request, headers: dict[str, str]) -> int:
    """Send it; the status of the answer, 0 if the connection was closed before."""
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.hostname or "", address.port, timeout=120)
    with contextlib.closing(connection), contextlib.suppress(OSError, http.client.HTTPException):
        connection.request(request.method, request.path, request.body, headers | {"Content-Type": request.kind})
        with connection.getresponse() as answer:
            answer.read()
            return answer.status
    return 0


def held(url: str, requests: Iterable[Request], headers: dict[str, str]) -> Held:
    """Send them one after the other and look at /health/live meanwhile.

    One that seems to hold it up is sent again: what the request does comes again, what other programs of this computer did
    does not, so the least of these times counts.
    """
    worst = (0.0, "nothing")
    with Watch(url) as watch:
        time.sleep(IDLE)
        idle = watch.longest()
        for request in requests:
            took = float("inf")
            for _ in range(TIMES):
                send(url, request, headers)
                took = min(took, watch.longest())
                if took <= idle + WANTED:
                    break
            worst = max(worst, (took, f"{request.method} {request.path}, {request.name}"))
    return Held(idle, *worst)


def requests(size: int, only: str = "") -> Iterator[Request]:
    """Every body at every route; at those whose path begins so."""
    made = list(bodies(size))
    for method, path in addresses():
        if path.startswith(only):
            for name, kind, body in made:
                if (kind == JSON) == path.startswith("/api/"):
                    yield Request(method, path, name, kind, body)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--megabytes", type=float, default=1.0)
    parser.add_argument("--only", default="", help="routes whose path begins so")
    given = parser.parse_args()
    size = round(given.megabytes * MEGABYTE) - 1000
    with plant() as running:
        for who, headers in (("strangers", {}), ("an administrator's key", {"Authorization": f"Bearer {running.key}"})):
            found = held(running.url, requests(size, given.only), headers)
            print(
                f"bodies of {size / MEGABYTE:.1f} MB by {who}: /health/live {found.more * 1000:+.0f} ms at worst (wanted: "
                f"{WANTED * 1000:.0f}; idle {found.idle * 1000:.0f} ms), beside {found.beside}"
            )


if __name__ == "__main__":
    main()
