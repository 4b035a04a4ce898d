"""Common parts of all Set-up pages: tabs, and the message about the last action."""

from typing import Any

from fastapi import Request, Response

from app.access.deps import Caller
from app.language.i18n import _
from app.web.templates import page


def setup_page(request: Request, template: str, caller: Caller, tab: str, **context: Any) -> Response:
    """A page of Set-up with the tabs that this caller may use."""
    tabs = [
        ("characteristics", _("Characteristics"), "/setup/characteristics"),
        ("machines", _("Machines and keys"), "/setup/machines"),
        ("programs", _("Program text"), "/setup/programs"),
    ]
    if caller.may("admin"):
        tabs.append(("people", _("People"), "/setup/people"))
        tabs.append(("stations", _("Stations"), "/setup/stations"))
        tabs.append(("screens", _("Wall screens"), "/setup/screens"))
        tabs.append(("notifications", _("Notifications"), "/setup/notifications"))
    if caller.may("engineer"):
        tabs.append(("reactions", _("Reaction plans"), "/setup/reactions"))
        tabs.append(("audit", _("Record of changes"), "/setup/audit"))
        tabs.append(("jobs", _("Background jobs"), "/setup/jobs"))
    return page(
        request,
        f"set_up/{template}",
        tabs=[(text, href, name == tab) for name, text, href in tabs],
        done=done(request.query_params.get("done", "")),
        may_edit=caller.may("engineer"),
        me=caller,
        **context,
    )


def done(code: str) -> str | None:
    """The sentence for what the page before did."""
    return {
        "added": _("Added."),
        "deleted": _("Deleted."),
        "test-sent": _("A test is sent within seconds; below, the delivery says how it ended."),
        "changed": _("Saved."),
        "same": _("Nothing was different; nothing was changed."),
        "revoked": _("The key is revoked. It stops working within a second."),
        "role": _("The role is changed."),
        "disabled": _("The person can no longer sign in, and has been signed out everywhere."),
        "enabled": _("The person can sign in again."),
        "screen-revoked": _("The key is revoked. The screen shows nothing from its next look on."),
        "unbound": _("The device is revoked. It shows nothing any more."),
        "badge": _("The badge is bound."),
        "no-badges": _("The badges are removed."),
        "withdrawn": _("The invitation is withdrawn."),
    }.get(code)
