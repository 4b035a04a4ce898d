"""The ledger of a machine: equal to a replay that only measures, over REST and on its page."""

from datetime import UTC, datetime

import pytest

from app.core.ledger import Worth
from app.core.period import ALWAYS
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines.queries import machine_named
from app.loop.summaries import queries as statistics
from app.quality.ledger import queries
from app.quality.ledger.schemas import money_of
from app.quality.what_if import simulation
from app.quality.what_if.queries import truly_of
from app.quality.what_if.schemas import WhatIfIn
from app.quality.what_if.tool_history import past_of
from tests.quality.closed_loop import cut, scatter
from tests.servers import Server
from tests.shop import Person, Shop


@pytest.fixture(scope="module")
def ran(common_shop: Shop) -> Shop:
    """An edge that would have worn out of tolerance, corrected."""
    cut(common_shop, scatter(400, wear=0.1))
    return common_shop


def test_it_equals_a_replay_that_only_measures(ran: Shop, server: Server) -> None:
    with server.database.sessions() as session:
        current = characteristic_named(session, ran.characteristic)
        past = past_of(session, current, statistics.window_of(session, current.characteristic))
        found = queries.verdicts_of(past)
        assert found.truly.sum() == truly_of(session, past).rejects
        # A zero range as wide as the tolerance and as R34 would correct what lies beyond; measuring only corrects nothing.
        free = past.history["deviation"] + past.history["compensated"] / current.parameters.factor
        assert found.without.sum() == (abs(free.round(6)) > 0.008).sum()
        ledger = queries.ledger_of(session, machine_named(session, ran.machine), ALWAYS, datetime.now(UTC))
        assert ledger.total.worth is Worth.SAVED
        assert money_of(ledger.total, 12.5) == ledger.total.net * 12.5
        replayed = simulation.replayed(session, current, WhatIfIn.model_validate({"last": 400}))
        assert ledger.total.truly == replayed.truly.rejects


def test_it_is_answered_by_week_tool_and_characteristic(ran: Shop) -> None:
    found = ran.call("GET", f"/machines/{ran.machine}/ledger")
    (tool,) = found["tools"]
    assert (tool["tool_memory"], tool["readings"]) == (3, 400)
    assert sum(week["net"] for week in found["weeks"]) == found["total"]["net"] > 200
    assert found["total"]["worth"] == "saved"
    assert (found["total"]["money"], found["currency"]) == (None, "EUR")
    (one,) = found["characteristics"]
    assert one["saved"] - one["spoiled"] == one["net"]
    empty = ran.call("GET", f"/machines/{ran.machine}/ledger?from=2020-01-01&to=2020-02-01")
    assert empty["weeks"] == []
    assert empty["total"]["readings"] == 0


def test_its_page_says_what_it_rests_on(ran: Shop, server: Server) -> None:
    viewer = Person(server, "viewer")
    page = viewer.open(f"/ledger?machine={ran.machine}")
    assert "Corrections saved" in page
    assert "ask an administrator to set the cost of a part" in page
    assert "INBAND_" not in page
    assert "INBAND_PART_COST" in Person(server, "admin").open(f"/ledger?machine={ran.machine}")
    assert "Nothing to reckon" in viewer.open(f"/ledger?machine={ran.machine}&from=2020-01-01&to=2020-02-01")
