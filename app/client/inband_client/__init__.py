"""Calls an Inband server: probe readings in, decisions out, tool-offset corrections back to the machine.

    from inband_client import Client

    with Client("http://127.0.0.1:8000", key) as inband:
        decision = inband.push(characteristic="shaft-d40", measured=39.9981, key="lathe-1:000812:d40")

`AsyncClient` has the same methods for asyncio. A value comes back as a frozen dataclass, an error as an exception that says
what the server's problem document says.
"""

from inband_client.async_client import AsyncClient
from inband_client.client import Client
from inband_client.errors import (
    Conflict,
    Forbidden,
    Invalid,
    NotFound,
    ProblemError,
    Stopped,
    TooLarge,
    Unauthorized,
    Unavailable,
    Untrusted,
    WrongField,
)
from inband_client.values import Alarm, Batch, Correction, Decision, Event, Reading, Reason, StoredReading

__all__ = [
    "Alarm",
    "AsyncClient",
    "Batch",
    "Client",
    "Conflict",
    "Correction",
    "Decision",
    "Event",
    "Forbidden",
    "Invalid",
    "NotFound",
    "ProblemError",
    "Reading",
    "Reason",
    "Stopped",
    "StoredReading",
    "TooLarge",
    "Unauthorized",
    "Unavailable",
    "Untrusted",
    "WrongField",
]
