"""Columns laid out as rows, and read back by the server that they are for."""

from datetime import UTC, datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import numpy as np
import psycopg

from app.db.engine import Database
from app.loop.readings.writer.binary_copy import always, array_of_int4, fixed, moment, moments, one_of, table, texts

TIME = datetime(2026, 11, 21, 8, 15, 2, 120001, tzinfo=timezone(timedelta(hours=1)))


def test_the_server_reads_what_was_meant(database: Database) -> None:
    sent = table(
        [
            fixed(np.array([1, -2, 2**31 - 1]), ">i4"),
            fixed(np.array([2**40, -1, 0]), ">i8", np.array([False, False, True])),
            fixed(np.array([0.1, -0.0, np.pi]), ">f8"),
            fixed(np.array([True, False, True]), "?"),
            fixed(np.array([moment(TIME), moment(datetime(1999, 12, 31, tzinfo=UTC)), 0]), ">i8"),
            one_of([b"zero", None, b"", b"average"], np.array([3, 1, 0], np.int8)),
            texts(["Šipka „Ø40“", None, ""]),
            one_of([None, array_of_int4([17, 18]), array_of_int4([])], np.array([1, 0, 2])),
            always(None),
            one_of([b"same"], np.zeros(3)),
        ],
        rows=3,
    )
    with psycopg.connect(database.dsn) as connection:
        connection.execute(
            "CREATE TEMPORARY TABLE t (a int, b bigint, c float8, d bool, e timestamptz, f text, g text, h int[], i text, j text)"
        )
        with connection.cursor().copy("COPY t FROM STDIN (FORMAT BINARY)") as copy:
            copy.write(sent)
        found = connection.execute("SELECT * FROM t").fetchall()
    assert [row[:4] for row in found] == [(1, 2**40, 0.1, True), (-2, -1, 0.0, False), (2**31 - 1, None, np.pi, True)]
    assert [row[4] for row in found] == [TIME, datetime(1999, 12, 31, tzinfo=UTC), datetime(2000, 1, 1, tzinfo=UTC)]
    assert [row[5:8] for row in found] == [("average", "Šipka „Ø40“", [17, 18]), (None, None, None), ("zero", "", [])]
    assert [row[8:] for row in found] == [(None, "same")] * 3


def test_many_times_are_as_each_of_them() -> None:
    berlin = ZoneInfo("Europe/Berlin")  # an hour more in summer
    times = [TIME, TIME.astimezone(UTC), *(datetime(2026, month, 1, 12, tzinfo=berlin) for month in range(1, 13))]
    assert moments(times).tolist() == [moment(time) for time in times]


def test_no_rows_are_a_table_too(database: Database) -> None:
    with psycopg.connect(database.dsn) as connection:
        connection.execute("CREATE TEMPORARY TABLE t (a int, b text)")
        with connection.cursor().copy("COPY t FROM STDIN (FORMAT BINARY)") as copy:
            copy.write(table([fixed(np.array([], np.int64), ">i4"), texts([])], rows=0))
        assert connection.execute("SELECT * FROM t").fetchall() == []
