"""One machine of the plant in its loop: fetch corrections, cut, measure, report, stop when it is ordered to.

Simulated seconds become times as follows: the past that is pushed at the start ends at the start and runs at its own
pace; from there on the plant runs `speed` times as fast as it says, so its times are those of the wall clock.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from random import Random
from typing import Any

from app.simulators.demo import drawing
from app.simulators.demo.simulation import Machine, Probe
from inband_client import Client, Conflict, Correction, ProblemError, Reading, Stopped

log = logging.getLogger(__name__)
DAY = 24 * 3600.0  # s
STOPS = {"tool_worn", "probe_fault", "offset_limit"}
LARGEST_LAG = 30.0  # s of the wall clock: what was missed beyond it is not made up for
SETS_ASIDE = {"oversize", "undersize", "tool_worn"}  # the first of them shows a quarantine
LOOKS_EVERY, IN_A_ROW = 10, 3  # parts between two looks at the board; parts not accepted that ask for a hand
NO_CAUSES: Mapping[str, int] = {}
PATIENCE = (60.0, 90.0)  # s of the wall clock until the simulated operator steps in


@dataclass
class Pace:
    """Simulated seconds and times."""

    speed: float
    began: datetime
    origin: float  # simulated seconds at `began`

    def moment(self, at: float) -> datetime:
        """The time that is written on what happened at this simulated second."""
        ahead = at - self.origin
        return self.began + timedelta(seconds=ahead / self.speed if ahead > 0 else ahead)

    def due_in(self, at: float) -> float:
        """Seconds of the wall clock until it happens."""
        return (self.moment(at) - datetime.now(UTC)).total_seconds()

    def now(self) -> float:
        """The simulated second of this moment."""
        return self.origin + (datetime.now(UTC) - self.began).total_seconds() * self.speed


class Line:
    """A machine with its gateway to the server, and the operator who looks after it."""

    def __init__(
        self,
        machine: Machine,
        gateway: Client,
        operator: Client,
        run: str,
        rng: Random,
        ending: threading.Event,
        causes: Mapping[str, int] = NO_CAUSES,
    ) -> None:
        self.machine = machine
        self.key = machine.spec.key
        self._gateway = gateway
        self._operator = operator
        self._run = run
        self._parts = f"{run}-{initials(self.key)}"  # machines count their parts each for itself
        self._rng = rng
        self._ending = ending
        self._causes = causes  # numbers of the catalogue by kind of alarm
        self._changed_at: dict[int, str | None] = {}
        self._ordered_to_stop = False  # the machine was ordered to stop because of what its dirty stylus measured
        self._set_aside = self._photographed = False
        self._patience: dict[str, float] = {}  # what waits for a person, and until when we leave it to others
        self.pace = Pace(1.0, datetime.now(UTC), 0.0)

    def close(self) -> None:
        """Hang up."""
        self._gateway.close()
        self._operator.close()

    # --- the past

    def has_history(self) -> bool:
        """Tell if the server holds readings of this machine already."""
        first = self.machine.spec.features[0].key
        return bool(self._gateway.get("/readings", characteristic=first, limit=1)["items"])

    def fill(self, parts: int, days: float | None = None) -> None:
        """Push a past that ends now, as fast as the server takes it; each part is cut with what had been decided by then.

        parts: how many are cut, without a night between them. days: what is cut in that many working days and the nights
        and weekends between them, instead.
        """
        machine, nights = self.machine, days is not None
        accepting = any("accept" in feature.more for feature in machine.spec.features)
        rehearsal = deepcopy(machine)  # how long it takes does not depend on what is decided
        while rehearsal.at < days * DAY if days is not None else rehearsal.serial < parts:
            rehearsal.rest(nights=nights)
            rehearsal.cut()
        self.pace = Pace(1.0, datetime.now(UTC), rehearsal.at)
        while machine.serial < rehearsal.serial:
            if self._ending.is_set():
                return
            if machine.rest(nights=nights) or (accepting and machine.serial % LOOKS_EVERY == 0):
                self._note_alarms()
            machine.cut()
            self._apply(self._push_batch(machine.measure()))
            self._change_worn_tools_of_the_past()
        self._note_alarms()

    def _note_alarms(self) -> None:
        for alarm in self._active_alarms():
            if alarm["kind"] == "acceptance":
                self._acknowledge(alarm, *REMEDIES["acceptance"])
            else:
                self._acknowledge(alarm, "noted", "Looked at; the loop has corrected it.")
            if _all_rejected(alarm):
                self._measure_what_waits()
                self._set_by_hand(alarm)

    def _measure_what_waits(self) -> None:
        while self.machine.pipeline:
            self._apply(self._push_batch(self.machine.measure(drain=True)))

    def _change_worn_tools_of_the_past(self) -> None:
        """Between two parts, when all that the old edge has cut is measured and what was decided on it is in its offset."""
        machine = self.machine
        worn = [number for number, edge in machine.edges.items() if edge.parts >= edge.tool.life]
        if not worn:
            return
        self._measure_what_waits()
        self._fetch_corrections()
        self._change_worn_tools()
        for number in worn:
            machine.fresh_edge(number, 0.0)

    def _push_batch(self, probes: list[Probe]) -> list[Correction]:
        batch = self._gateway.push_many(self._reading(probe, past=True) for probe in probes)
        return [decision.correction for decision in batch.decisions if decision.correction]

    def _apply(self, corrections: list[Correction]) -> None:
        """Put them into the offsets; the next reading confirms them by its `correction_in_effect`.

        What a person approves is approved now, whatever time the past has, so it is confirmed now too.
        """
        for correction in corrections:
            edge = self.machine.edges[correction.tool_memory]
            if correction.status == "pending":
                edge.correct(correction.number, correction.amount)
            elif correction.status == "awaiting_approval":
                self._approve(correction.number)
                self._gateway.confirm(self.key, correction.number, edge.correct(correction.number, correction.amount))

    def _approve(self, number: int) -> None:
        self._operator.post(f"/corrections/{self.key}/{number}/approve", {"reason": "Plausible, small."})

    # --- the present

    def settle(self) -> None:
        """Take over the offsets that the server knows, after a start with an older history."""
        tools = self._tools()
        self.machine.settle({number: tool["offset"] for number, tool in tools.items()})
        for number, tool in tools.items():
            waiting = [correction["number"] for correction in tool["open_corrections"]]
            last = tool["last_correction"]
            self.machine.edges[number].in_effect = min(waiting) - 1 if waiting else last["number"] if last else 0

    def live(self, pace: Pace) -> None:
        """Cut and measure until the plant ends."""
        self.pace = pace
        self._changed_at = {number: tool["changed_at"] for number, tool in self._tools().items()}
        self.machine.begin_live()
        self.machine.stand(pace.now())
        while not self._ending.is_set():
            try:
                self._cycle()
            except Stopped:
                return
            except ProblemError as refusal:
                log.warning("%s: %s", self.key, refusal)
                self._ending.wait(1.0)

    def _cycle(self) -> None:
        machine = self.machine
        machine.rest()
        self._wait_until(machine.at + machine.spec.cycle)
        self._fetch_corrections()
        if self._follow_tool_memory():
            machine.stand(self.pace.now())  # the next part is cut after the change, not before
            return
        alarms = self._active_alarms()
        self._look_after(alarms)
        kinds = {alarm["kind"] for alarm in alarms}
        if machine.dirt and "probe_fault" not in kinds and self._ordered_to_stop:
            machine.clean_stylus()
            self._ordered_to_stop = False
        if kinds & STOPS:
            machine.stand(machine.at + machine.spec.cycle)
            if "probe_fault" not in kinds:
                self._push(machine.measure(drain=True))
            return
        machine.cut()
        self._push(machine.measure())
        self._change_worn_tools()

    def _push(self, probes: list[Probe]) -> None:
        """One reading after the other; a machine that is ordered to stop does not go on probing."""
        for probe in probes:
            if self._gateway.push(self._reading(probe)).action == "stop":
                self._ordered_to_stop = True
                return

    def _reading(self, probe: Probe, *, past: bool = False) -> Reading:
        # In the past the tools are changed now, whatever time it has: only the corrections say what was cut when.
        moment = self.pace.moment(probe.measured_at)
        return Reading(
            characteristic=probe.feature.key,
            measured=None if probe.touches else probe.size,
            touches=probe.touches or None,
            measured_at=min(moment, datetime.now(UTC)) if past else moment,  # it may take longer than rehearsed
            machined_at=None if past or probe.part.cut_at < self.pace.origin else self.pace.moment(probe.part.cut_at),
            part=f"{self._parts}-{probe.part.serial:04d}",
            key=f"{self._run}:{self.key}:{probe.part.serial}:{probe.feature.key}",
            correction_in_effect=probe.part.in_effect[probe.feature.key],
            context=self.machine.spec.context_of(probe.feature, probe.part.serial, probe.part.temperature),
        )

    def _fetch_corrections(self) -> None:
        for correction in self._gateway.pending(self.key):
            edge = self.machine.edges.get(correction.tool_memory)
            if edge is None:  # a location that someone else uses
                continue
            offset = None
            if correction.number not in edge.applied:  # else it is in the offset already, with those after it
                offset = edge.correct(correction.number, correction.amount)
            try:
                self._gateway.confirm(self.key, correction.number, offset)
            except ProblemError as refusal:  # superseded in this moment: the tool memory says what holds
                log.info("%s: %s", self.key, refusal)

    def _follow_tool_memory(self) -> bool:
        """Take the offsets of the tool memory into the control; tell if a person changed a tool."""
        changed = False
        for number, tool in self._tools().items():
            edge = self.machine.edges[number]
            if tool["changed_at"] != self._changed_at[number]:
                self._changed_at[number] = tool["changed_at"]
                self.machine.fresh_edge(number, tool["offset"])
                changed = True
            edge.offset = tool["offset"]
        return changed

    def _tools(self) -> dict[int, dict[str, Any]]:
        tools = self._gateway.items(f"/machines/{self.key}/tools")
        return {tool["tool_memory"]: tool for tool in tools if tool["tool_memory"] in self.machine.edges}

    # --- the operator

    def _look_after(self, alarms: list[dict[str, Any]]) -> None:
        """Do for the visitor what has waited for a person for longer than a visitor needs."""
        waiting: dict[str, Callable[[], object]] = {}
        for alarm in alarms:
            waiting[f"alarm {alarm['id']}"] = lambda alarm=alarm: self._acknowledge(
                alarm, *REMEDIES.get(alarm["kind"], NOTED)
            )  # type: ignore[misc]
        for correction in self._operator.items(f"/machines/{self.key}/corrections", status="awaiting_approval"):
            number = correction["number"]
            waiting[f"correction {number}"] = lambda number=number: self._approve(number)  # type: ignore[misc]
        now = time.monotonic()
        self._patience = {what: self._patience.get(what) or now + self._rng.uniform(*PATIENCE) for what in waiting}
        for what, step_in in waiting.items():
            if now >= self._patience[what]:
                step_in()
        for alarm in alarms:
            if _all_rejected(alarm) and now >= self._patience[f"alarm {alarm['id']}"]:
                self._set_by_hand(alarm)

    def _active_alarms(self) -> list[dict[str, Any]]:
        return list(self._operator.items("/alarms", state="active", machine=self.key))

    def _acknowledge(self, alarm: dict[str, Any], action: str, comment: str) -> None:
        body: dict[str, Any] = {"action": action, "comment": f"{comment} (simulated operator)"}
        if alarm["kind"] in self._causes:
            body["cause"] = self._causes[alarm["kind"]]
        reason = "Until they are measured by hand (simulated operator)"
        try:
            if alarm["kind"] in SETS_ASIDE and not self._set_aside:
                self._set_aside = True
                self._operator.post("/quarantines", {"alarm": alarm["id"], "reason": reason}, repeat=True)
            if alarm["kind"] == "tool_worn" and not self._photographed:
                self._photographed = True
                photo = {"content": drawing.chipped_edge()}
                self._operator.post(f"/alarms/{alarm['id']}/photos", photo, repeat=True)
            self._operator.post(f"/alarms/{alarm['id']}/acknowledge", body | self._measured_by_hand(alarm), repeat=True)
        except Conflict as first:
            log.info("%s: %s", self.key, first)

    def _set_by_hand(self, alarm: dict[str, Any]) -> None:
        """Correct the offset by the bore gauge's deviation of the last part."""
        feature = next(f for f in self.machine.spec.features if f.key == alarm["characteristic"])
        offset = self._tools()[feature.tool]["offset"] + feature.factor * alarm["data"]["deviation"]
        reason = f"{alarm['count']} parts not accepted: set by the bore gauge (simulated operator)"
        self._operator.call(
            "PUT",
            f"/machines/{self.key}/tools/{feature.tool}",
            json={"offset": round(offset, 6), "reason": reason},
        )
        self.machine.edges[feature.tool].offset = round(offset, 6)

    def _measured_by_hand(self, alarm: dict[str, Any]) -> dict[str, Any]:
        """A rejected part is measured with a bore gauge: what lies far out was a chip under the stylus, not the part."""
        if alarm["kind"] != "acceptance":
            return {}
        target = next(f.target for f in self.machine.spec.features if f.key == alarm["characteristic"])
        measured_deviation, limit = alarm["data"]["deviation"], alarm["data"]["limit"]
        deviation = self._rng.gauss(measured_deviation if abs(measured_deviation) < 1.5 * limit else 0.0, 0.001)
        verdict = "good" if abs(deviation) <= limit else "bad"
        return {"hand_measured": round(target + deviation, 4), "hand_verdict": verdict}

    def _change_worn_tools(self) -> None:
        for number, edge in self.machine.edges.items():
            if edge.parts >= edge.tool.life:
                self._operator.post(
                    f"/machines/{self.key}/tools/{number}/change",
                    {"offset": 0.0, "reason": f"{edge.tool.name}: changed after {edge.parts} parts"},
                    repeat=True,
                )

    def _wait_until(self, at: float) -> None:
        due = self.pace.due_in(at)
        if due < -LARGEST_LAG:
            self.machine.stand(self.pace.now())
        elif due > 0:
            self._ending.wait(due)


def initials(key: str) -> str:
    """The mark of a machine on its parts.

    >>> initials("lathe-1"), initials("mill-1")
    ('L1', 'M1')
    """
    return "".join(word if word.isdecimal() else word[0] for word in key.split("-") if word).upper()


def _all_rejected(alarm: dict[str, Any]) -> bool:
    """Tell if part after part is rejected: such parts correct nothing, so only a person ends it."""
    if alarm["kind"] != "acceptance":
        return False
    in_a_row: bool = alarm["count"] == alarm["last_sequence"] - alarm["sequence"] + 1 >= IN_A_ROW
    return in_a_row


NOTED = ("noted", "Looked at.")
REMEDIES = {
    "tool_worn": ("tool_replaced", "Edge was chipped; fresh insert."),
    "offset_limit": ("tool_replaced", "Fresh insert."),
    "tool_life": ("tool_replaced", "Fresh insert."),
    "implausible": ("false_reading", "Chip on the stylus; wiped."),
    "probe_fault": ("false_reading", "Stylus was dirty; wiped."),
    "acceptance": ("measured_by_hand", "Bore gauge"),
    "oversize": ("noted", "Part sorted out."),
    "undersize": ("noted", "Part sorted out."),
}
