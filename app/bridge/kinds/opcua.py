"""SINUMERIK 840D sl, 828D and ONE by OPC UA: register block in user data (GUD) or R parameters, wear of tools.

Identifiers are in namespace 2 and are composed: browsing shows the first element of each array only. One array read
brings the whole block. Polling, no subscriptions: a control samples at 100 ms at best and shows only the last value.

Nothing is sent again by itself: a connection that is lost stays lost until `SinumerikRegisters.connect`, so that no write
arrives late. A wear is written only over a connection over which it was read before.
"""

import asyncio
import logging
import os
from collections.abc import Awaitable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar

import msgspec
from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from asyncua.ua.uaerrors import UaError
from msgspec import Meta, Struct

from app.bridge.certificates import uri_of
from app.bridge.configuration import Location, Machine
from app.bridge.kinds.opcua_answers import answered
from app.bridge.links import ControlAway, LinkError, Misconfigured
from app.bridge.registers import RegisterLink
from app.core.ring import SIZE

logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # every failure is raised as well, and said in our words

NUMBERED = True
PARAMETERS: Final = {"wear_length_1": 12, "wear_length_2": 13, "wear_length_3": 14, "wear_radius": 15}
"""Words for the offsets of an edge, and their numbers P as in $TC_DP: the mailbox carries them too."""
NAMESPACE: Final = 2
R_PARAMETERS: Final = "/Channel/Parameter/R"
EDGE_DATA: Final = "/Tool/Compensation/edgeData"
EDGE_SIZE: Final = "/Nck/Configuration/numCuttEdgeParams"
SERIAL: Final = "/Nck/State/hwProductSerialNr[1]"
PROGRAM_STATUS: Final = "/Channel/State/progStatus"
ACTIVE_TOOL: Final = "/Channel/State/actTNumber"
ABORTED: Final = 5
"""Status of a program that has ended or was reset; 1 interrupted, 2 stopped, 3 running, 4 waiting."""
SHOWN_WITHIN: Final = 1.0
"""s: a value that was written is shown after the control's next sampling tick."""
LOOK_EVERY: Final = 0.04  # s

T = TypeVar("T")
Codes = ua.StatusCodes
UNKNOWN = {
    Codes.BadNodeIdUnknown,
    Codes.BadNodeIdInvalid,
    Codes.BadAttributeIdInvalid,
    Codes.BadIndexRangeInvalid,
    Codes.BadIndexRangeNoData,
    Codes.BadOutOfRange,
}
FORBIDDEN = {
    Codes.BadUserAccessDenied,
    Codes.BadNotReadable,
    Codes.BadNotWritable,
    Codes.BadRequestNotAllowed,
    Codes.BadInternalError,  # what an 828D answers who has not signed in
}
LOGIN = {Codes.BadUserAccessDenied, Codes.BadIdentityTokenRejected, Codes.BadIdentityTokenInvalid}
NO_SESSION = {Codes.BadTooManySessions, Codes.BadMaxConnectionsReached, Codes.BadTcpNotEnoughResources}
NOT_IN_TIME = {Codes.BadCertificateTimeInvalid, Codes.BadCertificateIssuerTimeInvalid}
NOT_TRUSTED = {
    Codes.BadCertificateUntrusted,
    Codes.BadCertificateInvalid,
    Codes.BadCertificateChainIncomplete,
    Codes.BadCertificateUseNotAllowed,
    Codes.BadSecurityChecksFailed,
}


MEANING = ("channel", "tool_area")


class Settings(Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Address and login of a SINUMERIK, and the place of its block.

    url: of the OPC UA server, such as ``opc.tcp://192.168.214.1:4840``. user: set up at the control for the bridge;
    the password is one of password_env, password_file and password. certificate and key: files that ``inband bridge
    certificate`` makes; with them everything is signed and encrypted (Basic256Sha256). control_certificate: the control's,
    if no other shall be accepted. gud: the field of user data with the block. first_r: the block lies in R parameters from
    this one in place of user data. channel: of the user data or R parameters. tool_area: the TO area of the tools.
    serial: identifier of the serial number; left out, the hardware's is tried, then the name of the OPC UA server.
    """

    url: Annotated[str, Meta(pattern=r"^opc\.tcp://[^/\s@]+")]
    user: str | None = None
    password: str | None = None
    password_env: str | None = None
    password_file: str | None = None
    certificate: str | None = None
    key: str | None = None
    control_certificate: str | None = None
    gud: Annotated[str, Meta(pattern=r"^/NC/_N_(CH|NC)_GD\d_ACX/\w+$")] = "/NC/_N_CH_GD3_ACX/INBAND"
    first_r: Annotated[int, Meta(ge=0)] | None = None
    channel: Annotated[int, Meta(ge=1)] = 1
    tool_area: Annotated[int, Meta(ge=1)] = 1
    serial: str | None = None

    def beside(self, folder: Path, place: str, problems: list[str]) -> "Settings":
        """With files beside the configuration, and the password read; what is wrong is added to the problems."""
        given = [name for name in ("password", "password_env", "password_file") if getattr(self, name) is not None]
        if len(given) != (self.user is not None):
            problems.append(f"{place} needs user and one of password_env, password_file and password, or none of them.")
        if (self.certificate is None) != (self.key is None):
            problems.append(
                f"{place} needs both certificate and key, or none of them: “inband bridge certificate” makes both."
            )
        password = self.password
        if self.password_env is not None:
            password = os.environ.get(self.password_env)
            if not password:
                problems.append(f"{place}.password_env: the variable {self.password_env} is not set.")
        files = {}
        for name in ("password_file", "certificate", "key", "control_certificate"):
            if (file := getattr(self, name)) is not None:
                files[name] = str(folder / file)
                try:
                    content = (folder / file).read_bytes()
                    if name.endswith("certificate"):
                        uri_of(content)
                    elif name == "password_file":
                        password = content.decode().strip()
                except OSError as error:
                    problems.append(f"{place}.{name}: {folder / file} cannot be read: {error.strerror}.")
                except ValueError:
                    what = "no certificate" if name.endswith("certificate") else "no text in UTF-8"
                    problems.append(f"{place}.{name}: {folder / file} holds {what}.")
        return msgspec.structs.replace(self, password=password, password_env=None, **files)


def node_of(identifier: str) -> ua.NodeId:
    """The node of an identifier of the NC."""
    return ua.NodeId(ua.String(identifier), ua.Int16(NAMESPACE))


class NotKnown(Misconfigured):
    """The control does not know an identifier."""


def link(machine: Machine) -> RegisterLink:
    """The link to a SINUMERIK."""
    return RegisterLink(machine, SinumerikRegisters(machine))


class SinumerikRegisters:
    """Block, wear and state of a SINUMERIK, one OPC UA session."""

    whole = True

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.settings: Settings = machine.settings
        self._client: Client | None = None
        self._edge_size = 0
        self._requests: dict[str, ua.ReadRequest] = {}
        self._read: set[str] = set()
        """Identifiers of offsets that were read over this connection."""
        self._singly: set[str] = set()
        """Identifiers of several registers that the control does not know, while it knows each by itself."""

    # --- identifiers

    def block_id(self, first: int, count: int = 1) -> str:
        """The identifier of registers of the block, from a place that counts from 0."""
        settings = self.settings
        in_r = settings.first_r is not None
        start = first + (settings.first_r if settings.first_r is not None else 1)
        unit = f"u{settings.channel}," if in_r or settings.gud.startswith("/NC/_N_CH_") else ""
        array = f",#{count}" if count > 1 else ""
        return f"{R_PARAMETERS if in_r else settings.gud}[{unit}{start}{array}]"

    def offset_id(self, location: Location) -> str:
        """The identifier of a location's offset: parameters of all edges of a tool are in one row."""
        index = (location.edge - 1) * self._edge_size + self.parameter(location)
        return f"{EDGE_DATA}[u{self.settings.tool_area},c{location.tool},{index}]"

    def parameter(self, location: Location) -> int:
        """The number P of an offset, as in $TC_DP. Raises `Misconfigured` for a word that is not known."""
        number = PARAMETERS.get(location.register)
        if number is None:
            raise Misconfigured(
                f"register = {location.register!r} of tool memory {location.tool_memory} is not known for a SINUMERIK;"
                f" known are {', '.join(PARAMETERS)}."
            )
        return number

    def _state_id(self, name: str) -> str:
        return f"{name}[u{self.settings.channel},1]"

    # --- connection

    async def connect(self) -> str:
        """Connect, sign in, and read the serial number and the size of an edge."""
        await self.close()
        for location in self.machine.location:
            self.parameter(location)
        settings = self.settings
        client = Client(settings.url, timeout=max(self.machine.patience / 2, 1.0), watchdog_intervall=30.0)
        client.name = "Inband bridge"
        client.description = f"Inband bridge, {self.machine.key}"
        client.application_uri = "urn:inband:bridge"
        client.session_timeout = 60_000
        client.secure_channel_timeout = 3_600_000
        if settings.user is not None:
            client.set_user(settings.user)
            client.set_password(settings.password or "")
        try:
            if settings.certificate is not None and settings.key is not None:
                content = await asyncio.to_thread(Path(settings.certificate).read_bytes)
                client.application_uri = uri_of(content) or client.application_uri
                await client.set_security(
                    SecurityPolicyBasic256Sha256,
                    settings.certificate,
                    settings.key,
                    server_certificate=settings.control_certificate,
                )
            async with asyncio.timeout(self.machine.patience * 0.8):  # so that it hears what is asked for in vain
                await client.connect()
        except BaseException as error:
            client.disconnect_socket()
            if isinstance(error, Exception):
                raise self._not_connected(error) from error
            raise
        self._client = client
        identity = await self._identity()
        if self.machine.location:
            self._edge_size = await self._size_of_edge()
        return identity

    async def close(self) -> None:
        """Close the session, so that the control has it free for others; never raises."""
        client, self._client = self._client, None
        self._read.clear()
        if client is not None:
            try:
                async with asyncio.timeout(2.0):
                    await client.disconnect()
            except Exception:  # noqa: BLE001 - the connection may be gone already
                client.disconnect_socket()
            except BaseException:
                client.disconnect_socket()
                raise

    async def _identity(self) -> str:
        """The serial number; without a configured identifier the server's name where there is none."""
        wanted = self.settings.serial
        try:
            serial = str(await self._value(wanted or SERIAL)).strip()
        except Misconfigured:
            if wanted:
                raise
            serial = ""
        if not serial and not wanted:
            [found] = await self._ask([ua.NodeId(ua.Int32(ua.ObjectIds.Server_ServerArray))])
            names = found.Value.Value if found.Value is not None else None
            serial = str(names[0]) if isinstance(names, list) and names else ""
        if not serial:
            raise Misconfigured(f"The control answers no serial number at {wanted or SERIAL}: name another identifier.")
        return serial

    async def shown_time(self) -> datetime | None:
        """The time of the server in the control, as local time of the bridge's computer."""
        [found] = await self._ask([ua.NodeId(ua.Int32(ua.ObjectIds.Server_ServerStatus_CurrentTime))])
        shown = found.Value.Value if found.Value is not None else None
        return shown.replace(tzinfo=UTC).astimezone().replace(tzinfo=None) if isinstance(shown, datetime) else None

    async def _size_of_edge(self) -> int:
        """The number of parameters of an edge: 25 on old software, 34 or more on newer; read, never assumed."""
        size = _number(await self._value(EDGE_SIZE), EDGE_SIZE)
        if size != round(size) or not max(PARAMETERS.values()) <= size <= 200:
            raise Misconfigured(
                f"{EDGE_SIZE} answers {size:g}, which cannot be the number of parameters of an edge. Nothing is read from or"
                " written to tools."
            )
        return round(size)

    def _not_connected(self, error: Exception) -> LinkError:
        settings, key = self.settings, self.machine.key
        code = getattr(error, "code", None)
        shown = settings.certificate or "certificate"
        if isinstance(error, OSError | TimeoutError) or (code is None and isinstance(error, ConnectionError)):
            other = (
                " Does it still have the certificate of control_certificate?" if settings.control_certificate else ""
            )
            return ControlAway(
                f"No OPC UA server answers at {settings.url} ({_words(error)}). Look at the address, the cable, the firewall"
                f" of the control (port 4840), and whether OPC UA is switched on there.{other}"
            )
        if code in NO_SESSION:
            return ControlAway(
                f"The control has no session free: an 828D has 5, an 840D sl 10. Close other OPC UA clients of {key}; a session"
                " that was not closed ends after 60 s."
            )
        if code in NOT_IN_TIME:
            return Misconfigured(
                f"The control says that {shown} is not valid at its time. Compare its clock (Start-up, HMI, Date/Time) with"
                " the certificate, and set the clock; or make a new certificate with “inband bridge certificate”."
            )
        if code == Codes.BadCertificateUriInvalid:
            return Misconfigured(
                f"The control finds another URI in {shown} than the bridge says: make a new certificate with “inband bridge"
                " certificate”."
            )
        if code in NOT_TRUSTED:
            return Misconfigured(
                f"The control does not trust {shown} ({_words(error)}). At the panel: Start-up, Network, OPC UA, certificates;"
                " choose “Inband bridge” among the rejected ones and trust it. Look at the control's clock too."
            )
        if code in LOGIN:
            named = f"user {settings.user!r}" if settings.user else "a client that does not sign in"
            return Misconfigured(
                f"The control refuses {named}. Look at user and password in machine.{key}.opcua; a new user has the"
                " user name as password until it is changed with ChangeMyPassword."
            )
        if isinstance(error, UaError) and "No matching endpoints" in str(error):
            return Misconfigured(
                f"{settings.url} does not offer Basic256Sha256 with Sign & Encrypt, as machine.{key}.opcua.certificate asks"
                " for. Switch it on at the control (Start-up, Network, OPC UA)."
                if settings.certificate
                else f"{settings.url} accepts encrypted connections only. Make a certificate with “inband bridge certificate”,"
                f" and name it in machine.{key}.opcua (certificate, key)."
            )
        if isinstance(error, ValueError | TypeError):
            return Misconfigured(f"certificate and key of machine.{key}.opcua cannot be used: {_words(error)}.")
        return ControlAway(f"{settings.url} breaks the connection off: {_words(error)}.")

    # --- registers

    async def read(self, places: Sequence[int]) -> list[float]:
        """Registers of the block, by one read of all from the first to the last."""
        first, count = min(places), max(places) - min(places) + 1
        identifier = self.block_id(first, count)
        values = await self._at_once_or_singly(identifier, first, count)
        if len(values) != count:
            raise Misconfigured(
                f"{identifier} answers {len(values)} values in place of {count}: the field has to have {SIZE} elements"
                f" (DEF CHAN REAL INBAND[{SIZE}])."
            )
        numbers = values if set(map(type, values)) == {float} else [_number(value, identifier) for value in values]
        return numbers if len(places) == count else [numbers[place - first] for place in places]

    async def _at_once_or_singly(self, identifier: str, first: int, count: int) -> list[Any]:
        if identifier not in self._singly:
            try:
                return await self._values(identifier)
            except NotKnown as error:
                if count == 1:
                    raise
                unknown = error
        singles = [self.block_id(place) for place in range(first, first + count)]
        found = await self._ask([node_of(each) for each in singles])
        try:
            values = [self._good(each, single) for each, single in zip(found, singles, strict=True)]
        except NotKnown:
            if identifier in self._singly:
                raise
            raise unknown from None
        self._singly.add(identifier)
        return values

    async def write(self, place: int, value: float) -> None:
        """Write one register."""
        await self._set(self.block_id(place), value)

    async def shown(self, place: int, value: float) -> None:
        """Wait until the control shows a register."""
        await self._shown(self.block_id(place), value)

    async def read_offset(self, location: Location) -> float | None:
        """The wear of an edge."""
        identifier = self.offset_id(location)
        value = _number(await self._value(identifier), identifier)
        self._read.add(identifier)
        return value

    async def write_offset(self, location: Location, value: float) -> None:
        """Set the wear of an edge, if it was read over the same connection."""
        identifier = self.offset_id(location)
        if identifier not in self._read:
            raise ControlAway(f"{identifier} was not read since the connection was made: it is not written blindly.")
        await self._set(identifier, value)
        await self._shown(identifier, value)

    async def against_writing(self, location: Location) -> str | None:
        """The reason while a program that has not ended has the tool in use."""
        status, tool = self._state_id(PROGRAM_STATUS), self._state_id(ACTIVE_TOOL)
        states = [_number(await self._value(each), each) for each in (status, tool)]
        if states[0] != ABORTED and states[1] == location.tool:
            return f"Tool {location.tool} is in use by a program that has not ended: its wear is not written now."
        return None

    # --- requests

    async def _values(self, identifier: str) -> list[Any]:
        """The values of a field; a request that comes again is put together once, an answer with numbers read at once."""
        request = self._requests.get(identifier)
        if request is None:
            request = self._requests[identifier] = ua.ReadRequest(Parameters=_parameters([node_of(identifier)]))
        request.RequestHeader.Timestamp = datetime.now(UTC)
        answer = await self._sent(answered(self._connected().uaclient.session, request))
        if isinstance(answer, tuple):
            return list(answer)
        found = self._good(answer, identifier)
        return list(found) if isinstance(found, list | tuple) else [found]

    async def _value(self, identifier: str) -> object:
        """The value behind an identifier."""
        [found] = await self._ask([node_of(identifier)])
        return self._good(found, identifier)

    def _good(self, found: ua.DataValue, identifier: str) -> object:
        code = found.StatusCode.value if found.StatusCode is not None else 0
        if code and not ua.StatusCode(ua.UInt32(code)).is_good():
            raise self._refused(identifier, code, "read")
        return found.Value.Value if found.Value is not None else None

    async def _ask(self, nodes: Sequence[ua.NodeId]) -> list[ua.DataValue]:
        return await self._sent(self._connected().uaclient.session.read(_parameters(nodes)))

    async def _set(self, identifier: str, value: float) -> None:
        """Write a value without time stamps, which controls refuse."""
        wanted = ua.WriteValue(
            NodeId=node_of(identifier),
            AttributeId=ua.AttributeIds.Value,
            Value=ua.DataValue(ua.Variant(float(value), ua.VariantType.Double)),
        )
        request = ua.WriteParameters(NodesToWrite=[wanted])
        [status] = await self._sent(self._connected().uaclient.session.write(request))
        if not status.is_good():
            raise self._refused(identifier, status.value, "write")

    async def _shown(self, identifier: str, value: float) -> None:
        for _ in range(round(SHOWN_WITHIN / LOOK_EVERY)):
            if abs(_number(await self._value(identifier), identifier) - value) <= 1e-7 * max(1.0, abs(value)):
                return
            await asyncio.sleep(LOOK_EVERY)

    async def _sent(self, request: Awaitable[T]) -> T:
        try:
            return await request
        except (OSError, TimeoutError, UaError) as error:
            code = getattr(error, "code", None)
            if code in FORBIDDEN:
                raise self._refused("anything", code, "read") from error
            raise ControlAway(f"The connection to {self.settings.url} is lost: {_words(error)}.") from error

    def _connected(self) -> Client:
        if self._client is None:
            raise ControlAway(f"There is no connection to {self.settings.url}.")
        return self._client

    def _refused(self, identifier: str, code: int, verb: str) -> LinkError:
        name = _name(code)
        if code in UNKNOWN:
            return NotKnown(
                f"The control does not know {identifier} ({name}). {_hint(identifier)} Capital letters count; there is no"
                " blank before “[”."
            )
        if code in FORBIDDEN:
            who = f"User {self.settings.user!r}" if self.settings.user else "A client that does not sign in"
            given = self.settings.user or "inband"
            return Misconfigured(
                f"{who} may not {verb} {identifier} ({name}). As administrator of the OPC UA server call"
                f' GiveUserAccess("{given}", "{_realms(identifier, verb)}") with any OPC UA client.'
            )
        return ControlAway(f"The control does not {verb} {identifier}: {name}.")


def _parameters(nodes: Sequence[ua.NodeId]) -> ua.ReadParameters:
    return ua.ReadParameters(
        TimestampsToReturn=ua.TimestampsToReturn.Neither,
        NodesToRead=[ua.ReadValueId(NodeId=node, AttributeId=ua.AttributeIds.Value) for node in nodes],
    )


def _name(code: int) -> str:
    return ua.StatusCode(ua.UInt32(code)).name


def _number(value: object, identifier: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Misconfigured(f"{identifier} holds {value!r}, which is not a number.")
    return float(value)


def _words(error: Exception) -> str:
    code = getattr(error, "code", None)
    if code is not None:
        return ua.StatusCode(ua.UInt32(code)).name
    return str(error) or type(error).__name__


def _hint(identifier: str) -> str:
    if identifier.startswith("/Tool/"):
        return "Is there such a tool, by its internal T number, and such an edge?"
    if identifier.startswith("/NC/"):
        return f"Is INBAND[{SIZE}] defined (UGUD.DEF is GD3, MGUD.DEF is GD2), and active? Older ring programs had 96."
    if identifier.startswith(R_PARAMETERS):
        return "Has the channel that many R parameters (MD 28050)?"
    return "Look for a typing error."


def _realms(identifier: str, verb: str) -> str:
    if identifier.startswith("/Tool/"):
        realm = "Tool"
    elif identifier.startswith("/NC/"):
        realm = "Gud"
    elif identifier == "anything":
        return "StateRead; ToolRead; ToolWrite; GudRead; GudWrite"
    else:
        realm = "State"
    return f"{realm}Read; {realm}Write" if verb == "write" else f"{realm}Read"
