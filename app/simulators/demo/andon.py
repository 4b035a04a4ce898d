"""The andon of the demonstration plant: a webhook on this computer that writes down what it gets, so that notifications show."""

import json
import logging
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

from app.simulators.demo import duty
from inband_client import Client, Invalid

log = logging.getLogger(__name__)

NAME = "Andon of the demonstration"
LONGEST = 1_000_000  # bytes of a message


class _Andon(BaseHTTPRequestHandler):
    timeout = 10

    def do_POST(self) -> None:
        length = min(int(self.headers.get("Content-Length") or 0), LONGEST)
        try:
            subject = json.loads(self.rfile.read(length)).get("subject")
        except (ValueError, AttributeError):
            subject = "?"
        if subject:  # else a list of changes
            log.info("andon: %s", subject)
        self.send_response(204)
        self.end_headers()

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the name that is overridden
        """Say nothing of each request."""


def start(admin: Client) -> None:
    """Listen, and let Inband notify it of what stops a machine or wears a tool, where its administrator permits that."""
    server = HTTPServer(("127.0.0.1", 0), _Andon)
    try:
        _add(admin, f"http://127.0.0.1:{server.server_port}/")
    except Invalid as refusal:
        server.server_close()
        log.warning("no andon: %s", refusal)
        return
    threading.Thread(target=server.serve_forever, name="demo andon", daemon=True).start()


def _add(admin: Client, address: str) -> None:
    known = next((each for each in admin.items("/notifications/receivers") if each["name"] == NAME), None)
    if known is not None:  # of an earlier run, which had another port
        admin.call("PATCH", f"/notifications/receivers/{known['id']}", json={"address": address})
        return
    receiver = {"name": NAME, "means": "webhook", "address": address, "events": ["tool"]}
    number = admin.post("/notifications/receivers", receiver)["id"]
    andon = {"after": 0, "receivers": [number]}
    group = duty.group(admin)
    later = [{"after": 10, "on_duty": [group]}] if group is not None else []
    for name, steps, more in (
        ("Stopped or worn", [andon, *later], {"tones": ["stop", "wear"], "repeat": 30, "urgent": True}),
        (
            "Everything else, every hour",
            [andon],
            {"tones": ["attention", "waiting"], "digest": 60, "on_days_off": False},
        ),
    ):
        admin.post("/notifications/routes", {"name": name, "steps": steps, **more})
