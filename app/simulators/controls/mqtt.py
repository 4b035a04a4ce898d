"""A simulated machine that speaks MQTT: it keeps each reading until the bridge has stored it, and sends it again and again.

It needs a broker: one that runs, or mosquitto, which it starts where it is installed. Messages of a broker that fails may be lost
or come twice; nothing of that loses a reading here, or applies a correction twice.
"""

import asyncio
import contextlib
import getpass
import json
import shutil
import socket
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import aiomqtt

from app.bridge.unit import ended
from app.core.ring import Answer, Mail, Register, Slot, Status, Told, Unit, mail_registers
from app.simulators.controls import NoPlace
from app.simulators.controls.model import Feature, Model

AT = "the broker as host:port; mosquitto is started if left out"
AGAIN = 3.0  # s until what was not stored is sent again
TICK = 0.05  # s
ANSWER = 5.0  # s in which the broker answers
REFUSALS = {
    Answer.OFFSET_DIFFERS: "The offset is not the one that was expected.",
    Answer.NOT_POSSIBLE: "Tool or register is not known.",
}


TOLD = {"hold": Told.HOLD, "stop": Told.STOP}


class MqttSimulator:
    """One machine that is running. broker: a process of its own, if it has started one."""

    def __init__(self, model: Model, host: str, port: int, *, again: float = AGAIN) -> None:
        self.model = model
        self.host = host
        self.port = port
        self.again = again
        self.name = model.serial.lower()
        self.broker: asyncio.subprocess.Process | None = None
        self.outbox: dict[str, dict[str, object]] = {}
        self.stored: set[str] = set()
        self._noted = 0
        self._sent: dict[str, float] = {}
        self._answers: dict[int, dict[str, object]] = {}
        self._pending: list[dict[str, Any]] = []
        self._task: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Connect, now and whenever the broker comes back."""
        self._task = asyncio.create_task(self._run())

    async def stop(self) -> None:
        """End it, and its broker."""
        if self._task is not None:
            await ended([self._task])
        if self.broker is not None:
            with contextlib.suppress(ProcessLookupError):
                self.broker.terminate()
            await self.broker.wait()

    def table(self) -> dict[str, object]:
        """The table of a machine in the configuration."""
        settings: dict[str, object] = {"host": self.host, "port": self.port, "name": self.name}
        table = self.model.table("mqtt", settings, proof_needed=False, location=self.model.locations)
        return table | {"characteristics": {str(each.number): f"shaft-{each.number}" for each in self.model.features}}

    async def _run(self) -> None:
        while True:
            with contextlib.suppress(aiomqtt.MqttError):
                async with aiomqtt.Client(
                    self.host, self.port, identifier=self.name, clean_session=False, timeout=ANSWER, keepalive=5
                ) as client:
                    self._sent.clear()
                    for topic in ("stored", "corrections", "decisions"):
                        await client.subscribe(f"inband/v1/{self.name}/{topic}", qos=1)
                    listening = asyncio.create_task(self._listen(client))
                    try:
                        while not listening.done():
                            await self._work(client)
                            await asyncio.sleep(TICK)
                    finally:
                        listening.cancel()
                        await asyncio.gather(listening, return_exceptions=True)
            self._note()
            await asyncio.sleep(0.2)

    def _note(self) -> None:
        """Take new readings of the model over; its ring is never full."""
        self.model.registers[Register.ACK] = self.model.registers[Register.WRITTEN]
        for epoch, slot in self.model.written[self._noted :]:
            key = f"{self.name}:{epoch}:{slot.sequence}"
            self.outbox[key] = _body(key, slot)
        self._noted = len(self.model.written)

    async def _work(self, client: aiomqtt.Client) -> None:
        self._note()
        now = asyncio.get_running_loop().time()
        for key, body in list(self.outbox.items()):
            if now >= self._sent.get(key, 0.0) + self.again or key not in self._sent:
                self._sent[key] = now
                await client.publish(f"inband/v1/{self.name}/readings", json.dumps(body), qos=1)
        self._look_at_mail()
        for number, answer in list(self._answers.items()):
            if now >= self._sent.get(f"answer {number}", 0.0) + self.again or f"answer {number}" not in self._sent:
                self._sent[f"answer {number}"] = now
                await client.publish(f"inband/v1/{self.name}/applied", json.dumps(answer), qos=1)

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            body = json.loads(message.payload)
            if message.topic.matches("+/+/+/stored"):
                self.outbox.pop(body["key"], None)
                self.stored.add(body["key"])
            elif message.topic.matches("+/+/+/decisions"):
                if action := TOLD.get(body["action"]):
                    self.model.told.append(action)
            else:
                self._pending = body["corrections"]
                wanted = {each["number"] for each in self._pending}
                self._answers = {number: answer for number, answer in self._answers.items() if number in wanted}
                self._mail()

    def _mail(self) -> None:
        """Put the first of the list that has no answer into the mailbox of the NC, unless it has expired."""
        registers = self.model.registers
        if not self._pending:
            registers[Register.MAIL_NUMBER] = registers[Register.ANSWERED]
            return
        first = next((each for each in self._pending if each["number"] not in self._answers), None)
        if first is None or datetime.fromisoformat(first["expires_at"]) < datetime.now(UTC):
            return
        if registers[Register.MAIL_NUMBER] == first["number"]:
            return
        feature = self._feature(first)
        parameter = -1 if feature is None else feature.parameter
        mail = Mail(first["number"], first["tool"], first["edge"], parameter, first["before"], first["after"])
        for place, value in mail_registers(mail, Unit(self.model.unit)):
            registers[place] = value

    def _feature(self, correction: dict[str, Any]) -> Feature | None:
        for feature in self.model.every:
            if (feature.tool, feature.edge, feature.register) == tuple(
                correction[name] for name in ("tool", "edge", "register")
            ):
                return feature
        return None

    def _look_at_mail(self) -> None:
        registers = self.model.registers
        number = round(registers[Register.ANSWERED])
        if number not in {each["number"] for each in self._pending} or number in self._answers:
            return
        answer: dict[str, object] = {"number": number}
        if registers[Register.ANSWER] == Answer.APPLIED:
            answer["offset_after"] = registers[Register.OFFSET]
        else:
            reason = Answer(round(registers[Register.ANSWER]))
            answer |= {"refused": REFUSALS.get(reason, "Not taken."), "offset": registers[Register.OFFSET]}
            answer["differs"] = reason is Answer.OFFSET_DIFFERS
        self._answers[number] = answer
        self._mail()


def _body(key: str, slot: Slot) -> dict[str, object]:
    return {
        "key": key,
        "characteristic": str(slot.characteristic),
        **({"touches": []} if slot.status == Status.NO_TRIGGER else {"measured": slot.measured}),
        "part": str(slot.part),
        "correction_in_effect": slot.in_effect,
        "measured_at": datetime.now(UTC).isoformat(),
    }


async def serve(model: Model, port: int, at: str | None = None) -> MqttSimulator:
    """Start one. at: the broker as host:port; None starts mosquitto at ``port``. Raises `NoPlace` where neither is there."""
    if at is not None:
        host, _, number = at.rpartition(":")
        if not host or not number.isdecimal():
            raise NoPlace(f"{at!r} is no broker: name it as host:port, such as 127.0.0.1:1883.")
        simulator = MqttSimulator(model, host, int(number))
    else:
        port = port or free_port()
        broker = await start_broker(Path(tempfile.mkdtemp(prefix="inband-mqtt-")), port)
        simulator = MqttSimulator(model, "127.0.0.1", port)
        simulator.broker = broker
    await simulator.start()
    return simulator


def mosquitto() -> str | None:
    """The broker's program, where it is installed."""
    return shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin")


async def start_broker(folder: Path, port: int, *lines: str) -> asyncio.subprocess.Process:
    """Start mosquitto on the loopback, with its memory in a folder; it answers when this returns. lines: more settings."""
    program = mosquitto()
    if program is None:
        raise NoPlace(
            "A simulated machine that speaks MQTT needs a broker: install mosquitto, or name one by --at host:port."
        )
    settings = [
        f"listener {port} 127.0.0.1",
        f"user {getpass.getuser()}",  # root would become one who may not write in this folder
        "persistence true",
        f"persistence_location {folder}/",
        "autosave_on_changes true",
        "autosave_interval 1",
        "log_dest none",
        *(lines or ("allow_anonymous true",)),
    ]
    file = folder / "mosquitto.conf"
    await asyncio.to_thread(file.write_text, "\n".join(settings) + "\n", encoding="utf-8")
    process = await asyncio.create_subprocess_exec(program, "-c", str(file))
    for _ in range(300):
        if process.returncode is not None:
            raise NoPlace(f"mosquitto has ended at once: is port {port} free?")
        with contextlib.suppress(OSError):
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.close()
            return process
        await asyncio.sleep(0.1)
    process.kill()
    raise NoPlace("mosquitto does not answer.")


def free_port() -> int:
    """A port of the loopback that nobody listens on."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port
