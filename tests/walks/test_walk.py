"""Random walks over every act of the product, together on one plant: no fault at any step, and a record that holds."""

import re
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import psycopg
import pytest

from app.jobs.runner import JobRunner
from tests import chance
from tests.databases import NewDatabase, drop_database
from tests.in_process import InProcess, in_process
from tests.loop.readings.record import must_hold
from tests.shop import Shop
from tests.walks.addresses import KNOWN
from tests.walks.walker import OPENED, WITHOUT_BODY, Walker
from tests.web.api_operations import operations
from tests.web.good_bodies import BODIES, REACTION
from tests.web.whole_plant import Place


@pytest.fixture
def plant(new_database: NewDatabase) -> Iterator[InProcess]:
    url = new_database()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(JobRunner, "start", lambda _runner: None)  # walkers run its jobs
        with in_process(url, bridge_silent_after=86_400) as house:
            yield house
    drop_database(url)


def furnish(house: InProcess) -> None:
    """A machine whose characteristics share tools or wait for approval, with plans of all scopes and a mandatory context."""
    more = Shop(house)
    more.read(6.0)
    more.read(350.0)
    seat = f"{more.characteristic}-seat"
    more.add(seat, average_memory=6)  # the same tool
    kinds: tuple[dict[str, Any], ...] = ({"mode": "approval"}, {"max_total": 0.02}, {"plausible_jump": 0.05})
    for tool, given in enumerate(kinds, start=4):
        more.add(f"{more.characteristic}-{tool}", tool_memory=tool, average_memory=tool + 3, **given)
    round_: dict[str, Any] = {
        "target": 0.0,
        "natural_limit": "lower",
        "mode": "measure_only",
        "tool_memory": 0,
        "average_memory": 0,
    }
    more.add(f"{more.characteristic}-round", **round_)
    more.call("PATCH", f"/machines/{more.machine}/tools/3", sister=13)
    worn, here = {"kind": "tool_worn"}, {"characteristic": seat}
    scopes: tuple[dict[str, str], ...] = ({}, worn, here, here | worn)
    for scope in scopes:
        more.call("POST", "/reactions/plans", 201, **REACTION | scope)
    more.call("POST", "/reactions/catalogue", 201, sort="cause", name="Chip")
    watched: dict[str, Any] = {"every": 3, "after_alarm": 2, "required_context": ["order"], "reason": "Agreed"}
    more.call("PUT", f"/characteristics/{seat}/control-plan", **watched)


def checked(house: InProcess, walker: Walker) -> None:
    """What must hold after any sequence of acts."""
    try:
        must_hold(house.database.dsn)
    except AssertionError as broken:
        raise AssertionError("\n".join([str(broken), *walker.trail])) from broken
    failures = walker.record.rows("SELECT job, subject, error FROM job_failure")
    assert not failures, "\n".join([*walker.trail, *map(str, failures)])
    for _ in range(6):
        walker.look()


@contextmanager
def walking(house: InProcess, seed: int) -> Iterator[Walker]:
    """A walker; what it did is printed."""
    walker = Walker(house, seed)
    try:
        yield walker
        assert not walker.faults, "\n\n".join(walker.faults.values())
    finally:
        walker.record.connection.close()
        sys.stdout.write(f"seed {seed}, {walker.steps} steps: {walker.summary()}\n")


def walk(house: InProcess, seed: int, steps: int, seconds: float = 1e9) -> Walker:
    """So many steps, as long as there is time."""
    end = time.monotonic() + seconds
    with walking(house, seed) as walker:
        while walker.steps < steps and time.monotonic() < end:
            walker.step()
            if walker.steps % 20 == 0:
                checked(house, walker)
        checked(house, walker)
    return walker


def test_every_act_is_walked() -> None:
    assert {each.name for each in operations() if each.method != "GET"} == {*BODIES, *WITHOUT_BODY}


def test_every_address_is_known() -> None:
    for path in (*OPENED, *(each.path for each in operations())):
        known = next((query for part, query in KNOWN if part in path), "")
        names = set(re.findall(r"\{(\w+)\}", path)) - {"form"}
        assert names <= set(re.findall(r"\w+", known)), path


def test_a_short_walk(plant: InProcess) -> None:
    furnish(plant)
    walk(plant, 1, 40)


def test_a_record_that_does_not_hold_is_found(plant: InProcess) -> None:
    shop, dsn = Shop(plant), plant.database.dsn
    first = shop.read(6.0)["correction"]["number"]
    shop.read(0.0, correction_in_effect=first)
    shop.correction(first, "applied", offset_after=0.05)
    (alarm,) = shop.alarms()
    shop.acknowledge(alarm["id"], "offset_set", offset=0.0, changed_by="Anna")
    second = shop.read(6.0)["correction"]["number"]
    shop.correction(second, "applied")
    shop.call("POST", f"/machines/{shop.machine}/faults", 201, kind="battery_low")
    must_hold(dsn)
    alarm_again = """INSERT INTO alarm (machine_id, kind, data) SELECT machine_id, kind, data FROM alarm
        WHERE acknowledged_at IS NULL"""
    step_again = """INSERT INTO tool_event (machine_id, number, kind, offset_before, offset_after, correction, actor)
        SELECT machine_id, number, kind, offset_before, offset_after, correction, actor FROM tool_event
        WHERE correction = %s"""
    for statement, values, words in ((alarm_again, (), "'memory'"), (step_again, (second,), "'expected'")):
        with psycopg.connect(dsn) as connection:
            connection.execute(statement, values)
        with pytest.raises(AssertionError, match=words):
            must_hold(dsn)


@pytest.mark.long
def test_a_long_walk(plant: InProcess) -> None:
    Place(plant)  # with something of everything
    furnish(plant)
    walker = walk(plant, chance.seed(1), 3000, 300)
    corrections, tools = "/api/v1/corrections/{machine}/{number}", "/api/v1/machines/{machine}/tools/{tool}"
    alarms = "POST /api/v1/alarms/{alarm}/acknowledge"
    assert walker.steps >= 300, "so few say nothing of what was walked"
    assert {alarms, f"POST {corrections}/applied", f"POST {tools}/change", f"PUT {tools}"} <= walker.done()


@pytest.mark.long
def test_walkers_at_once(plant: InProcess) -> None:
    """Three on the same machines: nobody waits for ever, nobody meets a fault."""
    Place(plant)
    furnish(plant)
    seed, end = chance.seed(1), time.monotonic() + 120

    def go(number: int) -> None:
        with walking(plant, seed + number) as walker:
            while walker.steps < 500 and time.monotonic() < end:
                walker.step()

    with ThreadPoolExecutor(3) as pool:
        list(pool.map(go, range(3)))
    with walking(plant, seed) as walker:
        checked(plant, walker)
