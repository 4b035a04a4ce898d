"""Lines of the bridge's log: one for each reading, decision, correction offered and answered. What they say in words is in
fields too, for programs that collect them (``--log-format json``).
"""

import logging
from collections.abc import Sequence
from typing import Any

from app.bridge.links import Order, Outcome, Received
from inband_client import Decision

log = logging.getLogger(__name__)


def readings(machine: str, received: Sequence[Received], new: int) -> None:
    """Readings that have come from a control. new: the number of them that the store did not have."""
    if new:
        for each in received:
            _reading(machine, each)
    if again := len(received) - new:
        log.info(
            "%s: %d of %d readings had come before, and are not stored twice",
            machine, again, len(received), extra={"machine": machine, "readings": len(received), "again": again},
        )  # fmt: skip


def _reading(machine: str, received: Received) -> None:
    body = received.body
    about = {name: body.get(name) for name in ("characteristic", "measured", "part", "measured_at")}
    words = _words(body)
    if received.fault is not None:
        log.warning(
            "%s: reading %s goes to the quarantine: %s (%s)", machine, received.key, received.fault, words,
            extra={"machine": machine, "key": received.key, "fault": received.fault, **about},
        )  # fmt: skip
        return
    log.info(
        "%s: reading %s: %s", machine, received.key, words, extra={"machine": machine, "key": received.key, **about}
    )


def _words(body: dict[str, Any]) -> str:
    size = body.get("measured")
    words = [
        f"{body.get('characteristic') or body.get('number') or 'no characteristic'}",
        "touches" if "touches" in body else "no size" if size is None else f"{size} mm",
    ]
    words += [f"{name} {value}" for name in ("part", "measured_at") if (value := body.get(name))]
    return ", ".join(words)


def decision(machine: str, key: str, decided: Decision) -> None:
    """The server's answer to a reading. A stop or a hold, and what raises an alarm, is a warning."""
    words = [f"{decided.zone}, {decided.action}"]
    if decided.correction is not None:
        made = decided.correction
        words.append(f"correction {made.number} of {made.amount:+g} mm for tool memory {made.tool_memory}")
    words += [f"alarm {alarm.kind.replace('_', ' ')}" for alarm in decided.alarms]
    level = logging.WARNING if decided.alarms or decided.action in {"stop", "hold"} else logging.INFO
    log.log(
        level, "%s: decision on %s: %s", machine, key, "; ".join(words),
        extra={
            "machine": machine, "key": key, "characteristic": decided.characteristic, "zone": decided.zone,
            "action": decided.action, "correction": None if decided.correction is None else decided.correction.number,
        },
    )  # fmt: skip


def offered(machine: str, order: Order) -> None:
    """A correction that the control can take from now on."""
    log.info(
        "%s: correction %d is offered: tool memory %d from %g to %g mm",
        machine, order.number, order.tool_memory, order.before, order.after,
        extra={
            "machine": machine, "correction": order.number, "tool_memory": order.tool_memory, "before": order.before,
            "after": order.after,
        },
    )  # fmt: skip


def answered(machine: str, outcome: Outcome) -> None:
    """The control's answer to a correction."""
    about = {"machine": machine, "correction": outcome.number, "applied": outcome.applied, "offset": outcome.offset}
    held = "" if outcome.offset is None else f"; the control holds {outcome.offset:g} mm"
    if outcome.applied:
        log.info("%s: correction %d is applied%s", machine, outcome.number, held, extra=about)
    else:
        log.warning(
            "%s: correction %d is refused by the control: %s%s", machine, outcome.number, outcome.reason, held,
            extra=about,
        )  # fmt: skip
