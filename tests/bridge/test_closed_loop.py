"""The whole way: the model measures, the bridge sends, the server decides, the bridge offers, the model takes it."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.bridge.simulators.model import Feature, Model
from app.core.ring import Register, Unit
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
def test_a_size_comes_back_to_its_target(shop: Shop, tmp_path: Path, feature: Feature, unit: Unit, mode: str) -> None:
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
