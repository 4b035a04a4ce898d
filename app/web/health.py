"""For those who run the server: is it alive, is it ready, and what does it count."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Any

from fastapi import APIRouter, Request
from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    GCCollector,
    Histogram,
    PlatformCollector,
    ProcessCollector,
)
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.exposition import generate_latest
from prometheus_client.registry import Collector
from sqlalchemy import text
from starlette.responses import Response

from app.core.notify import ENOUGH_FAILURES
from app.db.disk import free, is_full
from app.db.engine import Database
from app.db.replica import Replica
from app.errors import Compiling, DiskFull
from app.web.api import EVERY_ERROR
from app.web.deps import IN_TURN, SettingsDep

compiling = Event()
"""Set while this process compiles what decides readings: a request with one waits for that."""
router = APIRouter(tags=["health"], generate_unique_id_function=lambda route: route.name)


def _says(example: Any, media_type: str = "application/json") -> dict[int | str, dict[str, Any]]:
    return {200: {"content": {media_type: {"example": example}}}}


@router.get("/health/live", responses=_says({"status": "live"}))
async def live() -> dict[str, str]:
    """The process answers."""
    return {"status": "live"}


@router.get("/health/ready", responses=_says({"status": "ready"}) | {503: EVERY_ERROR[503]}, dependencies=[IN_TURN])
def ready(request: Request, settings: SettingsDep) -> dict[str, str]:
    """The process decides readings, reaches its database, and its disk is not full. Where there is a replica: how far it is behind."""
    if compiling.is_set():
        raise Compiling
    if is_full(settings.data_dir):
        raise DiskFull
    database: Database = request.app.state.database
    with database.begin() as session:
        session.execute(text("SELECT 1"))
    replica: Replica | None = request.app.state.replica
    return {"status": "ready"} | ({} if replica is None else {"replica": replica.in_words()})


@router.get(
    "/metrics",
    response_class=Response,
    responses=_says('inband_readings_total{machine="lathe-1"} 812.0\n', "text/plain") | {503: EVERY_ERROR[503]},
    dependencies=[IN_TURN],
)
def metrics(request: Request) -> Response:
    """Prometheus metrics. What is counted is asked of the database, so every process answers the same."""
    return Response(generate_latest(request.app.state.metrics), media_type=CONTENT_TYPE_LATEST)


class Plant(Collector):
    """Readings, corrections and alarms, counted by the database at the moment of asking."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def collect(self) -> Iterable[Metric]:
        readings = CounterMetricFamily("inband_readings", "Readings stored.", labels=["machine"])
        latest = GaugeMetricFamily(
            "inband_last_reading_timestamp_seconds", "When the last reading came in.", labels=["machine"]
        )
        corrections = GaugeMetricFamily("inband_corrections", "Corrections by status.", labels=["machine", "status"])
        alarms = GaugeMetricFamily(
            "inband_active_alarms", "Alarms that are not acknowledged.", labels=["machine", "kind"]
        )
        with self._database.begin() as session:
            for machine, count, at in session.execute(text(_READINGS)):
                readings.add_metric([machine], count)
                if at is not None:
                    latest.add_metric([machine], float(at))
            for machine, status, count in session.execute(text(_CORRECTIONS)):
                corrections.add_metric([machine, status], count)
            for machine, kind, count in session.execute(text(_ALARMS)):
                alarms.add_metric([machine, kind], count)
            failing = GaugeMetricFamily(
                "inband_failing_jobs", "Units of work of a periodic job that fail.", labels=["job"]
            )
            finished = GaugeMetricFamily(
                "inband_job_last_run_timestamp_seconds", "When a periodic job last ran.", labels=["job"]
            )
            for job, at, count in session.execute(text(_JOBS)):
                failing.add_metric([job], count)
                if at is not None:
                    finished.add_metric([job], float(at))
            receivers = GaugeMetricFamily(
                "inband_failing_receivers", "Receivers of notifications that are not reached, again and again."
            )
            receivers.add_metric([], session.scalar(text(_RECEIVERS), {"enough": ENOUGH_FAILURES}) or 0)
        return readings, latest, corrections, alarms, failing, finished, receivers


_READINGS = """
SELECT m.key, coalesce(sum(s.sequence), 0), extract(epoch FROM max(s.last_received_at))
FROM machine m LEFT JOIN stream s ON s.machine_id = m.id GROUP BY m.key
"""
_CORRECTIONS = """
SELECT m.key, c.status, count(*) FROM correction c JOIN machine m ON m.id = c.machine_id
WHERE c.status IN ('held', 'awaiting_approval', 'pending') GROUP BY 1, 2
"""
_ALARMS = """
SELECT m.key, a.kind, count(*) FROM alarm a JOIN machine m ON m.id = a.machine_id
WHERE a.acknowledged_at IS NULL GROUP BY 1, 2
"""
_JOBS = """
SELECT job, extract(epoch FROM r.finished_at), coalesce(f.failing, 0)
FROM job_run r FULL JOIN (SELECT job, count(*) AS failing FROM job_failure GROUP BY job) f USING (job)
"""

_RECEIVERS = """
SELECT count(*) FROM receiver r LEFT JOIN person p ON p.id = r.person_id
WHERE r.failures >= :enough AND r.means <> 'browser' AND r.deleted_at IS NULL AND p.disabled_at IS NULL
"""


class Behind(Collector):
    """The copy of the database that charts and reports read."""

    def __init__(self, replica: Replica) -> None:
        self._replica = replica

    def collect(self) -> Iterable[Metric]:
        behind = GaugeMetricFamily(
            "inband_replica_behind_seconds", "Seconds that the replica lags; absent while it is unreachable."
        )
        if self._replica.behind is not None:
            behind.add_metric([], self._replica.behind)
        used = GaugeMetricFamily("inband_replica_used", "1 while charts, reports and searches read the replica.")
        used.add_metric([], float(self._replica.usable))
        return behind, used


class Disk(Collector):
    """Room on the disk of the data directory."""

    def __init__(self, data_dir: Path) -> None:
        self._data_dir = data_dir

    def collect(self) -> Iterable[Metric]:
        room = GaugeMetricFamily("inband_disk_free_bytes", "Free on the disk of the data directory.")
        with suppress(OSError):
            room.add_metric([], free(self._data_dir))
        return (room,)


def pool_waits() -> Histogram:
    """The time that requests of this process wait for a connection to the database, by pool."""
    return Histogram(
        "inband_pool_wait_seconds",
        "Time until a request had a connection to the database, by pool.",
        ["pool"],
        registry=None,
        buckets=(0.001, 0.005, 0.025, 0.1, 0.5, 1, 5, 10, 30),
    )


def registry(database: Database, data_dir: Path, replica: Replica | None, waits: Histogram) -> Any:
    """The metrics of one application: those of the plant, of its process, of its disk, and of its replica."""
    collectors = CollectorRegistry()
    collectors.register(waits)
    collectors.register(Plant(database))
    if replica is not None:
        collectors.register(Behind(replica))
    collectors.register(Disk(data_dir))
    ProcessCollector(registry=collectors)
    PlatformCollector(registry=collectors)
    GCCollector(registry=collectors)
    return collectors
