"""The four programs of the ring, step by step and without any control's words: one description for all of them.

Expressions are written as Python writes them. ``block[…]`` is the register block (`app.core.ring`), ``effect[…]`` the numbers of
the corrections in effect, one for each tool; other names are numbers of the program's own. A control keeps whole numbers as
REAL and an unset one as empty, so nothing is compared for equality.

Each program may be cut off between any two steps and is then run again from its beginning:

- a reading counts when its ``SEQ`` is written. Where the power goes before ``WRITTEN``, the next run finds that slot complete
  and counts it first, so that no other reading is written under its number;
- a correction is an absolute value. Where the power goes behind it, the next run finds the offset at that value already, and
  answers without setting it again.
"""

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple

from app.core.programs.lines import MM_PER_INCH, written
from app.core.programs.ring_settings import (
    LONGEST_SIZE,
    MAIL_TIME,
    MOST_CHARACTERISTICS,
    MOST_PARTS,
    TOLERANCE,
    TOLERANCE_INCH,
    TOOLS,
    RingSettings,
)
from app.core.ring import (
    FIRST_SLOT,
    HIGHEST_SEQUENCE,
    LAYOUT,
    MAIL_WEIGHTS,
    MODULUS,
    SIZE,
    SLOT_SIZE,
    SLOT_WEIGHTS,
    SLOTS,
    STEPS,
    Unit,
)

PAUSE = 0.5
"""Seconds between two looks at the acknowledgement."""
MOST_STEPS = LONGEST_SIZE * STEPS[Unit.MM]
"""Of a size: eight digits."""
MOST_MAIL = 200_000
"""No mail's tool, edge, parameter, lengths and check sum are together as much: nothing is calculated with what is damaged so."""


class Remark(NamedTuple):
    text: str


class Let(NamedTuple):
    """target: a name, ``block[…]`` or ``effect[…]``."""

    target: str
    value: str
    remark: str = ""


class If(NamedTuple):
    """Go to the label where the condition holds: two expressions, with one of < <= > >= between them."""

    condition: str
    label: str


class Missing(NamedTuple):
    """Go to the label where the caller has left out this argument, on controls that can tell."""

    argument: str
    label: str


class Filled(NamedTuple):
    """0 for each of these arguments that the caller has left out."""

    arguments: tuple[str, ...]


class Label(NamedTuple):
    name: str


class Goto(NamedTuple):
    label: str


class Do(Enum):
    """Steps that each control has its own words for."""

    SYNC = "nothing behind this is done ahead"
    PAUSE = "wait half a second"
    READ_UNIT = "unit: 1 mm, 2 inch"
    READ_CLOCK = "time: seconds of the day"
    NEW_EPOCH = "epoch: a number that was not there before"
    FIND_TOOL = "go to REPLY where the control does not have tool and edge"
    READ_WEAR = "offset: the wear of tool, edge and parameter"
    SET_WEAR = "that wear becomes value"
    RETURN = "back to the program that called"


class Alarm(Enum):
    """Alarms with their number and what the control shows: 26 characters at most, as older controls have it."""

    NOT_FETCHING = (1, "INBAND BRIDGE NOT FETCHING")
    NOT_SET_UP = (2, "INBAND BLOCK IS NOT SET UP")
    OTHER_UNIT = (3, "INBAND OTHER UNIT THAN SET")
    WRONG_ARGUMENT = (4, "INBAND WRONG ARGUMENT")
    NEW_EPOCH = (5, "INBAND NEEDS A NEW EPOCH")
    IN_USE = (6, "INBAND REGISTERS IN USE")
    MIXED_UNIT = (7, "INBAND UNITS ARE MIXED")
    NOT_FETCHED = (8, "INBAND OLD READINGS WAIT")
    STOP = (9, "INBAND SAYS STOP")
    HOLD = (10, "INBAND SAYS HOLD")
    NOT_DECIDED = (11, "INBAND HAS NOT DECIDED")


class Stop(NamedTuple):
    alarm: Alarm


Step = Remark | Let | If | Missing | Filled | Label | Goto | Do | Stop


class RingProgram(NamedTuple):
    """A program. name: `setup`, `reading`, `correction` or `tool`; arguments: what its caller hands over, in this order."""

    name: str
    title: str
    arguments: tuple[str, ...]
    steps: tuple[Step, ...]


def programs(settings: RingSettings) -> tuple[RingProgram, ...]:
    """The four programs: set up the block, send a reading, take a correction, a tool was selected."""
    return (
        RingProgram("setup", "SET UP THE BLOCK", ("applied",), tuple(_setup())),
        RingProgram(
            "reading",
            "SEND A READING",
            ("characteristic", "measured", "tool", "part", "in_effect", "status"),
            tuple(_reading(settings)),
        ),
        RingProgram("correction", "TAKE A CORRECTION", (), tuple(_correction(settings))),
        RingProgram("tool", "A TOOL WAS SELECTED", ("tool",), tuple(_tool())),
    )


def _reduced(name: str) -> Let:
    """The remainder by the modulus. Done often, so that no number has more than seven digits."""
    return Let(name, f"{name}-trunc({name}/{MODULUS})*{MODULUS}")


def _summed(total: str, name: str, weight: int) -> Iterator[Let]:
    """Add a weighted whole number of up to eight digits."""
    yield Let(total, f"{total}+{weight}*({name}-trunc({name}/{MODULUS})*{MODULUS})")
    yield _reduced(total)


def _steps_of_unit() -> Iterator[Step]:
    """A length is a whole number of steps, here and at the bridge: no two ways to round it."""
    yield Let("steps", str(STEPS[Unit.MM]), "OF A LENGTH, IN 1 MM")
    yield If("unit<1.5", "METRIC")
    yield Let("steps", str(STEPS[Unit.INCH]), "IN 1 INCH")


def _outside(name: str, highest: int, lowest: int = 0) -> Iterator[Step]:
    """To WRONG where a number is not whole, or outside lowest to highest."""
    yield If(f"abs({name}-round({name}))>0.0001", "WRONG")
    yield If(f"{name}<{lowest - 0.5}", "WRONG")
    yield If(f"{name}>{highest}.5", "WRONG")


def _stops(*stops: tuple[str, Alarm]) -> Iterator[Step]:
    yield Do.RETURN
    for label, alarm in stops:
        yield Label(label)
        yield Stop(alarm)


def _known_block() -> Iterator[Step]:
    """Nothing is done in registers that were never set up, or in another unit than they were set up for."""
    yield If(f"abs(block[LAYOUT]-{LAYOUT})>0.5", "UNSET")
    yield Do.READ_UNIT
    yield If("abs(unit-block[UNIT])>0.5", "UNITS")


def _setup() -> Iterator[Step]:
    yield Remark("APPLIED: NUMBER OF THE LAST CORRECTION THAT IS IN THE OFFSETS, 0 IF NONE")
    yield Filled(("applied",))
    yield from _outside("applied", MOST_PARTS)
    yield Do.SYNC
    yield If("abs(block[LAYOUT])<0.5", "CLEAR")
    yield If(f"abs(block[LAYOUT]-{LAYOUT - 1})<0.5", "OLDER")
    yield If(f"abs(block[LAYOUT]-{LAYOUT})>0.5", "INUSE")
    yield Remark("SET UP BEFORE, AND ITS COUNTERS ARE THERE: NOTHING IS CHANGED")
    yield If("block[EPOCH]>0.5", "DONE")
    yield Label("CLEAR")
    yield Do.READ_UNIT
    yield Let("old", "block[EPOCH]")
    yield Let("block[LAYOUT]", "0", "NOBODY READS THE BLOCK NOW")
    yield Let("block[MAIL_NUMBER]", "0")
    yield Remark("A NEW EPOCH: READINGS COUNTED FROM 1 ARE OTHERS THAN THOSE BEFORE")
    yield Do.NEW_EPOCH
    yield If("abs(epoch-old)>0.5", "FRESH")
    yield Let("epoch", "epoch+1")
    yield Label("FRESH")
    yield Let("count", "0")
    yield Label("ZERO")
    yield Let("block[count]", "0")
    yield Let("count", "count+1")
    yield If(f"count<{SIZE}", "ZERO")
    yield Let("effect[0]", "0", "NOT ON HOLD")
    yield Let("count", "1")
    yield Label("EACH")
    yield Let("effect[count]", "applied")
    yield Let("count", "count+1")
    yield If(f"count<={TOOLS}", "EACH")
    yield Let("block[APPLIED]", "applied")
    yield Let("block[UNIT]", "unit")
    yield Let("block[EPOCH]", "epoch")
    yield Do.SYNC
    yield Let("block[LAYOUT]", str(LAYOUT), "LAST: THE BLOCK CAN BE READ")
    yield Goto("DONE")
    yield from _older()
    yield Label("DONE")
    yield from _stops(
        ("INUSE", Alarm.IN_USE),
        ("MIXED", Alarm.MIXED_UNIT),
        ("WRONG", Alarm.WRONG_ARGUMENT),
        ("WAITS", Alarm.NOT_FETCHED),
    )


def _older() -> Iterator[Step]:
    """A block of the programs before these keeps its counters. Its readings have another check sum: none may wait."""
    yield Label("OLDER")
    yield Remark("SET UP BY OLDER PROGRAMS. ITS COUNTERS STAY, ITS READINGS MUST BE FETCHED")
    yield If("block[EPOCH]<0.5", "INUSE")
    yield If("abs(block[WRITTEN]-block[ACK])>0.5", "WAITS")
    yield Let("count", "0")
    yield Label("LEFT")
    yield Let("place", f"{FIRST_SLOT}+{SLOT_SIZE}*count")
    yield If("block[place+SEQ]-block[ACK]>0.5", "WAITS")
    yield Let("count", "count+1")
    yield If(f"count<{SLOTS}", "LEFT")
    yield Let("block[MAIL_NUMBER]", "block[ANSWERED]")
    yield Let("block[DECIDED]", "0")
    yield Let("block[ACTION]", "0")
    yield Do.SYNC
    yield Let("block[LAYOUT]", str(LAYOUT), "LAST")


def _reading(settings: RingSettings) -> Iterator[Step]:
    yield Let("limit", written(settings.time_out / PAUSE), f"LOOKS, {written(PAUSE)} S APART, UNTIL THE TIME IS OUT")
    yield Let("goon", str(int(settings.go_on)), "1: WRITE ON THEN, THE OLDEST READING IS LOST. 0: STOP")
    yield Do.SYNC
    yield from _known_block()
    yield from _arguments()
    yield Label("NEXT")
    yield Let("next", "block[WRITTEN]+1")
    yield Let("place", f"next-1-trunc((next-1)/{SLOTS})*{SLOTS}", "SLOT 0 TO 7")
    yield If("place>-0.5", "SLOT")
    yield Let("place", f"place+{SLOTS}", "THE QUOTIENT WAS ROUNDED UP")
    yield Label("SLOT")
    yield Let("place", f"{FIRST_SLOT}+{SLOT_SIZE}*place", "WHERE IT BEGINS")
    yield Remark("A SLOT COMPLETE BUT NOT COUNTED: THE POWER WENT THERE. IT IS COUNTED")
    yield If("abs(block[place+SEQ]-next)>0.5", "ROOM")
    yield If("abs(block[place+SEQ2]-next)>0.5", "ROOM")
    yield Let("block[WRITTEN]", "next")
    yield Goto("NEXT")
    yield Label("ROOM")
    yield If(f"next>{HIGHEST_SEQUENCE}", "EPOCHS")
    yield Let("count", "0")
    yield Remark(f"WAIT WHILE ALL {SLOTS} SLOTS ARE FULL, OR WHAT IS FETCHED WAS NEVER WRITTEN")
    yield Label("LOOK")
    yield Do.SYNC
    yield If("block[ACK]-next>-0.5", "WAIT")
    yield If(f"next-1-block[ACK]<{SLOTS - 1}.5", "FREE")
    yield Label("WAIT")
    yield If("count>=limit", "LATE")
    yield Do.PAUSE
    yield Let("count", "count+1")
    yield Goto("LOOK")
    yield Label("LATE")
    yield If("goon<0.5", "STOPPED")
    yield from _slot()
    yield from _decision(settings)
    yield from _stops(
        ("STOPPED", Alarm.NOT_FETCHING),
        *ACTED,
        ("OPEN", Alarm.NOT_DECIDED),
        ("UNSET", Alarm.NOT_SET_UP),
        ("UNITS", Alarm.OTHER_UNIT),
        ("MIXED", Alarm.MIXED_UNIT),
        ("WRONG", Alarm.WRONG_ARGUMENT),
        ("EPOCHS", Alarm.NEW_EPOCH),
    )


ACTED = (("HALT", Alarm.STOP), ("HOLDS", Alarm.HOLD))


def _decision(settings: RingSettings) -> Iterator[Step]:
    """Wait for the decision on this reading, and do what it says; one on an earlier reading that came late counts, too."""
    yield Let("limit", written(settings.decision_time / PAUSE), f"LOOKS, {written(PAUSE)} S APART, FOR THE DECISION")
    yield Let("count", "0")
    yield Label("JUDGE")
    yield Do.SYNC
    yield If("block[DECIDED]-next>-0.5", "JUDGED")
    yield If("count>=limit", "TIMEOUT")
    yield Do.PAUSE
    yield Let("count", "count+1")
    yield Goto("JUDGE")
    yield Label("TIMEOUT")
    yield Let("stops", str(int(settings.decision_stops)), "1: STOP WITHOUT A DECISION. 0: GO ON")
    yield If("block[ACTION]>1.5", "JUDGED")
    yield If("stops>0.5", "OPEN")
    yield Label("JUDGED")
    yield from _acted(settings)


def _acted(settings: RingSettings) -> Iterator[Step]:
    """Act once upon what the server has decided."""
    yield Let("action", "block[ACTION]", "0 GO ON, 1 HOLD, 2 STOP")
    yield If("action<0.5", "GOES")
    yield Let("block[ACTION]", "0", "SEEN")
    yield Do.SYNC
    yield If("action>1.5", "HALT")
    if settings.hold_stops:
        yield Goto("HOLDS")
    yield Label("GOES")


def _arguments() -> Iterator[Step]:
    yield Missing("measured", "WRONG")
    yield Filled(("characteristic", "tool", "part", "in_effect", "status"))
    yield from _steps_of_unit()
    yield Label("METRIC")
    yield If(f"abs(measured)*steps>{MOST_STEPS}", "WRONG")
    yield from _outside("characteristic", MOST_CHARACTERISTICS, 1)
    yield from _outside("tool", TOOLS)
    yield from _outside("part", MOST_PARTS)
    yield from _outside("in_effect", MOST_PARTS)
    yield from _outside("status", 3)


def _slot() -> Iterator[Step]:
    yield Label("FREE")
    yield Let("block[place+SEQ]", "0", "THE SLOT DOES NOT COUNT WHILE IT IS WRITTEN")
    yield Do.READ_CLOCK
    yield Remark("LEFT OUT: THE CORRECTION THAT WAS IN WHEN THE TOOL WAS SELECTED")
    yield If("in_effect>0.5", "KNOWN")
    yield If("tool<0.5", "KNOWN")
    yield Let("in_effect", "effect[tool]")
    yield Label("KNOWN")
    yield Let("size", "round(steps*measured)", "THE SIZE AS IT IS SENT")
    yield Let("measured", "size/steps")
    for name in ("characteristic", "measured", "in_effect", "part", "tool", "status", "time"):
        yield Let(f"block[place+{name.upper()}]", name)
    yield Remark("CHECK SUM")
    yield Let("check", "0")
    for name, of in (("size", "measured"), ("next", "sequence"), ("part", "part"), ("in_effect", "in_effect")):
        yield from _summed("check", name, SLOT_WEIGHTS[of])
    small = "+".join(f"{SLOT_WEIGHTS[name]}*{name}" for name in ("characteristic", "tool", "status"))
    for added in (small, f"{SLOT_WEIGHTS['time']}*time"):
        yield Let("check", f"check+{added}")
        yield _reduced("check")
    yield Let("block[place+CHECK]", "check")
    yield Do.SYNC
    yield Let("block[place+SEQ2]", "next")
    yield Let("block[place+SEQ]", "next", "FROM HERE ON THE READING COUNTS")
    yield Let("block[WRITTEN]", "next", "LAST")


def _correction(settings: RingSettings) -> Iterator[Step]:
    wait = MAIL_TIME[settings.control]
    yield Let("limit", written(wait / PAUSE), f"LOOKS, {written(PAUSE)} S APART, FOR MORE MAIL")
    yield Let("count", "limit", "THE FIRST LOOK DOES NOT WAIT")
    yield Do.SYNC
    yield If(f"abs(block[LAYOUT]-{LAYOUT})>0.5", "UNSET")
    yield from _acted(settings)
    yield Label("AGAIN")
    yield Do.SYNC
    yield Let("step", written(settings.largest_step), "MM: THE LARGEST STEP THAT IS TAKEN")
    yield Let("near", written(TOLERANCE), "MM: OFFSETS AS NEAR AS THIS ARE THE SAME")
    yield Let("number", "block[MAIL_NUMBER]")
    yield Remark("NO MAIL, OR ANSWERED BEFORE")
    yield If("number<0.5", "NOMAIL")
    yield Let("answer", "2", "THE MAIL IS DAMAGED")
    yield If(f"number>{HIGHEST_SEQUENCE}.5", "LATER")
    yield Let("number", "round(number)")
    yield If("abs(number-block[ANSWERED])<0.5", "NOMAIL")
    yield Do.READ_UNIT
    yield If("abs(unit-block[UNIT])>0.5", "UNITS")
    yield from _steps_of_unit()
    yield Let("step", f"step/{written(MM_PER_INCH)}")
    yield Let("near", written(TOLERANCE_INCH))
    yield Label("METRIC")
    yield from _mail()
    yield Remark("IS THERE SUCH A TOOL, AND MAY THIS REGISTER BE SET")
    yield Let("answer", "3")
    yield If("tool<0.5", "REPLY")
    for place, wear in enumerate(settings.wears, start=1):
        yield If(f"abs(parameter-{wear.parameter})>0.5", f"OTHER{place}")
        yield If(f"tool<{wear.tools}.5", "HAVE")
        yield Label(f"OTHER{place}")
    yield Goto("REPLY")
    yield Label("HAVE")
    yield Do.FIND_TOOL
    yield Do.READ_WEAR
    yield Let("value", "value/steps")
    yield Let("expected", "expected/steps")
    yield Remark("IN ALREADY: THE POWER WENT BEFORE THE ANSWER")
    yield If("abs(block[APPLIED]-number)<0.5", "ISIN")
    yield If("abs(offset-value)<=near", "ISIN")
    yield Let("answer", "9", "ON HOLD HERE")
    yield If("effect[0]>0.5", "LATER")
    yield Let("answer", "4", "STEP TOO LARGE")
    yield If("abs(value-expected)>step+near", "REPLY")
    yield Let("answer", "1", "THE OFFSET IS NOT WHAT INBAND KNOWS: SOMEBODY CHANGED IT")
    yield If("abs(offset-expected)>near", "REPLY")
    yield Do.SET_WEAR
    yield Do.READ_WEAR
    yield If("abs(offset-value)>near", "REPLY")
    yield Label("ISIN")
    yield Let("answer", "0")
    yield Let("block[APPLIED]", "number")
    yield Label("REPLY")
    yield Let("block[OFFSET]", "offset")
    yield Let("block[ANSWER]", "answer")
    yield Do.SYNC
    yield Let("block[ANSWERED]", "number", "LAST")
    yield Remark(f"MAIL FOR THE NEXT TOOL, IF IT COMES WITHIN {written(wait)} S")
    yield Let("count", "0")
    yield Goto("AGAIN")
    yield Label("NOMAIL")
    yield If("count>=limit", "DONE")
    yield Do.PAUSE
    yield Let("count", "count+1")
    yield Goto("AGAIN")
    yield Label("LATER")
    yield Remark("NOT ANSWERED: IT IS LOOKED AT AGAIN THE NEXT TIME")
    yield Let("block[ANSWER]", "answer")
    yield Label("DONE")
    yield Do.SYNC
    stops = (("UNSET", Alarm.NOT_SET_UP), ("UNITS", Alarm.OTHER_UNIT), ("MIXED", Alarm.MIXED_UNIT), *ACTED)
    yield from _stops(*stops)


def _mail() -> Iterator[Step]:
    """The mail in numbers of the program's own, all of them whole. What is checked is what is used: nothing is forgiven."""
    wholes, lengths = ("tool", "edge", "parameter"), ("expected", "value")
    for names in (wholes, (*lengths, "check")):
        sizes = "+".join(f"abs(block[MAIL_{name.upper()}])" for name in names)
        yield Let("sum", f"sum+{sizes}" if names[-1] == "check" else sizes, "TOO LARGE IS DAMAGED")
    yield If(f"sum<{MOST_MAIL}", "COPY")
    yield Goto("LATER")
    yield Label("COPY")
    for name in (*wholes, "check"):
        yield Let(name, f"round(block[MAIL_{name.upper()}])")
    for name in lengths:
        yield Let(name, f"round(steps*block[MAIL_{name.upper()}])")
    yield Do.SYNC
    yield Remark("IT IS BEING WRITTEN JUST NOW")
    yield If("abs(block[MAIL_NUMBER]-number)>0.5", "NOMAIL")
    yield Let("offset", "0")
    yield Remark("CHECK SUM")
    yield Let("sum", "0-check")
    for name, weight in MAIL_WEIGHTS.items():
        yield from _summed("sum", name, weight)
    yield Let("sum", "abs(sum)")
    yield If("sum<0.5", "FITS")
    yield If(f"sum<{MODULUS - 1}.5", "LATER")
    yield Label("FITS")


def _tool() -> Iterator[Step]:
    yield Filled(("tool",))
    yield from _outside("tool", TOOLS, 1)
    yield If(f"abs(block[LAYOUT]-{LAYOUT})>0.5", "UNSET")
    yield Remark("WHAT IT CUTS FROM NOW ON IS CUT WITH THIS CORRECTION IN ITS OFFSET")
    yield Let("effect[tool]", "block[APPLIED]")
    yield from _stops(("UNSET", Alarm.NOT_SET_UP), ("WRONG", Alarm.WRONG_ARGUMENT))
