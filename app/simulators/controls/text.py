"""A simulated machine that prints a text for people: on a TCP port like a serial server, and on a pseudo terminal like a serial port.

Above the sizes of a part stand a title and the part's number; nothing has a check sum, and nothing is printed again.
"""

from app.core.printed_line import DECIMALS
from app.core.ring import Slot, Unit
from app.simulators.controls.dprnt import PrintingSimulator
from app.simulators.controls.model import Feature, Model

FEATURES = (Feature(),)
LINES = (r"^PART +(?P<part>\S+)", r"^(?P<characteristic>D\d+) .*ACTUAL +(?P<measured>[-\d.]+)")
"""Expressions that find the readings in it."""


class TextSimulator(PrintingSimulator):
    """One machine that is running."""

    _part: int | None = None

    def table(self) -> dict[str, object]:
        """The table of a machine in the configuration."""
        table = super().table() | {"kind": "text"}
        table["text"] = table.pop("dprnt") | {"lines": list(LINES)}  # type: ignore[operator]
        table["characteristics"] = {f"D{each.number}": f"characteristic-{each.number}" for each in self.model.features}
        return table

    def text(self, epoch: int, slot: Slot) -> bytes:
        """A reading as it is printed, with the head of its part where it is the first."""
        del epoch
        unit = Unit(self.model.unit)
        nominal = next(each.nominal for each in self.model.features if each.number == slot.characteristic)
        lines = []
        if slot.part != self._part:
            self._part = slot.part
            lines = ["", "*** PROBE REPORT ***", f"PART {slot.part:06d}"]
        shown = f"{slot.measured:.{DECIMALS[unit]}f}"
        lines.append(f"D{slot.characteristic} NOMINAL {nominal:9.4f} ACTUAL {shown:>10} {unit.name}")
        return "".join(f"{line}\r\n" for line in lines).encode()

    def print_again(self) -> None:
        """Nothing is printed again."""


async def serve(model: Model, port: int = 0) -> TextSimulator:
    """Start a simulated machine."""
    simulator = TextSimulator(model)
    await simulator.start(port)
    return simulator
