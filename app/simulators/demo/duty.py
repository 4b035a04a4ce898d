"""The group that is on duty by shifts in the demonstration plant, and its days off."""

from datetime import UTC, datetime

from inband_client import Client

NAME = "Setters"
SHIFTS = {"06:00": "operator", "14:00": "engineer", "22:00": "admin"}  # who, by the beginning of the shift


def set_up(admin: Client) -> None:
    """Days off and the group, as far as they are not there."""
    calendar = admin.get("/notifications/calendar")
    if calendar["country"] is None and not calendar["days"]:
        year = datetime.now(UTC).year
        own = [f"{year}-12-24", f"{year}-12-31"]
        admin.call("PUT", "/notifications/calendar", json={"country": "DE", "subdivision": "BY", "days": own})
    group(admin)


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
