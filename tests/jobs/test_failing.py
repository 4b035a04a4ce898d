"""A characteristic whose background work fails: its neighbours go on, people and programs see it, and it ends by itself."""

from datetime import UTC, datetime, timedelta

import httpx
import pytest
from sqlalchemy import text

from app.jobs.actions import run_jobs
from app.quality.chart_signals.jobs import JOB
from tests.forked import inband
from tests.quality.baselines.rows import frozen
from tests.quality.chart_signals.line import Line
from tests.shop import Shop

pytestmark = pytest.mark.own_server  # it counts what fails in the whole plant


def broken(shop: Shop, line: Line) -> None:
    """Make the memory of its rules unreadable."""
    with shop.server.database.begin() as session:
        session.execute(
            text(
                "UPDATE watching w SET memory = '{\"main\": {}}' FROM characteristic c"
                " WHERE c.id = w.characteristic_id AND c.key = :key"
            ),
            {"key": line.key},
        )


def retried(shop: Shop) -> None:
    with shop.server.database.begin() as session:
        session.execute(text("UPDATE job_failure SET retry_at = now()"))
    run_jobs(shop.server.database, [JOB])


def test_one_characteristic_that_fails_is_shown_and_silences_no_other(shop: Shop) -> None:
    # The one that fails comes first by its key.
    bad, good = Line(shop, "a-bad"), Line(shop, "b-good")
    for line in (bad, good):
        line.rules(main={"nelson_1": "alarm"})
        line.look()
    broken(shop, bad)
    for line in (bad, good):
        line.push([0.0, 50.0])
    good.look()
    assert good.runs() == [("individuals", "nelson_1", 62, 62)]
    assert len(good.alarms()) == 1
    assert bad.runs() == []

    client = shop.server.client()
    assert 'inband_failing_jobs{job="run_rules"} 1.0' in client.get("/metrics").text
    (row,) = [
        item
        for item in shop.call("GET", f"/overview?machine={shop.machine}")["items"]
        if item["characteristic"] == bad.key
    ]
    assert {"code": "not_evaluated", "text": "Background evaluation fails"} in row["reasons"]
    check = inband("check", "--database-url", shop.server.database.dsn)
    assert check.returncode == 1
    assert f"run_rules fails for characteristic/{bad.key}" in " ".join(check.stderr.split())

    page = shop.admin.get("/setup/jobs")
    assert page.status_code == 200
    for where in ("", "/control"):
        told = shop.admin.get(f"/characteristics/{bad.key}{where}").text
        assert "Background work on this characteristic fails: Run rules of control charts." in told
        assert "Background work" not in shop.admin.get(f"/characteristics/{good.key}{where}").text

    with shop.server.database.begin() as session:
        session.execute(text("UPDATE watching SET memory = '{}', looked = 0, baseline_version = 0"))
    retried(shop)
    assert bad.runs() == [("individuals", "nelson_1", 62, 62)]
    assert 'inband_failing_jobs{job="run_rules"} 0.0' in client.get("/metrics").text
    assert bad.key not in shop.admin.get("/setup/jobs").text


def test_a_subgroup_of_more_than_ten_thousand_readings_is_judged_like_any_other(shop: Shop) -> None:
    at = datetime(2026, 5, 4, tzinfo=UTC)
    times = [at + timedelta(minutes=30 * group, seconds=20 * place) for group in range(25) for place in range(3)]
    long_shift = at + timedelta(days=1)
    times += [long_shift + timedelta(seconds=number / 10) for number in range(10_050)]
    key = f"{shop.characteristic}-pause"
    shop.add(key, tool_memory=0, average_memory=0, mode="measure_only")
    for start in range(0, len(times), 1000):
        rows = [
            {
                "characteristic": key,
                "measured": round(40 + ((start + place) * 7919 % 97 - 48) / 40_000, 6),
                "measured_at": time.isoformat(),
            }
            for place, time in enumerate(times[start : start + 1000])
        ]
        assert shop.machine_client.post("/api/v1/readings/batch", json=rows).status_code in {200, 201}
    shop.characteristic = key
    frozen(shop, 1, 75, chart="xbar_r", grouping="pause", group_pause=5.0)
    # The subgroup ends with the next reading after a pause.
    last = {"characteristic": key, "measured": 40.0, "measured_at": (long_shift + timedelta(hours=3)).isoformat()}
    assert shop.machine_client.post("/api/v1/readings", json=last).status_code == 201
    run_jobs(shop.server.database, [JOB])
    assert f"characteristic/{key}" not in shop.admin.get("/setup/jobs").text
    for path in (
        f"/characteristics/{key}/control?chart=ranges",
        f"/characteristics/{key}/figures/control?chart=ranges",
        f"/characteristics/{key}/report.json",
        f"/characteristics/{key}/rules/preview",
    ):
        answer: httpx.Response = shop.admin.get(f"/api/v1{path}")
        assert answer.status_code == 200, (path, answer.text[:300])
    frozen(shop, 1, len(times), chart="xbar_r", grouping="pause", group_pause=5.0)
