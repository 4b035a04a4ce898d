"""Six hundred readings with everything a report may hold: corrections, alarms, tool changes, exclusions, a baseline, signals."""

from random import Random
from typing import Any

from app.jobs.actions import run_jobs
from app.quality.chart_signals.jobs import JOB
from tests.shop import Shop

PERIOD = "last=all"
SAID: dict[str, Any] = {"cause": "material", "comment": "New batch, harder by 20 HB"}  # of the newest signal


def scatter(count: int, seed: int = 1, sigma: float = 1.5, mean: float = 0.2) -> list[float]:
    """Normal deviations, µm, rounded to the nanometre."""
    rng = Random(seed)
    return [round(rng.gauss(mean, sigma), 3) for _ in range(count)]


def sent(shop: Shop, values: list[float]) -> None:
    """Readings of parts with names."""
    shop.push(values, part=[f"SN-{at}" for at in range(len(values))])


def told(shop: Shop) -> None:
    """The story."""
    key = shop.characteristic
    sent(shop, scatter(300))
    freeze: dict[str, Any] = {
        "quantity": "deviation",
        "first_sequence": 1,
        "last_sequence": 300,
        "reason": "Mirno, Đorđe",
    }
    shop.call("POST", f"/characteristics/{key}/baselines", 201, **freeze)
    sent(shop, scatter(250, seed=2))
    for correction in shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"][:40]:
        shop.correction(correction["number"], "applied")
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="=1+1 insert worn")
    sent(shop, [9.1, -9.2, *scatter(48, seed=3, mean=2.5)])
    shop.read(1500)  # a probe fault
    fault = next(each for each in shop.alarms() if each["kind"] == "probe_fault")
    shop.acknowledge(fault["id"], "noted", comment="@SUM(1+1)*cmd|' /C calc'!A0")
    sent(shop, scatter(20, seed=4))
    for sequence, reason in ((17, "+1+1"), (560, "-2+3 chip")):
        shop.call("POST", f"/readings/{key}/{sequence}/exclude", reason=reason)
    shop.call(
        "PATCH", f"/characteristics/{key}", parameters={"weighting_factor": 3}, reason="\N{PLUS-MINUS SIGN} calmer"
    )
    sent(shop, scatter(30, seed=5))
    run_jobs(shop.server.database, [JOB])  # of this one alone: hundreds of others share the database
    kept = shop.call("GET", f"/signals?characteristic={key}&state=all")["items"]
    shop.call("POST", f"/signals/{kept[0]['id']}/comment", **SAID)


def report(shop: Shop, query: str = PERIOD, characteristic: str | None = None, status: int = 200) -> Any:
    """The report as JSON."""
    return shop.call("GET", f"/characteristics/{characteristic or shop.characteristic}/report.json?{query}", status)


def file(shop: Shop, form: str, query: str = PERIOD, characteristic: str | None = None) -> bytes:
    """The report as a file."""
    answer = shop.admin.get(f"/api/v1/characteristics/{characteristic or shop.characteristic}/report.{form}?{query}")
    assert answer.status_code == 200, answer.text
    return answer.content


def facts(found: Any, section: str) -> dict[str, Any]:
    """The facts of one section by their keys."""
    named = next(each for each in found["sections"] if each["key"] == section)
    return {fact["key"]: fact for fact in named["facts"]}


def table(found: Any, section: str) -> list[dict[str, Any]]:
    """The rows of the table of one section by the keys of their columns."""
    named = next(each for each in found["sections"] if each["key"] == section)
    if named["table"] is None:
        return []
    keys = [column["key"] for column in named["table"]["columns"]]
    return [dict(zip(keys, row, strict=True)) for row in named["table"]["rows"]]
