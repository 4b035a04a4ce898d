"""Pending corrections as program text, for controls without a network. Running a text twice changes nothing.

Each step sets the offset to the value it leads to, never adds to it, and is guarded three times on the control:

- by two variables. One holds the highest correction that was ever applied, so a step that is in already is passed over,
  also by an older text that is run after a newer one. The other holds the correction that was applied last: a correction
  that was let go late, behind a newer one, has the lower number, and is applied only right after the one it follows.
- by the offset. It must be what Inband expects before the step, or already what the step leads to (the control was
  switched off between two blocks). Otherwise the text stops, says so, and changes nothing more.
- at the end every offset must be where all steps together lead to, or the text says so.

The variable with the last correction applied is what the machine reports as `correction_in_effect`. Lengths are mm, and a
text stops where the control works in inch (`unit_check`).
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from app.core.decision.step import DECIMALS, rounded
from app.core.parameters import Axis
from app.core.programs import unit_check
from app.core.programs.correction_forms import Form
from app.core.programs.fanuc import pointed
from app.core.programs.lines import written

TOLERANCE = 0.0006  # mm: a control keeps three decimals, and rounds
HIGHEST_R, LAST_R = "R98", "R99"
HIGHEST_VARIABLE, LAST_VARIABLE = "#598", "#599"
MOST_STEPS = 200
# Whole nanometres: the mean of three sections has digits without end, and controls refuse a word of more than eight.
PLACES = 6


LAST_REGISTER = {Form.WEAR_VARIABLES: 99, Form.WEAR_VARIABLES_2000: 64}
"""Tools that the variables of a form reach; the next one is a register of another axis."""


class PendingCorrection(NamedTuple):
    """A pending correction, in the order in which they are to be applied. fetched: it is in a text already."""

    number: int
    tool: int
    amount: float
    axis: Axis


class OffsetStep(NamedTuple):
    """A correction with the offset before and after it. late_after: the newer correction that it follows, if any."""

    number: int
    tool: int
    axis: Axis
    amount: float
    before: float
    after: float
    late_after: int | None


def steps(wanted: Sequence[PendingCorrection], offsets: dict[int, float], highest: int, last: int) -> list[OffsetStep]:
    """The chain of offsets. highest and last: of the corrections applied so far, by number and by time; 0 for none.

    >>> made = steps([PendingCorrection(18, 3, -0.0061, Axis.X), PendingCorrection(16, 3, 0.002, Axis.X)], {3: -0.0081}, 17, 17)
    >>> [(step.number, step.before, step.after, step.late_after) for step in made]
    [(18, -0.0081, -0.0142, None), (16, -0.0142, -0.0122, 18)]
    """
    running = dict(offsets)
    chain = []
    for correction in wanted:
        before = running[correction.tool]
        after = running[correction.tool] = rounded(before + correction.amount)
        late = last if correction.number < highest else None
        chain.append(
            OffsetStep(correction.number, correction.tool, correction.axis, correction.amount, before, after, late)
        )
        highest, last = max(highest, correction.number), correction.number
    return chain


def write(form: Form, machine: str, chain: Sequence[OffsetStep]) -> str:
    """The text of these steps, to whole nanometres. The same steps always give the same text.

    >>> print(write(Form.G10_ABSOLUTE, "lathe-1", steps([PendingCorrection(18, 3, -0.0061, Axis.X)], {3: -0.0081}, 17, 17)))
    (INBAND CORRECTIONS FOR LATHE-1: 18)
    (LENGTHS ARE MM: RUN IT WITH G21 ACTIVE)
    (TOOL 3 X: -0.0081 BECOMES -0.0142, CORRECTION 18)
    G10 P3 X-0.0142
    M99
    <BLANKLINE>
    """
    return "\n".join(_WRITERS[form](machine, [_to_places(step) for step in chain])) + "\n"


def _to_places(step: OffsetStep) -> OffsetStep:
    """The offsets rounded, and the amount as what lies between them, so that increments add up to where offsets lead."""
    before, after = round(step.before, PLACES) + 0.0, round(step.after, PLACES) + 0.0
    return step._replace(before=before, after=after, amount=round(after - before, PLACES) + 0.0)


def _numbers(chain: Sequence[OffsetStep]) -> str:
    return ", ".join(str(step.number) for step in chain) or "NONE"


def _final(chain: Sequence[OffsetStep]) -> dict[int, OffsetStep]:
    """The last step of each tool."""
    return {step.tool: step for step in chain}


def _words(step: OffsetStep) -> str:
    return (
        f"CORRECTION {step.number}: TOOL {step.tool} {step.axis.value} {step.amount:+.9f}".rstrip("0").rstrip(".")
        + f", {written(step.before)} BECOMES {written(step.after)}"
    )


def _minus(value: float, number: Callable[[float], str]) -> str:
    """The operator and number that subtract this value from a variable: ``-0.5`` or ``+0.5``."""
    return f"{'+' if value < 0 else '-'}{number(abs(value))}"


# --- Sinumerik


def _turning(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    # Turning tools: length 1 lies along X, length 2 along Z (G18).
    yield from _sinumerik(machine, chain, {Axis.X: 12, Axis.Z: 13, Axis.Y: 14})


def _milling(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    # Milling tools: length 1 lies along the spindle; X and Y are the radius.
    yield from _sinumerik(machine, chain, {Axis.X: 15, Axis.Y: 15, Axis.Z: 12})


def _sinumerik(machine: str, chain: list[OffsetStep], parameter: dict[Axis, int]) -> Iterator[str]:
    def wear(step: OffsetStep) -> str:
        return f"$TC_DP{parameter[step.axis]}[{step.tool},1]"

    def differs(step: OffsetStep, value: float) -> str:
        return f"ABS({wear(step)}{_minus(value, written)})>{written(TOLERANCE)}"

    yield f"; INBAND CORRECTIONS FOR {machine.upper()}: {_numbers(chain)}"
    yield "; RUN IT AS A PROGRAM OF ITS OWN. RUN TWICE IT CHANGES NOTHING."
    yield f"; {HIGHEST_R}: HIGHEST CORRECTION APPLIED. {LAST_R}: LAST ONE APPLIED, REPORT IT WITH THE NEXT READING."
    yield from unit_check.sinumerik()
    yield "STOPRE"
    for step in chain:
        yield f"; {_words(step)}"
        if step.late_after is None:
            yield f"IF {HIGHEST_R}>={step.number} GOTOF DONE{step.number}"
        else:
            yield f"IF {LAST_R}<>{step.late_after} GOTOF DONE{step.number}"
        yield f"IF ({differs(step, step.before)}) AND ({differs(step, step.after)}) GOTOF DIFFERS"
        yield f"{wear(step)}={written(step.after)}"
        yield f"{LAST_R}={step.number}"
        if step.late_after is None:
            yield f"{HIGHEST_R}={step.number}"
        yield f"DONE{step.number}:"
    for step in _final(chain).values():
        yield f"IF {differs(step, step.after)} GOTOF DIFFERS"
    yield 'MSG("INBAND: CORRECTIONS ARE IN")'
    yield "M17"
    yield "DIFFERS:"
    yield 'MSG("INBAND: AN OFFSET IS NOT AS EXPECTED. NOTHING MORE WAS CHANGED")'
    yield "M0"
    yield "M17"


# --- Fanuc


def _wear_variables(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    # The lathe line knows the X wear only, at 2700, and has a way of its own to raise alarms.
    return _variables(machine, chain, {Axis.X: 2700, Axis.Z: 2800, Axis.Y: 2900}, unit_check.LATHE_LINE_ALARM)


def _wear_variables_2000(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    return _variables(machine, chain, {Axis.X: 2000, Axis.Z: 2100, Axis.Y: 2400}, unit_check.FANUC_ALARM)


def _guard(step: OffsetStep, place: int) -> str:
    if step.late_after is None:
        return f"IF[{HIGHEST_VARIABLE}GE{step.number}]GOTO{place + 2}"
    return f"IF[{LAST_VARIABLE}NE{step.late_after}]GOTO{place + 2}"


def _marks(step: OffsetStep) -> Iterator[str]:
    yield f"{LAST_VARIABLE}={step.number}"
    if step.late_after is None:
        yield f"{HIGHEST_VARIABLE}={step.number}"


def _head(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    yield f"(INBAND CORRECTIONS FOR {machine.upper()}: {_numbers(chain)})"
    yield "(RUN IT AS A PROGRAM OF ITS OWN. RUN TWICE IT CHANGES NOTHING)"
    yield f"({HIGHEST_VARIABLE}: HIGHEST CORRECTION APPLIED)"
    yield f"({LAST_VARIABLE}: LAST ONE APPLIED, REPORT IT WITH THE NEXT READING)"


def _variables(machine: str, chain: list[OffsetStep], base: dict[Axis, int], alarm: str) -> Iterator[str]:
    def wear(step: OffsetStep) -> str:
        return f"#[{base[step.axis]}+{step.tool}]"

    def off(step: OffsetStep, value: float) -> str:
        return f"ABS[{wear(step)}{_minus(value, pointed)}]"

    yield from _head(machine, chain)
    yield from unit_check.fanuc(alarm)
    for place, step in zip(range(10, 10 * len(chain) + 1, 10), chain, strict=True):
        yield f"({_words(step)})"
        yield _guard(step, place)
        yield f"IF[{off(step, step.before)}LE{written(TOLERANCE)}]GOTO{place + 1}"
        yield f"IF[{off(step, step.after)}GT{written(TOLERANCE)}]GOTO9999"
        yield f"N{place + 1} {wear(step)}={pointed(step.after)}"
        yield from _marks(step)
        yield f"N{place + 2}"
    for step in _final(chain).values():
        yield f"IF[{off(step, step.after)}GT{written(TOLERANCE)}]GOTO9999"
    yield "M99"
    yield f"N9999 {alarm.format('INBAND OFFSET NOT AS EXPECTED')}"
    yield "M99"


# Which address of G10 sets an offset, and which adds to it.
_ABSOLUTE = {Axis.X: "X", Axis.Z: "Z", Axis.Y: "Y"}
_INCREMENTAL = {Axis.X: "U", Axis.Z: "W", Axis.Y: "V"}


def _g10(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    """Incremental. G10 cannot look at an offset, so the variables alone guard it, and they are set first: switched off
    between the two blocks, a correction is missing, which the next reading sees; it is never there twice.
    """
    yield from _head(machine, chain)
    yield from unit_check.fanuc()
    for place, step in zip(range(10, 10 * len(chain) + 1, 10), chain, strict=True):
        yield f"({_words(step)})"
        yield _guard(step, place)
        yield from _marks(step)
        yield f"G10 P{step.tool} {_INCREMENTAL[step.axis]}{pointed(step.amount)}"
        yield f"N{place + 2}"
    yield "M99"


def _g10_absolute(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    """One block per tool; it sets the offset to where all corrections together lead."""
    yield f"(INBAND CORRECTIONS FOR {machine.upper()}: {_numbers(chain)})"
    yield f"({unit_check.said('G21')})"
    for tool, step in _final(chain).items():
        mine = [step for step in chain if step.tool == tool]
        head = f"TOOL {tool} {step.axis.value}: {written(mine[0].before)} BECOMES {written(step.after)}"
        yield f"({head}, CORRECTION {_numbers(mine)})"
        yield f"G10 P{tool} {_ABSOLUTE[step.axis]}{pointed(step.after)}"
    yield "M99"


def _list(machine: str, chain: list[OffsetStep]) -> Iterator[str]:
    """For people: one line per tool, with the offset that the control must show before and after."""
    yield f"INBAND CORRECTIONS FOR {machine.upper()}, LENGTHS IN MM: {_numbers(chain)}"
    for tool, step in _final(chain).items():
        mine = [step for step in chain if step.tool == tool]
        change = round(step.after - mine[0].before, DECIMALS)
        amount = f"{'-' if change < 0 else '+'} {written(abs(change))}"
        was, becomes = written(mine[0].before), written(step.after)
        yield f"TOOL {tool} {step.axis.value}: {was} {amount} = {becomes} (CORRECTION {_numbers(mine)})"


_WRITERS: dict[Form, Callable[[str, list[OffsetStep]], Iterator[str]]] = {
    Form.TURNING: _turning,
    Form.MILLING: _milling,
    Form.WEAR_VARIABLES: _wear_variables,
    Form.WEAR_VARIABLES_2000: _wear_variables_2000,
    Form.G10: _g10,
    Form.G10_ABSOLUTE: _g10_absolute,
    Form.LIST: _list,
}
