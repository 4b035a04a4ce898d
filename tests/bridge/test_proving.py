"""The touch test by the command, with the registers of a model in place of a control."""

from pathlib import Path

import pytest

from app.bridge import offset_change, proving
from app.bridge.offset_change import noted
from app.bridge.registers import RegisterLink
from app.core.ring import Unit
from app.simulators.controls.model import Feature, Model
from tests.bridge.plant import ModelRegisters, machine, store_in
from tests.loops import run

QUESTIONS = ("Is the program stopped?", "has nothing else changed?", "larger in size")


class Control:
    """A model behind the command. said: what a person reads; held: the offset at the control at each question."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, model: Model) -> None:
        self.registers = ModelRegisters(model)
        self.machine = machine(model, proof_needed=True)
        self.model, self.store = model, store_in(folder)
        self.said: list[str] = []
        self.held: list[float] = []
        monkeypatch.setattr(proving, "link_of", lambda chosen: RegisterLink(chosen, self.registers))
        monkeypatch.setattr(offset_change, "LEAST_PAUSE", 0.01)

    @property
    def offset(self) -> float:
        [held] = self.model.offsets.values()
        return held

    def tested(self, no_to: str = "", cut_at: str = "") -> bool:
        """Do the test: yes to each question but one; at another one the cable comes out."""

        def ask(question: str) -> bool:
            self.held.append(self.offset)
            self.said.append(question)
            self.registers.away = self.registers.away or bool(cut_at and cut_at in question)
            return not no_to or no_to not in question

        return run(proving.run(self.machine, 3, 0.010, self.store, self.said.append, ask))

    def proved(self) -> str | None:
        known = run(self.store.known(self.machine.key)).get(3)
        return known.proved if known else None


def control(folder: Path, monkeypatch: pytest.MonkeyPatch, **feature: object) -> Control:
    unit = feature.pop("unit", Unit.MM)
    return Control(folder, monkeypatch, Model((Feature(tool=3, **feature),), unit=unit))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("feature", "step", "shown"),
    [
        ({}, 0.010, "0.0100"),
        ({"holds": "radius"}, 0.005, "0.0050"),
        ({"sign": -1}, -0.010, "-0.0100"),
        ({"unit": Unit.INCH, "holds": "radius"}, 0.005 / 25.4, "0.0002"),
    ],
)
def test_the_control_is_asked_to_show_its_own_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, feature: dict[str, object], step: float, shown: str
) -> None:
    there = control(tmp_path, monkeypatch, **dict(feature))
    assert there.tested(), there.said
    assert there.held == pytest.approx([0.0, step, step], abs=5e-7)
    assert any(f"show {shown} in that place" in each for each in there.said)
    assert there.offset == 0.0
    assert there.proved() == there.machine.mapping_hash(there.machine.location[0])


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_no_proves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, question: str) -> None:
    there = control(tmp_path, monkeypatch)
    assert there.tested()
    assert not there.tested(no_to=question)
    assert (there.offset, there.proved()) == (0.0, None)
    assert "Not proved: no correction reaches this location." in there.said


def test_what_was_cut_off_is_taken_back_by_the_next_test(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = control(tmp_path, monkeypatch)
    assert not there.tested(cut_at=QUESTIONS[1])
    assert there.offset == pytest.approx(0.010)
    assert any("NOT taken back" in each and "Set 0.0000 mm in" in each for each in there.said)
    there.registers.away = False
    there.said.clear()
    assert there.tested()
    assert there.said[0].startswith("A touch test was cut off. Taken back: 0.0000 mm")
    assert run(noted(there.store, there.machine.key)) is None
