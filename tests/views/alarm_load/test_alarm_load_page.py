"""The load by alarms, over REST and on its page, from alarms that were stored."""

from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import text

from app.access.callers import Caller
from app.loop.alarms.kinds import kinds
from app.settings import Settings
from app.views.alarm_load.wording import made_by
from tests.quality.closed_loop import cut, scatter
from tests.servers import Server
from tests.shop import Person, Shop

BEGIN = datetime(2026, 2, 3, 6, tzinfo=UTC)
"""In a past in which nothing else was raised."""
PERIOD = "from=2026-02-03T06:00:00Z&to=2026-02-03T10:00:00Z"


@pytest.fixture(scope="module")
def ran(common_shop: Shop, server: Server) -> Shop:
    """A flood of twelve alarms, three of them of one cause in a minute; a silent bridge, twice; one that is active ever since."""
    flood = [("machine_fault", tool, 60.0 * tool, 30.0, None) for tool in range(1, 10)]
    chatter = [("machine_fault", 20, 540.0 + 20 * number, 5.0, None) for number in range(3)]
    silent = [("bridge_silent", None, 7200.0, 90.0, 60), ("bridge_silent", None, 9000.0, 600.0, 60)]
    with server.database.begin() as session:
        for kind, tool, at, lasted, silent_for in [*flood, *chatter, *silent, ("tool_life", 30, 10_000.0, None, None)]:
            raised = BEGIN + timedelta(seconds=at)
            heard = raised - timedelta(seconds=silent_for or 0)
            session.execute(
                text("""
                INSERT INTO alarm (machine_id, tool_memory, kind, raised_at, acknowledged_at, acknowledged_by, data)
                SELECT id, :tool, :kind, :at, :ended, 'ana', jsonb_strip_nulls(jsonb_build_object('received_at', CAST(:heard AS text)))
                    || '{"location": "receiver", "by": "parts", "parts": 520, "planned_parts": 500}'
                FROM machine WHERE key = :key
                """),
                {
                    "tool": tool,
                    "kind": kind,
                    "at": raised,
                    "ended": None if lasted is None else raised + timedelta(seconds=lasted),
                    "heard": heard.isoformat() if silent_for else None,
                    "key": common_shop.machine,
                },
            )
    return common_shop


def test_it_counts_by_position_and_names_what_makes_the_noise(ran: Shop) -> None:
    found = ran.call("GET", f"/alarm-load?machine={ran.machine}&{PERIOD}")
    (position,) = found["positions"]
    assert (position["alarms"], position["most"], position["over"], position["stale"]) == (15, 12, 1, 1)
    assert position["per_ten_minutes"] == pytest.approx(15 / 24)
    assert position["verdict"] == "acceptable"
    assert [flood["alarms"] for flood in position["floods"]] == [12]
    assert not found["enough"]
    loudest = found["top"][0]
    assert (loudest["kind"], loudest["tool_memory"], loudest["alarms"], loudest["chatters"]) == (
        "machine_fault",
        20,
        3,
        True,
    )
    assert loudest["quieter_left"] is None
    silent = found["top"][1]
    assert (silent["kind"], silent["alarms"], silent["quieter_left"], silent["chatters"]) == (
        "bridge_silent",
        2,
        1,
        False,
    )
    assert silent["made_by"] == "INBAND_BRIDGE_SILENT_AFTER"
    assert len(found["stale"]) == 1


def test_a_young_machine_is_counted_from_its_beginning(shop: Shop) -> None:
    """One alarm in the first minutes is no quiet month."""
    shop.read(350)
    found = shop.call("GET", f"/alarm-load?machine={shop.machine}")
    begin = datetime.fromisoformat(found["start"])
    assert timedelta() <= datetime.now(UTC) - begin < timedelta(hours=2)
    assert found["positions"][0]["per_ten_minutes"] > 0.05
    assert not found["enough"]


def test_a_time_before_all_machines_is_refused(shop: Shop) -> None:
    shop.call("GET", "/alarm-load?to=0001-01-05T00:00:00Z", 422)


def test_a_wider_wear_limit_is_replayed_from_the_readings(ran: Shop) -> None:
    for micrometres in (320, 500):
        ran.read(micrometres)
        ran.acknowledge(next(each["id"] for each in ran.alarms() if each["kind"] == "tool_worn"), "tool_replaced")
    found = ran.call("GET", f"/alarm-load?machine={ran.machine}")
    (worn,) = [each for each in found["top"] if each["kind"] == "tool_worn"]
    assert (worn["alarms"], worn["quieter_left"]) == (2, 1)
    assert worn["quieter"] == "R37 wider by 25 %: 1 of 2 alarms left"


def test_its_page_shows_the_same_and_what_it_rests_on(ran: Shop, server: Server) -> None:
    viewer, admin = Person(server, "viewer"), Person(server, "admin")
    page = viewer.open(f"/alarms/load?machine={ran.machine}&{PERIOD}")
    for words in (
        "ISA-18.2",
        "15",
        "time a bridge may be silent; ask an administrator",
        "1 of 2 alarms left",
        "not computed",
        "Active for more than 24 h",
    ):
        assert words in page
    assert "INBAND_" not in page
    assert "INBAND_BRIDGE_SILENT_AFTER" in admin.open(f"/alarms/load?machine={ran.machine}&{PERIOD}")
    assert "No alarm in this period" in viewer.open(f"/alarms/load?machine={ran.machine}&from=2020-01-01&to=2020-01-02")
    ran.call("GET", "/alarm-load?from=2020-01-01&to=2026-01-01", 422)


def test_a_loop_that_corrects_sooner_is_replayed(shop: Shop) -> None:
    """The same replay as on the page of What if."""
    cut(shop, [*scatter(120, wear=0.1), 26.0, *scatter(20, seed=2, begin=12.0)])
    found = shop.call("GET", f"/alarm-load?machine={shop.machine}")
    (large,) = [each for each in found["top"] if each["kind"] == "oversize"]
    replay = shop.call("POST", f"/characteristics/{shop.characteristic}/what-if", zero_range=0.0005, last=1000)
    assert large["quieter_left"] == replay["other"]["rejects"]
    left, now = (replay[which]["rejects"] for which in ("other", "today"))
    said = (
        f"{left} out of tolerance in place of {now}"
        if left < now
        else f"does not help: {left} out of tolerance, {now} as"
    )
    assert said in large["quieter"]


def test_what_makes_an_alarm_is_said_in_words() -> None:
    """A field of the API says nothing to who reads the table, and a setting of the server only to who may change it."""
    viewer, admin = Caller("person", "Ana", "viewer"), Caller("person", "Bo", "admin")
    assert {kind.name for kind in kinds() if "_" in made_by(kind.name, viewer)} == set()
    settings = {words for kind in kinds() if "_" in (words := made_by(kind.name, admin))}
    assert len(settings) == 3
    assert {name for name in settings if name.removeprefix("INBAND_").lower() not in Settings.model_fields} == set()
