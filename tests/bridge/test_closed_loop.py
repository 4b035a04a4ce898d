"""The whole way: the model measures, the bridge sends, the server decides, the bridge offers, the model takes it."""

import json
import logging
import re
from dataclasses import replace
from pathlib import Path

import pytest

from app.core.ring import Register, Told, Unit
from app.logs import JsonLines
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import bridge, location, parts, store_in, unit_of, until
from tests.loops import run
from tests.shop import Shop

QUIET = Feature(bias=0.006, wear=0.0, noise=0.0)


@pytest.mark.parametrize(
    ("feature", "unit"),
    [
        (QUIET, Unit.MM),
        (replace(QUIET, holds="radius"), Unit.MM),
        (replace(QUIET, sign=-1), Unit.INCH),
    ],
    ids=["diameter in mm", "radius in mm", "other sign, in inches"],
)
@pytest.mark.parametrize("mode", ["control", "direct"])
def test_a_size_comes_back_to_its_target(
    shop: Shop, tmp_path: Path, feature: Feature, unit: Unit, mode: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "app.bridge")
    model = Model((feature,), unit=unit)

    async def loop() -> None:
        store = store_in(tmp_path)
        one = unit_of(
            model,
            store,
            key=shop.machine,
            characteristics={"1": shop.characteristic},
            location=(location(feature),),
            corrections=mode,
        )
        async with bridge(shop, one):
            await parts(model, 1)
            await until(
                lambda: model.registers[Register.APPLIED] or model.registers[Register.MAIL_NUMBER], "a correction"
            )
            await parts(model, 2)

            async def all_sent() -> bool:
                stored = (await store.position(shop.machine)).sequence == 3
                return (
                    stored
                    and not (await store.counts(shop.machine)).waiting
                    and not await store.intents(shop.machine, "answered")
                )

            await until(all_sent, "everything at the server")
        store.close()

    run(loop())
    readings = shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
    assert [reading["action"] for reading in readings] == ["correct", "none", "none"]
    within = 2e-5 if unit is Unit.MM else 2e-4  # sizes and offsets travel in steps, of 0.00001 inch
    assert [reading["deviation"] for reading in readings] == pytest.approx([0.006, 0.0, 0.0], abs=within)
    [correction] = shop.call("GET", f"/machines/{shop.machine}/corrections")["items"]
    assert correction["status"] == "applied"
    assert correction["offset_after"] == pytest.approx(-0.006, abs=within)
    assert shop.call("GET", "/alarms?state=active&machine=" + shop.machine)["items"] == []
    said = [each.getMessage().removeprefix(f"{shop.machine}: ") for each in caplog.records]
    for line in (
        rf"reading \S+:1: {shop.characteristic}, 40\.\d+ mm, part 1(, |$)",
        r"decision on \S+:1: \w+, correct; correction 1 of -0\.006\S* mm for tool memory 3",
        r"correction 1 is offered: tool memory 3 from 0 to -0\.006",
        r"correction 1 is applied; the control holds -0\.00",
        r"decision on \S+:3: zero, none",
    ):
        assert len([each for each in said if re.match(line, each)]) == 1, (line, said)
    [record] = [each for each in caplog.records if "correction 1 is applied" in each.getMessage()]
    told = json.loads(JsonLines().format(record))
    assert (told["level"], told["machine"], told["correction"], told["applied"]) == ("info", shop.machine, 1, True)


@pytest.mark.parametrize("mode", ["control", "direct"])
def test_one_program_run_takes_the_corrections_of_every_tool(shop: Shop, tmp_path: Path, mode: str) -> None:
    """Six tools are 6 µm off, one of them has no location: the five others are right from the next part on."""
    features = tuple(replace(QUIET, number=tool, tool=tool) for tool in range(1, 7))
    keys = [shop.another("shaft", tool_memory=tool, average_memory=tool) for tool in range(1, 7)]
    model = Model(features, mail_wait=5.0)

    async def loop() -> None:
        store = store_in(tmp_path)
        one = unit_of(
            model,
            store,
            key=shop.machine,
            characteristics={str(tool): key for tool, key in enumerate(keys, 1)},
            location=tuple(location(feature, feature.tool) for feature in features[:2] + features[3:]),
            corrections=mode,
        )

        async def all_sent() -> bool:
            taken = model.registers[Register.ACK] == model.registers[Register.WRITTEN]
            waiting = (await store.counts(shop.machine)).waiting
            return taken and not waiting and not await store.intents(shop.machine, "answered")

        async with bridge(shop, one):
            await parts(model, 1)
            if mode == "direct":
                await until(lambda: model.registers[Register.APPLIED] == 6, "five offsets are set")
            else:
                await until(lambda: len(one.orders) == 5 and model.registers[Register.MAIL_NUMBER], "corrections")
            model.mail_wait = 0.3
            await parts(model, 2)
            await until(all_sent, "everything at the server")
            await until(lambda: one.held_back, "the third tool is held back")
            assert [each.tool_memory for each in one.held_back] == [3]
        store.close()

    run(loop())
    for tool, key in enumerate(keys, 1):
        readings = shop.call("GET", f"/readings?characteristic={key}")["items"]
        sizes = [round(1000 * reading["deviation"]) for reading in readings]
        assert sizes == ([6, 6, 6] if tool == 3 else [6, 0, 0])
        assert [reading["action"] for reading in readings][:2] == [
            "correct",
            "none" if tool != 3 else readings[1]["action"],
        ]
    statuses = [
        (each["tool_memory"], each["status"])
        for each in shop.call("GET", f"/machines/{shop.machine}/corrections")["items"]
    ]
    assert sorted(set(statuses)) == [(tool, "pending" if tool == 3 else "applied") for tool in range(1, 7)]
    assert shop.call("GET", "/alarms?state=active&machine=" + shop.machine)["items"] == []


def test_a_stop_reaches_the_program_that_waits_for_the_decision(shop: Shop, tmp_path: Path) -> None:
    """The size is 10 mm off: the probe cannot be believed, and nothing more is cut."""
    model = Model((replace(QUIET, bias=-10.0),), decision_wait=30.0)

    async def loop() -> None:
        store = store_in(tmp_path)
        one = unit_of(
            model, store, key=shop.machine, characteristics={"1": shop.characteristic}, location=(location(QUIET),)
        )
        async with bridge(shop, one):
            await parts(model, 1)
        assert await store.decisions(shop.machine) == []
        store.close()

    run(loop())
    assert model.told == [Told.STOP]
    assert [alarm["kind"] for alarm in shop.alarms()] == ["probe_fault"]
