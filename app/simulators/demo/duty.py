"""The group that is on duty by shifts in the demonstration plant, its days off, and maintenance of its machines."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from inband_client import Client

NAME = "Setters"
SHIFTS = {"06:00": "operator", "14:00": "engineer", "22:00": "admin"}  # who, by the beginning of the shift


def set_up(admin: Client, machines: Sequence[str]) -> None:
    """Days off, the group, and maintenance, as far as they are not there."""
    calendar = admin.get("/notifications/calendar")
    if calendar["country"] is None and not calendar["days"]:
        year = datetime.now(UTC).year
        own = [f"{year}-12-24", f"{year}-12-31"]
        admin.call("PUT", "/notifications/calendar", json={"country": "DE", "subdivision": "BY", "days": own})
    group(admin)
    if machines and not admin.get("/maintenance")["items"]:
        _maintenance(admin, machines)


def _maintenance(admin: Client, machines: Sequence[str]) -> None:
    """Of the first machine it is over, of the last one it is planned: tomorrow, a shift long."""
    over = admin.post("/maintenance", {"machine": machines[0], "reason": "Coolant changed"})
    admin.post(f"/maintenance/{over['id']}/end", {"reason": "Done"})
    begins = datetime.now(UTC).replace(hour=6, minute=0, second=0, microsecond=0) + timedelta(days=1)
    times = {"begins": begins.isoformat(), "ends": (begins + timedelta(hours=8)).isoformat()}
    admin.post("/maintenance", {"machine": machines[-1], "reason": "Spindle bearing is replaced"} | times)


def group(admin: Client) -> int | None:
    """The number of the group that is on duty by shifts: the browsers of those who may sign in; None without any."""
    for each in admin.items("/notifications/groups"):
        if each["name"] == NAME:
            return int(each["id"])
    browsers = {
        each["created_by"]: each["id"]
        for each in admin.items("/notifications/receivers")
        if each["means"] == "browser" and each["created_by"] in SHIFTS.values()
    }
    if not browsers:
        return None
    rota = [{"receivers": [browsers[who]], "shift": shift} for shift, who in SHIFTS.items() if who in browsers]
    return int(admin.post("/notifications/groups", {"name": NAME, "members": [*browsers.values()], "rota": rota})["id"])
