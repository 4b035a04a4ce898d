"""A small shop floor for tests: a lathe, one characteristic whose limits are easy to hit, and short words for what is done to it.

Target 40 mm; zero ±1 µm, averaging ±5 µm, tolerance ±8 µm, wear from 300 µm, confidence 1 mm; k = 2, factor −1.
"""

import itertools
import re
from collections.abc import Sequence
from typing import Any

import httpx
from playwright.sync_api import Page

from app.loop.characteristics import actions as characteristics
from app.loop.characteristics.schemas import CharacteristicIn
from app.loop.machines import actions as machines
from app.loop.machines.schemas import MachineIn

PARAMETERS: dict[str, Any] = {
    "tool_memory": 3,
    "average_memory": 5,
    "target": 40.0,
    "tolerance_width": 0.016,
    "zero_range": 0.001,
    "averaging_limit": 0.005,
    "wear_limit": 0.3,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
    "factor": -1,
}
KEY = "a test's key"
ACTOR = f"key {KEY}"
_names = itertools.count(1)


def unique(word: str) -> str:
    """A name that no other test of this server has: ``bore`` becomes ``bore-17``."""
    return f"{word}-{next(_names)}"


class Shop:
    """One machine of its own on a running server. Every answer that is not as expected fails the test."""

    def __init__(self, server: Any) -> None:
        self.server = server
        self.admin: httpx.Client = server.client(server.key())
        self.machine, self.characteristic = unique("lathe"), unique("shaft")
        name = self.machine.replace("lathe-", "Lathe ")
        with server.database.begin() as session:  # thousands of them are made
            machines.add_machine(session, MachineIn(key=self.machine, name=name, control="sinumerik"), ACTOR)
            characteristics.add_characteristic(session, CharacteristicIn(**self._described(self.characteristic)), ACTOR)
        self.machine_key: str = server.key(machine=self.machine)
        self.machine_client: httpx.Client = server.client(self.machine_key)

    def add(self, key: str, **parameters: Any) -> None:
        """A characteristic of this machine."""
        self.call("POST", "/characteristics", 201, **self._described(key, **parameters))

    def _described(self, key: str, **parameters: Any) -> dict[str, Any]:
        parameters = PARAMETERS | parameters
        return {"key": key, "name": f"Seat {key}", "machine": self.machine, "unit": "mm", "parameters": parameters}

    def another(self, word: str, **parameters: Any) -> str:
        """Add a characteristic with a name that no other test has; its key."""
        key = unique(word)
        self.add(key, **parameters)
        return key

    def call(
        self, method: str, path: str, /, status: int = 200, client: httpx.Client | None = None, **body: Any
    ) -> Any:
        """One request; the JSON of the answer."""
        answer = (client or self.admin).request(method, f"/api/v1{path}", json=body or None)
        assert answer.status_code == status, f"{method} {path}: {answer.status_code} {answer.text}"
        return answer.json() if answer.content else None

    def read(self, micrometres: float, characteristic: str | None = None, **more: Any) -> Any:
        """Push a reading that deviates by so much."""
        return self.call(
            "POST",
            "/readings",
            201,
            characteristic=characteristic or self.characteristic,
            measured=round(40 + micrometres / 1000, 6),
            **more,
        )

    def push(
        self,
        micrometres: Sequence[float],
        characteristic: str | None = None,
        *,
        answers: bool = False,
        **more: Sequence[Any],
    ) -> list[dict[str, Any]]:
        """Push readings that deviate by so much, in one batch; more: a column for each further field.

        With ``answers`` each is answered as a single one is.
        """
        rows = [
            {"characteristic": characteristic or self.characteristic, "measured": round(40 + value / 1000, 9)}
            | {name: column[at] for name, column in more.items()}
            for at, value in enumerate(micrometres)
        ]
        answer = self.admin.post(f"/api/v1/readings/batch?decisions={str(answers).lower()}", json=rows)
        assert answer.status_code == 201, answer.text
        return answer.json()["items"] if answers else []

    def correction(self, number: int, verb: str | None = None, status: int = 200, **body: Any) -> Any:
        """Look at a correction, or do something to it."""
        path = f"/corrections/{self.machine}/{number}"
        return self.call("POST", f"{path}/{verb}", status, **body) if verb else self.call("GET", path, status)

    def tool(self, number: int = 3) -> Any:
        return self.call("GET", f"/machines/{self.machine}/tools/{number}")

    def average(self, location: int = 5) -> float:
        value: float = self.call("GET", f"/machines/{self.machine}/averages/{location}")["average"]
        return value

    def alarms(self, state: str = "active") -> list[Any]:
        items: list[Any] = self.call("GET", f"/alarms?state={state}&machine={self.machine}")["items"]
        return items

    def acknowledge(self, alarm: int, action: str, status: int = 200, comment: str = "looked at", **more: Any) -> Any:
        return self.call("POST", f"/alarms/{alarm}/acknowledge", status, action=action, comment=comment, **more)


PASSWORD = "correct horse battery"


class Person:
    """Somebody with a browser that runs no scripts: follows links, sends forms."""

    def __init__(self, server: Any, role: str) -> None:
        self.name = unique(role)
        server.person(self.name, role, PASSWORD)
        self.browser: httpx.Client = server.client()
        self._session, self._csrf = "", ""
        answer = self.browser.post("/sign-in", data={"name": self.name, "password": PASSWORD})
        assert answer.status_code == 303, answer.text
        self.browser.follow_redirects = True

    def open(self, path: str, status: int = 200) -> str:
        """The page's text."""
        answer = self.browser.get(path)
        assert answer.status_code == status, f"{path}: {answer.status_code} {answer.text}"
        return answer.text

    def send(self, path: str, status: int = 200, **fields: str) -> str:
        """Send a form with the token of this session; the text of the page that one ends up on."""
        answer = self.browser.post(path, data={"csrf": self.csrf(), **fields})
        assert answer.status_code == status, f"{path}: {answer.status_code} {answer.text}"
        return answer.text

    def post(self, path: str, status: int = 303, /, **fields: str | list[str]) -> httpx.Response:
        """The same, and the answer itself: where it leads nobody goes."""
        answer = self.browser.post(path, data={"csrf": self.csrf(), **fields}, follow_redirects=False)
        assert answer.status_code == status, f"{path}: {answer.status_code} {answer.text[:3000]}"
        return answer

    def csrf(self) -> str:
        """The token of this session, which each change carries. Read from a page once: it is good as long as the session is."""
        session = str(self.browser.cookies)
        if session != self._session:
            text = self.open("/account")  # a page that is as short on a crowded server
            found = re.search(r'<meta name="csrf" content="([^"]+)"', text)
            assert found is not None
            self._session, self._csrf = str(self.browser.cookies), found[1]
        return self._csrf

    def sign_in(self, page: Page) -> None:
        """The same person in a real browser, which takes over the session; tests/access/test_sign_in.py types the password."""
        page.context.add_cookies(
            [
                {"name": each.name, "value": each.value or "", "domain": "127.0.0.1", "path": each.path}
                for each in self.browser.cookies.jar
            ]
        )
