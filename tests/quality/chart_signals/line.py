"""A characteristic that is only measured, watched by a baseline whose limits are easy to reckon with."""

from typing import Any

from app.jobs.actions import run_jobs
from app.quality.chart_signals.jobs import JOB
from tests.shop import Shop

# µm, mean 0, mean moving range 2.256: sigma is 2 µm, limits at ±6 µm.
QUIET = [1.128, -1.128] * 30


class Line:
    """A characteristic that is only measured, with a baseline of its first readings."""

    def __init__(self, shop: Shop, key: str = "", baseline: bool = True, **more: Any) -> None:
        self.shop, self.key = shop, f"{shop.characteristic}-{key or 'line'}"
        shop.add(self.key, tool_memory=0, average_memory=0, mode="measure_only")
        self.push(QUIET)
        if baseline:
            self.freeze(1, len(QUIET), **more)

    def push(self, values: list[float]) -> None:
        self.shop.push(values, self.key)

    def freeze(self, first: int, last: int, **more: Any) -> None:
        given: dict[str, Any] = {
            "quantity": "deviation",
            "first_sequence": first,
            "last_sequence": last,
            "reason": "quiet",
        } | more
        self.shop.call("POST", f"/characteristics/{self.key}/baselines", 201, **given)

    def rules(self, *, look_back: bool = False, **charts: dict[str, str]) -> Any:
        path = f"/characteristics/{self.key}/rules"
        return self.shop.call("PUT", path, rules=charts, reason="tried", look_back=look_back)

    def look(self) -> None:
        run_jobs(self.shop.server.database, [JOB])

    def signals(self, state: str = "all") -> list[dict[str, Any]]:
        found = self.shop.call("GET", f"/signals?characteristic={self.key}&state={state}")["items"]
        return sorted(found, key=lambda each: each["id"])

    def runs(self, state: str = "all") -> list[tuple[str, str, int, int]]:
        return [
            (each["chart"], each["rule"], each["first_sequence"], each["last_sequence"]) for each in self.signals(state)
        ]

    def exclude(self, sequence: int) -> None:
        self.shop.call("POST", f"/readings/{self.key}/{sequence}/exclude", reason="Chip on the stylus")

    def alarms(self, state: str = "active") -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.shop.call("GET", f"/alarms?characteristic={self.key}&state={state}")["items"]
        return [alarm for alarm in found if alarm["kind"] == "signal"]
