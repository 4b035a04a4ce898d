"""A SINUMERIK over OPC UA: the kind against the simulated control, over real sockets."""

import asyncio
import random
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from datetime import UTC
from pathlib import Path
from typing import Any

import pytest
from asyncua import Client, ua
from asyncua.common.utils import ServiceError
from asyncua.ua.ua_binary import struct_to_binary
from typer.testing import CliRunner

from app.bridge.certificates import new_pair
from app.bridge.configuration import ConfigurationError, Machine, configuration_from
from app.bridge.kinds import opcua
from app.bridge.kinds.opcua_answers import doubles_in
from app.bridge.links import ControlAway, LinkError, Misconfigured, Order, Position
from app.bridge.registers import RegisterLink
from app.cli.bridge import bridge
from app.core.ring import SIZE, Register, Unit
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.opcua import ADMINISTRATOR, BRIDGE, PASSWORD, Nc, SimulatedSinumerik, serve
from tests.bridge.plant import until
from tests.loops import run

QUIET = Feature(wear=0.0, noise=0.0)
TWO_EDGES = replace(QUIET, number=2, edge=2, register="wear_radius", holds="radius")


def machine(simulator: SimulatedSinumerik, folder: Path = Path(), **changed: Any) -> Machine:
    """The machine in the configuration; ``opcua`` changes its own table."""
    table: dict[str, Any] = simulator.table() | {"interval": 0.05, "patience": 30.0, "proof_needed": False}
    table["opcua"] = table["opcua"] | changed.pop("opcua", {})
    content = {"server": {"url": "http://127.0.0.1:1"}, "machine": {"lathe-1": table | changed}}
    return configuration_from(content, folder).machines[0]


@asynccontextmanager
async def control(model: Model, **options: Any) -> AsyncIterator[SimulatedSinumerik]:
    simulator = await serve(model, 0, **{"secure": False} | options)
    try:
        yield simulator
    finally:
        await simulator.stop()


@asynccontextmanager
async def linked(simulator: SimulatedSinumerik, folder: Path = Path(), **changed: Any) -> AsyncIterator[RegisterLink]:
    link = opcua.link(machine(simulator, folder, **changed))
    try:
        await link.connect()
        yield link
    finally:
        await link.close()


@asynccontextmanager
async def client(simulator: SimulatedSinumerik, user: str = BRIDGE) -> AsyncIterator[Client]:
    """Another client of the control."""
    other = Client(f"opc.tcp://127.0.0.1:{simulator.port}", timeout=30)
    other.set_user(user)
    other.set_password(PASSWORD)
    async with other:
        yield other


def made(model: Model) -> None:
    """One part."""
    for _ in model.part():
        pass


async def shown(simulator: SimulatedSinumerik) -> None:
    """Wait until the control's next tick has shown what the model holds."""
    nc = simulator.control.nc
    await until(
        lambda: (nc.registers, nc.offsets, nc.running) == (nc.model.registers, nc.model.offsets, nc.model.running),
        "the next tick",
    )


async def sentence(work: Callable[[], Awaitable[Any]], kind: type[LinkError]) -> str:
    with pytest.raises(kind) as failed:
        await work()
    return str(failed.value)


def test_readings_come_once_and_in_order_through_cuts() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        chance = random.Random(7)
        stored: dict[str, float] = {}
        position = Position()
        async with control(model) as simulator:
            link = opcua.link(machine(simulator))

            async def make() -> None:
                for _ in range(20):
                    for _ in model.part():
                        full = model.registers[Register.WRITTEN] - model.registers[Register.ACK] >= 8
                        await asyncio.sleep(0.02 if full or chance.random() < 0.05 else 0)

            async def cut() -> None:
                while True:
                    await asyncio.sleep(chance.uniform(0.2, 0.6))
                    simulator.cut()

            making, cutting = asyncio.create_task(make()), asyncio.create_task(cut())
            async with asyncio.timeout(120):
                connected = False
                while len(stored) < 20:
                    try:
                        if not connected:
                            await link.connect()
                            connected = True
                        received = await link.fetch(position)
                        for reading in received:
                            assert reading.key not in stored
                            stored[reading.key] = reading.body["measured"]
                            position = reading.position or position
                        await link.acknowledge(received)
                        await asyncio.sleep(0.02)
                    except LinkError:
                        await link.close()
                        connected = False
                        await asyncio.sleep(0.02)
            cutting.cancel()
            await making
            await link.close()
        truth = [size for _, size in sorted((int(key.split(":")[1]), size) for key, size in model.truth().items())]
        assert list(stored.values()) == truth

    run(scenario())


@pytest.mark.parametrize("edge_size", [25, 34])
def test_offsets_of_each_edge_are_found_by_the_size_that_is_read(edge_size: int) -> None:
    async def scenario() -> None:
        model = Model((QUIET, TWO_EDGES))
        model.offsets |= {(3, 1, "wear_length_1"): 0.25, (3, 2, "wear_radius"): 0.5}
        async with control(model, edge_size=edge_size) as simulator:
            both = simulator.table()["location"]
            assert isinstance(both, list)
            both[1]["tool_memory"] = 4
            async with linked(simulator, location=both) as link:
                assert await link.offsets() == {3: 0.25, 4: 1.0}

    run(scenario())


@pytest.mark.parametrize("first_r", [None, 700])
def test_a_correction_goes_through_the_mailbox_once(first_r: int | None) -> None:
    async def scenario() -> None:
        model = Model((QUIET,), unit=Unit.INCH)
        async with control(model, first_r=first_r) as simulator, linked(simulator) as link:
            made(model)
            await shown(simulator)
            order = Order(5, 3, 0.0, -0.0127)
            for _ in range(3):
                await link.fetch(Position())
                await link.offer([order])
                made(model)
                await shown(simulator)
            await link.fetch(Position())
            [outcome] = await link.outcomes()
            assert (outcome.number, outcome.applied) == (5, True)
            assert outcome.offset == pytest.approx(-0.0127)
            assert [(each.number, round(each.after, 6)) for each in model.applied] == [(5, -0.0005)]

    run(scenario())


def test_registers_that_the_control_does_not_know_together_are_read_singly(monkeypatch: pytest.MonkeyPatch) -> None:
    """A control of another make knows the whole block, and each register by itself."""
    known = Nc.read

    def read(nc: Nc, identifier: str) -> ua.Variant:
        if "#" in identifier and f"#{SIZE}]" not in identifier:
            raise ServiceError(ua.StatusCodes.BadNodeIdUnknown)
        return known(nc, identifier)

    monkeypatch.setattr(Nc, "read", read)

    async def scenario() -> None:
        model = Model((QUIET,))
        async with control(model) as simulator, linked(simulator) as link:
            made(model)
            await shown(simulator)
            await link.fetch(Position())
            assert await link.try_out() == []
            await link.offer([Order(1, 3, 0.0, -0.01)])
            assert model.registers[Register.MAIL_NUMBER] == 1

    run(scenario())


def test_what_was_written_is_waited_for_until_it_is_shown() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        async with control(model) as simulator, linked(simulator) as link:
            await link.registers.write(Register.ACK, 7.0)
            await link.registers.shown(Register.ACK, 7.0)
            assert await link.registers.read([Register.ACK]) == [7.0]
            assert simulator.control.nc.registers[Register.ACK] == 7.0

    run(scenario())


def test_a_hand_edit_is_seen_and_not_overwritten() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        made(model)
        async with control(model) as simulator, linked(simulator, corrections="direct") as link:
            model.edit((3, 1, "wear_length_1"), 0.03)
            await shown(simulator)
            assert await link.offsets() == {3: 0.03}
            await link.fetch(Position())
            await link.offer([Order(1, 3, 0.0, -0.01)])
            [outcome] = await link.outcomes()
            assert (outcome.applied, outcome.differs, outcome.offset) == (False, True, 0.03)
            assert model.offsets[3, 1, "wear_length_1"] == 0.03

    run(scenario())


def test_a_wear_is_set_directly_but_not_while_its_tool_is_in_use() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        made(model)
        async with control(model) as simulator, linked(simulator, corrections="direct") as link:
            model.running, model.tool_in_spindle = True, 3
            await shown(simulator)
            await link.offer([Order(1, 3, 0.0, -0.01)])
            assert await link.outcomes() == []
            assert "in use" in await sentence(lambda: link.write_offset(3, -0.01), ControlAway)
            model.running = False
            await shown(simulator)
            await link.offer([Order(1, 3, 0.0, -0.01)])
            assert [outcome.applied for outcome in await link.outcomes()] == [True]
            assert model.offsets[3, 1, "wear_length_1"] == -0.01

    run(scenario())


def test_nothing_is_written_after_the_connection_was_lost() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        made(model)
        async with control(model) as simulator, linked(simulator) as link:
            await link.read_offset(3)
            simulator.cut()
            assert "lost" in await sentence(lambda: link.write_offset(3, 0.02), ControlAway)
            await link.connect()
            assert "blindly" in await sentence(
                lambda: link.registers.write_offset(link.machine.location[0], 0.02), ControlAway
            )
            await asyncio.sleep(0.3)
            assert model.offsets[3, 1, "wear_length_1"] == 0.0
            await link.read_offset(3)
            await link.write_offset(3, 0.02)
            assert model.offsets[3, 1, "wear_length_1"] == 0.02

    run(scenario())


def test_unknown_identifiers_are_named() -> None:
    async def scenario() -> None:
        async with control(Model((QUIET,))) as simulator:
            cases: list[tuple[dict[str, Any], str, str]] = [
                ({"opcua": {"gud": "/NC/_N_CH_GD2_ACX/INBAND"}}, "/NC/_N_CH_GD2_ACX/INBAND[u1,1,#98]", "UGUD.DEF"),
                ({"opcua": {"first_r": 950}}, "/Channel/Parameter/R[u1,950,#98]", "28050"),
                ({"opcua": {"channel": 2}}, "/NC/_N_CH_GD3_ACX/INBAND[u2,1,#98]", "BadAttributeIdInvalid"),
                ({"opcua": {"serial": "/Nck/State/serial"}}, "/Nck/State/serial", "BadNodeIdUnknown"),
            ]
            for changed, identifier, hint in cases:

                async def work(changed: dict[str, Any] = changed) -> None:
                    async with linked(simulator, **changed) as link:
                        await link.fetch(Position())

                words = await sentence(work, Misconfigured)
                assert identifier in words
                assert hint in words
            table: Any = simulator.table()["location"]

            async def other_tool() -> None:
                async with linked(simulator, location=[table[0] | {"tool": 9}]) as link:
                    await link.offsets()

            words = await sentence(other_tool, Misconfigured)
            assert "edgeData[u1,c9,12]" in words
            assert "T number" in words

            async def other_word() -> None:
                async with linked(simulator, location=[table[0] | {"register": "length"}]):
                    pass

            assert "wear_length_1, wear_length_2" in await sentence(other_word, Misconfigured)

    run(scenario())


def test_a_size_of_an_edge_that_cannot_be_is_refused() -> None:
    async def scenario() -> None:
        async with control(Model((QUIET,)), edge_size=10) as simulator:
            assert "numCuttEdgeParams" in await sentence(opcua.link(machine(simulator)).connect, Misconfigured)

    run(scenario())


def test_logins_rights_and_sessions_are_said() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        made(model)
        async with control(model) as simulator:
            wrong = opcua.link(machine(simulator, opcua={"password": "no"}))
            assert "password" in await sentence(wrong.connect, Misconfigured)

            simulator.control.rights[BRIDGE] = {"StateRead", "ToolRead", "GudRead"}
            async with linked(simulator) as link:
                [*received] = await link.fetch(Position())
                words = await sentence(lambda: link.acknowledge(received), Misconfigured)
                assert 'GiveUserAccess("inband", "GudRead; GudWrite")' in words
                async with client(simulator, ADMINISTRATOR) as administrator:
                    await give(administrator, BRIDGE, "GudWrite; ToolWrite")
                await link.acknowledge(received)
                assert model.registers[Register.ACK] == 1.0

            simulator.control.sessions = 0
            assert "session" in await sentence(opcua.link(machine(simulator)).connect, ControlAway)

    run(scenario())


async def give(administrator: Client, user: str, realms: str) -> None:
    call = ua.CallMethodRequest(
        ObjectId=opcua.node_of("/Methods"),
        MethodId=opcua.node_of("/Methods/GiveUserAccess"),
        InputArguments=[ua.Variant(user), ua.Variant(realms)],
    )
    [result] = await administrator.uaclient.session.call([call])
    result.StatusCode.check()


def test_sessions_are_given_back() -> None:
    async def scenario() -> None:
        async with control(Model((QUIET,))) as simulator:
            link = opcua.link(machine(simulator))
            for _ in range(8):
                await link.connect()
            await link.close()
            for _ in range(8):
                connecting = asyncio.create_task(link.connect())
                await asyncio.sleep(0.03)
                connecting.cancel()
                await asyncio.gather(connecting, return_exceptions=True)
                await link.close()
            await until(lambda: not simulator.control._external_sessions, "sessions that are free")
            async with linked(simulator):
                pass

    run(scenario())


def test_a_machine_that_does_not_answer_is_said() -> None:
    async def scenario() -> None:
        async with control(Model((QUIET,))) as simulator:
            chosen = machine(simulator)
        assert f"127.0.0.1:{simulator.port}" in await sentence(opcua.link(chosen).connect, ControlAway)

    run(scenario())


def test_another_serial_number_and_the_name_in_place_of_it() -> None:
    async def scenario() -> None:
        model = Model((QUIET,), serial="")
        async with control(model) as simulator:
            assert await opcua_identity(simulator) == "urn:inband:simulated:sinumerik"
            model.serial = "ST-C82011223344"
            assert await opcua_identity(simulator) == "ST-C82011223344"

    run(scenario())


async def opcua_identity(simulator: SimulatedSinumerik) -> str:
    link = opcua.link(machine(simulator, identity="any"))
    try:
        return await link.connect()
    finally:
        await link.close()


def test_an_encrypted_connection_needs_a_trusted_certificate(tmp_path: Path) -> None:
    async def scenario() -> None:
        result = CliRunner().invoke(bridge, ["certificate", "--folder", str(tmp_path), "--host", "edge-1"])
        assert result.exit_code == 0, result.output
        der = (tmp_path / "inband-bridge.der").read_bytes()
        assert (tmp_path / "inband-bridge.pem").stat().st_mode & 0o077 == 0
        ours = {"certificate": "inband-bridge.der", "key": "inband-bridge.pem"}
        model = Model((QUIET,))
        made(model)
        async with control(model, secure=True) as simulator:
            chosen = machine(simulator, tmp_path, opcua=ours)
            simulator.control.trusted = set()
            words = await sentence(opcua.link(chosen).connect, Misconfigured)
            assert "trust" in words
            assert "inband-bridge.der" in words
            simulator.control.trusted = {der}
            async with linked(simulator, tmp_path, opcua=ours) as link:
                assert len(await link.fetch(Position())) == 1
            model.clock_ahead = -20 * 366 * 86_400.0
            assert "clock" in await sentence(opcua.link(chosen).connect, Misconfigured)
            model.clock_ahead = 0.0
            other = new_pair("other", "edge-1", "urn:other")
            (tmp_path / "other.der").write_bytes(other.certificate)
            other_client = Client(f"opc.tcp://127.0.0.1:{simulator.port}", timeout=30)
            for endpoint in await other_client.connect_and_get_server_endpoints():
                policies = {token.TokenType: token.SecurityPolicyUri for token in endpoint.UserIdentityTokens}
                assert policies[ua.UserTokenType.UserName].endswith("#Basic256Sha256"), (
                    "strict clients send no plain password"
                )
            pinned = machine(simulator, tmp_path, patience=2.0, opcua=ours | {"control_certificate": "other.der"})
            with pytest.raises(LinkError):
                await opcua.link(pinned).connect()
        async with control(Model((QUIET,))) as simulator:
            plain = machine(simulator, tmp_path, opcua=ours)
            assert "Basic256Sha256" in await sentence(opcua.link(plain).connect, Misconfigured)

    run(scenario())


def test_mistakes_of_the_table_are_all_said(tmp_path: Path) -> None:
    table = {
        "kind": "opcua",
        "unit": "mm",
        "secret": "secret",
        "corrections": "none",
        "opcua": {
            "url": "opc.tcp://127.0.0.1:4840",
            "user": "inband",
            "certificate": "missing.der",
            "control_certificate": "text.der",
        },
    }
    (tmp_path / "text.der").write_text("no certificate")
    with pytest.raises(ConfigurationError) as failed:
        configuration_from({"server": {"url": "http://127.0.0.1:1"}, "machine": {"lathe-1": table}}, tmp_path)
    words = str(failed.value)
    for each in (
        "password_env",
        "both certificate and key",
        "missing.der cannot be read",
        "text.der holds no certificate",
    ):
        assert each in words


def test_the_simulated_control_answers_as_the_manual_says() -> None:
    async def scenario() -> None:
        model = Model((QUIET,))
        model.offsets[3, 1, "wear_length_1"] = 0.25
        async with control(model, first_r=700) as simulator, client(simulator) as other:

            async def value(identifier: str) -> Any:
                return await other.get_node(opcua.node_of(identifier)).read_value()

            row = await value("/Tool/Compensation/edgeData[u1,c3,1,12]")
            assert (len(row), row[-1]) == (12, 0.25)
            assert await value("/Tool/Compensation/edgeData[u1,c3,12]") == 0.25
            assert await value("/Channel/Parameter/R[u1, 700, #2]") == [0.0, 0.0]
            with pytest.raises(ua.uaerrors.BadNodeIdUnknown):
                await value("/Channel/Parameter/R [u1,1]")
            with pytest.raises(ua.uaerrors.BadAttributeIdInvalid):
                await value("/Channel/Parameter/R[u3,1]")
            with pytest.raises(ua.uaerrors.BadWriteNotSupported):
                await other.get_node(opcua.node_of("/Channel/Parameter/R[u1,1]")).write_value(1.0)
            with pytest.raises(ua.uaerrors.BadNotWritable):
                await other.get_node(opcua.node_of(opcua.SERIAL)).write_value(ua.DataValue(ua.Variant(1.0)))
            root = other.get_node(opcua.node_of("/"))
            assert root in await other.nodes.objects.get_children()
            names = [(await node.read_browse_name()).Name for node in await root.get_children()]
            assert "R" in names
            assert not [name for name in names if "[" in name]
            await simulator.hold()
            model.registers[Register.OFFSET] = 1.0
            assert (await value(f"/NC/_N_CH_GD3_ACX/INBAND[u1,1,{SIZE}]"))[Register.OFFSET] == 0.0
            simulator.start()
            await shown(simulator)
            assert await value(f"/NC/_N_CH_GD3_ACX/INBAND[u1,{Register.OFFSET + 1}]") == 1.0

    run(scenario())


def answer_to_a_read(*values: ua.DataValue, **header: Any) -> bytes:
    return struct_to_binary(ua.ReadResponse(ResponseHeader=ua.ResponseHeader(**header), Results=list(values)))


def test_numbers_are_read_out_of_an_answer_as_asyncua_reads_them() -> None:
    numbers = [1.5, -2.0, float("inf"), 0.0]
    whole = ua.Variant(numbers, ua.VariantType.Double)
    assert doubles_in(answer_to_a_read(ua.DataValue(whole))) == tuple(numbers)
    assert doubles_in(answer_to_a_read(ua.DataValue(whole, SourceTimestamp=ua.DateTime.now(UTC)))) == tuple(numbers)


@pytest.mark.parametrize(
    "answer",
    [
        answer_to_a_read(ua.DataValue(ua.Variant(1.5, ua.VariantType.Double))),
        answer_to_a_read(ua.DataValue(ua.Variant([1.5, 2.0], ua.VariantType.Float))),
        answer_to_a_read(ua.DataValue(ua.Variant([1, 2], ua.VariantType.Int32))),
        answer_to_a_read(ua.DataValue(StatusCode=ua.StatusCode(ua.UInt32(ua.StatusCodes.BadNodeIdUnknown)))),
        answer_to_a_read(
            ua.DataValue(
                ua.Variant([1.5, 2.0], ua.VariantType.Double),
                StatusCode=ua.StatusCode(ua.UInt32(ua.StatusCodes.UncertainLastUsableValue)),
            )
        ),
        answer_to_a_read(*[ua.DataValue(ua.Variant([1.5, 2.0], ua.VariantType.Double))] * 2),
        answer_to_a_read(
            ua.DataValue(ua.Variant([1.5, 2.0], ua.VariantType.Double)),
            ServiceResult=ua.StatusCode(ua.UInt32(ua.StatusCodes.BadTimeout)),
        ),
        answer_to_a_read(ua.DataValue(ua.Variant([1.5] * 96, ua.VariantType.Double)))[:200],
        b"",
    ],
    ids=["one", "floats", "integers", "unknown", "uncertain", "two", "fault", "half", "nothing"],
)
def test_any_other_answer_is_left_to_asyncua(answer: bytes) -> None:
    assert doubles_in(answer) is None
