"""Four weeks of runs of cycle 452 on a rotary table that drifts, through the public API; the last waits to be entered."""

from datetime import UTC, datetime, timedelta
from math import cos, radians, sin
from random import Random
from typing import Any, NamedTuple

from inband_client import Client

MACHINE = "mill-1"
PLAN = {
    "ball_radius": 12.5,
    "max_modification": 0.05,
    "max_modification_angle": 0.02,
    "max_dev_cal_ball": 0.01,
    "limits": {"EX0C": 0.008, "EY0C": 0.008, "EA0C": 0.003, "EB0C": 0.003, "backlash.C": 0.004},
    "reason": "As in the acceptance of the rotary table",
}
HEAD = {
    "program": r"TNC:\nc_prog\table\preset_452.h",
    "tool": "TOUCH_PROBE",
    "kinematics": "MILL1_C",
    "mode": "optimise",
}
BALL = (180.0, 0.0, 40.0)  # at the angle 0, from the axis, mm
PLACE = [250.0, 0.0, -120.0]  # of the axis in the kinematics
ANGLES = (-90.0, -45.0, 0.0, 45.0, 90.0, 135.0, 180.0)
BACKLASH = 0.0018  # degrees
TOUCH = 0.000_5  # mm, scatter of a touch
WEEK = timedelta(days=7)


class Stand(NamedTuple):
    """Error of the axis against its kinematics: mm in X and Y, degrees about X and Y."""

    x: float
    y: float
    a: float
    b: float


WEEKS = (  # the first is entered; from then on the table creeps away again
    Stand(0.0123, -0.0081, 0.0021, -0.0013),
    Stand(0.0011, -0.0004, 0.0001, 0.0),
    Stand(0.0026, -0.0002, 0.0001, 0.0002),
    Stand(0.0041, -0.0007, 0.0, 0.0001),
    Stand(0.0058, -0.0009, 0.0002, 0.0001),
)


def behind(admin: Client, machine: str, seed: int) -> None:
    """The runs of this machine, if it is the one with the rotary table and they are not there already."""
    if machine != MACHINE or admin.get("/kinematics/runs", machine=machine, limit=1)["items"]:
        return
    rng = Random(f"{seed}:{machine}:turning")
    admin.call("PUT", f"/machines/{machine}/kinematics", json=PLAN)
    now, place = datetime.now(UTC) - timedelta(hours=2), list(PLACE)
    for week, stand in enumerate(WEEKS):
        at = now - WEEK * (len(WEEKS) - 1 - week)
        axis = {"axis": "C", "ball": BALL, "position": place, "incidence": 0.0, "positions": _positions(stand, rng)}
        run = {"machine": machine, "key": f"452:{week}", "measured_at": at.isoformat(), "backlash_angle": 1.0}
        stored = admin.post(
            "/kinematics/runs", HEAD | run | {"ball_radius": 12.5, "touches_per_ball": 4, "axes": [axis]}
        )
        if week == 0:
            place = stored["axes"][0]["position_after"]
            body = {"reason": "Monthly check", "at": (at + timedelta(minutes=20)).isoformat()}
            admin.post(f"/kinematics/runs/{stored['run']}/enter", body)


def _positions(stand: Stand, rng: Random) -> list[dict[str, Any]]:
    positions = []
    for angle in ANGLES:
        for approach, sense in (("positive", 1), ("negative", -1)):
            centre = _turned(stand, angle - sense * BACKLASH / 2)
            positions.append({"angle": angle, "approach": approach, "touches": _touches(centre, rng)})
    return positions


def _turned(stand: Stand, angle: float) -> tuple[float, float, float]:
    """Place of the calibration sphere after the table has turned about an axis with this error."""
    c, s, a, b = cos(radians(angle)), sin(radians(angle)), radians(stand.a), radians(stand.b)
    x, y, z = BALL[0] - stand.x, BALL[1] - stand.y, BALL[2]
    x, y, z = x - b * z, y + a * z, z + b * x - a * y  # seen from the leaning axis
    x, y = c * x - s * y, s * x + c * y
    x, y, z = x + b * z, y - a * z, z - b * x + a * y
    return x + stand.x, y + stand.y, z


def _touches(centre: tuple[float, float, float], rng: Random) -> list[list[float]]:
    """Four round the equator, one on top."""
    directions = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)]
    radius = float(PLAN["ball_radius"])  # type: ignore[arg-type] # a number among words
    points = []
    for direction in directions:
        away = radius + rng.gauss(0, TOUCH)
        points.append([round(c + away * d, 5) for c, d in zip(centre, direction, strict=True)])
    return points
