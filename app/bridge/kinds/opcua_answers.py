"""Answers of an OPC UA server to a read of one field: numbers are read at once, all else by asyncua."""

import struct
from typing import Final

from asyncua import ua
from asyncua.client.ua_session import UaSession
from asyncua.ua.ua_binary import struct_from_binary

ANSWER: Final = struct.Struct("<4s12xIBi3siBBi")
"""Beginning of an answer to a read: type, service result, diagnostics, texts, more of a header, number of values; of the first
value what it has, its type, and its length."""
READ_ANSWER: Final = b"\x01\x00\x7a\x02"
GOOD: Final = b"\0\0\0\0"
DOUBLES: Final = 0x80 | ua.VariantType.Double.value


async def answered(session: UaSession, request: ua.ReadRequest) -> tuple[float, ...] | ua.DataValue:
    """The answer to a read of one field: ``session.read``, but for how numbers are read."""
    answer = await session._send_request(request)  # noqa: SLF001 - the answer as it came
    if (numbers := doubles_in(bytes(answer))) is not None:
        return numbers
    response = struct_from_binary(ua.ReadResponse, answer)
    response.ResponseHeader.ServiceResult.check()
    found: ua.DataValue
    [found] = response.Results
    return found


def doubles_in(answer: bytes) -> tuple[float, ...] | None:
    """The numbers of an answer to a read of one field of Double; None for any other answer.

    asyncua reads an answer value by value, which costs as much as the rest of a poll.
    """
    if len(answer) < ANSWER.size:
        return None
    kind, result, diagnostics, texts, more, count, mask, variant, length = ANSWER.unpack_from(answer)
    plain = (kind, result, diagnostics, more, count) == (READ_ANSWER, 0, 0, b"\0\0\0", 1) and texts <= 0
    has_value, has_status = mask & 1, mask & 2
    end = ANSWER.size + 8 * length
    if not plain or not has_value or variant != DOUBLES or length < 0 or len(answer) < end + 4:
        return None
    if has_status and answer[end : end + 4] != GOOD:
        return None
    return struct.unpack_from(f"<{length}d", answer, ANSWER.size)
