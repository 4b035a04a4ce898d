"""The unmanned lathe line's macro arithmetic, digit by digit: what its program writes into the offset, we write too.

The macro is run here as it is printed, in decimal fractions; the characteristic is set up as the domain says: R33 = 0,
k = 1, acceptance 2 of 3 over section means. Offsets are compared to the picometre that corrections are kept to.
"""

import json
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest

from app.core.acceptance import accepted, sections_outside
from app.core.decision.decide import LoopState, ReadingAlarm, decide
from app.core.decision.step import Action, deviation_of
from app.core.parameters import Parameters, read
from app.core.probing import measured_value

CASE: dict[str, Any] = json.loads((Path(__file__).parent / "cases/lathe_line.json").read_text("utf-8"))
PICOMETRE = Decimal("0.000000001")


class Macro:
    """The program of the control: #505 nominal, #506 ES, #507 EI, #510-#512 sections, #513 rejects, #[2700+n] offset."""

    def __init__(self) -> None:
        self.v505, self.v506, self.v507 = (
            Decimal(CASE[name]) for name in ("nominal", "upper_deviation", "lower_deviation")
        )
        self.v513 = CASE["rejects"]
        self.offset = Decimal(CASE["offset"])

    def measure(self, sections: list[Decimal]) -> bool:
        """One part; whether it is good."""
        v130, v131 = self.v505 + self.v506, self.v505 + self.v507
        inside = 0
        for value in sections:
            if value > v130 or value < v131:
                self.v513 += 1  # N1000
            else:
                inside += 1
        v510, v511, v512 = sections
        self.offset += (self.v505 + (self.v506 + self.v507) / 2) - (v510 + v511 + v512) / 3  # N1005
        return inside >= 2


def line(**more: Any) -> Parameters:
    """The characteristic that stands for the macro."""
    drawing = {name: float(CASE[name]) for name in ("nominal", "upper_deviation", "lower_deviation")}
    system = {
        "zero_range": 0,
        "weighting_factor": 1,
        "accept": {"n": 2, "m": 3},
        "wear_limit": 0.3,
        "confidence_limit": 1,
    }
    return read(drawing | system | {"tool_memory": 5, "factor": -1, "rejected_may_correct": True} | more)[0]


def test_the_case_is_what_the_macro_as_printed_computes() -> None:
    macro = Macro()
    for part in CASE["parts"]:
        good = macro.measure([Decimal(section) for section in part["sections"]])
        assert (good, macro.v513) == (part["good"], part["rejects"])
        assert abs(macro.offset - Decimal(part["offset"])) < 2 * PICOMETRE


def test_our_corrections_make_the_same_offset_count_and_verdict() -> None:
    """With the setting that rejected parts correct too, as the macro does."""
    parameters, macro = line(), Macro()
    offset, rejects = Decimal(CASE["offset"]), 0
    for part in CASE["parts"]:
        sections = [Decimal(section) for section in part["sections"]]
        macro.measure(sections)
        value, points, _fault = measured_value(parameters, [[float(section)] for section in sections])
        good = accepted(parameters, points)
        rejects += sections_outside(parameters, points)
        decision = decide(parameters, LoopState(), deviation_of(value, parameters.target), accepted=good)
        offset += Decimal(str(decision.amount or 0.0))
        assert (good, rejects) == (part["good"], macro.v513)
        assert abs(offset - macro.offset) <= len(CASE["parts"]) * PICOMETRE
        assert (ReadingAlarm.ACCEPTANCE in decision.alarms) == (not part["good"])
    assert round(offset, 6) == round(macro.offset, 6)


@pytest.mark.parametrize("part", [part for part in CASE["parts"] if not part["good"]])
def test_without_that_setting_a_rejected_part_corrects_nothing(part: dict[str, Any]) -> None:
    parameters = line(rejected_may_correct=False)
    value, points, _fault = measured_value(parameters, [[float(section)] for section in part["sections"]])
    decision = decide(
        parameters, LoopState(), deviation_of(value, parameters.target), accepted=accepted(parameters, points)
    )
    assert (decision.action, decision.amount) == (Action.NONE, None)


@pytest.mark.parametrize(("deviation", "zone"), [(0.0, "zero"), (0.000001, "average"), (-0.000001, "average")])
def test_without_a_zero_range_everything_but_the_target_itself_is_corrected(deviation: float, zone: str) -> None:
    decision = decide(line(), LoopState(), deviation)
    assert (decision.zone, decision.amount) == (zone, -deviation if deviation else None)


def test_the_order_holds_with_a_zero_range_of_nothing() -> None:
    assert line().zero_range == 0
    with pytest.raises(ValueError, match="order"):
        line(averaging_limit=0)  # R33 < R34 is strict
