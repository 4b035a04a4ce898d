"""Somebody who does whatever the product lets one do, by chance: acts of the API, readings, forms of pages, periodic jobs.

The bodies are those of tests/web/good_bodies.py, which are good ones; names and numbers in them are put out of the record of
the moment, choices are made anew, and what need not be said is left out now and then. Refusals are answers too; faults are not.
"""

import random
import threading
from collections import Counter, deque
from datetime import UTC, datetime, timedelta
from typing import Any
from urllib.parse import urljoin

import httpx

from app.jobs.actions import run_jobs
from app.main import JOBS
from tests.in_process import InProcess
from tests.pages.house import PAGES
from tests.shop import PARAMETERS, Person
from tests.walks.addresses import Record
from tests.walks.forms import forms
from tests.web.api_operations import Operation, body_schema, operations, resolved
from tests.web.good_bodies import BODIES

ONE_AT_A_TIME = threading.Lock()  # of all processes of a plant one runs the periodic jobs

WITHOUT_BODY = {
    "DELETE /api/v1/machines/{machine}/connection",
    "POST /api/v1/machines/{machine}/touch-tests/{number}/stop",
    "DELETE /api/v1/reports/{number}",
    "POST /api/v1/reports/{number}/cancel",
    "POST /api/v1/kinematics/runs/{run}/recompute",
    "DELETE /api/v1/notifications/routes/{route}",
    "DELETE /api/v1/notifications/receivers/{receiver}",
    "DELETE /api/v1/notifications/groups/{group}",
    "POST /api/v1/notifications/receivers/{receiver}/test",
    "DELETE /api/v1/notifications/me",
    "DELETE /api/v1/notifications/me/browser",
    "POST /api/v1/notifications/me/browser/test",
    "DELETE /api/v1/machines/{machine}/keys/{key}",
    "DELETE /api/v1/keys/{key}",
    "DELETE /api/v1/wall-screens/{screen}",
}
OFTEN = ("/alarms/", "/corrections/", "/tools/", "/quarantines", "/reactions/", "/readings/{", "/averages/", "/notes")
# Who walks would lose the way back: the own session, the own rights.
NOT_WALKED = ("/sign-out", "/account/p", "/setup/people", "/setup/stations", "/simulated")
ACTIONS = ("tool_replaced", "keep_cutting", "false_reading", "sister_tool", "noted", "offset_set", "measured_by_hand")
OPENED = (
    *(each for each in PAGES if not any(part in each for part in ("{what}", ":path", "{library}", "{memory}"))),
    *(f"/alarms/{{number}}?action={action}" for action in ACTIONS),
    *(f"/station/{{machine}}/alarms/{{number}}?action={action}" for action in ACTIONS),
    *(f"/machines/{{machine}}/tools/{{number}}/{what}" for what in ("edit", "change", "sister")),
    *(f"/station/{{machine}}/corrections/{{number}}?do={what}" for what in ("approve", "release", "reject")),
    *(f"/quarantines/{{number}}/parts/{{part}}/{what}" for what in ("measure", "release", "scrap")),
    "/calibration/{machine}/averages/{location}",
)
NUMBERS = ("part", "pallet", "cause")  # are words in other bodies
CHANGES: tuple[dict[str, Any], ...] = (
    {"mode": "approval"},
    {"mode": "automatic"},
    {"mode": "measure_only"},
    {"tool_memory": 4},
    {"tool_memory": 13},
    {"tool_memory": 0},
    {"factor": 1},
    {"target": 40.004},
    {"average_memory": 0},
    {"average_memory": 6},
    {"wear_policy": "release"},
    {"max_step": 0.004},
    {"max_total": 0.02},
    {"plausible_jump": 0.05},
    {"accept": {"n": 2, "m": 3}},
    {"rejected_may_correct": True},
    {"natural_limit": "lower"},
    {"weighting_factor": 1},
    {"factor": -0.5},
)

LOOKED_UP = {
    "machine": "SELECT key FROM machine ORDER BY id",
    "machines": "SELECT key FROM machine ORDER BY id",
    "characteristic": "SELECT key FROM characteristic ORDER BY id",
    "characteristics": "SELECT key FROM characteristic ORDER BY id",
    "alarm": "SELECT id FROM alarm ORDER BY 1",
    "numbers": "SELECT t.number FROM correction t JOIN machine m ON m.id = t.machine_id WHERE m.key = '{machine}'"
    " ORDER BY t.status IN ('awaiting_approval', 'pending'), 1",
    "sequence": "SELECT max(sequence) FROM reading GROUP BY characteristic_id ORDER BY 1",
    "hand_sequence": "SELECT max(sequence) FROM reading GROUP BY characteristic_id ORDER BY 1",
    "cause": "SELECT id FROM catalogue_entry WHERE sort = 'cause' ORDER BY 1",
    "corrective_action": "SELECT id FROM catalogue_entry WHERE sort = 'action' ORDER BY 1",
    "receivers": "SELECT id FROM receiver ORDER BY 1",
    "pallet": "SELECT id FROM alignment ORDER BY 1",
    "part": "SELECT id FROM alignment ORDER BY 1",
    "reference": "SELECT id FROM work_zero ORDER BY 1",
    "tool_memory": "SELECT 3 UNION SELECT 4 UNION SELECT 13 UNION SELECT 14 ORDER BY 1",
    "sister": "SELECT 3 UNION SELECT 4 UNION SELECT 13 ORDER BY 1",
    "offset": 'SELECT "offset"::float8 FROM tool UNION SELECT 0 UNION SELECT 0.05 ORDER BY 1',
    "offset_after": 'SELECT "offset"::float8 FROM tool UNION SELECT 0 UNION SELECT 0.05 ORDER BY 1',
    "hand_measured": "SELECT 40.001::float8 UNION SELECT 40.02::float8",
    "hand_verdict": "SELECT 'good' UNION SELECT 'bad'",
    "changed_by": "SELECT 'Anna'",
    "although_fetched": "SELECT true UNION SELECT false",
}


class Walker:
    """One walk; ``trail`` has the last steps of it."""

    def __init__(self, server: InProcess, seed: int, machines: list[str] | None = None) -> None:
        self.server, self.chance, self.machines = server, random.Random(seed), machines
        self.record = Record(server.database.dsn, self.chance)
        self.api = server.client(server.key())
        self.person = Person(server, "admin")
        self.trail: deque[str] = deque(maxlen=40)
        self.answers: Counter[tuple[str, int]] = Counter()
        self.operations = [each for each in operations() if each.method != "GET"]
        self.weights = [4 if any(part in each.path for part in OFTEN) else 1 for each in self.operations]
        self.keys: list[str] = []
        self.faults: dict[str, str] = {}
        self.steps = 0

    def step(self) -> None:
        """Do one thing."""
        self.steps += 1
        way = self.chance.random()
        if way < 0.35:
            self.read()
        elif way < 0.43:
            self.answer()
        elif way < 0.75:
            self.act(self.chance.choices(self.operations, self.weights)[0])
        elif way < 0.97:
            self.form(self.chance.choice(OPENED))
        else:
            with ONE_AT_A_TIME:
                run_jobs(self.server.database, JOBS)
            self.trail.append("jobs")

    def _answered(self, name: str, what: Any, answer: httpx.Response) -> httpx.Response:
        self.answers[name, answer.status_code // 100] += 1
        self.trail.append(f"{answer.request.method} {answer.request.url.raw_path.decode()} {what} {answer.status_code}")
        if answer.status_code >= 500:
            self.faults.setdefault(name, "\n".join([*self.trail, answer.text[:200]]))
        return answer

    # --- readings

    def read(self) -> None:
        """Send a reading as machines do: ordinary ones, worn tools, doubled, late, of probes that err."""
        chance = self.chance
        known = self.record.chosen("SELECT key FROM characteristic WHERE form_of IS NULL ORDER BY id")
        assert known is not None
        size = chance.choice((chance.gauss(0, 3),) * 5 + (7.0, -7.0, 20.0, -20.0, 350.0, -350.0, 1500.0))
        body: dict[str, Any] = {"characteristic": known["key"], "measured": round(40 + size / 1000, 6)}
        if chance.random() < 0.3:
            self.keys.append(f"walk-{len(self.keys)}")
            body["key"] = self.keys[-1] if chance.random() < 0.7 else chance.choice(self.keys)
        if chance.random() < 0.3:
            body["correction_in_effect"] = chance.choice((0, 1, 2, 3, 5, 8, 13))
        if chance.random() < 0.3:
            at = datetime.now(UTC) - timedelta(seconds=chance.choice((0, 1, 60, 3600, 100_000)))
            body["measured_at"] = at.isoformat()
            if chance.random() < 0.5:
                body["machined_at"] = (at - timedelta(seconds=5)).isoformat()
        if chance.random() < 0.5:
            body["part"] = f"SN-{chance.randrange(40)}"
        if chance.random() < 0.3:
            body["context"] = {"order": "A-77", "nest": chance.randrange(1, 4), "part_temperature": 20.5}
        if chance.random() < 0.1:
            body["first_move_triggered"] = True
        if chance.random() < 0.1:
            body["measured"] = None
        if chance.random() < 0.2:
            batch = [body | {"measured": round(40 + chance.gauss(0, 4) / 1000, 6), "key": None} for _ in range(5)]
            self._answered("batch", batch, self.api.post("/api/v1/readings/batch?decisions=true", json=batch))
        else:
            self._answered("reading", body, self.api.post("/api/v1/readings", json=body))

    # --- the API

    def act(self, operation: Operation) -> None:
        """Call an operation on something that is there."""
        values = self.record.values(operation.path)
        if values is None or "/people/{" in operation.path:
            return
        if "/tools/{tool}" in operation.path and self.chance.random() < 0.5:
            values["tool"] = self.chance.choice((3, 4, 13))
        content = self.body(operation, values) if operation.name in BODIES else None
        if operation.path.endswith("/readings/batch"):
            content = [content]
        url = operation.path.format(**({"form": "csv"} | values))
        self._answered(operation.name, content, self.api.request(operation.method, url, json=content))

    def body(self, operation: Operation, values: dict[str, Any]) -> Any:
        """A body that may be a good one now."""
        if operation.path.endswith("/alarms/{alarm}/acknowledge"):
            return self.acknowledgement(values)
        chance, schema = self.chance, body_schema(operation)
        declared, required = schema.get("properties", {}), schema.get("required", ())
        given = dict(BODIES[operation.name])
        for name, given_kind in declared.items():
            if name not in given:
                continue
            if name in LOOKED_UP and not isinstance(given[name], str if name in NUMBERS else dict):
                given[name] = self.looked_up(name, values)
                continue
            kind = resolved(given_kind)
            if name not in required and chance.random() < 0.05:
                del given[name]
            elif kind.get("enum") and chance.random() < 0.2:
                given[name] = chance.choice(kind["enum"])
            elif kind.get("type") == "boolean" and chance.random() < 0.2:
                given[name] = not given[name]
            elif name == "key":
                given[name] = f"key-{chance.randrange(10_000)}"
            elif name.startswith("seen_"):
                del given[name]
            elif name.endswith("_at") and name != "machined_at" and isinstance(given[name], str):
                given[name] = datetime.now(UTC).isoformat()
        if "machine" in given and isinstance(given.get("characteristic"), str):
            machine = "SELECT m.key FROM machine m JOIN characteristic c ON c.machine_id = m.id WHERE c.key = '{}'"
            given["machine"] = next(self.record.numbers(machine.format(given["characteristic"])), given["machine"])
        if "reference" in given and "/fixtures/" not in operation.path:
            given["reference"] = 40.0
        if operation.path.endswith("/aqdef"):
            given["content"] = given["content"].format(characteristic=self.looked_up("characteristic", values))
        if "parameters" in given:
            given["parameters"] = PARAMETERS | chance.choice(CHANGES) | chance.choice(CHANGES)
        if operation.path.endswith("/what-if") or operation.path.endswith("/proposals"):
            given = {"zero_range": chance.choice((0.0005, 0.002, 0.003))} | (
                {"reason": "Tried"} if operation.path.endswith("/proposals") else {}
            )
        return given

    def answer(self) -> None:
        """Acknowledge an alarm that waits; a tool that is to be switched has a sister then."""
        alarm = self.record.chosen(
            "SELECT t.id AS alarm, m.key AS machine, t.tool_memory AS tool FROM alarm t JOIN machine m ON m.id = t.machine_id "
            "WHERE t.acknowledged_at IS NULL ORDER BY t.id"
        )
        if alarm is None:
            return
        body = self.acknowledgement(alarm)
        if body["action"] == "sister_tool" and alarm["tool"]:
            url = "/api/v1/machines/{machine}/tools/{tool}".format(**alarm)
            sister = {"sister": 3 if alarm["tool"] == 13 else 13}
            self._answered("sister", sister, self.api.patch(url, json=sister))
        path = "/api/v1/alarms/{alarm}/acknowledge"
        self._answered(f"POST {path}", body, self.api.post(path.format(**alarm), json=body))

    def acknowledgement(self, values: dict[str, Any]) -> dict[str, Any]:
        """An answer to an alarm, with what goes with it."""
        action = self.chance.choice(ACTIONS)
        body: dict[str, Any] = {"action": action, "comment": "Looked at"}
        if action in {"tool_replaced", "offset_set"}:
            body["offset"] = self.looked_up("offset", values)
        if action == "offset_set":
            body["changed_by"] = "Anna"
        if action == "measured_by_hand":
            body |= {"hand_measured": 40.001, "hand_verdict": self.chance.choice(("good", "bad"))}
        for name in ("cause", "corrective_action"):
            if self.chance.random() < 0.7:
                body[name] = self.looked_up(name, values)
        return body

    def looked_up(self, name: str, values: dict[str, Any]) -> Any:
        """Something of the record that may stand in the field; several where it takes a list."""
        found = list(self.record.numbers(LOOKED_UP[name].format(machine=values.get("machine", ""))))
        some = found[-6:] if self.chance.random() < 0.7 else found
        if name in {"numbers", "machines", "characteristics", "receivers"}:
            return self.chance.sample(some, min(len(some), self.chance.randrange(1, 4)))
        return self.chance.choice(some) if some else 1

    # --- pages

    def form(self, page: str) -> None:
        """Open a page, and send a form of it if there is one."""
        values = self.record.values(page)
        if values is None:
            return
        browser, path = self.person.browser, page.format(**values)
        opened = self._answered(f"GET {page}", "", browser.get(path))
        found = [each for each in forms(opened.text) if not each.action.startswith(NOT_WALKED)]
        if opened.status_code != 200 or not found:
            return
        chosen = self.chance.choice(found)
        fields = chosen.filled(self.chance)
        action = urljoin(opened.url.path, chosen.action) if chosen.action else str(opened.url.path)
        answer = browser.post(action, data=fields)
        self._answered(f"FORM {page}", (action, {n: v for n, v in fields.items() if n != "csrf"}), answer)

    def look(self) -> None:
        """Something is read, as JSON or as a page."""
        reading = [each for each in operations() if each.method == "GET" and each.path != "/api/v1/events"]
        operation = self.chance.choice(reading)
        values = self.record.values(operation.path)
        if values is not None:
            url = operation.path.format(**({"form": "csv"} | values))
            self._answered(operation.name, "", self.api.get(url))

    def done(self) -> set[str]:
        """Names of what was not refused."""
        return {name for name, kind in self.answers if kind in {2, 3}}

    def summary(self) -> str:
        """What was done how often, and what was never done."""
        tried = {name for name, _ in self.answers}
        counts = Counter(kind for (_, kind), n in self.answers.items() for _ in range(n))
        return f"{dict(counts)}\nnever done: {sorted(tried - self.done())}"
