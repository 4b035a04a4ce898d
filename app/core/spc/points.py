"""The points of a control chart as they come in: pieces of any size give what the whole gives.

What comes in are the points of the individuals or X-bar chart as z, their distance from the centre in sigma. Ranges, sums
and averages follow from z and a memory, which `memory()` gives as JSON: a chart can be put away and taken up again.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.spc.cusum import cusum
from app.core.spc.ewma import ewma, moving_average
from app.core.spc.refusal import Floats
from app.core.spc.shewhart import Baseline, Chart, given, moving_ranges

Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class ChartSettings:
    """Parameters of a chart. width: of its limits, in sigma. weight: lambda of the EWMA. span: of the moving average, in points.

    reference, limit, headstart: k, h and headstart of the CUSUM, in sigma.
    """

    chart: Chart
    width: float = 3.0
    weight: float = 0.2
    exact: bool = True
    span: int = 5
    reference: float = 0.5
    limit: float = 5.0
    headstart: float = 0.0

    @property
    def reach(self) -> float:
        """Distance of the limits from the centre, in the unit of `Piece.rows`."""
        return self.limit if self.chart is Chart.CUSUM else self.width

    @property
    def baseline(self) -> Baseline:
        """Baseline that judges z."""
        return given(0.0, 1.0, self.width)


class Piece(NamedTuple):
    """Some points: z, the first and the last reading that each is made of, and whether it is the first of a tool.

    rows: one, or of a CUSUM two, its upper sum and its lower one turned over.
    """

    rows: list[Floats]
    first: Whole
    last: Whole
    begins: Flags

    def only(self, wanted: Flags) -> "Piece":
        """Those points."""
        return Piece([row[wanted] for row in self.rows], self.first[wanted], self.last[wanted], self.begins[wanted])


@dataclass
class Points:
    """One chart, fed with z.

    >>> points = Points(ChartSettings(Chart.MOVING_AVERAGE, span=2))
    >>> one, at = np.array([1.0, 3.0]), np.array([1, 2])
    >>> points.feed(Piece([one], at, at, at < 0)).rows[0].round(3).tolist()
    [1.0, 2.828]
    """

    settings: ChartSettings
    waiting: list[float] = field(default_factory=list)  # z of the last points, as far as the next ones need them
    waiting_at: int = 0
    state: list[float] = field(default_factory=list)
    seen: int = 0

    def feed(self, piece: Piece) -> Piece:
        """The points of this chart that are complete with these."""
        if not len(piece.last):
            return piece
        fed = self._fed(piece)
        self.seen += len(piece.last)
        return fed

    def _fed(self, piece: Piece) -> Piece:
        settings, z = self.settings, piece.rows[0]
        match settings.chart:
            case Chart.EWMA:
                start = self.state[0] if self.state else None
                chart = ewma(settings.baseline, z, settings.weight, exact=settings.exact, start=start, seen=self.seen)
                self.state = [float(chart.points[-1])]
                return piece._replace(rows=[chart.z])
            case Chart.CUSUM:
                state = (self.state[0], self.state[1]) if self.state else None
                sums = cusum(
                    settings.baseline, z, settings.reference, settings.limit, headstart=settings.headstart, state=state
                )
                self.state = [float(sums.above[-1]), float(sums.below[-1])]
                return piece._replace(rows=[sums.above, -sums.below])
            case Chart.MOVING_AVERAGE:
                before = len(self.waiting)
                together = np.concatenate((np.array(self.waiting, np.float64), z))
                self.waiting = together[len(together) - min(len(together), settings.span - 1) :].tolist()
                return piece._replace(rows=[moving_average(settings.baseline, together, settings.span).z[before:]])
            case Chart.MOVING_RANGE:
                return self._ranges(piece)
        return piece

    def _ranges(self, piece: Piece) -> Piece:
        """Ranges over the beginning of a tool are none: what lies between is no scatter."""
        z, first, begins = piece.rows[0], piece.first, piece.begins
        if self.waiting:
            z = np.concatenate((np.array(self.waiting), z))
            first, begins = np.concatenate(([self.waiting_at], first)), np.concatenate(([True], begins))
        self.waiting, self.waiting_at = [float(z[-1])], int(first[-1])
        if len(z) < 2:
            return Piece([z[:0]], first[:0], first[:0], begins[:0])
        ranges = moving_ranges(self.settings.baseline, z).z
        last = piece.last[-len(ranges) :]
        return Piece([ranges], first[:-1], last, begins[1:]).only(~begins[1:])

    def memory(self) -> dict[str, Any]:
        """State to go on from, as JSON."""
        return {
            "waiting": self.waiting,
            "waiting_at": self.waiting_at,
            "state": self.state,
            "seen": self.seen,
        }

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Go on where another one has left off with the same settings."""
        self.waiting, self.waiting_at = list(memory["waiting"]), memory["waiting_at"]
        self.state, self.seen = list(memory["state"]), memory["seen"]
