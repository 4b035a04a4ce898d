"""Machines and gateways that speak MQTT 5 over a broker, by six topics; library aiomqtt, an extra.

Below ``inband/v1/{machine}/``: ``readings`` come in; ``stored`` answers each with its key, once it is stored durably;
``corrections`` is the list that is pending now, retained; ``applied`` is the machine's answer to one of them; ``decisions`` are the server's on each reading; ``offsets`` is what
the machine holds, if it says so. A message is acknowledged to the broker when it is stored, not before: what this bridge
did not store, the broker of a persistent session delivers again. The broker itself may lose messages that it has
acknowledged (it writes them to its disk now and then): a machine sends a reading until ``stored`` names its key.
"""

import asyncio
import contextlib
import hashlib
import json
import logging
import math
import os
import ssl
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final, Literal

import aiomqtt
from msgspec import Struct
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from app.bridge.configuration import Location, Machine, Number, Positive
from app.bridge.fields import FIELDS, Form, left_out_since, refuse_unknown
from app.bridge.links import Clock, ControlAway, Decided, LinkError, Misconfigured, Order, Outcome, Position, Received
from app.bridge.messages import foreign_readings, object_in, own_reading
from app.bridge.moments import learn_ahead
from app.core.ring import INCH
from app.files.formats.cell_values import zone_named

log = logging.getLogger(__name__)
IN_FLIGHT: Final = 200  # messages that the broker may send before the first is acknowledged
AT_ONCE: Final = 50  # readings of a poll: a broker that is slow has to answer for all of them before a call is given up
AT_LEAST_ONCE: Final = 1
REFUSED: Final = 0x80  # from here on a reason of MQTT is a failure
BAD_LOGIN, NOT_ALLOWED, TAKEN_OVER = 0x86, 0x87, 0x8E
GOODBYE: Final = 3.0  # s
ECHO: Final = 5.0  # s until what was published comes back
OTHERS_TURN: Final = 15.0  # s that a client stays away after another one has taken its id


class Settings(Struct, forbid_unknown_fields=True, frozen=True):
    """A broker, and the topics of one machine there.

    host, port: 1883, with tls 8883, if left out. name: of the machine in the topics; its key if left out. prefix: of the
    topics. client_id: ``inband-bridge-`` and the machine's key if left out; no other client may have it. username; password in a
    file or in a variable of the environment. tls, ca: a file with the authority of the broker's certificate, if it is one of
    the plant's own. certificate, private_key: files of the client's own. session: s that the broker keeps messages for a
    bridge that is unreachable. valid: s after which a list of corrections that was not renewed counts no longer. keepalive: s.

    fields: members of messages of another form by field of `app.bridge.fields.FIELDS`, see `app.bridge.messages`; readings: their
    topic, if it is another; decimal, times and zone of what they say in texts.
    """

    host: str
    port: int | None = None
    name: str | None = None
    prefix: str = "inband/v1"
    client_id: str | None = None
    username: str | None = None
    password_file: str | None = None
    password_env: str | None = None
    tls: bool = False
    ca: str | None = None
    certificate: str | None = None
    private_key: str | None = None
    session: Number = 7 * 86_400
    valid: Positive = 600.0
    keepalive: Number = 20
    fields: dict[str, str] = {}
    readings: str | None = None
    decimal: Literal[".", ","] = "."
    times: str | None = None
    zone: str | None = None

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        if not self.tls and (self.ca or self.certificate):
            raise ValueError("ca and certificate need tls = true")
        if (self.certificate is None) != (self.private_key is None):
            raise ValueError("certificate and private_key belong together")
        for name in self.fields.keys() - set(FIELDS):
            raise ValueError(f"fields.{name} is no field; fields are {', '.join(FIELDS)}")
        refuse_unknown(self.zone)
        for word in (self.prefix, self.name or "", self.readings or ""):
            if set(word) & set("+#\0") or word.startswith("/"):
                raise ValueError(f"{word!r} is no part of a topic: without + and #, not beginning with /")
        if self.password_file and self.password_env:
            raise ValueError("password_file or password_env, not both")
        if self.username is None and (self.password_file or self.password_env):
            raise ValueError("a password needs a username")


class Client(aiomqtt.Client):
    """A client that notes with which reason the broker has refused a message: the library passes over it."""

    refused = ""

    def _on_publish(self, client: Any, userdata: Any, mid: int, reason_code: Any, properties: Any) -> None:
        if getattr(reason_code, "value", 0) >= REFUSED:
            self.refused = str(reason_code)
        super()._on_publish(client, userdata, mid, reason_code, properties)


class MqttLink:
    """The link to one machine by a broker."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.settings: Settings = machine.settings
        self.clock = Clock()
        self._left_out: dict[str, str] = {}
        self.base = f"{self.settings.prefix}/{self.settings.name or machine.key}"
        self.port = self.settings.port or (8883 if self.settings.tls else 1883)
        self.where = f"{self.settings.host}:{self.port}"
        self.readings = self.settings.readings or f"{self.base}/readings"
        zone = None if self.settings.zone is None else zone_named(self.settings.zone)
        scale = INCH if machine.unit == "inch" else 1.0
        self._form = Form(scale, self.settings.decimal, self.settings.times, zone)
        self._client: Client | None = None
        self._listening: asyncio.Task[None] | None = None
        self._readings: list[aiomqtt.Message] = []
        self._answers: list[aiomqtt.Message] = []
        self._handed_on: list[aiomqtt.Message] = []  # answers, not acknowledged yet
        self._offsets: dict[int, float] = {}
        self._offered: tuple[Sequence[Order], float] | None = None
        self._taken_over = -OTHERS_TURN
        self._echo: tuple[str, bytes, asyncio.Event] | None = None

    @property
    def remark(self) -> str:
        """Temperatures that are left out, in words."""
        return " ".join(self._left_out.values())

    # --- connection

    async def connect(self) -> str:
        """Connect to the broker, take up the session, listen."""
        if self.machine.corrections == "direct":
            raise Misconfigured('Over MQTT the machine sets its offsets itself: use corrections = "control" or "none".')
        if time.monotonic() < self._taken_over + OTHERS_TURN:
            raise Misconfigured(self._takeover())
        await self.close()
        client = Client(
            self.settings.host,
            self.port,
            identifier=self._client_id(),
            username=self.settings.username,
            password=self._password(),
            tls_context=self._tls() if self.settings.tls else None,
            protocol=aiomqtt.ProtocolVersion.V5,
            clean_start=False,
            properties=_connect_properties(self.settings.session),
            keepalive=self.settings.keepalive,
            timeout=math.inf,  # the caller has one; that of aiomqtt may swallow a cancellation in Python 3.11
        )
        client._client.manual_ack_set(True)  # noqa: SLF001 - aiomqtt has no word of its own for it
        client.pending_calls_threshold = IN_FLIGHT  # that many answers at once are meant: no warning about them
        try:
            await client.__aenter__()
            self._client = client
            self._listening = asyncio.create_task(self._listen(client))
            for topic in (self.readings, f"{self.base}/applied", f"{self.base}/offsets"):
                [reason, *_] = await client.subscribe(topic, qos=AT_LEAST_ONCE)
                if getattr(reason, "value", reason) >= REFUSED:
                    raise Misconfigured(
                        f"The broker {self.where} does not let the bridge read {topic}: {reason}. Look at its"
                        " list of rights."
                    )
        except aiomqtt.MqttError as error:
            raise self._wrong(error) from error
        return f"{self.where}/{self.base}"

    async def close(self) -> None:
        """Leave the broker; the session stays."""
        client, self._client = self._client, None
        if self._listening is not None:
            self._listening.cancel()
            await asyncio.gather(self._listening, return_exceptions=True)
            self._listening = None
        if client is not None:
            with contextlib.suppress(aiomqtt.MqttError, TimeoutError):
                async with asyncio.timeout(GOODBYE):
                    await client.__aexit__(None, None, None)
        self._readings, self._answers, self._handed_on = [], [], []  # not acknowledged: they come again
        self._offered = None

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            topic = str(message.topic)
            if topic == self.readings:
                self._readings.append(message)
            elif topic == f"{self.base}/applied":
                self._answers.append(message)
            elif topic != f"{self.base}/offsets":  # of `try_out`
                if self._echo is not None and topic == self._echo[0] and bytes(message.payload) == self._echo[1]:
                    self._echo[2].set()
                self._done(message)
            else:
                self._take_offsets(message)
                self._done(message)

    def _there(self) -> Client:
        """The client; raises where the connection has ended."""
        if self._listening is not None and self._listening.done():
            error = self._listening.exception()
            if isinstance(error, aiomqtt.MqttError):
                raise self._wrong(error)
            raise ControlAway(f"The broker {self.where} has ended the connection.") from error
        if self._client is None:
            raise ControlAway(f"There is no connection to the broker {self.where}.")
        return self._client

    def _done(self, message: aiomqtt.Message) -> None:
        """Acknowledge a message to the broker."""
        if message.qos and self._client is not None:
            self._client._client.ack(message.mid, message.qos)  # noqa: SLF001

    async def _publish(
        self, topic: str, content: object, *, retain: bool = False, expires: float | None = None
    ) -> None:
        properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
        if expires is not None:
            properties.MessageExpiryInterval = round(expires)
        client, listening = self._there(), self._listening
        assert listening is not None  # as long as there is a client
        publishing = asyncio.ensure_future(
            client.publish(
                f"{self.base}/{topic}", json.dumps(content), qos=AT_LEAST_ONCE, retain=retain, properties=properties
            )
        )
        try:
            # Of a broker that is killed no answer comes: the library would wait for it as long as the caller lets it.
            await asyncio.wait({publishing, listening}, return_when=asyncio.FIRST_COMPLETED)
            if not publishing.done():
                self._there()
            await publishing
        except aiomqtt.MqttError as error:
            raise self._wrong(error) from error
        finally:
            publishing.cancel()
        if client.refused:
            raise Misconfigured(
                f"The broker {self.where} does not let the bridge write {self.base}/{topic}: {client.refused}. Look at its"
                " list of rights."
            )

    def _wrong(self, error: aiomqtt.MqttError) -> LinkError:
        """The error of ours that stands for one of the library."""
        reason = getattr(error, "rc", None) or getattr(error.__cause__, "rc", None)
        code = getattr(reason, "value", reason)
        if code in {BAD_LOGIN, NOT_ALLOWED, 4, 5}:
            return Misconfigured(
                f"The broker {self.where} refuses the login of {self.settings.username or 'a client without a name'}: look"
                " at username, password, certificate, and the broker's list of users."
            )
        if code == TAKEN_OVER:
            self._taken_over = time.monotonic()
            return Misconfigured(self._takeover())
        if "CERTIFICATE_VERIFY_FAILED" in str(error):
            return Misconfigured(
                f"The certificate of the broker {self.where} is not to be trusted ({error}): look at ca, and that host is a"
                " name in the certificate."
            )
        if "SSL" in str(error) or "TLS" in str(error):
            return Misconfigured(f"No encrypted connection to the broker {self.where}: {error}. Look at tls, port, ca.")
        if self._listening is not None and self._listening.done():
            return ControlAway(
                f"The broker {self.where} has ended the connection. Does it still run, and does another program use the client"
                f" id {self._client_id()!r}, such as a second bridge? Each has its own, and one bridge alone serves a machine."
            )
        return ControlAway(
            f"The broker {self.where} does not answer: {error}. Look at host, port, tls and network; does it run?"
        )

    def _takeover(self) -> str:
        return (
            f"Another program has connected to the broker {self.where} with the client id {self._client_id()!r}: does a"
            " second bridge run with this machine? Each has its own client_id, and one bridge alone serves a machine."
        )

    def _client_id(self) -> str:
        return self.settings.client_id or f"inband-bridge-{self.machine.key}"

    def _password(self) -> str | None:
        if self.settings.password_env:
            if (password := os.environ.get(self.settings.password_env)) is None:
                raise Misconfigured(f"The variable {self.settings.password_env} (password_env) is not set.")
            return password
        if self.settings.password_file:
            try:
                return Path(self.settings.password_file).read_text(encoding="utf-8").strip()
            except (OSError, UnicodeDecodeError) as error:
                raise Misconfigured(f"password_file {self.settings.password_file} cannot be read: {error}.") from error
        return None

    def _tls(self) -> ssl.SSLContext:
        try:
            context = ssl.create_default_context(cafile=self.settings.ca)
            if self.settings.certificate is not None:
                context.load_cert_chain(self.settings.certificate, self.settings.private_key)
        except (OSError, ssl.SSLError) as error:
            raise Misconfigured(f"ca, certificate or private_key cannot be read: {error}.") from error
        return context

    # --- readings

    async def fetch(self, stored: Position) -> Sequence[Received]:
        """Readings that came, some at a time: what is acknowledged stays so, though a later call is given up."""
        del stored
        self._there()
        messages, self._readings = self._readings[:AT_ONCE], self._readings[AT_ONCE:]
        received = [each for message in messages for each in self._received(message)]
        if received:
            learn_ahead(self.clock, received, datetime.now().astimezone())
        return received

    def _received(self, message: aiomqtt.Message) -> list[Received]:
        payload, machine = bytes(message.payload), self.machine
        if self.settings.fields:
            found = foreign_readings(payload, machine.key, self.settings.fields, machine.characteristics, self._form)
        else:
            found = [own_reading(payload, machine.characteristics, self._form)]
        received = []
        for index, each in enumerate(found):
            self._left_out = left_out_since(self._left_out, each.body, each.left_out)
            if each.fault is None and each.key is not None:
                received.append(Received(each.key, each.body, mark=(message, each.said)))
                continue
            digest = hashlib.sha256(payload + bytes(index)).hexdigest()[:32]
            shown = {"message": payload[:200].decode("utf-8", "replace")}
            key = f"{machine.key}:refused:{digest}"
            received.append(Received(key, shown, fault=each.fault, mark=(message, each.said)))
        return received

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """Tell the machine which keys are stored, then the broker that the messages are done.

        All at once: one by one, each waits for the broker's answer, and a backlog takes longer than a call may take.
        """
        answers = []
        for each in received:
            _, key = each.mark
            refused = {"refused": each.fault} if each.fault or key is None else {}
            answers.append(self._publish("stored", {"key": key} | refused))
        await asyncio.gather(*answers)
        for message in {id(each.mark[0]): each.mark[0] for each in received}.values():
            self._done(message)

    async def tell_refused(self, key: str, reason: str) -> None:
        """Tell the machine that a reading, whose key was confirmed to it as stored, was refused by the server."""
        await self._publish("stored", {"key": key, "refused": reason})

    # --- corrections

    async def offer(self, orders: Sequence[Order]) -> None:
        """Publish the pending list, retained, when it has changed, and before it expires."""
        self._there()
        while self._handed_on:
            self._done(self._handed_on.pop())
        if self.machine.corrections == "none":
            return
        now = time.monotonic()
        valid = self.settings.valid
        if self._offered is not None and self._offered[0] == tuple(orders) and now < self._offered[1] + valid / 2:
            return
        expires = datetime.now(UTC) + timedelta(seconds=valid)
        # by number: a machine that takes them in this order ends with the highest one, and names it as that in effect
        content = [self._offer_of(order, expires) for order in sorted(orders, key=lambda order: order.number)]
        await self._publish("corrections", {"corrections": content}, retain=True, expires=valid if content else None)
        self._offered = (tuple(orders), now)

    def _offer_of(self, order: Order, expires: datetime) -> dict[str, object]:
        location = self._location(order.tool_memory)
        assert location is not None  # the guards have seen to it
        unit = self.machine.unit
        return {
            "number": order.number,
            "tool_memory": order.tool_memory,
            "tool": location.tool,
            "edge": location.edge,
            "register": location.register,
            "before": round(location.to_control(order.before, unit), 6),
            "after": round(location.to_control(order.after, unit), 6),
            "unit": unit,
            "expires_at": expires.isoformat(timespec="seconds"),
        }

    def _location(self, tool_memory: int) -> Location | None:
        return next((place for place in self.machine.location if place.tool_memory == tool_memory), None)

    async def outcomes(self) -> Sequence[Outcome]:
        """The machine's answers since the last call."""
        self._there()
        messages, self._answers = self._answers, []
        self._handed_on += messages
        found = []
        for message in messages:
            try:
                found.append(self._outcome(object_in(bytes(message.payload))))
            except ValueError as error:
                log.warning("%s: an answer on %s/applied is passed over: %s", self.machine.key, self.base, error)
        return found

    def _outcome(self, body: Mapping[str, Any]) -> Outcome:
        number, after, refused = (body.get(name) for name in ("number", "offset_after", "refused"))
        if not isinstance(number, int) or isinstance(number, bool):
            raise ValueError("it has no number of a correction")  # noqa: TRY004 - of a message, not of a caller
        if (after is None) == (refused is None):
            raise ValueError("it has either offset_after, applied, or refused, a reason")
        order = next((each for each in (self._offered or ((), 0.0))[0] if each.number == number), None)
        location = self._location(order.tool_memory if order else int(body.get("tool_memory") or 0))
        held = after if after is not None else body.get("offset")
        if held is not None and (isinstance(held, bool) or not isinstance(held, int | float)):
            raise ValueError("the offset is not a number")
        offset = None if held is None or location is None else location.from_control(held, self.machine.unit)
        if refused is None:
            return Outcome(number, applied=True, offset=offset)
        return Outcome(number, False, offset, str(refused)[:500], differs=body.get("differs") is True)

    # --- decisions

    async def decide(self, decided: Sequence[Decided]) -> None:
        """Publish the decision on each reading."""
        self._there()
        await asyncio.gather(
            *(
                self._publish(
                    "decisions",
                    {
                        "key": each.key,
                        "characteristic": each.characteristic,
                        "action": each.action,
                        "reason": each.reason,
                        "measure_next": each.measure_next,
                    },
                )
                for each in decided
            )
        )

    async def try_out(self) -> list[str]:
        """Publish all that the bridge will publish, with words that ask for nothing, and see it come back where the broker lets it."""
        nothing = {"key": f"{self.machine.key}:check"}
        contents: dict[str, dict[str, Any]] = {
            "stored": nothing,
            "decisions": nothing | {"characteristic": "", "action": "none", "reason": "check"},
        }
        if self.machine.corrections != "none":
            contents["corrections"] = {"corrections": []}  # as the bridge itself begins
        wrong = [await self._tried(topic, content) for topic, content in contents.items()]
        return [words for words in wrong if words]

    async def _tried(self, topic: str, content: Mapping[str, Any]) -> str:
        """The words of what went wrong; empty if nothing did."""
        client, name = self._there(), f"{self.base}/{topic}"
        client.refused = ""
        [reason, *_] = await client.subscribe(name, qos=AT_LEAST_ONCE)
        self._echo = (name, json.dumps(content).encode(), asyncio.Event())
        try:
            await self._publish(topic, content, retain=topic == "corrections")
            if getattr(reason, "value", reason) < REFUSED:
                await asyncio.wait_for(self._echo[2].wait(), ECHO)
        except TimeoutError:
            return f"The broker {self.where} took a message on {name} and did not hand it on: look at its rights and its log."
        except Misconfigured as error:
            return str(error)
        finally:
            self._echo = None
            await client.unsubscribe(name)
        return ""

    # --- offsets

    async def offsets(self) -> dict[int, float]:
        """The offsets that the machine has published, if it does."""
        return dict(self._offsets)

    def _take_offsets(self, message: aiomqtt.Message) -> None:
        try:
            body = object_in(bytes(message.payload))
        except ValueError as error:
            log.warning("%s: %s/offsets is passed over: %s", self.machine.key, self.base, error)
            return
        for location in self.machine.location:
            value = body.get(str(location.tool_memory))
            if isinstance(value, int | float) and not isinstance(value, bool):
                self._offsets[location.tool_memory] = location.from_control(value, self.machine.unit)


def _connect_properties(session: int) -> Properties:
    properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
    properties.SessionExpiryInterval = session
    properties.ReceiveMaximum = IN_FLIGHT
    return properties


def link(machine: Machine) -> MqttLink:
    """The link to a machine by a broker."""
    return MqttLink(machine)
