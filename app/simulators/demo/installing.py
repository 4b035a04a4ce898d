"""Setting the plant up through the public API, once; a second start finds what is there."""

import threading
from collections.abc import Sequence
from datetime import UTC, datetime
from random import Random

from app.simulators.demo import andon, calibrating, duty, plant, reacting, touching, turning
from app.simulators.demo.running import Line, Pace
from app.simulators.demo.simulation import Machine
from inband_client import Client, NotFound

KEY_NAME = "demonstration plant"
PAST = 300  # parts of each machine, if no number of days is asked for


def set_up(admin: Client, machine: plant.Machine) -> None:
    """The machine and its characteristics, as far as they are not there."""
    settings: dict[str, object] = {
        "key": machine.key,
        "name": machine.name,
        "control": machine.control,
        "type": machine.type,
        "signal_path": machine.signal_path,
    }
    _unless_there(admin, "/machines", settings, machine.key)
    for feature in machine.features:
        body = {"key": feature.key, "name": feature.name, "machine": machine.key, "part": machine.part}
        _unless_there(admin, "/characteristics", body | {"parameters": feature.parameters}, feature.key)
        path = f"/characteristics/{feature.key}/control-plan"
        if feature.plan and admin.get(path)["since"] is None:
            admin.call("PUT", path, json=feature.plan | {"reason": "As the customer asks for"})
        path = f"/characteristics/{feature.key}/expansion"
        if feature.expansion and admin.get(path)["changed_at"] is None:
            admin.call("PUT", path, json=feature.expansion | {"reason": "16MnCr5, sensor in the jaws"})

    for tool in machine.tools:
        path = f"/machines/{machine.key}/tools/{tool.number}"
        if admin.get(path)["name"] is None:
            admin.call("PATCH", path, json={"name": tool.name, "edge": "D1", "planned_parts": tool.life})


def _unless_there(admin: Client, path: str, body: dict[str, object], key: str) -> None:
    try:
        admin.get(f"{path}/{key}")
    except NotFound:
        admin.post(path, body)


def new_key(admin: Client, path: str, body: dict[str, str]) -> str:
    """The secret of a fresh key; the one of an earlier run stops working."""
    for key in list(admin.items(path)):
        if key["name"] == body["name"] and key["revoked_at"] is None:
            admin.call("DELETE", f"{path}/{key['id']}")
    secret: str = admin.post(path, body)["secret"]
    return secret


def lines(
    url: str, admin_key: str, seed: int, ending: threading.Event, machines: Sequence[plant.Machine] = plant.MACHINES
) -> list[Line]:
    """The machines of the plant, set up and with keys of their own."""

    def client(key: str) -> Client:
        return Client(url, key, patience=None, stop=ending)

    admin = client(admin_key)
    operator = client(new_key(admin, "/keys", {"name": f"{KEY_NAME}: operator", "role": "operator"}))
    run = datetime.now(UTC).strftime("%y%m%d%H%M%S")
    simulated: list[Line] = []
    causes = reacting.set_up(admin)
    for spec in machines:
        set_up(admin, spec)
        calibrating.behind(admin, spec.key, seed)
        turning.behind(admin, spec.key, seed)
        touching.behind(admin, spec.key, seed)
        gateway = client(new_key(admin, f"/machines/{spec.key}/keys", {"name": KEY_NAME}))
        rng = Random(f"{seed}:{spec.key}:operator")
        simulated.append(Line(Machine(spec, seed), gateway, operator, run, rng, ending, causes))
    duty.set_up(admin, [spec.key for spec in machines])
    andon.start(admin)
    admin.close()
    return simulated


def run_line(line: Line, speed: float, past: float | None = None) -> None:
    """The past if there is none yet (of some days, else some hours), then the present."""
    if line.has_history():
        line.settle()
    else:
        line.fill(PAST, past)
    line.live(Pace(speed, datetime.now(UTC), line.machine.at))
