"""Rows for PostgreSQL's binary COPY, made of columns: no object per row, no call per value.

Every value is some bytes of one large block, or NULL; `table` lays them one behind the other, row by row, in machine
code. Format: the header, per row the number of fields, per field its length (−1 for NULL) and its bytes, the trailer.
Source: PostgreSQL, COPY, Binary Format. Whole numbers are sent in the width of their column, times as microseconds
since 2000-01-01 UTC.
"""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.compiled import compiled

Whole = NDArray[np.int64]

EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
MICROSECOND = timedelta(microseconds=1)
HEADER = b"PGCOPY\n\xff\r\n\0" + bytes(8)
TRAILER = b"\xff\xff"


class Column(NamedTuple):
    """The values of one column: their bytes, and where each row's begin and how many they are (−1: NULL)."""

    block: bytes
    starts: Whole
    lengths: Whole


def fixed(values: NDArray[Any], kind: str, null: NDArray[np.bool_] | None = None) -> Column:
    """Values of one width: `kind` is NumPy's, such as ``>f8``, ``>i4``, ``?``."""
    sent = values.astype(kind)
    lengths = np.full(len(values), sent.itemsize, np.int64)
    if null is not None:
        lengths[null] = -1
    return Column(sent.tobytes(), np.arange(len(values), dtype=np.int64) * sent.itemsize, lengths)


def one_of(values: Sequence[bytes | None], which: NDArray[Any]) -> Column:
    """Values of which there are few: each row says which one it has."""
    ends = np.cumsum([len(value or b"") for value in values], dtype=np.int64)
    lengths = np.array([-1 if value is None else len(value) for value in values], np.int64)
    at = which.astype(np.int64)
    return Column(b"".join(value or b"" for value in values), (ends - np.maximum(lengths, 0))[at], lengths[at])


def texts(values: Sequence[str | None]) -> Column:
    """Texts that differ from row to row."""
    sent = [b"" if value is None else value.encode() for value in values]
    lengths = np.fromiter(map(len, sent), np.int64, len(sent))
    starts = np.cumsum(lengths) - lengths
    if None in values:
        lengths[[at for at, value in enumerate(values) if value is None]] = -1
    return Column(b"".join(sent), starts, lengths)


def moment(at: datetime) -> int:
    """A time as PostgreSQL keeps it."""
    return (at - EPOCH) // MICROSECOND


def array_of_int4(values: Sequence[int]) -> bytes:
    """A one-dimensional array of integers, as the server sends and takes it."""
    head = np.array([1, 0, 23, len(values), 1], ">i4").tobytes()  # dimensions, no NULLs, int4's number, count, from 1
    return head + b"".join(np.array([4, value], ">i4").tobytes() for value in values)


def table(columns: Sequence[Column]) -> bytes:
    """The whole of what COPY … FROM STDIN (FORMAT BINARY) is sent."""
    bases = np.cumsum([0, *(len(column.block) for column in columns)])
    block = np.frombuffer(b"".join(column.block for column in columns), np.uint8)
    starts = np.array([column.starts + base for column, base in zip(columns, bases, strict=False)])
    lengths = np.array([column.lengths for column in columns])
    out = np.empty(int(np.maximum(lengths, 0).sum()) + (4 * len(columns) + 2) * lengths.shape[1], np.uint8)
    _lay(block, starts, lengths, out)
    return HEADER + out.tobytes() + TRAILER


@compiled
def _lay(block: NDArray[np.uint8], starts: Whole, lengths: Whole, out: NDArray[np.uint8]) -> None:
    columns, rows = starts.shape
    at = 0
    for row in range(rows):
        out[at], out[at + 1] = columns >> 8, columns & 255
        at += 2
        for column in range(columns):
            length = lengths[column, row]
            for shift in range(4):  # −1 becomes four bytes of 255
                out[at + shift] = (length >> (24 - 8 * shift)) & 255
            at += 4
            start = starts[column, row]
            for byte in range(length):
                out[at + byte] = block[start + byte]
            at += max(length, 0)
