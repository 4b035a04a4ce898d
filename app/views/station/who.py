"""The question who acts at a station, and the answer to it."""

from collections.abc import Mapping
from typing import Any

from fastapi import Request
from sqlalchemy.orm import Session

from app.access import devices
from app.access.audit.actions import acts
from app.access.deps import AtStation, Caller
from app.access.identification import LONGEST_PIN, NotIdentified, Shown, identify
from app.errors import InbandError, Invalid, NotAllowed, TooManyRequests
from app.web.forms import by_field

REFUSED = (Invalid, NotIdentified, NotAllowed, TooManyRequests)
"""After these the same is asked again, with what was typed."""


def who(request: Request, session: Session, at: AtStation, form: Mapping[str, str]) -> Caller:
    """The person who acts: signed in, or identified on the device for this one action.

    Raises `NotIdentified`, `TooManyRequests`, and `NotAllowed` for a person without the role operator.
    """
    if at.device is None:
        assert at.caller is not None
        at.caller.must("operator")
        return at.caller
    name = form.get("other_name", "").strip() or form.get("who", "")
    shown = Shown(name, form.get("pin", ""), form.get("badge", "").strip())
    session.commit()  # its connection is given back: identification has transactions of its own
    caller = identify(request.app.state.database, at.device, shown)
    caller.must("operator")
    acts(caller.person_id, None, at.device.id)
    return caller


def asked(session: Session, at: AtStation, form: Mapping[str, str], error: InbandError | None) -> dict[str, Any]:
    """Content of every second touch: what was typed, what was wrong, and on a device the question who acts."""
    errors: dict[str, str] = {}
    if error is not None:
        errors = by_field(error) or {"who": f"{error.detail} {error.advice}".strip()}
    return {
        "form": form,
        "errors": errors,
        "asks_who": at.device is not None,
        "people": devices.people_at(session, at.device.id) if at.device else [],
        "longest": LONGEST_PIN,
    }
