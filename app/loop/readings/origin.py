"""The origin of a reading in a file that Inband wrote: by it a reading that comes back is known again.

A number is given once to a characteristic, and the moment at which it was given is kept to the microsecond: both together name
a reading in any plant. CSV and NDJSON have them as columns, AQDEF as the GUID of a value (K0097).
"""

from datetime import UTC, datetime, timedelta
from typing import NamedTuple
from uuid import UUID

COLUMNS = ("sequence", "received_at", "parameters_version")
"""A table with all of these was written by Inband."""
EMPIRICAL = "empirical value, mm"
"""Process parameter of AQDEF: what was taken off the measured size, so that the corrected one is in the file."""
SAME = 2e-9
"""mm; sizes that differ by less are one that was rounded on its way."""
_MARK = 0x2A2BAD  # 22 bits that tell such a GUID from those of others
_BEGIN = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_LAYOUT = 8  # RFC 9562: free bits of one's own
_VARIANT = 0b10
_LATEST = 57  # bits of microseconds: the year 6536


class Origin(NamedTuple):
    """The number of a reading, the moment at which it was stored, and its measured size, mm."""

    sequence: int
    received_at: datetime
    measured: float


def guid_of(sequence: int, received_at: datetime) -> str:
    """The GUID of a reading.

    >>> guid_of(7, datetime(2026, 11, 26, 19, 30, 0, 5, tzinfo=UTC))
    '0066132f-8299-8e05-aa2b-ad0000000007'
    """
    moment = (received_at - _BEGIN) // _MICROSECOND
    head = (moment >> 12) << 16 | _LAYOUT << 12 | moment & 0xFFF
    return str(UUID(int=head << 64 | _VARIANT << 62 | _MARK << 40 | sequence))


def named_by(guid: str) -> tuple[int, datetime] | None:
    """Number and moment of the reading that a GUID names; None for one of another program.

    >>> named_by("0066132f-8299-8e05-aa2b-ad0000000007")
    (7, datetime.datetime(2026, 11, 26, 19, 30, 0, 5, tzinfo=datetime.timezone.utc))
    """
    try:
        bits = UUID(guid).int
    except ValueError:
        return None
    head, tail = bits >> 64, bits & (1 << 64) - 1
    moment = (head >> 16) << 12 | head & 0xFFF
    if head >> 12 & 0xF != _LAYOUT or tail >> 40 != _VARIANT << 22 | _MARK or moment >> _LATEST:
        return None
    return tail & (1 << 40) - 1, _BEGIN + moment * _MICROSECOND
