"""Receivers that fail in words."""

from app.language.i18n import _
from app.loop.notifications.tables import Receiver


def what_to_look_at(row: Receiver) -> str:
    """The settings to look at where messages to a receiver fail; empty where what was answered names one itself."""
    if "INBAND_" in (row.failure or ""):
        return ""
    return {
        "mail": _("Check the address, INBAND_MAIL_SERVER, and the log of the mail server."),
        "webhook": _("Check the address, and the program behind it: its log says why it does not take the message."),
        "apprise": _("Check the address as apprise writes it, and that this server reaches the service."),
    }.get(row.means, "")
