"""A second OPC UA library agrees with the simulated SINUMERIK: o6, which stands on open62541.

It is not among the development requirements; ``pip install o6`` and these tests run, in a process of their own.
"""

import asyncio
import importlib.util
import json
import sys
from typing import Any

import pytest
from asyncua import ua

from app.bridge.kinds.opcua import EDGE_SIZE
from app.core.ring import SIZE, Register
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.opcua import BRIDGE, PASSWORD, serve
from tests.loops import run

pytestmark = pytest.mark.skipif(importlib.util.find_spec("o6") is None, reason="o6 is not installed (pip install o6)")
BLOCK = "/NC/_N_CH_GD3_ACX/INBAND"
CLIENT = """
import json, sys
import o6

url, user, password, steps = sys.argv[1], sys.argv[2], sys.argv[3], json.loads(sys.argv[4])
found = []
try:
    with o6.Client(url, username=user, password=password, allowNonePolicyPassword=True) as client:
        for identifier, value in steps:
            node = "ns=2;s=" + identifier
            try:
                if value is not None:
                    client.write(node, o6.Double(value))
                answer = client.read(node)
                numbers = list(answer) if hasattr(answer, "__len__") else [answer]
                found.append([float(each) for each in numbers])
            except Exception as error:
                found.append(str(error))
except Exception as error:
    found.append(str(error))
print("\\n" + json.dumps(found))
"""


async def foreign(url: str, *steps: tuple[str, float | None], password: str = PASSWORD) -> list[Any]:
    """The answers to reads, and to writes that are read back: numbers, or the error in words."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", CLIENT, url, BRIDGE, password, json.dumps(steps), stdout=asyncio.subprocess.PIPE
    )
    said, _ = await process.communicate()
    answers: list[Any] = json.loads(said.decode().splitlines()[-1])
    return answers


def test_it_reads_and_writes_as_the_bridge_does() -> None:
    model = Model((Feature(wear=0.0, noise=0.0),))
    for _ in model.part():
        pass

    async def story() -> None:
        simulator = await serve(model, 0, secure=False)
        try:
            url = f"opc.tcp://127.0.0.1:{simulator.port}"
            block, edge, unknown, acknowledged = await foreign(
                url,
                (f"{BLOCK}[u1,1,#{SIZE}]", None),
                (EDGE_SIZE, None),
                (f"{BLOCK}S[u1,1]", None),
                (f"{BLOCK}[u1,{Register.ACK + 1}]", 1.0),
            )
            assert len(block) == SIZE
            assert block[Register.WRITTEN] == 1.0
            assert edge[0] >= 25
            assert "NODE_ID_UNKNOWN" in unknown
            assert model.registers[Register.ACK] == 1.0, acknowledged
            [refused] = await foreign(url, (EDGE_SIZE, None), password="another")
            assert refused == str(ua.StatusCodes.BadUserAccessDenied)
        finally:
            await simulator.stop()

    run(story())
