"""The size axis of the charts: sizes as the drawing counts them, and what was taken off the machine's readings for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.core.decision.limits import nanometres
from app.language.formatting import mm, um
from app.language.i18n import _


@dataclass(frozen=True)
class SizeAxis:
    """The scale of corrected sizes, target + deviation; mm.

    target: in force now, the size at deviation 0. empirical_values: those taken off the readings in view, each once, oldest
    first. retargeted: some readings in view were judged about another target; they stand where they deviate from their own.
    """

    target: float
    empirical_values: Sequence[float] = ()
    retargeted: bool = False

    @property
    def title(self) -> str:
        """The title of the axis: names the empirical value, and says where it or the target changed within the view."""
        words = _("Size, mm")
        values = list(dict.fromkeys(nanometres(value) for value in self.empirical_values))
        if len(values) > 1:
            words = _("Size, mm (empirical value {low} to {high})").format(
                low=um(min(values) / 1e6), high=um(max(values) / 1e6)
            )
        elif any(values):
            words = _("Size, mm (empirical value {value})").format(value=um(values[0] / 1e6))
        if self.retargeted:
            words += "<br>" + _("the target changed in this view: each about its own")
        return words


def size_lines(size: float | None, measured: float | None) -> list[str]:
    """Lines of a tooltip: the corrected size (mm), and the machine's own reading where it is another."""
    if size is None:
        return []
    lines = [_("size {size}").format(size=mm(size))]
    if measured is not None and nanometres(measured - size):
        lines.append(
            _("machine reading {size}, empirical value {value} taken off").format(
                size=mm(measured), value=um(measured - size)
            )
        )
    return lines
