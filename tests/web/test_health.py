"""Health, readiness and metrics of the server."""

from typing import Any

from prometheus_client.parser import text_string_to_metric_families

from tests.servers import Server
from tests.shop import Shop


def metrics(server: Server) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    answer = server.client().get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain")
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def test_alive_and_ready_without_a_key(server: Server) -> None:
    for which in ("live", "ready"):
        answer = server.client().get(f"/health/{which}")
        assert (answer.status_code, answer.json()) == (200, {"status": which})


def test_metrics_count_what_is_in_the_record(shop: Shop) -> None:
    def of(name: str, **labels: str) -> Any:
        return metrics(shop.server).get((name, tuple(sorted({"machine": shop.machine, **labels}.items()))))

    assert of("inband_readings_total") == 0
    shop.read(6.0)
    batch = [{"characteristic": shop.characteristic, "measured": 40.006}] * 100
    assert shop.admin.post("/api/v1/readings/batch", json=batch).status_code == 201
    shop.read(350.0, key="twice")
    shop.call("POST", "/readings", 200, characteristic=shop.characteristic, measured=40.35, key="twice")
    assert of("inband_readings_total") == 102
    assert of("inband_last_reading_timestamp_seconds") > 1.7e9
    assert of("inband_corrections", status="pending") == 1
    assert of("inband_corrections", status="held") == 1
    assert of("inband_active_alarms", kind="tool_worn") == 1
    shop.acknowledge(shop.alarms()[0]["id"], "keep_cutting")
    assert of("inband_active_alarms", kind="tool_worn") is None
    assert of("inband_corrections", status="pending") == 2


def test_the_room_on_the_disk_is_reported(server: Server) -> None:
    assert metrics(server)["inband_disk_free_bytes", ()] > 0


def test_the_process_is_measured(server: Server) -> None:
    found = metrics(server)
    assert 1e7 < found["process_resident_memory_bytes", ()] < 1e9
    assert found["process_open_fds", ()] > 5
