"""A clock that is behind, as the writer decides reading after reading: the tool is paused before parts are out, and for nothing else."""

from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from app.core.clock import FEWEST
from app.core.parameters import Parameters
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.columnar import decide_in_columns
from app.loop.readings.writer.decide import decide_one_by_one, decide_reading
from app.loop.readings.writer.doubts import Answered, leave_out_answered
from app.loop.readings.writer.pending import PendingCorrection, PendingWrites, Verdict
from app.loop.readings.writer.snapshot import LoadedAverage, LoadedStream, LoadedTool, Snapshot
from tests.shop import PARAMETERS

OUT = 8.0  # µm
BOTH, CUT = ("machined_at", "measured_at"), ("machined_at",)
TOOL, AVERAGE = (1, PARAMETERS["tool_memory"]), (1, PARAMETERS["average_memory"])
HOURS = timedelta(hours=1)


class Machine:
    """A lathe that cuts a part a minute, and applies a correction before the next; wear 0.5 µm a part, scatter 0.3 µm.

    tells: the times that it sends, by a clock that is behind; confirmations have that time as well if `says_when`. numbers: it sends that of the last correction, too. buffer: parts between
    cut and receipt. step: of the size. gauge: how long before its receipt a part is measured.
    """

    def __init__(self, tells: tuple[str, ...], behind: timedelta = HOURS * 0, k: int = 2, seed: int = 0) -> None:
        self.tells, self.behind, self.buffer, self.step, self.wear = tells, behind, 0, 0.0, 0.5
        self.gauge, self.numbers, self.number, self.in_effect, self.new_at = timedelta(), False, 0, list[int](), 0
        self.at, self.chance, self.offset = datetime(2026, 3, 2, 6, tzinfo=UTC), np.random.default_rng(seed), 0.0
        self.questions, self.says_when = list[Any](), False
        self.sizes, self.cuts, self.actions, self.alarms = list[float](), list[datetime](), list[str](), list[Any]()
        self.entry, self.snapshot = Entry(1, "lathe", 1, "seat"), Snapshot(last_correction={1: 0}, versions={1: 0})
        self.snapshot.parameters[1] = Parameters(**PARAMETERS | {"weighting_factor": k})
        self.snapshot.streams[1] = LoadedStream(entry=self.entry, version=1, average=AVERAGE[1], tool=TOOL[1])
        self.snapshot.averages[AVERAGE] = LoadedAverage(*AVERAGE)
        self.snapshot.tools[TOOL] = LoadedTool(machine_id=1, number=TOOL[1])

    def part(self) -> None:
        """Cut a part, and measure the one that comes out of the buffer."""
        self.at += timedelta(minutes=1)
        worn = self.wear * (len(self.sizes) - self.new_at)
        self.sizes.append(worn + self.step + self.offset * 1000 + float(self.chance.normal(0, 0.3)))
        self.cuts.append(self.at)
        self.in_effect.append(self.number)
        if len(self.sizes) > self.buffer:
            place = len(self.sizes) - 1 - self.buffer
            self.read(self.sizes[place], self.cuts[place], self.in_effect[place])

    def read(self, size: float, cut: datetime, in_effect: int = 0) -> None:
        """Send a reading, and apply what is asked for before the next part."""
        times = {"machined_at": cut, "measured_at": self.at - self.gauge}
        said: dict[str, Any] = {name: times[name] - self.behind for name in self.tells}
        verdict = self.decide(size, **said | ({"correction_in_effect": in_effect} if self.numbers else {}))
        if verdict.correction is not None and verdict.correction.status == "pending":
            self.apply(verdict.correction)

    def decide(self, size: float, **told: Any) -> Verdict:
        """Have a reading decided, as if it was stored."""
        pending = PendingWrites(self.snapshot)
        reading = ReadingIn("seat", measured=round(40 + size / 1000, 5), **told)
        verdict = decide_reading(pending, self.entry, reading, self.at)
        assert isinstance(verdict, Verdict)
        for number, alarm in enumerate(pending.raised, 1):
            alarm.id = number
        self.alarms += [alarm for alarm in pending.raised if alarm.kind == "early_effect"]
        self.questions += [alarm for alarm in pending.raised if alarm.data.get("why") == "clock"]
        pending.settle()
        self.actions.append(verdict.decision.action.value)
        return verdict

    def apply(self, correction: PendingCorrection) -> None:
        """Confirm it, some seconds later."""
        self.offset, self.number = round(self.offset + correction.amount, 9), correction.number
        tool = self.snapshot.tools[TOOL]
        at = self.at + timedelta(seconds=5) - (self.behind if self.says_when else timedelta())
        self.snapshot.tools[TOOL] = structs.replace(
            tool,
            offset=self.offset,
            total=round(tool.total + correction.amount, 9),
            corrections=[
                c._replace(status="applied", applied_at=at) if c.number == correction.number else c
                for c in tool.corrections
            ],
        )

    def change_tool(self) -> None:
        """Put a new tool in, and say so."""
        self.offset, self.new_at = 0.0, len(self.sizes)
        tool, stream = self.snapshot.tools[TOOL], self.snapshot.streams[1]
        self.snapshot.tools[TOOL] = structs.replace(tool, offset=0.0, total=0.0, reset_at=self.at)
        self.snapshot.streams[1] = structs.replace(stream, gain_from=stream.sequence)
        self.snapshot.averages[AVERAGE] = LoadedAverage(*AVERAGE)

    @property
    def out(self) -> int:
        return sum(abs(size) > OUT for size in self.sizes)

    def run(self, parts: int) -> None:
        """Cut so many, or up to the one that the machine is to stop at."""
        for _part in range(parts):
            self.part()
            if self.actions and self.actions[-1] == "stop":
                break


@pytest.mark.parametrize("k", [1, 2, 4])
@pytest.mark.parametrize("hours", [0.5, 3])
def test_a_clock_that_is_behind_costs_one_part(hours: float, k: int) -> None:
    """Of 60 parts 20 to 30 would be out, of which nothing stops the machine. The alarm comes before, and the first that is out stops it."""
    machines = [Machine(BOTH, HOURS * hours, k, seed) for seed in range(6)]
    for machine in machines:
        machine.run(60)
        assert [alarm.data["by"] for alarm in machine.alarms] == ["clock"]
        [alarm] = machine.alarms
        assert alarm.sequence <= 11
        assert machine.actions[-1] == "stop"
        assert machine.out <= 2
    assert sum(machine.out for machine in machines) <= len(machines) + 1


def test_a_clock_that_is_set_back_while_the_machine_cuts_is_found() -> None:
    """By an hour, as in autumn: all that it sends then is older than what it has sent."""
    machine = Machine(BOTH)
    machine.run(20)
    assert (machine.alarms, machine.out) == ([], 0)
    machine.behind = HOURS
    machine.run(20)
    [alarm] = machine.alarms
    assert alarm.data["by"] == "clock"
    assert alarm.sequence <= 32


@pytest.mark.parametrize("scatter", [0.0, 20.0])
def test_a_clock_that_is_right_to_some_seconds_pauses_nothing(scatter: float) -> None:
    machine = Machine(BOTH)
    for _part in range(100):
        machine.behind = timedelta(seconds=abs(float(machine.chance.normal(0, scatter))))
        machine.part()
    assert (machine.alarms, machine.out) == ([], 0)


@pytest.mark.parametrize("tells", [CUT, BOTH])
@pytest.mark.parametrize("buffer", [4, 12, 25])
def test_parts_that_are_on_the_way_at_an_even_pace_pause_nothing(tells: tuple[str, ...], buffer: int) -> None:
    """Nor where an edge chips, and all that is in the buffer is out of tolerance."""
    for seed in range(6):
        machine = Machine(tells, k=1 + seed % 3, seed=seed)
        machine.buffer, machine.wear = buffer, (0.05, 0.3)[seed % 2]
        for part in range(90):
            machine.step = 10.0 if part >= 50 else 0.0
            machine.part()
        assert machine.alarms == []
        assert "stop" not in machine.actions


def test_a_gauge_whose_every_reading_is_five_minutes_late_pauses_nothing() -> None:
    """It writes when it began, or its file is fetched each five minutes. Parts are on the way for twenty."""
    for seed in range(6):
        machine = Machine(BOTH, k=1 + seed % 3, seed=seed)
        machine.gauge, machine.buffer, machine.wear = timedelta(minutes=5), 20, (0.05, 0.3)[seed % 2]
        for part in range(90):
            machine.step = 10.0 if part >= 50 else 0.0
            machine.part()
        assert machine.alarms == []
        assert "correct" in machine.actions
        assert "stop" not in machine.actions


def test_parts_on_the_way_are_that_while_a_tool_is_paused_for_another_reason() -> None:
    """By `machined_at` a part was cut before a correction, and no clock is under suspicion: it is answered as ever."""
    for late, answer in ((timedelta(minutes=5), "none"), (HOURS, "stop")):
        machine = Machine(BOTH)
        machine.gauge = late
        for size in (0, 0, 0, 6, 6, 6):
            machine.at += timedelta(minutes=1)
            machine.read(size, machine.at - HOURS)
            if machine.actions[-1] == "correct":
                break
        machine.snapshot.tools[TOOL] = structs.replace(machine.snapshot.tools[TOOL], paused_by=7)
        machine.at += timedelta(minutes=1)
        machine.read(OUT + 1, machine.at - HOURS)
        assert machine.actions[-2:] == ["correct", answer]


def test_quiet_readings_of_a_batch_are_among_those_that_came_in() -> None:
    """Else those before and after them look as if they had followed each other."""
    kept = []
    for columns in (False, True):
        machine = Machine(BOTH)
        pending = PendingWrites(machine.snapshot)
        quiet = [
            (machine.entry, ReadingIn("seat", measured=40.0, measured_at=machine.at - timedelta(minutes=late)))
            for late in (0, 3, 9, 4, 2, 7, 1)
        ]
        last = (machine.entry, ReadingIn("seat", measured=40.0, machined_at=machine.at - HOURS))
        decide = decide_in_columns if columns else decide_one_by_one
        decide(pending, [*quiet, last], machine.at)
        kept.append(pending.stream(1).arrivals[-FEWEST:])
    assert kept[0] == kept[1]
    assert [each.sequence for each in kept[1]] == [4, 5, 6, 7, 8]


@pytest.mark.parametrize("tells", [CUT, BOTH])
def test_what_a_network_kept_back_pauses_nothing(tells: tuple[str, ...]) -> None:
    """In a bunch, and one reading each half minute beside those of now."""
    for apart in (0.2, 30.0):
        machine = Machine(tells)
        machine.run(10)
        away = machine.at
        machine.at += HOURS
        for minute in range(30):
            machine.at += timedelta(seconds=apart)
            now, cut = machine.at, away + timedelta(minutes=2 * minute)
            machine.at = max(cut, now)
            machine.behind = machine.at - cut  # measured when it was cut
            machine.read(0.5 * minute, machine.at)
        assert machine.alarms == []


def test_history_that_is_sent_as_readings_pauses_nothing() -> None:
    """A part a minute, three hours ago, as fast as they can be sent."""
    machine = Machine(BOTH)
    for minute in range(60):
        machine.at += timedelta(seconds=0.05)
        machine.behind = HOURS * 3 - timedelta(minutes=minute)
        machine.read(0.3 * minute, machine.at)
    assert machine.alarms == []


@pytest.mark.parametrize("hours", [0.5, 3])
def test_a_tool_that_was_changed_is_no_guess_where_numbers_show_the_clock(hours: float) -> None:
    """All parts of the new tool count as cut before, and nothing would be corrected until the clock has caught up, or be said of why."""
    for seed in range(6):
        machine = Machine(CUT, HOURS * hours, 1 + seed % 3, seed)
        machine.numbers = True
        machine.run(25)
        assert (machine.alarms, machine.out) == ([], 0), "the number wins"
        machine.change_tool()
        machine.run(60)
        [alarm] = machine.alarms
        assert (alarm.data["by"], alarm.data["before"], alarm.sequence) == ("clock", True, 26)
        assert alarm.data["lag"] <= machine.behind.total_seconds()
        assert machine.actions[-1] == "stop"
        assert machine.out == 1


def test_a_number_that_shows_some_minutes_hides_no_reading_that_shows_more() -> None:
    machine = Machine(BOTH, timedelta(minutes=15.5))
    machine.numbers = True
    machine.run(25)
    machine.change_tool()
    machine.run(10)
    [alarm] = machine.alarms
    assert (alarm.data["before"], alarm.data["lag"]) == (True, 15.5 * 60)
    assert "number" not in alarm.data


@pytest.mark.parametrize("tells", [CUT, BOTH])
@pytest.mark.parametrize("buffer", [0, 1, 12, 40])
def test_numbers_of_parts_on_the_way_show_no_clock(tells: tuple[str, ...], buffer: int) -> None:
    for seed in range(6):
        machine = Machine(tells, k=1 + seed % 3, seed=seed)
        machine.numbers, machine.buffer, machine.wear = True, buffer, 0.1
        machine.run(50)
        machine.change_tool()
        machine.run(60)
        assert [alarm for alarm in machine.alarms if alarm.data.get("number")] == []
        assert "correct" in machine.actions[-60 + buffer :]
        assert "stop" not in machine.actions


@pytest.mark.parametrize("k", [1, 2, 4])
@pytest.mark.parametrize("hours", [0.5, 3])
def test_where_the_cut_alone_is_told_a_person_is_asked_before_parts_are_out(hours: float, k: int) -> None:
    for seed in range(6):
        machine = Machine(CUT, HOURS * hours, k, seed)
        while not machine.questions:
            machine.part()
        question = machine.questions[0]
        assert (len(machine.sizes) <= 12, machine.out) == (True, 0)
        assert (question.tool_memory, question.data["lag"]) == (None, pytest.approx(3600 * hours))


@pytest.mark.parametrize(("tells", "numbers"), [(BOTH, False), (CUT, True)])
def test_nobody_is_asked_where_it_is_known(tells: tuple[str, ...], numbers: bool) -> None:
    for buffer in (0, 1, 4, 25):
        machine = Machine(tells, k=2)
        machine.buffer, machine.numbers, machine.wear = buffer, numbers, 0.2
        machine.run(90)
        assert machine.questions == []
    machine = Machine(CUT, k=2)
    machine.buffer = 4
    machine.run(90)
    assert machine.questions == [], "parts that are on their way for some minutes"


def test_what_was_answered_is_not_asked_again() -> None:
    machine = Machine(CUT, HOURS)
    while not machine.questions:
        machine.part()
    for answered, left in ((Answered(1, 3, "clock", 0, 3600.0), 1), (Answered(1, 0, "clock", 0, 3600.0), 0)):
        assert len(left_of(machine, answered)) == left


def left_of(machine: Machine, answered: Answered) -> list[Any]:
    """Questions of this machine that are asked although this was answered."""
    pending = PendingWrites(machine.snapshot)
    pending.raised = list(machine.questions)
    leave_out_answered(pending, [answered])
    return pending.raised


@pytest.mark.parametrize("tells", [CUT])
@pytest.mark.parametrize("buffer", [15, 24, 60, 90])
def test_an_even_buffer_of_the_answered_length_is_never_asked_about_again(tells: tuple[str, ...], buffer: int) -> None:
    """Nor where clock and pace scatter by some seconds, nor where the parts are less long on their way."""
    for seed in range(3):
        machine = Machine(tells, k=1 + seed % 2, seed=seed)
        machine.buffer, machine.wear = buffer, 1.0
        for _part in range(buffer + 80):
            machine.behind = timedelta(seconds=abs(float(machine.chance.normal(0, 6))))
            machine.part()
        assert machine.questions
        for minutes in (buffer, buffer + 0.3, buffer + 40):
            assert left_of(machine, Answered(1, 0, "clock", 0, 60.0 * minutes)) == []


@pytest.mark.parametrize("jump", [15, 30, 60, 600])
@pytest.mark.parametrize("buffer", [16, 40])
def test_a_clock_that_goes_wrong_after_the_answer_is_asked_about(buffer: int, jump: int) -> None:
    for seed in range(3):
        machine = Machine(CUT, k=1, seed=seed)
        machine.buffer, machine.wear = buffer, 1.0
        machine.run(buffer + 40)
        answered = Answered(1, 0, "clock", 0, machine.questions[-1].data["lag"])
        assert left_of(machine, answered) == []
        machine.behind, machine.questions = timedelta(minutes=jump), []
        machine.run(buffer + 60)
        first = left_of(machine, answered)[0]
        assert first.data["lag"] == pytest.approx(60 * (buffer + jump), abs=60)
        assert first.sequence <= buffer + 60


def test_after_a_tool_change_a_person_is_asked_although_all_times_are_of_one_clock() -> None:
    """Until then they fit; but the change has the time of the server, and nothing would be corrected for hours."""
    machine = Machine(CUT, HOURS * 3)
    machine.says_when = True
    machine.run(25)
    assert (machine.questions, machine.out) == ([], 0)
    machine.change_tool()
    machine.run(10)
    assert (machine.questions[0].sequence, machine.questions[0].data["before"], machine.out) == (30, True, 0)
