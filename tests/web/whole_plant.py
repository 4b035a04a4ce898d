"""A plant in which every operation of the API can be done."""

from typing import Any

import httpx

from app.views.reports.request import ReportRequest, SectionName
from app.web.openapi import example_of
from tests.geometry.rotary_axes.bench import axis
from tests.quality.chart_signals.line import Line
from tests.servers import Server
from tests.shop import Shop
from tests.views.reports.made_here import made_here
from tests.waits import until
from tests.web.api_operations import Operation
from tests.web.good_bodies import BODIES, GAUGE, REACTION


class Place:
    """A plant in which every address leads to something that the operation may be done to."""

    def __init__(self, server: Server) -> None:
        self.shop = shop = Shop(server)
        self.nobody = server.client()
        self.dsn = server.database.dsn
        self.approved = f"{shop.characteristic}-a"
        shop.add(self.approved, mode="approval", tool_memory=4, average_memory=6)
        self.on_trial = f"{shop.characteristic}-t"
        shop.add(self.on_trial, mode="measure_only", tool_memory=8, average_memory=9)
        shop.read(6.0)
        awaiting = shop.read(6.0, self.approved)["correction"]["number"]
        held = shop.read(350.0)
        shop.call("PATCH", f"/machines/{shop.machine}/tools/3", sister=13)
        shop.call(
            "POST",
            f"/machines/{shop.machine}/calibrations",
            201,
            **BODIES["POST /api/v1/machines/{machine}/calibrations"]
            | {"average_memory": 6, "touches": [25.002, 25.0022], "key": None},
        )
        pairs = [  # enough of them to suggest 0.001
            shop.call(
                "POST",
                f"/machines/{shop.machine}/averages/5/pairs",
                201,
                machine_value=measured,
                external_value=40.0,
                instrument="CMM",
            )
            for measured in (40.0011, 40.0009, 40.001, 40.0009, 40.0011)
        ]
        name = f"person-{shop.machine}"
        server.person(name, "viewer")
        person = next(each for each in shop.call("GET", "/people?limit=1000")["items"] if each["name"] == name)
        line = Line(shop)
        line.push([9.0])
        line.look()
        line.freeze(1, 50)
        self.line = line
        proposals = f"/characteristics/{shop.characteristic}/proposals"
        proposal = shop.call("POST", proposals, 201, zero_range=0.003, reason="Fewer corrections")
        self.values: dict[str, Any] = {
            "machine": shop.machine,
            "characteristic": shop.characteristic,
            "sequence": 1,
            "tool": 3,
            "location": 5,
            "fixture": "vice",
            "feature": "bore",
            "number": 1,
            "alarm": held["alarms"][0]["id"],
            "signal": line.signals()[0]["id"],
            "version": 1,
            "pair": pairs[0]["id"],
            "note": shop.call("POST", "/notes", 201, machine=shop.machine, text="New bar")["id"],
            "proposal": proposal["id"],
            "receiver": self.notified(shop),
            "route": 1,
            "group": 1,
            "maintenance": shop.call("POST", "/maintenance", 201, machine=shop.machine, reason="New bearing")["id"],
            "plan": shop.call("POST", "/reactions/plans", 201, **self.reaction(shop))["id"],
            "entry": shop.call("POST", "/reactions/catalogue", 201, sort="action", name=shop.machine)["id"],
            "picture": shop.admin.post("/api/v1/reactions/pictures", json=example_of("PictureIn")).json()["digest"],
            "screen": shop.call("POST", "/wall-screens", 201, name="Hall")["id"],
            "delivery": 1,
            "form": "csv",
            "person": next(person[name] for name in ("id", "name", "key") if name in person),
            "key": shop.call("POST", f"/machines/{shop.machine}/keys", 201, name="second")["id"],
        }
        photos = f"/alarms/{self.values['alarm']}/photos"
        self.values["photo"] = shop.call("POST", photos, 201, **example_of("PictureIn"))["id"]
        set_aside = shop.call("POST", "/quarantines", 201, alarm=self.values["alarm"], reason="Edge broken")
        self.values["quarantine"] = set_aside["id"]
        zero = BODIES["POST /api/v1/work-zeros"] | {"machine": shop.machine, "key": None}
        side = BODIES["POST /api/v1/alignments"] | {"machine": shop.machine, "key": None}
        made = {
            path: shop.call("POST", path, 201, **body) for path, body in (("/work-zeros", zero), ("/alignments", side))
        }
        self.zero = made["/work-zeros"]["id"]
        self.tested = Shop(server)  # one touch test is open per machine
        self.beat()
        tests = f"/machines/{self.tested.machine}/touch-tests"
        self.test = shop.call("POST", tests, 201, tool_memory=3)["id"]
        shop.call("POST", f"{tests}/{self.test}/report", **example_of("TouchTestReport"))
        doubtful = {  # with warnings that somebody may acknowledge
            "/work-zeros": {name: value for name, value in zero.items() if name != "fixture"} | {"feeler": 5.0},
            "/alignments": side
            | {"side": [each | {"measured": [100 - each["nominal"][0], 0.1]} for each in side["side"]]},
        }
        doubted = {path: shop.call("POST", path, 201, **body)["id"] for path, body in doubtful.items()}
        form = shop.call("POST", "/forms", 201, **BODIES["POST /api/v1/forms"] | {"machine": shop.machine, "key": None})
        plan = "PUT /api/v1/machines/{machine}/kinematics"
        shop.call("PUT", f"/machines/{shop.machine}/kinematics", **BODIES[plan])
        first = shop.call("POST", "/kinematics/runs", 201, machine=shop.machine, axes=[axis()])["run"]
        shop.call("POST", f"/kinematics/runs/{first}/enter", reason="As it was")
        larger = shop.call("POST", "/kinematics/runs", 201, machine=shop.machine, axes=[axis((0.1, 0, 0, 0))])["run"]
        largest = shop.call("POST", "/kinematics/runs", 201, machine=shop.machine, axes=[axis((0.2, 0, 0, 0))])["run"]
        second = shop.call("POST", "/kinematics/runs", 201, machine=shop.machine, axes=[axis()])["run"]
        self.values["run"] = first
        study = {"kind": "grr", "machine": shop.machine, "gauge": "Probe T8", "rows": GAUGE["rows"]}
        self.values["study"] = shop.call("POST", "/gauge-studies", 201, **study)["id"]
        numbers = ReportRequest(sections=(SectionName.NUMBERS,))
        reports = made_here(server.database, numbers, "csv", shop.characteristic)
        of_reports = ("", "/cancel", "/file")
        self.runs = {"confirm": larger, "acknowledge": largest, "enter": second}
        self.numbers = {"approve": awaiting, "release": held["correction"]["number"]} | {
            f"/api/v1{path}/{{number}}/recompute": each["id"] for path, each in made.items()
        }
        self.numbers |= {f"/api/v1{path}/{{number}}/acknowledge": number for path, number in doubted.items()}
        of_alignment: tuple[str, ...] = ("/api/v1/alignments/{number}", "/api/v1/alignments/{number}/figure")
        of_alignment += ("/api/v1/alignments/{number}/program",)
        self.numbers |= dict.fromkeys(of_alignment, made["/alignments"]["id"])
        of_form = ("/api/v1/forms/{number}", "/api/v1/forms/{number}/figure", "/api/v1/forms/{number}/recompute")
        self.numbers |= dict.fromkeys(of_form, form["id"])
        self.numbers |= {f"/api/v1/reports/{{number}}{what}": reports for what in of_reports}
        of_part = "/api/v1/quarantines/{quarantine}/parts/{number}/"
        self.numbers |= {of_part + what: 1 for what in ("measure", "release", "scrap")}

    @staticmethod
    def reaction(shop: Shop) -> dict[str, Any]:
        """A plan of this place alone."""
        return REACTION | {"characteristic": shop.characteristic, "kind": "hunting"}

    @staticmethod
    def notified(shop: Shop) -> Any:
        """A receiver with a route that is off, and a delivery; in a database of their own they are each the first."""
        sent: dict[str, Any] = {"name": "Anna", "means": "mail", "address": "anna@example.com"}
        number = shop.call("POST", "/notifications/receivers", 201, **sent)["id"]
        steps = [{"receivers": [number]}]
        shop.call("POST", "/notifications/routes", 201, name="Off", enabled=False, steps=steps)
        shop.call("POST", "/notifications/groups", 201, name="Setters", members=[number])
        test = shop.call("POST", f"/notifications/receivers/{number}/test", 202)["id"]
        until(lambda: shop.call("GET", f"/notifications/deliveries/{test}")["state"] == "failed")
        return number

    def beat(self) -> None:
        """Let the bridges tell that they live. An alarm about their quarantine would be counted as stored."""
        for each in (self.shop, self.tested):
            body = BODIES["POST /api/v1/machines/{machine}/heartbeat"] | {"quarantined": 0, "quarantine": []}
            self.shop.call("POST", f"/machines/{each.machine}/heartbeat", **body)

    def url(self, operation: Operation, **other: Any) -> str:
        values = dict(self.values)
        verb = operation.path.rpartition("/")[2]
        values["number"] = self.numbers.get(operation.path) or self.numbers.get(verb, values["number"])
        values["run"] = self.runs.get(verb, values["run"])
        if "/touch-tests/" in operation.path:
            values |= {"machine": self.tested.machine, "number": self.test}
        if "/trial" in operation.path:
            values["characteristic"] = self.on_trial
        if "/baselines" in operation.path:
            values["characteristic"] = self.line.key
        if operation.path.endswith("/retire"):
            values["version"] = 2  # the one in force
        if operation.path == "/api/v1/keys/{key}" and "key" not in other:
            values["key"] = self.shop.call("POST", "/keys", 201, name="third", role="viewer")["id"]
        return operation.path.format(**(values | other))

    def body(self, operation: Operation) -> dict[str, Any]:
        def filled(value: Any) -> Any:
            if isinstance(value, list):
                return [filled(each) for each in value]
            return value.format(**self.values) if isinstance(value, str) else value

        body = {name: filled(value) for name, value in BODIES[operation.name].items()}
        if operation.path == "/api/v1/quarantines":
            body["alarm"] = self.values["alarm"]
        return body | ({"reference": self.zero} if "/fixtures/" in operation.path else {})

    def send(self, operation: Operation, content: bytes | str, **headers: str) -> httpx.Response:
        return self.shop.admin.request(
            operation.method,
            self.url(operation),
            content=content,
            headers={"Content-Type": "application/json"} | headers,
        )
