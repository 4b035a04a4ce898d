"""Bad input at every endpoint of the OpenAPI document: a problem in words, nothing stored, never a 5xx.

What is tried follows from the document itself, so an endpoint that is added is tried too; what it needs to be called
rightly stands in `BODIES`, and a test fails while it is missing there.
"""

import fcntl
import itertools
import json
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from functools import cache, partial
from typing import Any, NamedTuple

import httpx
import psycopg
import pytest

from app.loop.notifications import notifier
from app.views.reports.request import ReportRequest, SectionName
from app.web.openapi import example_of
from tests import keeper
from tests.conftest import NewDatabase, Server, drop_database
from tests.geometry.rotary_axes.bench import axis
from tests.in_process import InProcess, application, in_process
from tests.loop.readings.record import counted
from tests.quality.control_charts.line import Line
from tests.shop import PARAMETERS, Shop
from tests.views.reports.made_here import made_here
from tests.waits import until

pytestmark = pytest.mark.own_server  # rows of all tables are counted

READING = {"characteristic": "{characteristic}", "measured": 40.0}
FULL_READING = READING | {
    "measured_at": "2026-11-21T08:15:02Z",
    "machined_at": "2026-11-21T08:15:00Z",
    "part": "SN-1",
    "key": "bad-input",
    "correction_in_effect": 0,
    "context": {"order": "A-77", "nest": 2, "events": ["door opened"]},
}
AQDEF = "K0100 1\nK2001/1 {characteristic}\nK2142/1 mm\nK0001/1 40\nK0004/1 21.11.2026/08:15:02\n"
WHY = {"reason": "Compared with a micrometer"}
WHAT_IF = {"averaging_limit": 0.006, "factor": -1.0, "delay": 1, "effect": 1.0, "last": 1000}
PERIOD: dict[str, Any] = {
    "chart": "xbar_s",
    "quantity": "deviation",
    "first_sequence": 1,
    "last_sequence": 60,
    "grouping": "consecutive",
    "group_size": 2,
    "group_pause": 2.5,
    "ewma_lambda": 0.2,
    "ewma_width": 3.0,
    "ewma_exact": True,
    "cusum_k": 0.5,
    "cusum_h": 5.0,
    "cusum_headstart": 2.5,
    "average_span": 5,
    "settle": 20,
    "excluded": [{"first": 3, "last": 4, "reason": "Chip on the stylus"}],
}
GAUGE: dict[str, Any] = {
    "gauge": "Probe T8",
    "reference": 40.0,
    "tolerance": 0.016,
    "resolution": 0.0001,
    "each": "reading",
    "unbalanced": "refuse",
    "rows": [{"part": part, "operator": "A", "values": [40.0, 40.001]} for part in ("1", "2")],
}
NIGHT = {"days": [1, 2, 3, 4, 5], "begins": "22:00", "ends": "06:00"}
ROUTE: dict[str, Any] = {
    "name": "Night",
    "enabled": False,
    "kinds": ["tool_worn"],
    "tones": ["stop"],
    "machines": ["{machine}"],
    "characteristics": ["{characteristic}"],
    "hours": [NIGHT],
    "on_days_off": False,
    "urgent": True,
    "repeat": 10,
    "digest": 5,
    "hold_off": 5,
    "steps": [{"after": 0, "receivers": [1]}],
}
RECEIVER: dict[str, Any] = {
    "name": "Andon",
    "address": "https://andon.example/inband",
    "quiet": [NIGHT],
    "away_until": "2026-11-21T08:15:02Z",
    "events": ["tool"],
}
TURN: dict[str, Any] = {"receivers": [1], "days": [1, 2], "first": "2026-11-30", "last": "2026-12-31"}
GROUP: dict[str, Any] = {
    "name": "Setters",
    "members": [1],
    "rota": [TURN | {"shift": "06:00"}, TURN | {"begins": "22:00", "ends": "06:00"}],
}
REACTION: dict[str, Any] = {
    "name": "Seat oversize",
    "steps": [{"text": "Set the part aside."}],
    "cause_needed": False,
    "action_needed": False,
    "receivers": [],
    "reason": "First version",
}
BODIES: dict[str, dict[str, Any]] = {
    "POST /api/v1/notifications/routes": ROUTE,
    "PUT /api/v1/notifications/routes/{route}": ROUTE,
    "POST /api/v1/notifications/groups": GROUP,
    "PUT /api/v1/notifications/groups/{group}": GROUP,
    "PUT /api/v1/notifications/calendar": {"country": "DE", "subdivision": "BY", "days": ["2026-12-24"]},
    "POST /api/v1/maintenance": {
        "machine": "{machine}",
        "begins": f"{datetime.now(UTC) + timedelta(days=1):%Y-%m-%dT%H:%M:%SZ}",
        "ends": f"{datetime.now(UTC) + timedelta(days=1, hours=1):%Y-%m-%dT%H:%M:%SZ}",
        "reason": "Spindle bearing replaced",
        "stopping_anyway": False,
    },
    "POST /api/v1/maintenance/{maintenance}/extend": {
        "ends": f"{datetime.now(UTC) + timedelta(days=2):%Y-%m-%dT%H:%M:%SZ}",
        "reason": "The spare part comes tomorrow",
    },
    "POST /api/v1/maintenance/{maintenance}/end": WHY,
    "POST /api/v1/notifications/receivers": RECEIVER | {"means": "webhook"},
    "PATCH /api/v1/notifications/receivers/{receiver}": RECEIVER | {"address": "anna@example.com", "events": []},
    "PUT /api/v1/notifications/me": {
        "address": "anna@example.com",
        "quiet": [NIGHT],
        "away_until": "2026-11-21T08:15:02Z",
        "shift_report": True,
    },
    "PUT /api/v1/notifications/me/browser": {"quiet": [NIGHT], "away_until": "2026-11-21T08:15:02Z"},
    "POST /api/v1/notifications/me/browser/messages": {"shown": [1]},
    "POST /api/v1/reactions/plans": REACTION | {"characteristic": "{characteristic}", "rule": "nelson_1"},
    "PUT /api/v1/reactions/plans/{plan}": REACTION | {"characteristic": "{characteristic}", "kind": "hunting"},
    "POST /api/v1/reactions/plans/{plan}/withdraw": WHY,
    "POST /api/v1/reactions/pictures": example_of("PictureIn"),
    "POST /api/v1/alarms/{alarm}/photos": example_of("PictureIn"),
    "POST /api/v1/alarms/{alarm}/photos/{photo}/remove": WHY,
    "POST /api/v1/reactions/catalogue": {"sort": "cause", "name": "Chip on the stylus"},
    "PATCH /api/v1/reactions/catalogue/{entry}": {"retired": False},
    "POST /api/v1/readings/aqdef": {"name": "bad.dfq", "content": AQDEF},
    "POST /api/v1/readings/table": {
        "name": "bad.csv",
        "content": "Time;Value\n2026-11-21T08:15:02Z;40.001\n",
        "characteristic": "{characteristic}",
        "map": {"measured": "Value"},
        "unit": "mm",
        "decimal": ".",
        "missing": ["---"],
        "dry_run": True,
    },
    "POST /api/v1/wall-screens": {"name": "Hall C"},
    "POST /api/v1/machines": {"key": "mill-bad", "name": "Mill", "control": "heidenhain"},
    "PATCH /api/v1/machines/{machine}": {"name": "Lathe", "control": "fanuc", "corrections_expire_after": 8.0},
    "POST /api/v1/machines/{machine}/keys": {"name": "Second control"},
    "POST /api/v1/characteristics": {
        "key": "bore-bad",
        "name": "Bore",
        "machine": "{machine}",
        "part": "ring",
        "unit": "mm",
        "parameters": PARAMETERS,
    },
    "PATCH /api/v1/characteristics/{characteristic}": {
        "name": "Seat",
        "part": "shaft",
        "parameters": PARAMETERS | {"zero_range": 0.002},
        "reason": "Noisy machine",
    },
    "POST /api/v1/characteristics/{characteristic}/trial/start": {
        "weighting_factor": 3.0,
        "zero_range": 0.0015,
        "parameters_version": 1,
        "reason": "Shadow trial looked at",
    },
    "PUT /api/v1/characteristics/{characteristic}/control-plan": {
        "every": 5,
        "minutes": 60.0,
        "per_shift": True,
        "after_change": 3,
        "after_alarm": 10,
        "on_the_way": 0,
        "numbered": False,
        "reason": "Agreed with quality",
    },
    "PUT /api/v1/machines/{machine}/context": {"order": "4711", "nest": 2},
    "PUT /api/v1/characteristics/{characteristic}/expansion": {
        "coefficient": 11.5,
        "coefficient_uncertainty": 1.0,
        "scale_coefficient": 8.0,
        "temperature_uncertainty": 0.5,
        "length": 40.0,
        "reason": "16MnCr5",
    },
    "POST /api/v1/quarantines": {"alarm": 1, "guard": 0.001, "by_hand_only": False, "reason": "Edge broken"},
    "POST /api/v1/quarantines/{quarantine}/parts/{number}/measure": {"measured": 40.001, "reason": "Micrometer"},
    "POST /api/v1/quarantines/{quarantine}/parts/{number}/release": WHY,
    "POST /api/v1/quarantines/{quarantine}/parts/{number}/scrap": WHY,
    "POST /api/v1/readings": FULL_READING,
    "POST /api/v1/readings/batch": FULL_READING | {"key": "bad-input-2"},  # sent as a list of one
    "POST /api/v1/readings/{characteristic}/{sequence}/exclude": WHY,
    "POST /api/v1/readings/{characteristic}/{sequence}/by-hand": {
        "measured": 40.001,
        "verdict": "good",
        "comment": "Micrometer",
    },
    "PUT /api/v1/machines/{machine}/tools/{tool}": {"offset": 0.01} | WHY,
    "POST /api/v1/machines/{machine}/tools/{tool}/change": {"offset": 0.01} | WHY,
    "PATCH /api/v1/machines/{machine}/tools/{tool}": {
        "edge": "D1",
        "name": "T03",
        "kind": "DCMT 11T304",
        "planned_parts": 400,
        "planned_total": 0.05,
        "sister": 13,
    },
    "POST /api/v1/machines/{machine}/tools/{tool}/switch": WHY,
    "POST /api/v1/corrections/{machine}/approve": {"numbers": [2]} | WHY,  # the one of `Place` that awaits approval
    "PUT /api/v1/machines/{machine}/averages/{location}": {"empirical_value": 0.001} | WHY,
    "POST /api/v1/machines/{machine}/calibrations": {
        "average_memory": 5,
        "gauge_size": 25.0,
        "touches": [25.001, 25.0012],
        "repeats": 2,
        "surface": "free",
        "probe_type": "axial",
        "axis": "X",
        "direction": "negative",
        "zero_range": 0.001,
        "averaging_limit": 0.01,
        "confidence_limit": 1.0,
        "weighting_factor": 2.0,
        "path_factor": 1.0,
        "tool_memory": 30,
        "calibrated_at": "2026-11-21T08:15:02Z",
        "key": "bad-input",
    },
    "POST /api/v1/machines/{machine}/calibrations/ring": {
        "tool_memory": 32,
        "nominal": 30.0,
        "upper_deviation": 0.01,
        "lower_deviation": -0.01,
        "radius_term": 6.0,
        "sections": [{"plus": 24.0, "minus": -24.0}] * 3,
        "first_move_triggered": False,
        "calibrated_at": "2026-11-21T08:15:02Z",
        "key": "bad-ring",
    },
    "POST /api/v1/machines/{machine}/calibrations/{number}/accept": WHY,
    "POST /api/v1/machines/{machine}/averages/{location}/pairs": {
        "machine_value": 40.001,
        "external_value": 40.0,
        "instrument": "Micrometer",
        "key": "bad-pair",
    },
    "POST /api/v1/machines/{machine}/averages/{location}/pairs/{pair}/exclude": WHY,
    "POST /api/v1/machines/{machine}/averages/{location}/suggestion/accept": {"empirical_value": 0.001} | WHY,
    "PUT /api/v1/machines/{machine}/averages/{location}/calibration-plan": {
        "due_parts": 500,
        "due_days": 7.0,
        "acceptance": "accept",
    },
    "PUT /api/v1/machines/{machine}/tools/{tool}/calibration-plan": {"due_parts": 500},
    "POST /api/v1/corrections/{machine}/{number}/applied": {
        "offset_after": -0.006,
        "applied_at": "2026-11-21T08:15:02Z",
    },
    "POST /api/v1/corrections/{machine}/{number}/rejected": WHY | {"although_fetched": False},
    "POST /api/v1/corrections/{machine}/{number}/approve": WHY,
    "POST /api/v1/corrections/{machine}/{number}/release": WHY,
    "POST /api/v1/characteristics/{characteristic}/baselines": PERIOD | WHY | {"key": "bad-input", "seen_version": 2},
    "POST /api/v1/characteristics/{characteristic}/baselines/preview": PERIOD,
    "POST /api/v1/characteristics/{characteristic}/baselines/{version}/retire": WHY,
    "POST /api/v1/characteristics/{characteristic}/baselines/{version}/put-in-force": WHY,
    "PUT /api/v1/characteristics/{characteristic}/rules": {
        "rules": {"main": {"nelson_1": "alarm"}, "ewma": {"nelson_1": "watch"}},
        "look_back": True,
        "seen_version": 0,
    }
    | WHY,
    "POST /api/v1/reports": {
        "characteristics": ["{characteristic}"],
        "machines": [],
        "from": "2026-11-01T00:00:00Z",
        "to": "2099-01-01T00:00:00Z",
        "last": 5,
        "sections": ["numbers"],
        "format": "csv",
        "paper": "letter",
        "timezone": "Europe/Belgrade",
    },
    "POST /api/v1/gauge-studies": GAUGE
    | {"kind": "grr", "machine": "{machine}", "characteristic": "{characteristic}", "key": "bad-study"},
    "POST /api/v1/gauge-studies/from-readings": {name: value for name, value in GAUGE.items() if name != "rows"}
    | {"kind": "type_one", "characteristic": "{characteristic}", "first": 1, "through": 5, "take": "readings"}
    | {"key": "bad-probing"},
    "PUT /api/v1/gauge-studies/{study}": GAUGE | WHY | {"seen_revision": 1},
    "POST /api/v1/signals/{signal}/comment": {"cause": "material", "comment": "New batch, harder by 20 HB"},
    "POST /api/v1/characteristics/{characteristic}/what-if": WHAT_IF | {"weighting_factor": 3.0, "zero_range": 0.002},
    "POST /api/v1/characteristics/{characteristic}/what-if/sampling": WHAT_IF,
    "POST /api/v1/characteristics/{characteristic}/what-if/map": WHAT_IF
    | {"weighting_factors": [1.0, 2.0], "zero_ranges": [0.001, 0.002], "criterion": "ppk"},
    "POST /api/v1/characteristics/{characteristic}/proposals": WHAT_IF | {"zero_range": 0.0015} | WHY,
    "POST /api/v1/proposals/{proposal}/approve": WHY,
    "POST /api/v1/proposals/{proposal}/reject": WHY,
    "POST /api/v1/proposals/{proposal}/withdraw": WHY,
    "POST /api/v1/work-zeros": {
        "machine": "{machine}",
        "kind": "pocket",
        "tip": 6.0,
        "work_offset": "G54",
        "fixture": "vice",
        "touches": [{"x": -53.0, "approach": "-X"}, {"x": 47.0, "approach": "+X"}],
        "z_touched": -150.0,
        "feeler": 0.1,
        "tool_length": 98.0,
        "key": "bad-zero",
    },
    "POST /api/v1/work-zeros/{number}/recompute": {"tip": 5.998, "repeatability": 0.001, "leave_out": []} | WHY,
    "PUT /api/v1/work-zeros/fixtures/{machine}/{fixture}": {
        "basis": "frozen",
        "reference": 1,
        "warning": 0.01,
        "alarm": 0.03,
        "characteristics": {},
    }
    | WHY,
    "POST /api/v1/forms": {
        "machine": "{machine}",
        "feature": "bore",
        "kind": "coaxiality",
        "method": "least_squares",
        "sections": [{"height": 40, "touches": [[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0]]}],
        "datum": {"sections": [{"height": 0, "centre": [0, 0]}, {"height": 20, "centre": [0, 0.001]}]},
        "tolerance": 0.01,
        "repeatability": 0.001,
        "tip_diameter": 4.0,
        "side": "inside",
        "part": "SN-1",
        "key": "bad-form",
    },
    "POST /api/v1/forms/{number}/recompute": WHY,
    "POST /api/v1/count-charts": {
        "chart": "np",
        "counts": [4, 2, 5, 3],
        "inspected": 50,
        "baseline": 3,
        "centre": 0.06,
    },
    "POST /api/v1/alignments": {
        "machine": "{machine}",
        "kind": "two_points",
        "side": [{"nominal": [0, 0], "measured": [0, 0.1]}, {"nominal": [100, 0], "measured": [100, 0.3]}],
        "repeatability": 0.002,
        "work_offset": "G54",
        "base": [0.0, 0.0, 0.0],
        "table": {"axis": "C", "centre": [0.0, 0.0], "position": 90.0, "clockwise": True},
        "key": "bad-alignment",
    },
    "POST /api/v1/alignments/pallets": {"pallet": 1, "part": 2, "name": "pallet 4", "key": "bad-pallet"},
    "POST /api/v1/alignments/{number}/acknowledge": WHY,
    "POST /api/v1/work-zeros/{number}/acknowledge": WHY,
    "POST /api/v1/kinematics/runs/{run}/acknowledge": WHY,
    "POST /api/v1/kinematics/measuring-plans": example_of("MeasuringPlanIn"),
    "POST /api/v1/machines/{machine}/heartbeat": example_of("HeartbeatIn"),
    "POST /api/v1/machines/{machine}/touch-tests": example_of("TouchTestIn"),
    "POST /api/v1/machines/{machine}/touch-tests/{number}/answer": example_of("TouchTestAnswer"),
    "POST /api/v1/machines/{machine}/touch-tests/{number}/report": example_of("TouchTestReport"),
    "POST /api/v1/machines/{machine}/tools/{tool}/reported": {"offset": 0.0, "none_applied": True},
    "POST /api/v1/notes": {
        "characteristic": "{characteristic}",
        "sequence": 1,
        "at": "2026-11-21T08:15:02Z",
        "text": "New bar",
    },
    "POST /api/v1/notes/{note}/withdraw": WHY,
    "POST /api/v1/machines/{machine}/faults": {"kind": "battery_low", "text": "low", "active": True},
    "POST /api/v1/alignments/{number}/recompute": {"method": "small", "leave_out": []} | WHY,
    "POST /api/v1/kinematics/runs": {
        "machine": "{machine}",
        "measured_at": "2026-11-21T06:42:10Z",
        "key": "bad-run",
        "head": "Fork 1",
        "program": "452.h",
        "ball_radius": 12.5,
        "axes": [axis()],
        "confirm": "New head",
    },
    "POST /api/v1/kinematics/runs/{run}/confirm": WHY,
    "POST /api/v1/kinematics/runs/{run}/enter": WHY | {"offsets": True},
    "POST /api/v1/kinematics/runs/{run}/undo": WHY,
    "PUT /api/v1/machines/{machine}/kinematics": {
        "ball_radius": 12.5,
        "max_modification": 0.05,
        "max_modification_angle": 0.01,
        "max_dev_cal_ball": 0.01,
        "reference_head": "Fork 1",
        "limits": {"EX0C": 0.01},
        "characteristics": {},
    }
    | WHY,
    "POST /api/v1/machines/{machine}/kinematics/backups/{version}/restore": WHY | {"instead_of": 2},
    "POST /api/v1/programs/read": {"control": "sinumerik", "text": "N10 R33=0.001"},
    "POST /api/v1/machines/{machine}/corrections/fetched": {"numbers": [1], "form": "turning"},
    "POST /api/v1/machines/{machine}/corrections/applied": {"numbers": [1]},
    "POST /api/v1/alarms/{alarm}/acknowledge": {"action": "tool_replaced", "comment": "Insert was worn", "offset": 0.0},
    "PATCH /api/v1/people/{person}": {"role": "operator"},
    "POST /api/v1/people/invitations": {"role": "viewer"},
    "POST /api/v1/keys": {"name": "Dashboard", "role": "viewer"},
}
OF_A_PERSON = {"PUT /api/v1/notifications/me", "PUT /api/v1/notifications/me/browser"}  # the key that asks here is none
NEWER = {
    "POST /api/v1/machines/{machine}/heartbeat",
    "POST /api/v1/machines/{machine}/touch-tests/{number}/report",
}  # a bridge that is newer than the server may say more
SHARES = 6  # of all operations, so that several workers try them
DOORS = ("POST /api/v1/readings", "POST /api/v1/readings/batch")

# JSON that no field anywhere may take.
POISON = (
    "NaN",
    "Infinity",
    "-Infinity",
    "1e400",
    "-1e400",
    "9" * 400,
    "9" * 5000,
    '"\\u0000"',
    '"a\\u0000b"',
    '"\\ud800"',
    '"\\udc00x"',
    '{"x": {"y": []}}',
    "[[[[]]]]",
    json.dumps("x" * 100_000),
)
WRONG = {
    "string": ("true", "5", "5.5", "[]", '["x"]'),
    "number": ('"5"', '"five"', "true", "[]", '""'),
    "integer": ('"5"', "5.5", "true", "[]", "9" * 30, "-" + "9" * 30),
    "boolean": ("5", '"maybe"', "[]"),
    "array": ("5", '"x"', "true"),
    "object": ("5", '"x"', "true", "[]"),
}
WRONG_TIMES = ("1763709302", "1763709302120", '"1763709302"', '"2026-11-21T08:15:02"', '"yesterday"', '"2026-13-41"')
WHOLE = (
    b"",
    b" ",
    b"{",
    b"[]",
    b"[1]",
    b"7",
    b"true",
    b'"text"',
    b"null",
    b"NaN",
    b"\xff\xfe{}",
    b'{"x": "\xc3\x28"}',
    b'{"x": "\xed\xa0\x80"}',
    b"[" * 100_000,
    b'{"x":' * 100_000,
    b"\x00",
    b"offset=1&reason=x",
    b"<offset>1</offset>",
    b'{"reason": "x"} {"reason": "y"}',
    b"{'reason': 'x'}",
)
CALLED = ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "", "json")
BAD_NUMBERS = ("0", "-1", "x", "1.5", "%00", "9" * 30, "%D9%A3", "1e3", "NaN", "0x10", "%20")
BAD_KEYS = (
    "nowhere",
    "%00",
    "a%00b",
    "%ED%A0%80",
    "%FF",
    "UPPER",
    "x" * 300,
    "%F0%9F%98%80",
    "'%3B--",
    "-",
    ".%2e",
    "%0A",
)
LEAKS = (
    "Traceback",
    "psycopg",
    "sqlalchemy",
    "pydantic",
    "msgspec",
    "asyncio",
    'File "',
    "SELECT ",
    "validation error",
)


class Operation(NamedTuple):
    name: str
    method: str
    path: str
    declared: dict[str, Any]


@cache
def document() -> dict[str, Any]:
    """It takes some seconds: one worker makes it for all."""
    folder = keeper.in_memory()
    if folder is None:
        return dict(application().openapi())
    with (folder / "openapi.json").open("a+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        if not (text := file.read()):
            text = json.dumps(application().openapi())
            file.write(text)
    return dict(json.loads(text))


@cache
def operations() -> tuple[Operation, ...]:
    return tuple(
        Operation(f"{method.upper()} {path}", method.upper(), path, declared)
        for path, methods in document()["paths"].items()
        for method, declared in methods.items()
    )


def resolved(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema itself, whatever it refers to or may be besides null."""
    while True:
        if "$ref" in schema:
            schema = document()["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
        elif len(options := [each for each in schema.get("anyOf", ()) if each.get("type") != "null"]) == 1:
            schema = options[0]
        elif len(schema.get("allOf", ())) == 1:
            schema = schema["allOf"][0]
        else:
            return schema


def operation_named(name: str) -> Operation:
    return next(each for each in operations() if each.name == name)


def body_schema(operation: Operation) -> dict[str, Any]:
    schema = resolved(operation.declared["requestBody"]["content"]["application/json"]["schema"])
    return resolved(schema["items"]) if schema.get("type") == "array" else schema


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


@contextmanager
def emptied(new_database: NewDatabase) -> Iterator[InProcess]:
    """Inband on a database of its own; what is sent to receivers leaves at once, and no bridge falls silent."""
    url = new_database()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(notifier, "EVERY", 0.1)
        # An alarm about a silent bridge would be counted as stored.
        with in_process(url, bridge_silent_after=86_400) as house:
            yield house
    drop_database(url)


@pytest.fixture(scope="module")
def place(new_database: NewDatabase) -> Iterator[Place]:
    with emptied(new_database) as house:
        yield Place(house)


@pytest.fixture
def house(new_database: NewDatabase) -> Iterator[InProcess]:
    with emptied(new_database) as made:
        yield made


def as_text(operation: Operation, body: dict[str, Any], field: str | None = None, value: str = "") -> str:
    """The body as JSON text, with one field written in a way that no JSON writer would."""
    parts = [f"{json.dumps(name)}: {json.dumps(each)}" for name, each in body.items() if name != field]
    if field is not None:
        parts.append(f"{json.dumps(field)}: {value}")
    text = "{" + ", ".join(parts) + "}"
    return f"[{text}]" if operation.path.endswith("/batch") else text


def complaint(answer: httpx.Response, what: str, statuses: range = range(400, 500)) -> str | None:
    """Fault of an answer to bad input; None if it is as it should be."""
    what = what if len(what) < 200 else what[:100] + " … " + what[-60:]
    if answer.status_code not in statuses:
        return f"{what}: {answer.status_code} {answer.text[:200]}"
    if answer.headers["content-type"] != "application/problem+json":
        return f"{what}: {answer.headers['content-type']}"
    problem = answer.json()
    if not {"type", "title", "status", "detail", "errors"} <= set(problem) or problem["status"] != answer.status_code:
        return f"{what}: {problem}"
    sentences = [problem["detail"], *(error["message"] for error in problem["errors"])]
    if any(len(sentence.split()) < 2 for sentence in sentences) or any(leak in answer.text for leak in LEAKS):
        return f"{what}: no help in {problem}"
    if answer.status_code == 422 and not problem["errors"]:
        return f"{what}: names no field: {problem}"
    return None


Complaints = Iterator[str | None]


def bad_fields(operation: Operation, place: Place, of: int) -> Complaints:
    """Every field with what it may not take, left out, twice; fields that nobody knows. Of what no field anywhere may take,
    each has one in so many, and its neighbours have the others."""
    body, schema = place.body(operation), body_schema(operation)

    def tried(field: str, value: str) -> str | None:
        return complaint(place.send(operation, as_text(operation, body, field, value)), f"{field}: {value}")

    for turn, (field, declared) in enumerate(schema["properties"].items(), len(operation.name)):
        kind = resolved(declared)
        either = "anyOf" in kind  # a number or a word, such as a feed
        bad = [*POISON[turn % of :: of], *(() if either else WRONG.get(kind.get("type", "string"), ()))]
        if kind.get("format") == "date-time":
            bad += WRONG_TIMES
        if "enum" in kind:
            bad += ['"nonsense"', '""']
        for value in bad:
            yield tried(field, value)
        if field in schema.get("required", ()):
            yield tried(field, "null")
            without = {name: value for name, value in body.items() if name != field}
            yield complaint(place.send(operation, as_text(operation, without)), f"without {field}")
    if operation.name not in NEWER:
        yield tried("colour", '"red"')
        yield tried("colo\\u0000ur", '"red"')
    first, value = next(iter(body.items()))
    doubled = as_text(operation, body).replace("{", f"{{{json.dumps(first)}: {json.dumps(value)}, ", 1)
    yield complaint(place.send(operation, doubled), "doubled")
    big = as_text(operation, body, "colour", json.dumps("x" * 1_100_000))
    yield complaint(place.send(operation, big), "large")


def bad_parameters(operation: Operation, place: Place, of: int) -> Complaints:
    """Every parameter of a characteristic with one in so many of what it may not take, and parameters that do not fit one
    another."""
    body = place.body(operation)
    parameters = body.pop("parameters")
    numbers = {f"R{number:02}" for number in (4, 10, 11, 23, 25, 26, 27, 28, 29, 30, 31, 33, 34, 36, 37)}
    every = resolved(resolved(body_schema(operation)["properties"]["parameters"]))["properties"]
    assert len(every) > 20
    for turn, name in enumerate(sorted({*every, *parameters, *numbers})):
        wrong = () if name == "rejected_may_correct" else ("true",)
        bad = (*POISON, '"five"', *wrong, "[]", "-1e300", '{"n": 1}', '{"n": 3, "m": 2}')
        for value in bad[turn % of :: of]:
            text = as_text(operation, body, "parameters", as_text(operation, parameters, name, value))
            yield complaint(place.send(operation, text), f"{name}: {value}", range(422, 423))
    for unfit in (
        {"zero_range": 0.006},
        {"averaging_limit": 0.009},
        {"wear_limit": 0.007},
        {"confidence_limit": 0.2},
        {"weighting_factor": 0.5},
        {"factor": 0},
        {"tool_memory": 33},
        {"average_memory": 21},
        {"tolerance_width": 0},
        {"accept": {"n": 2, "m": 1}},
        {"R33": 0.001, "zero_range": 0.002},
    ):
        text = as_text(operation, body | {"parameters": parameters | unfit})
        yield complaint(place.send(operation, text), str(unfit), range(422, 423))


def no_body(operation: Operation, place: Place, of: int) -> Complaints:
    """One in so many of what is no body at all, a good one that is called something else, and one that is not compressed
    as it says."""
    optional = not operation.declared["requestBody"].get("required")
    turn = list(BODIES).index(operation.name)
    for content in WHOLE[turn % of :: of]:
        if (content in {b"", b"null"} and optional) or (content == b"[]" and operation.path.endswith("/batch")):
            continue  # nothing to do is no mistake
        yield complaint(place.send(operation, content), repr(content))
    if operation.name not in DOORS:  # these read what a machine sends whatever it is called
        good = as_text(operation, place.body(operation))
        for kind in CALLED[turn % of :: of]:
            yield complaint(place.send(operation, good, **{"Content-Type": kind}), f"as {kind!r}")
    yield complaint(place.send(operation, b"\x1f\x8b\x08\x00", **{"Content-Encoding": "gzip"}), "compressed")


def bad_addresses(operation: Operation, place: Place, of: int) -> Complaints:
    """Every name and number of the address in turn as something that there is not, or that is no name and no number: one
    in so many of these."""
    content = as_text(operation, place.body(operation)) if operation.name in BODIES else None
    for turn, parameter in enumerate(operation.declared.get("parameters", ()), len(operation.name)):
        if parameter["in"] != "path":
            continue
        name = parameter["name"]
        bad = BAD_NUMBERS if resolved(parameter["schema"]).get("type") == "integer" else BAD_KEYS
        for value in bad[turn % of :: of]:
            answer = place.shop.admin.request(
                operation.method,
                operation.path.format(**(place.values | {name: value})),
                content=content,
                headers={"Content-Type": "application/json"} if content else {},
            )
            yield complaint(answer, f"{name}: {value}")


def bad_queries(operation: Operation, place: Place, of: int) -> Complaints:
    """Every parameter of the query in turn with one in so many of what it may not be, others with the rest; a text may be
    anything that finds nothing."""
    content = as_text(operation, place.body(operation)) if operation.name in BODIES else None
    parameters = [each for each in operation.declared.get("parameters", ()) if each["in"] == "query"]
    url = place.url(operation) if parameters else ""
    needed = {p["name"]: place.values.get(p["name"], "1") for p in parameters if p.get("required")}
    for turn, parameter in enumerate(parameters, len(operation.name)):
        name, kind = parameter["name"], resolved(parameter["schema"])
        several = "anyOf" in kind or kind.get("type") not in {"integer", "number", "boolean"}
        strict = not several or "enum" in kind or kind.get("format") == "date-time"
        bad = [
            "%00",
            "a%00b",
            "%ED%A0%80",
            "x" * 5000,
            "%FF",
            "NaN",
            "-1",
            "9" * 30,
            "",
            "1.5",
            "'%3B--",
            "%F0%9F%98%80",
        ]
        if kind.get("format") == "date-time":
            bad += ["1763709302", "2026-11-21T08:15:02", "2026-13-01T00:00:00Z"]
        if name == "limit":
            bad += ["0", "1001"]
        if kind.get("type") == "number":
            bad.remove("1.5")
            if kind.get("minimum", 0) <= -1:
                bad.remove("-1")
        query = "&".join(f"{key}={value}" for key, value in needed.items() if key != name)
        for value in bad[turn % of :: of]:
            if operation.path == "/api/v1/events" and not strict:
                continue
            answer = place.shop.admin.request(
                operation.method,
                f"{url}?{query}&{name}={value}",
                content=content if strict else None,
                headers={"Content-Type": "application/json"} if content else {},
            )
            if answer.status_code < 300 and not strict:
                continue  # a text that finds nothing
            yield complaint(answer, f"{name}={value}")


def no_key(operation: Operation, place: Place) -> Complaints:
    """Somebody whom nobody knows."""
    if not operation.path.startswith("/api/v1/") or "openapi" in operation.path:
        return
    content = as_text(operation, place.body(operation)) if operation.name in BODIES else None
    url = place.url(operation, key=1)
    for headers in (
        {},
        {"Authorization": "Bearer inband_x"},
        {"Authorization": "Basic YTpi"},
        {"Cookie": "inband_session=x"},
    ):
        answer = place.nobody.request(
            operation.method, url, content=content, headers=headers | {"Content-Type": "application/json"}
        )
        yield complaint(answer, str(headers), range(401, 402))


def wrong_methods(operation: Operation, place: Place) -> Complaints:
    """What else may be done to an address; the answer names what may."""
    path = operation.path
    here = [each for each in operations() if re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", each.path), path)]
    own = {each.method for each in operations() if each.path == path}
    if operation.method != min(own):
        return  # tried with the other one
    for method in {"GET", "POST", "PUT", "PATCH", "DELETE", "TRACE"} - {each.method for each in here}:
        answer = place.shop.admin.request(method, path.format(**place.values))
        yield complaint(answer, method, range(405, 406))
        if set(answer.headers["allow"].replace(" ", "").split(",")) != own:
            yield f"{method}: {answer.headers['allow']}"


Try = Callable[[Operation, Place], Complaints]


def refused_and_nothing_stored(attempt: Try, tried: Iterable[Operation], place: Place) -> None:
    with psycopg.connect(place.dsn, autocommit=True) as connection:
        before = counted(connection)
        for operation in tried:
            found = [each for each in attempt(operation, place) if each is not None]
            assert not found, f"{operation.name}, {len(found)}:\n" + "\n".join(found[:40])
            after = counted(connection)
            if operation.path.endswith("/report.{form}"):
                before["audit_entry"] = after["audit_entry"]  # reports that were written are in the record
            assert after == before, operation.name


def test_every_operation_with_a_body_is_tried() -> None:
    assert {each.name for each in operations() if "requestBody" in each.declared} == set(BODIES)
    assert len(operations()) > 40


some_or_all = pytest.mark.parametrize(
    "of", [pytest.param(8, id="some"), pytest.param(1, id="all", marks=pytest.mark.long)]
)


@some_or_all
@pytest.mark.parametrize("name", BODIES)
def test_bad_fields(name: str, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(bad_fields, of=of), [operation_named(name)], place)


@some_or_all
@pytest.mark.parametrize("name", [name for name, body in BODIES.items() if "parameters" in body])
def test_bad_parameters(name: str, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(bad_parameters, of=of), [operation_named(name)], place)


@some_or_all
@pytest.mark.parametrize("name", BODIES)
def test_what_is_no_body(name: str, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(no_body, of=of), [operation_named(name)], place)


@some_or_all
@pytest.mark.parametrize("share", range(SHARES))
@pytest.mark.parametrize("attempt", [bad_addresses, bad_queries])
def test_bad_addresses_and_queries(attempt: Callable[..., Complaints], share: int, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(attempt, of=of), operations()[share::SHARES], place)


@pytest.mark.parametrize("share", range(SHARES))
@pytest.mark.parametrize("attempt", [no_key, wrong_methods])
def test_at_every_operation(attempt: Try, share: int, place: Place) -> None:
    refused_and_nothing_stored(attempt, operations()[share::SHARES], place)


def test_it_is_the_same_through_a_socket(server: Server) -> None:
    """A body for the door of readings, one for everything else, and an address with names, a number and a query."""
    place = Place(server)
    for attempt, name in (
        (partial(bad_fields, of=8), "POST /api/v1/readings"),
        (partial(no_body, of=8), "POST /api/v1/readings"),
        (partial(bad_fields, of=8), "PUT /api/v1/machines/{machine}/tools/{tool}"),
        (partial(no_body, of=8), "PUT /api/v1/machines/{machine}/tools/{tool}"),
        (partial(bad_addresses, of=8), "GET /api/v1/corrections/{machine}/{number}"),
        (partial(bad_queries, of=8), "GET /api/v1/readings"),
        (no_key, "GET /api/v1/readings"),
        (wrong_methods, "GET /api/v1/readings"),
    ):
        place.beat()  # an alarm about a silent bridge would be counted as stored
        refused_and_nothing_stored(attempt, [operation_named(name)], place)


@pytest.mark.parametrize("turn", [0, *(pytest.param(turn, marks=pytest.mark.long) for turn in range(1, SHARES))])
def test_what_all_this_was_tried_on_can_be_done(house: InProcess, turn: int) -> None:
    """The bodies above are good ones: what was refused was refused for what was changed in them."""

    def sent(place: Place, operation: Operation) -> httpx.Response:
        body = place.body(operation)
        if operation.name == "POST /api/v1/machines":
            body["key"] = f"mill-{place.shop.machine}"
        if operation.name == "POST /api/v1/characteristics":
            body["key"] = f"bore-{place.shop.machine}"
        return place.send(operation, as_text(operation, body))

    wrong = []
    places: list[Place] = []
    for name in list(BODIES)[turn::SHARES]:
        operation, answer = operation_named(name), None
        for number in itertools.count():  # what was done at one place before may stand in the way there
            fresh = number == len(places)
            if fresh:
                places.append(Place(house))
            answer = sent(places[number], operation)
            if fresh or not answer.is_error:
                break
        done = {200, 201, 204} | ({404} if name in OF_A_PERSON else set())
        if answer is None or answer.status_code not in done:
            wrong.append(f"{name}: {answer and answer.text}")
    assert wrong == []
