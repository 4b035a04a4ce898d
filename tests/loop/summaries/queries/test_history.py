"""A history as columns is what the readings are, one by one."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import psycopg
import pytest
from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone
from app.core.decision.step import Code
from app.core.period import Period
from app.errors import Invalid
from app.loop.characteristics import queries as characteristics
from app.loop.summaries import queries
from app.loop.summaries.queries.history import BLOCK, COLUMNS, MOST_AT_ONCE, POSTGRES_EPOCH
from app.loop.summaries.queries.window import Window
from app.loop.tables.readings import Reading
from bench.plant import PARAMETERS
from bench.readings import fill
from tests.servers import Server
from tests.shop import Shop

pytestmark = pytest.mark.own_server  # very many readings that no machine has sent

COUNT = 2 * BLOCK + 77


@pytest.fixture(scope="module")
def filled(server: Server) -> str:
    shop = Shop(server)
    parameters = PARAMETERS | {"tool_memory": 3}
    shop.call("POST", "/characteristics", 201, key="long", name="long", machine=shop.machine, parameters=parameters)
    with psycopg.connect(server.database.dsn, autocommit=True) as connection:
        fill(connection, "long", COUNT)
    with server.database.begin() as session:
        session.execute(
            text("""INSERT INTO exclusion (machine_id, characteristic_id, sequence, actor, reason)
                    SELECT machine_id, id, 78, 'a', 'b' FROM characteristic WHERE key = 'long'""")
        )
    return "long"


def rows_of(session: Session, key: str, window: Window) -> list[Reading]:
    current = characteristics.characteristic_named(session, key)
    query = select(Reading).where(
        Reading.characteristic_id == current.characteristic.id, Reading.sequence.between(window.first, window.last)
    )
    return list(session.scalars(query.order_by(Reading.sequence)))


def test_every_column_says_what_the_rows_say(server: Server, filled: str) -> None:
    with server.database.begin() as session:
        characteristic = characteristics.characteristic_named(session, filled).characteristic
        window = Window(5, COUNT - 3, COUNT)
        history = queries.history_of(session, characteristic, window, COLUMNS)
        rows = rows_of(session, filled, window)
    assert len(history) == len(rows) == COUNT - 7
    zones, codes = list(Zone), list(Code)
    for name in COLUMNS:
        if name in {"measured_at", "received_at", "machined_at"}:
            told = [None if np.isnat(moment) else moment.item().replace(tzinfo=UTC) for moment in history[name]]
            assert told == [getattr(row, name) for row in rows]
        elif name == "zone":
            assert [zones[number].value for number in history[name]] == [row.zone for row in rows]
        elif name == "code":
            assert [codes[number].value for number in history[name]] == [row.code for row in rows]
        elif name == "paused":
            assert history[name].tolist() == [row.paused_by is not None for row in rows]
        elif name == "part":
            numbers = dict(zip([row.part for row in rows], history[name].tolist(), strict=True))
            assert len(set(numbers.values())) == len(numbers) == len(rows)
            assert min(numbers.values()) >= 0
        elif name == "compensated":
            expected = np.array([np.nan if row.compensated is None else row.compensated for row in rows])
            np.testing.assert_array_equal(history[name], expected)
        else:
            assert history[name].tolist() == [-1 if getattr(row, name) is None else getattr(row, name) for row in rows]


def test_what_a_session_has_read_it_does_not_read_again(server: Server, filled: str) -> None:
    """And it is the same as read by another one, whatever was asked for before."""
    asked = [(1, COUNT, ["deviation", "zone"]), (1, COUNT, ["measured", "zone"]), (9, 60, ["zone", "measured"]),
             (9, 60, ["received_at"]), (1, COUNT, []), (1, COUNT + 5, ["zone"]), (40, 39, ["zone"])]  # fmt: skip
    with server.database.begin() as session:
        characteristic = characteristics.characteristic_named(session, filled).characteristic
        found = [queries.history_of(session, characteristic, Window(a, b, COUNT), names) for a, b, names in asked]
    for (first, last, names), history in zip(asked, found, strict=True):
        with server.database.begin() as session:
            alone = queries.history_of(session, characteristic, Window(first, last, COUNT), names)
        assert history.columns.keys() == alone.columns.keys() == {"sequence", *names}
        for name, values in alone.columns.items():
            np.testing.assert_array_equal(history[name], values)
        assert history.excluded.tolist() == alone.excluded.tolist()
    assert np.shares_memory(found[2]["zone"], found[0]["zone"]), "read once"
    assert np.shares_memory(found[2]["measured"], found[1]["measured"])


def test_excluded_readings_are_marked_and_left_out_when_counted(server: Server, filled: str) -> None:
    with server.database.begin() as session:
        characteristic = characteristics.characteristic_named(session, filled).characteristic
        history = queries.history_of(session, characteristic, Window(70, 80, COUNT))
    assert history["sequence"][history.excluded].tolist() == [78]
    assert history.counted["sequence"].tolist() == [70, 71, 72, 73, 74, 75, 76, 77, 79, 80]


def test_no_more_than_a_block_is_taken_over_at_once(
    server: Server, filled: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the driver copies its rows nothing else in the process goes on: no reading is let in."""
    fetched: list[int] = []
    at_once = psycopg.Cursor.fetchall

    def fetchall(cursor: psycopg.Cursor[Any]) -> list[Any]:
        rows = at_once(cursor)
        fetched.append(sum(len(value) for row in rows for value in row if isinstance(value, bytes)))
        return rows

    monkeypatch.setattr(psycopg.Cursor, "fetchall", fetchall)
    with server.database.begin() as session:
        characteristic = characteristics.characteristic_named(session, filled).characteristic
        history = queries.history_of(session, characteristic, Window(1, COUNT, COUNT), COLUMNS)
    assert len(history) == COUNT
    assert fetched, "other rows are fetched all at once: the measure is taken"
    assert max(fetched) <= BLOCK * 8


def test_a_period_takes_what_was_measured_in_it(server: Server, filled: str) -> None:
    with server.database.begin() as session:
        characteristic = characteristics.characteristic_named(session, filled).characteristic
        whole = Window(1, COUNT, COUNT)
        every = queries.history_of(session, characteristic, whole, ["measured_at"])
        start = every["measured_at"][9].item().replace(tzinfo=UTC)
        period = replace(whole, period=Period(start, start + timedelta(seconds=5)))
        found = queries.history_of(session, characteristic, period)
        assert found["sequence"].tolist() == [10, 11, 12, 13, 14]
        never = replace(whole, period=Period(datetime(2099, 1, 1, tzinfo=UTC)))
        nothing = queries.history_of(session, characteristic, never, COLUMNS)
        empty = queries.history_of(session, characteristic, Window(1, 0, COUNT), COLUMNS)
    assert len(nothing) == len(empty) == 0
    assert nothing["measured_at"].dtype == POSTGRES_EPOCH.dtype


def test_too_many_readings_at_once_are_refused_with_the_number(server: Server, filled: str) -> None:
    with server.database.begin() as session:
        characteristic = characteristics.characteristic_named(session, filled).characteristic
        with pytest.raises(Invalid, match=str(MOST_AT_ONCE)):
            queries.history_of(session, characteristic, Window(1, MOST_AT_ONCE + 1, MOST_AT_ONCE + 1))
