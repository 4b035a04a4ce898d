"""Ring programs of an older layout: nothing is fetched or written, and check, log and page say what to do."""

import logging
from pathlib import Path

import pytest

from app.bridge import checking
from app.bridge.configuration import Machine
from app.bridge.links import Misconfigured, Order, Position
from app.bridge.registers import RegisterLink
from app.core.ring import LAYOUT, Register
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import ModelRegisters, bridge, machine, parts, store_in, unit_of, until
from tests.bridge.test_checking import findings, table
from tests.loops import run
from tests.shop import Person, Shop

QUIET = Feature(bias=0.006, wear=0.0, noise=0.0)
WRITE_AGAIN = "The ring programs in the control are of an older Inband (layout 1, this one has 2)"
HOW = "“inband program write CHARACTERISTIC --ring”. How to: docs/how-to/ring-programs.md."


def of_layout_1(model: Model) -> Model:
    """A machine whose programs have written one reading, and wait for a correction."""
    for _ in model.part():
        pass
    model.registers[Register.LAYOUT] = 1.0
    return model


@pytest.mark.parametrize("whole", [True, False])
def test_nothing_is_fetched_and_no_correction_offered(*, whole: bool) -> None:
    model = of_layout_1(Model())

    async def story() -> None:
        registers = ModelRegisters(model, whole=whole)
        link = RegisterLink(machine(model), registers)
        await link.connect()
        for _ in range(2):
            with pytest.raises(Misconfigured) as refused:
                await link.fetch(Position())
            assert str(refused.value).startswith(WRITE_AGAIN)
            assert str(refused.value).endswith(HOW)
            await link.offer([Order(18, 3, 0.0, 0.010)])
            assert await link.outcomes() == []
        assert registers.writes == []
        model.registers[Register.LAYOUT] = float(LAYOUT)
        assert len(await link.fetch(Position())) == 1

    run(story())


def test_the_check_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = of_layout_1(Model())

    def modelled(one: Machine) -> RegisterLink:
        return RegisterLink(one, ModelRegisters(model))

    monkeypatch.setattr(checking, "link_of", modelled)
    said = findings(tmp_path, table("haas", address="192.0.2.17") | {"unit": "mm"})
    [found] = [each for each in said if WRITE_AGAIN in each]
    assert found.startswith("✗ lathe-1: ")
    assert found.endswith(HOW)


def test_the_page_and_the_log_say_it_and_new_programs_go_on(
    shop: Shop, viewer: Person, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "app.bridge")
    model = Model((QUIET,))

    async def story() -> None:
        store = store_in(tmp_path)
        registers = ModelRegisters(model)
        one = unit_of(model, store, registers, key=shop.machine, characteristics={"1": shop.characteristic})
        async with bridge(shop, one, heartbeat=True):
            await parts(model, 1)
            await until(lambda: model.registers[Register.ACK] == 1, "the first reading")
            await until(lambda: model.registers[Register.MAIL_NUMBER], "the correction")
            model.registers[Register.LAYOUT] = 1.0
            await until(lambda: one.state == "configuration", "the bridge has seen it")
            before = len(registers.writes)

            def shown() -> bool:
                return bool(shop.call("GET", f"/machines/{shop.machine}/connection")["state"] == "configuration")

            await until(shown, "the server has heard it")
            page = viewer.open(f"/machines/{shop.machine}/connection")
            assert WRITE_AGAIN in page
            assert HOW in page
            assert len(registers.writes) == before
            model.registers[Register.LAYOUT] = float(LAYOUT)
            await until(lambda: one.state == "online", "the new programs are there")
            await parts(model, 1)
            await until(lambda: model.applied, "the correction is taken")
        store.close()

    run(story())
    [warned] = [each for each in caplog.records if WRITE_AGAIN in each.getMessage()]
    assert warned.levelno == logging.WARNING
    assert HOW in warned.getMessage()
