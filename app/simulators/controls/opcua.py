"""A simulated SINUMERIK behind OPC UA: the model of a machine, and what the manual says of the control's server.

* The state of the NC is copied every 100 ms; anyone who reads in between reads the state before, his own writes too.
* Browsing shows the first element of each array; other identifiers are composed, and have no node.
* ``X[u1,1,12]`` and ``X[u1,1,#12]`` are rows 1 to 12, an array. What the machine does not have reads BadAttributeIdInvalid,
  what is mistyped BadNodeIdUnknown.
* Five sessions, which last 60 s. A user may do nothing until the administrator has called GiveUserAccess.
* Certificates of clients are trusted one by one, or all; the control's clock decides whether they are valid.
* A write with a time stamp is refused, and one that is no Double.

Not as at the control: identifiers that are composed cannot be subscribed to.
"""

import asyncio
import re
from collections.abc import Iterator
from contextlib import suppress
from copy import copy
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

from asyncua import Server, ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.address_space import NodeData
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from cryptography import x509

from app.bridge.certificates import new_pair, read_certificate
from app.bridge.kinds.opcua import (
    ACTIVE_TOOL,
    EDGE_DATA,
    EDGE_SIZE,
    NAMESPACE,
    PARAMETERS,
    PROGRAM_STATUS,
    R_PARAMETERS,
    SERIAL,
    node_of,
)
from app.core.ring import SIZE, Unit
from app.simulators.controls.model import Model

TICK: Final = 0.1  # s
SESSIONS: Final = 5
GUD: Final = "/NC/_N_CH_GD3_ACX/INBAND"
NUMBER_OF_R: Final = 1000
ADMINISTRATOR: Final = "admin"
BRIDGE: Final = "inband"
PASSWORD: Final = "simulated"  # noqa: S105 - of a machine that does not exist
RIGHTS: Final = "StateRead; ToolRead; ToolWrite; GudRead; GudWrite; StateWrite"
GIVE: Final = "/Methods/GiveUserAccess"
FORM: Final = re.compile(r"(?P<path>/[\w/]+)(\[(?P<index>[^\]]*)\])?")
INDEX: Final = re.compile(r"((?P<unit>u\d+)(, ?|$))?((?P<column>c\d+)(, ?|$))?((?P<first>\d+)(, ?(?P<last>#?\d+))?)?")
WORDS: Final = {number: word for word, number in PARAMETERS.items()}
OLD_EDGE_DATA: Final = "/Tool/Compensation/cuttEdgeParam"
STANDARD: Final[dict[ua.NodeId, NodeData]] = {}
CURRENT_TIME: Final = ua.NodeId(ua.Int32(ua.ObjectIds.Server_ServerStatus_CurrentTime))
ANYBODY: Final = User(role=UserRole.Anonymous)
Codes = ua.StatusCodes


class Nc:
    """The NC as the server shows it: a copy of the model from the last tick.

    edge_size: parameters of an edge. first_r: the block lies in R parameters from this one too. others: numbers of tools and
    R parameters that are not the model's.
    """

    def __init__(self, model: Model, edge_size: int, first_r: int | None) -> None:
        self.model = model
        self.edge_size = edge_size
        self.first_r = first_r
        self.others: dict[tuple[str, int], float] = {}
        self.copy()

    def copy(self) -> None:
        """Take over the model's state."""
        model = self.model
        self.registers = list(model.registers)
        self.offsets = dict(model.offsets)
        self.running = model.running
        self.tool = model.tool_in_spindle
        self.shown = dict(self.others)

    def read(self, identifier: str) -> ua.Variant:
        """The value behind an identifier. Raises `ServiceError`."""
        path, column, first, last = _parsed(identifier)
        if path == SERIAL.partition("[")[0]:
            return ua.Variant(self.model.serial, ua.VariantType.String)
        cells = self._cells(path, column)
        if first not in cells or last not in cells:
            raise ServiceError(Codes.BadAttributeIdInvalid)
        values = [cells[place] for place in range(first, last + 1)]
        return ua.Variant(values if last > first else values[0], ua.VariantType.Double)

    def write(self, identifier: str, value: ua.DataValue) -> None:
        """Set one number of the model. Raises `ServiceError`."""
        path, column, place, last = _parsed(identifier)
        if path == SERIAL.partition("[")[0]:
            raise ServiceError(Codes.BadNotWritable)
        if place not in self._cells(path, column) or last != place:
            raise ServiceError(Codes.BadAttributeIdInvalid)
        if value.SourceTimestamp is not None or value.ServerTimestamp is not None:
            raise ServiceError(Codes.BadWriteNotSupported)
        if value.Value is None or value.Value.VariantType != ua.VariantType.Double or value.Value.is_array:
            raise ServiceError(Codes.BadTypeMismatch)
        number = float(value.Value.Value)
        if path == GUD:
            self.model.registers[place - 1] = number
        elif path == R_PARAMETERS:
            if self.first_r is not None and 0 <= place - self.first_r < SIZE:
                self.model.registers[place - self.first_r] = number
            else:
                self.others[path, place] = number
        elif path in {EDGE_DATA, OLD_EDGE_DATA}:
            offset = (column, *self._edge_and_word(place))
            if offset in self.model.offsets:
                self.model.offsets[offset] = number
            else:
                self.others[f"c{column}", place] = number
        else:
            raise ServiceError(Codes.BadNotWritable)

    def _cells(self, path: str, column: int) -> dict[int, float]:
        if path == GUD:
            return dict(enumerate(self.registers, 1))
        if path == R_PARAMETERS:
            cells = {place: self.shown.get((path, place), 0.0) for place in range(NUMBER_OF_R)}
            if self.first_r is not None:
                cells |= dict(enumerate(self.registers, self.first_r))
            return cells
        if path in {EDGE_DATA, OLD_EDGE_DATA}:
            return self._tool(column)
        single = {
            EDGE_SIZE: float(self.edge_size),
            PROGRAM_STATUS: 3.0 if self.running else 5.0,
            ACTIVE_TOOL: float(self.tool),
        }
        if path not in single:
            raise ServiceError(Codes.BadNodeIdUnknown)
        return {1: single[path]}

    def _tool(self, tool: int) -> dict[int, float]:
        edges = [edge for number, edge, _ in self.offsets if number == tool]
        if not edges:
            return {}
        cells = {place: self.shown.get((f"c{tool}", place), 0.0) for place in range(1, max(edges) * self.edge_size + 1)}
        for place in cells:
            offset = (tool, *self._edge_and_word(place))
            if offset in self.offsets:
                cells[place] = self.offsets[offset]
        return cells

    def _edge_and_word(self, place: int) -> tuple[int, str]:
        edge, parameter = divmod(place - 1, self.edge_size)
        return edge + 1, WORDS.get(parameter + 1, "")


def _parsed(identifier: str) -> tuple[str, int, int, int]:
    """Path, column, first and last row of an identifier. Raises `ServiceError`."""
    form = FORM.fullmatch(identifier)
    index = INDEX.fullmatch(form["index"] or "") if form else None
    if form is None or index is None:
        raise ServiceError(Codes.BadNodeIdUnknown)
    if index["unit"] not in {None, "u1"}:
        raise ServiceError(Codes.BadAttributeIdInvalid)
    first = int(index["first"] or 1)
    last = index["last"] or str(first)
    end = first + int(last[1:]) - 1 if last.startswith("#") else int(last)
    return form["path"], int((index["column"] or "c1")[1:]), first, end


def _realm(identifier: str) -> str:
    if identifier.startswith("/NC/"):
        return "Gud"
    return "Tool" if identifier.startswith("/Tool/") else "State"


class Control(InternalServer):
    """The server's inside: sessions, users, certificates."""

    def __init__(self, nc: Nc) -> None:
        super().__init__(user_manager=self)  # type: ignore[arg-type] # it has get_user
        self.nc = nc
        self.users = {ADMINISTRATOR: PASSWORD, BRIDGE: PASSWORD}
        self.rights: dict[str, set[str]] = {ADMINISTRATOR: {"StateRead", "ToolRead", "GudRead"}}
        self.trusted: set[bytes] | None = None
        self.sessions = SESSIONS
        self.disabled_clock = True
        self.max_session_timeout_ms = 60_000
        self.certificate_validator = self.judge

    async def load_standard_address_space(self, shelffile: Path | None = None) -> None:
        """Fill in the nodes that every server has: made once for all simulated controls of the process, and copied."""
        if not STANDARD:
            await super().load_standard_address_space(shelffile)
            STANDARD.update(self.aspace._nodes)  # noqa: SLF001 - there is no other way to make them once only
        self.aspace._nodes = _Nodes()  # noqa: SLF001

    def get_user(
        self, iserver: InternalServer, username: str | None = None, password: str | None = None, certificate: Any = None
    ) -> User | None:
        """The user who signs in, None if the password is wrong; without a name he has no rights."""
        if username is None:
            return User(role=UserRole.User)
        return User(role=UserRole.User, name=username) if self.users.get(username) == password else None

    async def judge(self, certificate: x509.Certificate, application: ua.ApplicationDescription) -> None:
        """Refuse a client's certificate that is not trusted, not valid at the control's time, or of another URI."""
        now = datetime.now(UTC) + timedelta(seconds=self.nc.model.clock_ahead)
        if not certificate.not_valid_before_utc <= now <= certificate.not_valid_after_utc:
            raise ServiceError(Codes.BadCertificateTimeInvalid)
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        if application.ApplicationUri not in names.get_values_for_type(x509.UniformResourceIdentifier):
            raise ServiceError(Codes.BadCertificateUriInvalid)
        if self.trusted is not None and certificate not in [read_certificate(each) for each in self.trusted]:
            raise ServiceError(Codes.BadCertificateUntrusted)

    def add_endpoint(self, endpoint: ua.EndpointDescription) -> None:
        """Offer an endpoint: passwords are encrypted where messages are, else some clients refuse to sign in."""
        for token in endpoint.UserIdentityTokens:
            if (
                token.TokenType == ua.UserTokenType.UserName
                and endpoint.SecurityMode == ua.MessageSecurityMode.SignAndEncrypt
            ):
                token.SecurityPolicyUri = endpoint.SecurityPolicyUri
        super().add_endpoint(endpoint)

    def create_session(
        self,
        name: str,
        user: User = ANYBODY,
        external: bool = False,
    ) -> InternalSession:
        """A session of a client, if one is free."""
        if external and len(self._external_sessions) >= self.sessions:
            raise ServiceError(Codes.BadTooManySessions)
        return Session(self, self.aspace, self.subscription_service, name, user=user, external=external)

    def give(self, user: str, realms: str) -> None:
        """Give a user rights: realms with ``;`` between them."""
        self.rights.setdefault(user, set()).update(each.strip() for each in realms.split(";"))


class _Nodes(dict[ua.NodeId, NodeData]):
    """Nodes of one server: those that every server has are copied when they are asked for."""

    def __missing__(self, identifier: ua.NodeId) -> NodeData:
        node = STANDARD[identifier]
        self[identifier] = new = copy(node)
        new.references = list(node.references)
        new.attributes = {name: copy(attribute) for name, attribute in node.attributes.items()}
        for attribute in new.attributes.values():
            attribute.datachange_callbacks = {}
        return new

    def __contains__(self, identifier: object) -> bool:
        return super().__contains__(identifier) or identifier in STANDARD

    def get(self, identifier: ua.NodeId, default: Any = None) -> Any:
        try:
            return self[identifier]
        except KeyError:
            return default


class Session(InternalSession):
    """A session: identifiers of the NC are answered from its copy, by the user's rights."""

    iserver: Control

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        """The NC's values; the server's own nodes as usual."""
        if not self.external:
            return await super().read(params)
        found = []
        for each in params.NodesToRead:
            if each.NodeId == CURRENT_TIME:
                ahead = timedelta(seconds=self.iserver.nc.model.clock_ahead)
                found.append(ua.DataValue(ua.Variant(datetime.now(UTC) + ahead, ua.VariantType.DateTime)))
                continue
            if not _of_nc(each.NodeId) or each.AttributeId != ua.AttributeIds.Value:
                rest = replace(params, NodesToRead=[each])
                found += await super().read(rest)
                continue
            try:
                self._allowed(each.NodeId.Identifier, "Read")
                found.append(ua.DataValue(self.iserver.nc.read(each.NodeId.Identifier)))
            except ServiceError as error:
                found.append(ua.DataValue(StatusCode=ua.StatusCode(ua.UInt32(error.code))))
        return found

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Set the NC's values."""
        if not self.external:
            return await super().write(params)
        return [self._written(each) for each in params.NodesToWrite]

    def _written(self, each: ua.WriteValue) -> ua.StatusCode:
        if not _of_nc(each.NodeId):
            return ua.StatusCode(ua.UInt32(Codes.BadNotWritable))
        try:
            self._allowed(each.NodeId.Identifier, "Write")
            self.iserver.nc.write(each.NodeId.Identifier, each.Value)
        except ServiceError as error:
            return ua.StatusCode(ua.UInt32(error.code))
        return ua.StatusCode()

    def _allowed(self, identifier: str, verb: str) -> None:
        name = self.user.name
        if name is None:
            raise ServiceError(Codes.BadRequestNotAllowed)
        if not self.iserver.rights.get(name, set()) & {f"{_realm(identifier)}{verb}", f"Sinu{verb}All"}:
            raise ServiceError(Codes.BadUserAccessDenied)

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """GiveUserAccess, for the administrator."""
        return [self._called(each) for each in params]

    def _called(self, each: ua.CallMethodRequest) -> ua.CallMethodResult:
        code = Codes.Good
        values = [argument.Value for argument in each.InputArguments]
        if each.MethodId.Identifier != GIVE:
            code = Codes.BadMethodInvalid
        elif self.user.name != ADMINISTRATOR or len(values) != 2 or not all(isinstance(value, str) for value in values):
            code = Codes.BadInvalidArgument
        else:
            self.iserver.give(*values)
        return ua.CallMethodResult(StatusCode=ua.StatusCode(ua.UInt32(code)))


def _of_nc(node: ua.NodeId) -> bool:
    return node.NamespaceIndex == NAMESPACE and isinstance(node.Identifier, str)


class SimulatedSinumerik:
    """A control that is running. control: its inside, for tests."""

    def __init__(self, server: Server, control: Control, port: int) -> None:
        self.server = server
        self.control = control
        self.port = port
        self.nodes: dict[str, Any] = {}
        self._ticking: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to copy the NC's state."""
        self._ticking = asyncio.create_task(self._tick())

    async def _tick(self) -> None:
        while True:
            self.control.nc.copy()
            for identifier, node in self.nodes.items():
                with suppress(ServiceError):
                    await node.write_value(self.control.nc.read(identifier))
            await asyncio.sleep(TICK)

    def table(self) -> dict[str, object]:
        """The machine's table in the configuration."""
        model = self.control.nc.model
        settings: dict[str, object] = {
            "url": f"opc.tcp://127.0.0.1:{self.port}",
            "user": BRIDGE,
            "password": PASSWORD,
        }
        if self.control.nc.first_r is not None:
            settings["first_r"] = self.control.nc.first_r
        return {
            "kind": "opcua",
            "unit": "inch" if model.unit == Unit.INCH else "mm",
            "secret": "key-of-the-machine-at-the-server",
            "identity": model.serial,
            "characteristics": {str(each.number): f"shaft-{each.number}" for each in model.features},
            "opcua": settings,
            "location": [
                {
                    "tool_memory": each.tool,
                    "tool": each.tool,
                    "edge": each.edge,
                    "register": each.register,
                    "holds": each.holds,
                    "sign": each.sign,
                }
                for each in model.places
            ],
        }

    def cut(self) -> None:
        """Break every connection off, as if the cable were pulled."""
        for transport in list(self.control.asyncio_transports):
            transport.abort()

    async def hold(self) -> None:
        """Copy the NC's state no more, until `start`."""
        if self._ticking is not None:
            self._ticking.cancel()
            await asyncio.gather(self._ticking, return_exceptions=True)

    async def stop(self) -> None:
        """End it."""
        await self.hold()
        await self.server.stop()


async def serve(
    model: Model, port: int, *, edge_size: int = 34, first_r: int | None = None, secure: bool = True
) -> SimulatedSinumerik:
    """Start a simulated SINUMERIK on a port of this machine; 0 for a free one.

    edge_size: parameters of an edge. first_r: the block lies in R parameters from this one too. secure: connections may be
    encrypted (it makes a certificate at the start).
    """
    # what NC programs of a SINUMERIK write into the mailbox is the parameter P of $TC_DP
    model.features = tuple(replace(each, parameter=PARAMETERS.get(each.register, 1)) for each in model.features)
    control = Control(Nc(model, edge_size, first_r))
    control.give(BRIDGE, RIGHTS)
    server = Server(iserver=control)
    await server.init()
    await server.set_application_uri("urn:inband:simulated:sinumerik")
    server.name = "Simulated SINUMERIK"
    server.set_endpoint(f"opc.tcp://127.0.0.1:{port}")
    policies = [ua.SecurityPolicyType.NoSecurity]
    if secure:
        pair = await asyncio.to_thread(new_pair, "Simulated SINUMERIK", "localhost", "urn:inband:simulated:sinumerik")
        await server.load_certificate(pair.certificate, "der")
        await server.load_private_key(pair.key, None, "pem")
        policies.append(ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt)
    server.set_security_policy(policies)
    await server.register_namespace("SinumerikVarProvider")
    simulator = SimulatedSinumerik(server, control, port)
    simulator.nodes = await _browsable(server, control.nc)
    await server.start()
    assert server.bserver is not None
    simulator.port = server.bserver.port
    simulator.start()
    return simulator


async def _browsable(server: Server, nc: Nc) -> dict[str, Any]:
    """Nodes for the first element of what the control has: all that browsing shows."""
    root = await server.nodes.objects.add_folder(node_of("/"), ua.QualifiedName("Sinumerik", NAMESPACE))
    nodes = {}
    for identifier in _firsts(nc):
        name = ua.QualifiedName(identifier.rpartition("/")[2], NAMESPACE)
        nodes[identifier] = await root.add_variable(node_of(identifier), name, nc.read(identifier))
    return nodes


def _firsts(nc: Nc) -> Iterator[str]:
    for identifier in (R_PARAMETERS, GUD, EDGE_SIZE, PROGRAM_STATUS, ACTIVE_TOOL, SERIAL.partition("[")[0], EDGE_DATA):
        with suppress(ServiceError):
            nc.read(identifier)
            yield identifier
