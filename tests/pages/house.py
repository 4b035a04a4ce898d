"""A house with something of everything in it, and the addresses of all its pages."""

from typing import Any

from app.web.openapi import example_of
from tests.geometry.alignment.test_alignments import SIX
from tests.geometry.geometric_form.test_forms import BORE
from tests.geometry.rotary_axes.bench import axis
from tests.pictures import as_json, picture
from tests.quality.chart_signals.line import Line
from tests.servers import Server
from tests.shop import Shop
from tests.waits import until

# By the address of the route: how it is opened, as a function of the shop.
PAGES = {
    "/": ["/", "/?show=attention"],
    "/overview": ["/overview", "/overview?by=ppk&machine={machine}"],
    "/plant/{machine}": ["/plant/{machine}"],
    "/connections": ["/connections"],
    "/machines/{machine}/connection": ["/machines/{machine}/connection"],
    "/machines/{machine}/touch-tests/{number}": ["/machines/{machine}/touch-tests/{touch_test}"],
    "/station/{machine}": ["/station/{machine}", "/station/{machine}?tool=3"],
    "/station/{machine}/alarms/{number}": [
        "/station/{machine}/alarms/{alarm}?action=noted",
        "/station/{machine}/alarms/{alarm}?action=measured_by_hand",
    ],
    "/station/{machine}/corrections/{number}": ["/station/{machine}/corrections/{waiting}?do=approve"],
    "/station/{machine}/context": ["/station/{machine}/context"],
    "/station/{machine}/note": ["/station/{machine}/note"],
    "/station/{machine}/sizes": ["/station/{machine}/sizes"],
    "/notes": ["/notes", "/notes?machine={machine}", "/notes?characteristic={characteristic}"],
    "/notes/new": ["/notes/new?machine={machine}", "/notes/new?characteristic={characteristic}&sequence=3"],
    "/notes/{number}": ["/notes/{note}"],
    "/station/{machine}/tools/{number}/corrections": ["/station/{machine}/tools/5/corrections"],
    "/station/{machine}/tools/{number}/change": ["/station/{machine}/tools/3/change"],
    "/characteristics/{characteristic}": [
        "/characteristics/{characteristic}",
        "/characteristics/{characteristic}?last=50&scale=true",
        "/characteristics/{characteristic}?last=all&scale=time",
        "/characteristics/{characteristic}?first=2&through=5&before=5",
    ],
    "/characteristics/{characteristic}/readings/{sequence}": [
        "/characteristics/{characteristic}/readings/3",
        "/characteristics/{characteristic}/readings/7",
    ],
    "/characteristics/{characteristic}/control": [
        "/characteristics/{characteristic}/control",
        "/characteristics/{characteristic}-watched/control?last=200",
        "/characteristics/{characteristic}-watched/control?last=all&chart=cusum&baseline=1",
        "/characteristics/{characteristic}-empty/control",
    ],
    "/characteristics/{characteristic}/control/freeze": [
        "/characteristics/{characteristic}-watched/control/freeze?last=200",
        "/characteristics/{characteristic}-empty/control/freeze",
        "/characteristics/{characteristic}-watched/control/freeze?first_sequence=1&last_sequence=60&excluded=7%20chip",
    ],
    "/count-charts": ["/count-charts", "/count-charts?chart=u&size=4&data=3%0A5%0A1%0A4"],
    "/characteristics/{characteristic}/rules": [
        "/characteristics/{characteristic}/rules",
        "/characteristics/{characteristic}-watched/rules?set=nelson&last=200",
    ],
    "/characteristics/{characteristic}/signals": ["/characteristics/{characteristic}-watched/signals?state=open"],
    "/signals/{number}": ["/signals/{signal}"],
    "/characteristics/{characteristic}/report": [
        "/characteristics/{characteristic}/report?last=all&timezone=Europe/Belgrade",
        "/characteristics/{characteristic}-empty/report?section=numbers&section=capability",
    ],
    "/reports": ["/reports?characteristic={characteristic}"],
    "/characteristics/{characteristic}/capability": [
        "/characteristics/{characteristic}/capability",
        "/characteristics/{characteristic}-watched/capability?last=all&side=upper",
        "/characteristics/{characteristic}-empty/capability",
    ],
    "/characteristics/{characteristic}/six-pack": [
        "/characteristics/{characteristic}/six-pack",
        "/characteristics/{characteristic}-watched/six-pack?last=all",
        "/characteristics/{characteristic}-empty/six-pack",
    ],
    "/gauges": ["/gauges", "/gauges?machine={machine}", "/gauges?characteristic={characteristic}"],
    "/gauges/new": [
        "/gauges/new",
        "/gauges/new?kind=type_one&characteristic={characteristic}",
        "/gauges/new?kind=grr",
        "/gauges/new?kind=linearity&machine={machine}",
    ],
    "/gauges/{number}": ["/gauges/{crossed}", "/gauges/{repeated}"],
    "/gauges/{number}/correct": ["/gauges/{crossed}/correct", "/gauges/{repeated}/correct"],
    "/characteristics/{characteristic}/what-if": [
        "/characteristics/{characteristic}/what-if",
        "/characteristics/{characteristic}/what-if?k=3&r33=2.5&goal=corrections#replay",
        "/characteristics/{characteristic}-watched/what-if?r34=6",
        "/characteristics/{characteristic}-empty/what-if",
    ],
    "/characteristics/{characteristic}/trial": [
        "/characteristics/{characteristic}/trial",
        "/characteristics/{characteristic}-empty/trial",
    ],
    "/characteristics/{characteristic}/sampling": [
        "/characteristics/{characteristic}/sampling?seconds=12",
        "/characteristics/{characteristic}-empty/sampling",
    ],
    "/characteristics/{characteristic}/temperature": [
        "/characteristics/{characteristic}/temperature",
        "/characteristics/{characteristic}-warm/temperature",
        "/characteristics/{characteristic}-empty/temperature",
    ],
    "/characteristics/{characteristic}/control-plan": [
        "/characteristics/{characteristic}/control-plan",
        "/characteristics/{characteristic}-empty/control-plan",
    ],
    "/characteristics/{characteristic}/trial/start": ["/characteristics/{characteristic}/trial/start"],
    "/shift": ["/shift", "/shift?machine={machine}", "/shift?at=2020-01-01"],
    "/wall": ["/wall#{wall_key}"],
    "/setup/screens": ["/setup/screens"],
    "/ledger": ["/ledger", "/ledger?machine={machine}"],
    "/proposals": ["/proposals", "/proposals?status=all"],
    "/proposals/{number}": ["/proposals/{proposal}"],
    "/alarms": ["/alarms", "/alarms?machine={machine}"],
    "/alarms/load": ["/alarms/load", "/alarms/load?machine={machine}"],
    "/alarms/history": ["/alarms/history"],
    "/alarms/causes": ["/alarms/causes", "/alarms/causes?machine={machine}&from=2020-01-01&to=2020-01-02"],
    "/alarms/{number}": ["/alarms/{alarm}", "/alarms/{alarm}?action=keep_cutting"],
    "/alarms/{number}/affected": ["/alarms/{alarm}/affected"],
    "/quarantines": ["/quarantines", "/quarantines?state=all&machine={machine}"],
    "/quarantines/{number}": ["/quarantines/{quarantine}"],
    "/quarantines/{number}/parts/{part}/{what}": ["/quarantines/{quarantine}/parts/1/measure"],
    "/corrections": ["/corrections", "/corrections?machine={machine}"],
    "/corrections/{machine}/tools/{tool}": ["/corrections/{machine}/tools/5"],
    "/todo": ["/todo", "/todo?machine={machine}&mine=true"],
    "/search": ["/search", "/search?q=shaft"],
    "/parts": ["/parts", "/parts?part=SN-1"],
    "/parts/{part:path}": ["/parts/SN%201/2"],
    "/machines": ["/machines"],
    "/machines/{machine}": ["/machines/{machine}"],
    "/machines/{machine}/geometry": ["/machines/{machine}/geometry"],
    "/tools": ["/tools"],
    "/machines/{machine}/tools/{number}": ["/machines/{machine}/tools/3", "/machines/{machine}/tools/32"],
    "/machines/{machine}/tools": ["/machines/{machine}/tools?tool=3"],
    "/machines/{machine}/corrections/program": [
        "/machines/{machine}/corrections/program",
        "/machines/{machine}/corrections/program?form=list",
    ],
    "/machines/{machine}/corrections/{number}": ["/machines/{machine}/corrections/1"],
    "/machines/{machine}/tools/{number}/{what}": [
        "/machines/{machine}/tools/3/edit",
        "/machines/{machine}/tools/3/change",
        "/machines/{machine}/tools/3/sister",
    ],
    "/machines/{machine}/averages/{location}/edit": ["/machines/{machine}/averages/5/edit"],
    "/calibration": ["/calibration"],
    "/calibration/probes": ["/calibration/probes?machine={machine}&tool=32"],
    "/calibration/{machine}/{memory}/{location}": [
        "/calibration/{machine}/averages/5",
        "/calibration/{machine}/averages/6",
        "/calibration/{machine}/probes/32",
    ],
    "/calibration/{machine}/{memory}/{location}/{number}": [
        "/calibration/{machine}/averages/5/1",
        "/calibration/{machine}/averages/5/3",
        "/calibration/{machine}/probes/32/4",
    ],
    "/calibration/{machine}/{memory}/{location}/{what}/{number}": [
        "/calibration/{machine}/averages/5/accept/1",
        "/calibration/{machine}/averages/6/suggestion/0",
    ],
    "/alignments": ["/alignments", "/alignments?machine={machine}"],
    "/alignments/new": [
        "/alignments/new",
        "/alignments/new?found=measured&like={alignment}",
        "/alignments/new?kind=two_points",
        "/alignments/new?kind=two_holes",
    ],
    "/alignments/pallets/new": ["/alignments/pallets/new?part={alignment}"],
    "/alignments/history": ["/alignments/history?machine={machine}&name=pallet%204"],
    "/alignments/{number}": ["/alignments/{alignment}"],
    "/forms": ["/forms"],
    "/forms/new": ["/forms/new", "/forms/new?example=printed", "/forms/new?from={form}"],
    "/work-zeros": ["/work-zeros", "/work-zeros?machine={machine}"],
    "/work-zeros/new": ["/work-zeros/new", "/work-zeros/new?kind=corner", "/work-zeros/new?like={zero}"],
    "/work-zeros/{number}": ["/work-zeros/{zero}"],
    "/work-zeros/fixtures/{machine}/{fixture}": [
        "/work-zeros/fixtures/{machine}/vice-with-a-name-as-long-as-people-give-them"
    ],
    "/forms/{form}": ["/forms/{form}", "/forms/{form}?section=2"],
    "/forms/features/{machine}/{feature}": ["/forms/features/{machine}/bore-d56?kind=axis_straightness"],
    "/kinematics": ["/kinematics"],
    "/kinematics/measuring-plan": ["/kinematics/measuring-plan"],
    "/setup/jobs": ["/setup/jobs"],
    "/maintenance": ["/maintenance", "/maintenance?machine={machine}"],
    "/maintenance/new": ["/maintenance/new?machine={machine}"],
    "/maintenance/{number}/end": ["/maintenance/{maintenance}/end"],
    "/maintenance/{number}/extend": ["/maintenance/{maintenance}/extend"],
    "/setup/notifications": ["/setup/notifications"],
    "/setup/notifications/days-off": ["/setup/notifications/days-off"],
    "/setup/notifications/groups/new": ["/setup/notifications/groups/new"],
    "/setup/notifications/groups/{group}": ["/setup/notifications/groups/{group}"],
    "/setup/notifications/routes/new": ["/setup/notifications/routes/new"],
    "/setup/notifications/routes/{route}": ["/setup/notifications/routes/{route}"],
    "/account/notifications": ["/account/notifications"],
    "/setup/reactions": ["/setup/reactions"],
    "/setup/reactions/new": ["/setup/reactions/new"],
    "/setup/reactions/{plan}": ["/setup/reactions/{plan}"],
    "/kinematics/new": [
        "/kinematics/new",
        "/kinematics/new?way=positions",
        "/kinematics/new?example=1&machine={machine}",
    ],
    "/kinematics/machines/{machine}": [
        "/kinematics/machines/{machine}",
        "/kinematics/machines/{machine}?value=backlash.C&before={run}",
    ],
    "/kinematics/machines/{machine}/backups/{version}": ["/kinematics/machines/{machine}/backups/1"],
    "/kinematics/runs/{run}": ["/kinematics/runs/{run}"],
    "/kinematics/runs/{run}/protocol": ["/kinematics/runs/{run}/protocol"],
    "/kinematics/runs/{run}/{what}": ["/kinematics/runs/{run}/enter"],
    "/kinematics/compare": ["/kinematics/compare?run={run}"],
    "/setup": ["/setup"],
    "/setup/characteristics": ["/setup/characteristics"],
    "/setup/characteristics/new": ["/setup/characteristics/new"],
    "/setup/characteristics/{characteristic}": ["/setup/characteristics/{characteristic}"],
    "/setup/programs": ["/setup/programs"],
    "/setup/characteristics/{characteristic}/program": [
        "/setup/characteristics/{characteristic}/program",
        "/setup/characteristics/{characteristic}/program?kind=calibration&gauge=199.852&control=fanuc",
        "/setup/characteristics/{characteristic}/program?kind=ring&control=haas&number=7",
    ],
    "/setup/machines": ["/setup/machines"],
    "/setup/machines/new": ["/setup/machines/new"],
    "/setup/machines/{machine}": ["/setup/machines/{machine}", "/setup/machines/new?like={machine}"],
    "/setup/parameters": [
        "/setup/parameters",
        "/setup/parameters?parameter=zero_range&value=0.002&on={characteristic}",
    ],
    "/setup/people": ["/setup/people"],
    "/setup/stations": ["/setup/stations"],
    "/setup/audit": ["/setup/audit"],
    "/station": ["/station"],
    "/account": ["/account"],
    "/import": ["/import"],
    "/api/docs": ["/api/docs"],
    "/compare": ["/compare", "/compare?of={characteristic}&by=version"],
    "/proof": ["/proof"],
    "/help": ["/help"],
    "/help/{name:path}": ["/help/how-to/run-rules", "/help/reference/glossary"],
    "/licences": ["/licences"],
    "/licences/{library}": ["/licences/psycopg"],
}
ADDRESSES = [address for addresses in PAGES.values() for address in addresses]

HEARTBEAT: dict[str, Any] = {
    "version": "0.2.0.dev17+g1cbe8a9",
    "state": "control_away",
    "detail": "ConnectionRefusedError: opc.tcp://192.168.214.1:4840 does not answer; the next attempt is made in 30 s",
    "waiting": 1204,
    "oldest_waiting_at": "2026-11-01T08:00:00Z",
    "quarantined": 27,
    "quarantine": [
        {
            "key": f"a-machine-with-a-long-key:123456:{number}",
            "characteristic": "shaft-with-a-long-key",
            "reason": "There is no characteristic shaft-with-a-long-key. GET /api/v1/characteristics lists them.",
            "at": "2026-11-01T08:00:00Z",
        }
        for number in range(3)
    ],
    "clock_offset": -3605.2,
    "kind": "opcua",
    "mapping": "5b8c1f0e5b8c1f0e",
    "hold_all": True,
    "identity": "ZA6-1207 840D sl",
    "locations": [
        {"tool_memory": 3, "mapping": "77d09a12", "proved_at": "2026-11-01T08:00:00Z", "offset": -0.0123},
        {"tool_memory": 13, "mapping": "1c2d3e4f", "proved_at": None, "offset": None},
        {"tool_memory": 14, "mapping": "9a8b7c6d", "proved_at": None, "offset": 0.25, "touch_test_by_page": True},
    ],
}


def routes() -> set[str]:
    """Every address that answers GET, for people and for programs."""
    from fastapi.routing import APIRoute

    from app.main import ROUTERS

    found = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]
    return {route.path for route in found if "GET" in (route.methods or ())}


def furnished(server: Server) -> Shop:
    """A machine with something of everything: a worn tool, held and pending corrections, a long name, no data."""
    made = Shop(server)
    for deviation in (0.4, 3.0, 6.1, -12.5, 2.0, 0.2, 350.0):
        made.read(deviation)
    made.add(f"{made.characteristic}-empty", tool_memory=4)
    made.add(f"{made.characteristic}-approval", tool_memory=5, average_memory=6, mode="approval")
    made.read(6.0, f"{made.characteristic}-approval")
    made.read(-12.0, f"{made.characteristic}-approval")
    made.call(
        "PATCH",
        f"/machines/{made.machine}/tools/3",
        name="Finishing tool with a name as long as tool lists have them",
        edge="D1",
        planned_parts=400,
        sister=13,
    )
    warm = f"{made.characteristic}-warm"
    made.add(warm, tool_memory=0, average_memory=0)
    degrees = [21 + at % 17 / 4 for at in range(60)]
    made.push(
        [at % 5 + degree for at, degree in enumerate(degrees)],
        warm,
        context=[{"part_temperature": each} for each in degrees],
    )
    steel: dict[str, Any] = {
        "coefficient": 11.5,
        "temperature_uncertainty": 0.5,
        "reason": "16MnCr5, as on the drawing",
    }
    made.call("PUT", f"/characteristics/{warm}/expansion", **steel)
    made.call("POST", f"/machines/{made.machine}/heartbeat", **HEARTBEAT)
    tests = f"/machines/{made.machine}/touch-tests"
    test = made.call("POST", tests, 201, tool_memory=14)["id"]
    made.call("POST", f"{tests}/{test}/report", **example_of("TouchTestReport"))
    calibrations = f"/machines/{made.machine}/calibrations"
    limits: dict[str, Any] = {"zero_range": 0.001, "averaging_limit": 0.01, "confidence_limit": 1.0}
    for touches in ([199.8553], [201.9], [199.8553, None]):
        made.call("POST", calibrations, 201, average_memory=5, gauge_size=199.852, touches=touches, **limits)
    ring: dict[str, Any] = {"nominal": 30.0, "upper_deviation": 0.01, "lower_deviation": -0.01, "radius_term": 6.0}
    sections = [{"plus": 24.012, "minus": -23.988}] * 3
    made.call("POST", f"{calibrations}/ring", 201, tool_memory=32, sections=sections, **ring)
    for difference in (0.002, 0.0025, 0.0022, 0.0024, 0.0045):
        pair: dict[str, Any] = {"machine_value": 40.0 + difference, "external_value": 40.0, "instrument": "CMM, hall C"}
        made.call("POST", f"/machines/{made.machine}/averages/6/pairs", 201, **pair)
    made.call("POST", "/alignments", 201, machine=made.machine, touches=SIX, name="pallet 4", repeatability=0.002)
    bore = BORE | {"feature": "bore-d56", "machine": made.machine}
    made.call("POST", "/forms", 201, **bore)
    turned: dict[str, Any] = {"axes": [axis(both=True, backlash=0.002)], "machine": made.machine}
    first = made.call("POST", "/kinematics/runs", 201, **turned)["run"]
    made.call("POST", f"/kinematics/runs/{first}/enter", reason="Monthly check")
    made.call("POST", "/kinematics/runs", 201, **turned)
    vice = "vice-with-a-name-as-long-as-people-give-them"
    web: dict[str, Any] = {
        "kind": "web",
        "tip": 6.0,
        "fixture": vice,
        "repeatability": 0.001,
        "z_touched": -200.0,
        "part": "SN-0008127731-B",
    }
    for shift in (0.0, 0.02):
        sides = [{"x": -1053.0 + shift, "y": 0, "approach": "+X"}, {"x": -947.0 + shift, "y": 0, "approach": "-X"}]
        ends = [{"x": -1040, "y": -833.0, "approach": "+Y"}, {"x": -960, "y": -832.2, "approach": "+Y"}]
        top = {"x": -1000, "y": -763.0, "approach": "-Y"}
        made.call("POST", "/work-zeros", 201, machine=made.machine, touches=[*sides, *ends, top], **web)
    watched: dict[str, Any] = {"warning": 0.01, "alarm": 0.03, "reason": "It creeps"}
    made.call("PUT", f"/work-zeros/fixtures/{made.machine}/{vice}", **watched)
    line = Line(made, "watched")
    line.push([9.0, 0.0, -7.0])
    line.look()
    about: dict[str, Any] = {
        "machine": made.machine,
        "characteristic": made.characteristic,
        "gauge": "Probe T8, ruby 2 mm",
    }
    cells = [
        {"part": str(part), "operator": operator, "values": [40 + part / 1000, 40.0003 + part / 1000, 40.0001]}
        for part in range(10)
        for operator in ("Jovanović-Đorđević", "Živković", "third")
    ]
    made.call("POST", "/gauge-studies", 201, kind="grr", rows=cells, **about)
    repeats = [{"values": [40.0 + n % 7 / 10_000 for n in range(50)]}]
    made.call("POST", "/gauge-studies", 201, kind="type_one", reference=40.0, rows=repeats, **about)
    made.call(
        "POST",
        f"/characteristics/{made.characteristic}/proposals",
        201,
        zero_range=0.002,
        reason="Half as many corrections",
    )
    made.call(
        "PATCH",
        f"/characteristics/{made.characteristic}-empty",
        name="Concentric recess with a name as long as drawings have them Ø118.750 P7/h6",
        parameters={"zero_range": 0.0015},
        reason="A reason that somebody took the time to write down in full, with everything that matters.",
    )
    made.call(
        "POST", "/notes", 201, machine=made.machine, text="Coolant changed\n" + "Kühlschmierstoffkonzentration" * 4
    )
    made.call("POST", "/notes", 201, characteristic=made.characteristic, sequence=3, text="New batch of bars")
    made.call("POST", "/quarantines", 201, alarm=made.alarms()[0]["id"], reason="Edge broken amid the batch")
    rules: dict[str, Any] = {"every": 5, "minutes": 240.0, "per_shift": True, "after_change": 3, "after_alarm": 10}
    made.call("PUT", f"/characteristics/{made.characteristic}/control-plan", **rules, reason="As agreed with quality")
    _notified(made)
    _with_plan(made)
    return made


def _with_plan(made: Shop) -> None:
    """A reaction plan for the alarm that is looked at, with something to choose, and an alarm with a cause."""
    cause = made.call("POST", "/reactions/catalogue", 201, sort="cause", name="Chip between the part and the jaws")[
        "id"
    ]
    made.call("POST", "/reactions/catalogue", 201, sort="action", name="Insert indexed")
    drawing = as_json(picture(size=(1200, 500)))
    shown = {"digest": made.call("POST", "/reactions/pictures", 201, **drawing)["digest"], "alt": "A chipped edge"}
    made.call("POST", f"/alarms/{made.alarms()[0]['id']}/photos", 201, **drawing)
    steps = [
        {"text": "Set the part aside.", "picture": shown},
        {"text": "Look at the edge " + "with the loupe, from all sides, " * 5},
    ]
    body: dict[str, Any] = {"characteristic": made.alarms()[0]["characteristic"], "steps": steps, "reason": "New"}
    made.call("POST", "/reactions/plans", 201, name="Edge broken", **body)
    made.read(20.0, made.another("seat"))
    made.acknowledge(made.alarms()[-1]["id"], "noted", cause=cause)


def _notified(made: Shop) -> None:
    """A receiver, a route that is off, and a delivery that has failed."""
    receiver: dict[str, Any] = {
        "name": "Shift leader of the hall with the long name",
        "means": "mail",
        "address": "shift.leader@a-plant-with-a-long-name.example",
        "quiet": [{"days": [6, 7], "begins": "22:00", "ends": "06:00"}],
    }
    number = made.call("POST", "/notifications/receivers", 201, **receiver)["id"]
    turn = {"receivers": [number], "shift": "06:00", "days": [1, 2, 3, 4, 5]}
    made.call("POST", "/notifications/groups", 201, name="Setters of the hall", members=[number], rota=[turn])
    made.call(
        "POST", "/maintenance", 201, machine=made.machine, reason="Spindle bearing replaced; the supplier is here"
    )
    made.call("PUT", "/notifications/calendar", country="DE", subdivision="BY", days=["2026-12-24"])
    hours = [{"days": [1, 2, 3, 4, 5], "begins": "06:00", "ends": "14:00"}]
    steps = [{"receivers": [number]}, {"after": 15, "receivers": [number]}]
    route: dict[str, Any] = {"kinds": ["tool_worn", "probe_fault"], "hours": hours, "steps": steps, "enabled": False}
    made.call("POST", "/notifications/routes", 201, name="Worn tools, early shift", **route)
    test = made.call("POST", f"/notifications/receivers/{number}/test", 202)["id"]
    until(lambda: made.call("GET", f"/notifications/deliveries/{test}")["state"] == "failed")


def values_of(shop: Shop) -> dict[str, Any]:
    """What stands for the names in `ADDRESSES`."""

    def of(what: str) -> list[Any]:
        items: list[Any] = shop.call("GET", f"/{what}?machine={shop.machine}")["items"]
        return items

    here = f"/machines/{shop.machine}"
    waiting = shop.call("GET", f"{here}/corrections?status=awaiting_approval")["items"]
    proposals = shop.call("GET", f"/characteristics/{shop.characteristic}/proposals")["items"]
    repeated, crossed = of("gauge-studies")
    return {
        "machine": shop.machine,
        "characteristic": shop.characteristic,
        "alarm": shop.alarms()[0]["id"],
        "waiting": waiting[0]["number"],
        "quarantine": of("quarantines")[0]["id"],
        "proposal": proposals[0]["id"],
        "signal": of("signals")[0]["id"],
        "note": of("notes")[-1]["id"],
        "repeated": repeated["id"],
        "crossed": crossed["id"],
        "touch_test": shop.call("GET", f"{here}/touch-tests")["items"][0]["id"],
        "zero": of("work-zeros")[0]["id"],
        "alignment": of("alignments")[0]["id"],
        "form": of("forms")[0]["id"],
        "run": of("kinematics/runs")[-1]["run"],
        "wall_key": shop.call("POST", "/wall-screens", 201, name="Hall with a name as long as halls have them")[
            "url"
        ].partition("#")[2],
        "route": shop.call("GET", "/notifications/routes")["items"][-1]["id"],
        "group": shop.call("GET", "/notifications/groups")["items"][-1]["id"],
        "maintenance": shop.call("GET", "/maintenance")["items"][0]["id"],
        "plan": shop.call("GET", "/reactions/plans")["items"][-1]["id"],
    }
