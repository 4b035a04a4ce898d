"""Three weeks of calibrations that the plant has behind it when it starts, through the public API like everything."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from random import Random
from typing import Any

from inband_client import Client

LIMITS = {
    "zero_range": 0.001,
    "averaging_limit": 0.006,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
    "path_factor": 1,
}
REPEATS = 5
TOUCH = 0.000_4  # mm, scatter of a touch
RING = {"nominal": 30.0, "upper_deviation": 0.008, "lower_deviation": -0.008, "radius_term": 6.0}
AGE = timedelta(days=21)


@dataclass(frozen=True)
class Gauged:
    """A location that is calibrated against a gauge (L92): how its probe has drifted since three weeks ago, mm."""

    machine: str
    location: int  # R11
    gauge: float
    drift: Sequence[float]
    plan: dict[str, Any]
    last_waits: bool = False  # the last one is to be accepted by a person
    dirty: int | None = None  # which one met a dirty gauge


@dataclass(frozen=True)
class Ringed:
    """A probe that is calibrated in a ring: how far it stood beside the spindle each week, mm."""

    machine: str
    tool: int  # R10
    beside: Sequence[float]
    plan: dict[str, Any]


@dataclass(frozen=True)
class Compared:
    """A location with parts that were measured again on a measuring machine: by how much the machine read too much, mm."""

    machine: str
    location: int
    nominal: float
    instrument: str
    differences: Sequence[float]


GAUGED = (
    Gauged(
        "lathe-1", 5, 40.0023, (0.0002, 0.0004, 0.0011, 0.0019, 0.0021, 0.0026, 0.0041),
        {"due_parts": 1500, "due_days": 7.0}, last_waits=True, dirty=3,
    ),
    Gauged("lathe-1", 6, 120.0008, (-0.0006, -0.0017, -0.0024, -0.0023), {"due_days": 30.0}),
    Gauged("lathe-2", 2, 80.0011, (0.0003, 0.0012, 0.0018), {"due_parts": 340}),
    Gauged("mill-1", 11, 25.0004, (0.0004, 0.0021, 0.0024), {"due_days": 7.5, "acceptance": "automatic"}),
)  # fmt: skip
RINGED = (Ringed("lathe-3", 32, (0.0124, -0.0021, 0.0008, 0.0017), {"due_days": 7.0}),)
COMPARED = (
    Compared("lathe-2", 1, 62.015, "CMM", (0.0031, 0.0022, 0.0027, 0.0019, 0.0034, 0.0026, 0.0121)),
    Compared("lathe-3", 4, 39.9875, "Micrometer 0–25/7", (0.0012, 0.0005, 0.0009)),
)


def behind(admin: Client, machine: str, seed: int) -> None:
    """Send the past calibrations of this machine, unless they are there already."""
    if admin.get(f"/machines/{machine}/calibrations", limit=1)["items"]:
        return
    rng = Random(f"{seed}:{machine}:calibration")
    for place in GAUGED:
        if place.machine == machine:
            _gauged(admin, place, rng)
    for probe in RINGED:
        if probe.machine == machine:
            _ringed(admin, probe, rng)
    for compared in COMPARED:
        if compared.machine == machine:
            _compared(admin, compared)


def _moments(count: int) -> list[str]:
    now = datetime.now(UTC)
    return [(now - AGE * (count - at) / count - timedelta(hours=7)).isoformat() for at in range(1, count + 1)]


def _gauged(admin: Client, place: Gauged, rng: Random) -> None:
    path, plan = f"/machines/{place.machine}/calibrations", f"/machines/{place.machine}/averages/{place.location}"
    for at, (drift, moment) in enumerate(zip(place.drift, _moments(len(place.drift)), strict=True)):
        if at:
            by_itself = not (place.last_waits and at + 1 == len(place.drift))
            acceptance_plan = {"acceptance": "automatic"} if by_itself else place.plan
            admin.call("PUT", f"{plan}/calibration-plan", json=acceptance_plan)
        body = LIMITS | {"average_memory": place.location, "gauge_size": place.gauge, "calibrated_at": moment}
        if at == place.dirty:
            touches = [round(place.gauge + 1.04 + rng.gauss(0, TOUCH), 5)]
            admin.post(path, body | {"touches": touches, "path_factor": 2})
        touches = [round(place.gauge + drift + rng.gauss(0, TOUCH), 5) for _touch in range(REPEATS)]
        admin.post(path, body | {"touches": touches})
    admin.call("PUT", f"{plan}/calibration-plan", json=place.plan)


def _ringed(admin: Client, probe: Ringed, rng: Random) -> None:
    path, plan = f"/machines/{probe.machine}/calibrations/ring", f"/machines/{probe.machine}/tools/{probe.tool}"
    half = RING["nominal"] - RING["radius_term"]
    for at, (beside, moment) in enumerate(zip(probe.beside, _moments(len(probe.beside)), strict=True)):
        if at == 1:
            admin.call("PUT", f"{plan}/calibration-plan", json={"acceptance": "automatic"})
        body = RING | {"tool_memory": probe.tool, "calibrated_at": moment}
        if at == 2:  # the probe stood too high: a chord is shorter than the diameter
            low = {"plus": round(half - 0.031, 5), "minus": round(-half + 0.027, 5)}
            admin.post(path, body | {"sections": [low]})
        sections = [
            {
                "plus": round(half + beside + rng.gauss(0, TOUCH), 5),
                "minus": round(-half + beside + rng.gauss(0, TOUCH), 5),
            }
            for _section in range(3)
        ]
        calibration = admin.post(path, body | {"sections": sections})
        if at == 0:
            admin.post(
                f"/machines/{probe.machine}/calibrations/{calibration['number']}/accept", {"reason": "Probe mounted"}
            )
    admin.call("PUT", f"{plan}/calibration-plan", json=probe.plan)


def _compared(admin: Client, compared: Compared) -> None:
    pairs = f"/machines/{compared.machine}/averages/{compared.location}/pairs"
    if admin.get(pairs, limit=1)["items"]:
        return
    for at, difference in enumerate(compared.differences):
        true = round(compared.nominal + (at % 4 - 1.5) * 0.0014, 5)
        body = {"machine_value": round(true + difference, 5), "external_value": true}
        admin.post(pairs, body | {"instrument": compared.instrument})
