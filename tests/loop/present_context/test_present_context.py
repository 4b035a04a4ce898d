"""What a machine works at is put on its readings that bring no context, and on no others."""

from datetime import UTC, datetime, timedelta
from typing import Any

from app.jobs.actions import run_jobs
from app.loop.control_plan import jobs as control_plans
from app.loop.present_context import actions
from tests.servers import Server
from tests.shop import Person, Shop


def works_at(shop: Shop, status: int = 200, **context: Any) -> Any:
    answer = shop.admin.put(f"/api/v1/machines/{shop.machine}/context", json=context)
    assert answer.status_code == status, answer.text
    return answer.json()


def said(shop: Shop, sequence: int) -> dict[str, Any]:
    """The context of a reading as far as it says anything, once the job has run."""
    run_jobs(shop.server.database, [actions.JOB])
    context = shop.call("GET", f"/readings/{shop.characteristic}/{sequence}")["context"]
    return {name: value for name, value in (context or {}).items() if value is not None}


def test_readings_that_bring_none_get_what_the_machine_worked_at_when_they_came(shop: Shop) -> None:
    shop.read(0.1)
    works_at(shop, order="A-1", nest=2)
    shop.read(0.2)
    shop.read(0.3, context={"operator": "Milica"})
    works_at(shop, order="A-2")
    shop.read(0.4, context={"part_temperature": 21.5})
    shop.push([0.1], context=[{"machine_temperature": 24.0}])
    assert works_at(shop)["context"]["order"] is None
    shop.read(0.5)
    assert [said(shop, sequence) for sequence in range(1, 7)] == [
        {},
        {"order": "A-1", "nest": 2},
        {"operator": "Milica"},
        {"order": "A-2", "part_temperature": 21.5},
        {"order": "A-2", "machine_temperature": 24.0},
        {},
    ]
    listed = shop.call("GET", f"/readings?characteristic={shop.characteristic}&context.order=A-1")["items"]
    assert [item["sequence"] for item in listed] == [2]


def test_it_is_not_missed_while_it_is_on_its_way(shop: Shop) -> None:
    path = f"/characteristics/{shop.characteristic}/control-plan"
    shop.call("PUT", path, required_context=["order"], reason="Agreed with quality")
    works_at(shop, order="A-1")
    shop.read(0.1)
    run_jobs(shop.server.database, [control_plans.JOB])
    assert shop.alarms() == []


def test_it_is_set_by_who_may_on_record_and_not_over_a_newer_one(shop: Shop, server: Server) -> None:
    path = f"/api/v1/machines/{shop.machine}/context"
    tag = shop.admin.get(path).headers["ETag"]
    assert server.client(server.key("viewer")).put(path, json={}).status_code == 403
    assert shop.machine_client.put(path, json={"order": "A-1"}, headers={"If-Match": tag}).status_code == 200
    assert shop.admin.put(path, json={"order": "A-2"}, headers={"If-Match": tag}).status_code == 412
    works_at(shop, 422, order="a\nb")
    works_at(shop, 422, nest="2")
    newest = shop.call("GET", "/audit?limit=20")["items"]
    entry = next(
        each for each in newest if each["subject"] == f"machine/{shop.machine}" and "context" in each["action"]
    )
    assert entry["after"] == {"order": "A-1"}


def test_it_is_scanned_at_the_station(shop: Shop, operator: Person) -> None:
    path = f"/station/{shop.machine}/context"
    assert f'href="{path}"' in operator.open(f"/station/{shop.machine}")
    assert "holds from now on" in operator.send(path, order="A-77", nest="3")
    assert 'value="A-77"' in operator.open(path)
    assert operator.send(path, 422, nest="three").count("aria-invalid") == 1
    assert shop.call("GET", f"/machines/{shop.machine}/context")["context"]["nest"] == 3


def test_what_was_measured_before_and_comes_late_does_not_get_the_work_of_now(shop: Shop) -> None:
    """A bridge has kept it through an outage; a reading's context is never changed."""
    works_at(shop, order="A-1")
    measured_at = datetime.now(UTC).isoformat()
    works_at(shop, order="A-2")
    shop.read(0.1, measured_at=measured_at)
    shop.read(0.2, measured_at=(datetime.now(UTC) - timedelta(hours=3)).isoformat())
    shop.read(0.3, measured_at=datetime.now(UTC).isoformat())
    assert [said(shop, sequence) for sequence in (1, 2, 3)] == [{}, {}, {"order": "A-2"}]
