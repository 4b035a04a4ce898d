"""Rows for PostgreSQL's binary COPY, made of columns: no object per row, no call per value.

Every value is some bytes of one large block, or NULL; `table` lays them one behind the other, row by row, in machine
code. Format: the header, per row the number of fields, per field its length (−1 for NULL) and its bytes, the trailer.
Source: PostgreSQL, COPY, Binary Format. Whole numbers are sent in the width of their column, times as microseconds
since 2000-01-01 UTC.
"""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta, timezone
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
    """The values of one column: their bytes, and where each row's begin and how many they are (−1: NULL).

    A number says it of all rows: row r begins at r x `starts`.
    """

    block: bytes
    starts: Whole | int
    lengths: Whole | int


def fixed(values: NDArray[Any], kind: str, null: NDArray[np.bool_] | None = None) -> Column:
    """Values of one width: `kind` is NumPy's, such as ``>f8``, ``>i4``, ``?``."""
    sent = values.astype(kind)
    if null is None or not null.any():
        return Column(sent.tobytes(), sent.itemsize, sent.itemsize)
    return Column(sent.tobytes(), np.arange(len(values)) * sent.itemsize, np.where(null, -1, sent.itemsize))


def always(value: bytes | None) -> Column:
    """The same value in each row."""
    return Column(value or b"", 0, -1 if value is None else len(value))


def one_of(values: Sequence[bytes | None], which: NDArray[Any]) -> Column:
    """Values of which there are few: each row says which one it has."""
    if len(values) == 1:
        return always(values[0])
    lengths = np.array([-1 if value is None else len(value) for value in values], np.int64)  # there may be none
    sizes = np.maximum(lengths, 0)
    at = which.astype(np.int64)
    return Column(b"".join(value or b"" for value in values), (np.cumsum(sizes) - sizes)[at], lengths[at])


def texts(values: Sequence[str | None]) -> Column:
    """Texts that differ from row to row."""
    filled = [value or "" for value in values]
    block = "".join(filled)
    sent = filled if block.isascii() else [value.encode() for value in filled]
    lengths = np.fromiter(map(len, sent), np.int64, len(sent))
    starts = np.cumsum(lengths) - lengths
    if None in values:
        lengths[[at for at, value in enumerate(values) if value is None]] = -1
    return Column(block.encode(), starts, lengths)


def moment(at: datetime) -> int:
    """A time as PostgreSQL keeps it."""
    return (at - EPOCH) // MICROSECOND


def moments(times: Sequence[datetime]) -> Whole:
    """Many times, as PostgreSQL keeps them."""
    # Two times of one fixed offset are subtracted five times as fast as two of different ones.
    epochs = {
        zone: EPOCH.astimezone(zone) if isinstance(zone, timezone) else EPOCH for zone in {at.tzinfo for at in times}
    }
    return np.array([(at - epochs[at.tzinfo]) // MICROSECOND for at in times], np.int64)


def array_of_int4(values: Sequence[int]) -> bytes:
    """A one-dimensional array of integers, as the server sends and takes it."""
    head = np.array([1, 0, 23, len(values), 1], ">i4").tobytes()  # dimensions, no NULLs, int4's number, count, from 1
    body = np.full((len(values), 2), 4, ">i4")  # each with its length
    body[:, 1] = np.fromiter(values, np.int64, len(values))
    return head + body.tobytes()


def table(columns: Sequence[Column], rows: int) -> memoryview:
    """The whole of what COPY … FROM STDIN (FORMAT BINARY) is sent."""
    # For each column: where its block begins, its step and length, and its place among those that differ from row to row.
    layout = np.empty((len(columns), 4), np.int64)
    starts, lengths = [np.zeros(rows, np.int64)], [np.zeros(rows, np.int64)]
    size, begin = len(HEADER) + len(TRAILER) + rows * (2 + 4 * len(columns)), 0
    for number, column in enumerate(columns):
        if isinstance(column.starts, int) and isinstance(column.lengths, int):
            layout[number] = begin, column.starts, column.lengths, -1
            size += rows * max(column.lengths, 0)
        else:
            layout[number] = begin, 0, 0, len(starts)
            starts.append(np.asarray(column.starts))
            lengths.append(np.asarray(column.lengths))
            size += int(np.maximum(column.lengths, 0).sum())
        begin += len(column.block)
    block = np.frombuffer(b"".join(column.block for column in columns), np.uint8)
    out = np.empty(size, np.uint8)
    out[: len(HEADER)] = np.frombuffer(HEADER, np.uint8)
    _lay(block, layout, np.array(starts), np.array(lengths), out[len(HEADER) :])
    out[-len(TRAILER) :] = np.frombuffer(TRAILER, np.uint8)
    return out.data


@compiled
def _lay(block: NDArray[np.uint8], layout: Whole, starts: Whole, lengths: Whole, out: NDArray[np.uint8]) -> None:
    at = 0
    for row in range(starts.shape[1]):
        out[at], out[at + 1] = layout.shape[0] >> 8, layout.shape[0] & 255
        at += 2
        for column in range(layout.shape[0]):
            start, length, among = layout[column, 0], layout[column, 2], layout[column, 3]
            if among < 0:
                start += row * layout[column, 1]
            else:
                start += starts[among, row]
                length = lengths[among, row]
            for shift in range(4):  # −1 becomes four bytes of 255
                out[at + shift] = (length >> (24 - 8 * shift)) & 255
            at += 4
            for byte in range(length):
                out[at + byte] = block[start + byte]
            at += max(length, 0)
