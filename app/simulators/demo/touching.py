"""Four weeks of work zeros in a vice that creeps away, and parts aligned by eight touches, through the public API."""

from datetime import UTC, datetime, timedelta
from random import Random
from typing import Any

from inband_client import Client

MACHINE = "mill-1"
FIXTURE = "vice-left"
LIMITS = {"basis": "first", "warning": 0.01, "alarm": 0.025, "reason": "A third of the tolerance of the pocket"}
ZEROS = 28
STEADY = 17  # zeros before the vice begins to creep
CREEP = (0.0013, -0.0004)  # mm from one zero to the next
TOUCH = 0.001  # mm, scatter of a touch
POCKET = ((-353.012, "-X"), (-259.008, "+X"), (-181.254, "-Y"), (-127.246, "+Y"))
PLACES: tuple[tuple[list[float], str], ...] = (
    ([10.0, 10.0, 0.0], "+Z"),
    ([180.0, 15.0, 0.0], "+Z"),
    ([90.0, 120.0, 0.0], "+Z"),
    ([30.0, 125.0, 0.0], "+Z"),
    ([20.0, 0.0, -15.0], "-Y"),
    ([170.0, 0.0, -15.0], "-Y"),
    ([0.0, 60.0, -15.0], "-X"),
    ([0.0, 20.0, -15.0], "-X"),
)
FOUND = (
    0.012,
    0.046,
    0.021,
    0.0086,
    0.104,
    -0.205,
    0.051,
    -0.0314,
)  # mm along the normals: turned by a tenth of a degree


def behind(admin: Client, machine: str, seed: int) -> None:
    """The zeros and alignments of this machine, if it is the one with the vice and they are not there already."""
    if machine != MACHINE or admin.get("/work-zeros", machine=machine, limit=1)["items"]:
        return
    rng = Random(f"{seed}:{machine}:touching")
    now = datetime.now(UTC) - timedelta(hours=3)
    for at in range(ZEROS):
        crept = max(0, at - STEADY)
        admin.post("/work-zeros", _zero(machine, at, [crept * step for step in CREEP], now, rng))
        if at == 0:
            admin.call("PUT", f"/work-zeros/fixtures/{machine}/{FIXTURE}", json=LIMITS)
    touches = [
        {"nominal": place, "normal": normal, "deviation": round(residual + rng.gauss(0, TOUCH / 3), 4)}
        for (place, normal), residual in zip(PLACES, FOUND, strict=True)
    ]
    alignment = {"machine": machine, "name": "casting on pallet 4", "touches": touches, "repeatability": TOUCH}
    set_again = {"work_offset": "G55", "base": [-306.01, -154.25, -299.85], "key": "align:1"}
    admin.post("/alignments", alignment | set_again)


def _zero(machine: str, at: int, shift: list[float], now: datetime, rng: Random) -> dict[str, Any]:
    touches = [
        {
            approach[1].lower(): round(place + shift["XY".index(approach[1])] + rng.gauss(0, TOUCH), 4),
            "approach": approach,
        }
        for place, approach in POCKET
    ]
    return {
        "machine": machine,
        "kind": "pocket",
        "tip": 6.0,
        "fixture": FIXTURE,
        "part": f"SN-{4100 + at}",
        "touches": touches,
        "z_touched": round(-201.5 + rng.gauss(0, TOUCH), 4),
        "feeler": 0.1,
        "tool_length": 98.25,
        "repeatability": TOUCH,
        "touched_at": (now - timedelta(days=ZEROS - 1 - at)).isoformat(),
        "key": f"zero:{at}",
    }
