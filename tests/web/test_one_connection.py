"""One request holds one connection to the database, and pages leave machines theirs."""

from collections.abc import Iterator

import pytest
from sqlalchemy import text

from app.db.engine import Database
from app.logs import REQUEST
from tests.databases import NewDatabase, drop_database
from tests.in_process import InProcess, in_process
from tests.one_connection import SecondConnection
from tests.shop import Shop
from tests.web.test_health import metrics


@pytest.fixture(scope="module")
def server(new_database: NewDatabase) -> Iterator[InProcess]:
    """One whose pages have a single connection."""
    url = new_database()
    with in_process(url, pool_size=1, pool_overflow=0) as running:
        yield running
    drop_database(url)


def test_a_second_connection_of_a_request_is_an_error_of_the_tests(database: Database) -> None:
    token = REQUEST.set("a test's")
    try:
        with database.begin() as session:
            session.execute(text("SELECT 1"))
            with pytest.raises(SecondConnection), database.begin() as second:
                second.execute(text("SELECT 1"))
            session.commit()
            with database.begin() as second:
                second.execute(text("SELECT 1"))
    finally:
        REQUEST.reset(token)


def test_what_follows_a_commit_is_a_transaction_of_its_own(database: Database) -> None:
    with pytest.raises(ZeroDivisionError), database.begin() as session:
        session.execute(text("CREATE TABLE first ()"))
        session.commit()
        session.execute(text("CREATE TABLE second ()"))
        raise ZeroDivisionError
    with database.begin() as session:
        found = session.execute(text("SELECT to_regclass('first') IS NULL, to_regclass('second') IS NULL")).one()
    assert tuple(found) == (False, True)


def test_machines_are_served_while_pages_hold_every_connection(server: InProcess) -> None:
    shop = Shop(server)
    machine = shop.machine_client
    pages: Database = server.app.state.database
    with pages.begin() as holding:
        holding.execute(text("SELECT 1"))
        reading = {"characteristic": shop.characteristic, "measured": 40.006}
        assert machine.post("/api/v1/readings", json=reading).status_code == 201
        assert machine.post("/api/v1/readings/batch?decisions=true", json=[reading]).status_code == 201
        (correction, *_rest) = machine.get(f"/api/v1/machines/{shop.machine}/corrections?status=pending").json()[
            "items"
        ]
        path = f"/api/v1/corrections/{shop.machine}/{correction['number']}"
        assert machine.get(path).status_code == 200
        assert machine.post(f"{path}/applied", json={}).status_code == 200
        beat = {"version": "1", "state": "online", "waiting": 0}
        assert machine.post(f"/api/v1/machines/{shop.machine}/heartbeat", json=beat).status_code == 200
        assert machine.get(f"/api/v1/machines/{shop.machine}/tools").status_code == 200
        assert server.client().get("/health/live").status_code == 200


def test_the_time_that_requests_wait_for_a_connection_is_counted(server: InProcess) -> None:
    def waits(pool: str) -> float:
        return metrics(server)["inband_pool_wait_seconds_count", (("pool", pool),)]

    before = waits("pages")
    assert server.client().get("/health/ready").status_code == 200
    assert waits("pages") > before
    assert waits("doors") >= 0
