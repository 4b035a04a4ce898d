"""Many simulated SINUMERIKs in one process, at a cost that leaves the machine to what is measured.

Each has a model of a machine and an address of its own, and answers as `app.simulators.controls.opcua` does, from a copy of the
NC that is made every 100 ms; without users, rights and encryption. The answer to a read of the whole block, which is nearly all
that is asked, is put together by hand: some 30 µs. Everything else goes the usual way through asyncua.
"""

import asyncio
import struct
from datetime import UTC, datetime
from typing import Any, Final

from asyncua import ua
from asyncua.common.utils import Buffer, ServiceError
from asyncua.ua import ua_binary

from app.core.ring import SIZE
from app.simulators.controls.model import Model
from app.simulators.controls.opcua import GUD, TICK, Nc, SimulatedSinumerik

HEADER: Final = struct.Struct("<3scIIIII")
"""Of a chunk: kind, whether it is the last, size, channel, token, number, request."""
CHANNEL: Final = 7
TOKEN: Final = ua.NodeId(ua.Int32(4711))  # a session's: four bytes
SKIPPED: Final = 31
"""Bytes of a request's header after its type: token, time, handle, diagnostics, audit entry, patience, and nothing more."""
READ, READ_ANSWER, WRITE = 631, b"\x01\x00\x7a\x02", 673
BLOCK: Final = f"{GUD}[u1,1,#{SIZE}]"
NONE_POLICY: Final = "http://opcfoundation.org/UA/SecurityPolicy#None"


def now() -> int:
    """The time as OPC UA counts it: steps of 100 ns since 1601."""
    return int(datetime.now(UTC).timestamp() * 1e7) + 116_444_736_000_000_000


class FastSinumerik(asyncio.Protocol):
    """One connection to one control."""

    def __init__(self, nc: Nc, url: str) -> None:
        self.nc = nc
        self.url = url
        self.data = b""
        self.number = 0
        self.block = b""  # the request's words that ask for the whole block

    def connection_made(self, transport: Any) -> None:
        """Begin."""
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        """Take requests, whole or in pieces."""
        self.data += data
        while len(self.data) >= 8:
            size = int.from_bytes(self.data[4:8], "little")
            if len(self.data) < size:
                return
            message, self.data = self.data[:size], self.data[size:]
            self.answer(message)

    def answer(self, message: bytes) -> None:
        """Answer one chunk."""
        kind = message[:3]
        if kind == b"MSG":
            request = message[20:24]
            if self.block and message.endswith(self.block):
                self.send(request, self.fast(message[24 + 4 + 4 + 8 : 24 + 4 + 4 + 12]))
            else:
                self.send(request, self.slow(message[24:]))
        elif kind == b"HEL":
            acknowledge = ua.Acknowledge(ua.UInt32(0), ua.UInt32(65535), ua.UInt32(65535))
            answer = ua_binary.uatcp_to_binary(ua.MessageType.Acknowledge, acknowledge)  # type: ignore[arg-type]
            self.transport.write(answer)
        elif kind == b"OPN":
            self.open(message)
        else:
            self.transport.close()

    def open(self, message: bytes) -> None:
        """A channel without security."""
        data = Buffer(message[12:])
        security = ua_binary.struct_from_binary(ua.AsymmetricAlgorithmHeader, data)
        sequence = ua_binary.struct_from_binary(ua.SequenceHeader, data)
        request = ua_binary.struct_from_binary(ua.OpenSecureChannelRequest, data)
        answer = ua.OpenSecureChannelResponse()
        answer.ResponseHeader.RequestHandle = request.RequestHeader.RequestHandle
        answer.ResponseHeader.Timestamp = datetime.now(UTC)
        token = answer.Parameters.SecurityToken
        token.ChannelId, token.TokenId = ua.UInt32(CHANNEL), ua.UInt32(13)
        token.CreatedAt, token.RevisedLifetime = datetime.now(UTC), request.Parameters.RequestedLifetime
        self.number += 1
        body = ua_binary.struct_to_binary(security)
        body += struct.pack("<II", self.number, sequence.RequestId) + ua_binary.struct_to_binary(answer)
        self.transport.write(b"OPNF" + struct.pack("<II", 12 + len(body), CHANNEL) + body)

    def send(self, request: bytes, body: bytes) -> None:
        """Send an answer in one chunk."""
        self.number += 1
        self.transport.write(
            HEADER.pack(b"MSG", b"F", 24 + len(body), CHANNEL, 13, self.number, int.from_bytes(request, "little"))
            + body
        )

    def fast(self, handle: bytes) -> bytes:
        """The whole block."""
        numbers = self.nc.registers
        head = READ_ANSWER + struct.pack("<q", now()) + handle + b"\0\0\0\0" + b"\0" + b"\0\0\0\0" + b"\0\0\0"
        return head + struct.pack(f"<iBBi{SIZE}dIi", 1, 3, 0x8B, SIZE, *numbers, 0, 0)

    def slow(self, body: bytes) -> bytes:
        """Everything else."""
        data = Buffer(body)
        kind = ua_binary.nodeid_from_binary(data.copy())
        name = {
            READ: "Read",
            WRITE: "Write",
            ua.ObjectIds.CreateSessionRequest_Encoding_DefaultBinary: "CreateSession",
            ua.ObjectIds.ActivateSessionRequest_Encoding_DefaultBinary: "ActivateSession",
            ua.ObjectIds.CloseSessionRequest_Encoding_DefaultBinary: "CloseSession",
            ua.ObjectIds.GetEndpointsRequest_Encoding_DefaultBinary: "GetEndpoints",
        }[int(kind.Identifier)]
        request = ua_binary.struct_from_binary(getattr(ua, f"{name}Request"), data)
        answer: Any = getattr(ua, f"{name}Response")()
        answer.ResponseHeader.RequestHandle = request.RequestHeader.RequestHandle
        answer.ResponseHeader.Timestamp = datetime.now(UTC)
        if name == "Read":
            answer.Results = [self.read(each.NodeId) for each in request.Parameters.NodesToRead]
            if [each.NodeId.Identifier for each in request.Parameters.NodesToRead] == [BLOCK]:
                self.block = body[4 + SKIPPED :]
        elif name == "Write":
            answer.Results = [self.write(each) for each in request.Parameters.NodesToWrite]
        elif name == "CreateSession":
            answer.Parameters.SessionId = answer.Parameters.AuthenticationToken = TOKEN
            answer.Parameters.RevisedSessionTimeout = request.Parameters.RequestedSessionTimeout
            answer.Parameters.ServerEndpoints = [self.endpoint()]
        elif name == "GetEndpoints":
            answer.Endpoints = [self.endpoint()]
        return ua_binary.struct_to_binary(answer)

    def endpoint(self) -> ua.EndpointDescription:
        """The only way in: no security, nobody signs in."""
        policy = ua.UserTokenPolicy("anonymous", ua.UserTokenType.Anonymous)
        return ua.EndpointDescription(
            EndpointUrl=self.url,
            SecurityMode=ua.MessageSecurityMode.None_,
            SecurityPolicyUri=NONE_POLICY,
            UserIdentityTokens=[policy],
        )

    def read(self, node: ua.NodeId) -> ua.DataValue:
        """The value of the NC; of the server itself only its state is asked for."""
        if node.NamespaceIndex == 0:
            return ua.DataValue(ua.Variant(0, ua.VariantType.Int32))
        try:
            return ua.DataValue(self.nc.read(str(node.Identifier)))
        except ServiceError as error:
            return ua.DataValue(StatusCode=ua.StatusCode(ua.UInt32(error.code)))

    def write(self, each: ua.WriteValue) -> ua.StatusCode:
        """Set a value of the NC."""
        try:
            self.nc.write(each.NodeId.Identifier, each.Value)
        except ServiceError as error:
            return ua.StatusCode(ua.UInt32(error.code))
        return ua.StatusCode()


class Fleet:
    """Controls that run. tables: one for each, for the configuration."""

    def __init__(self, models: list[Model]) -> None:
        self.ncs = [Nc(model, edge_size=34, first_r=None) for model in models]
        self.tables: list[dict[str, object]] = []

    async def start(self) -> None:
        """Listen, each at a free port, and copy the state of every NC each 100 ms."""
        loop = asyncio.get_running_loop()
        for nc in self.ncs:
            protocol = lambda nc=nc: FastSinumerik(nc, "opc.tcp://127.0.0.1")  # noqa: E731
            server = await loop.create_server(protocol, "127.0.0.1", 0)
            control: Any = type("Control", (), {"nc": nc})
            table = SimulatedSinumerik(None, control, server.sockets[0].getsockname()[1]).table()  # type: ignore[arg-type]
            table["opcua"] = {"url": table["opcua"]["url"]}  # type: ignore[index]
            self.tables.append(table)
        self._task = asyncio.create_task(self._tick())

    async def _tick(self) -> None:
        while True:
            for nc in self.ncs:
                nc.copy()
            await asyncio.sleep(TICK)
