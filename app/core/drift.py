"""Drift of sizes regressed on temperature, on parts since the last pause, and on wear.

What is regressed is the wear curve (`app.core.wear`: what sizes would have been, had nothing been corrected), with a level of
its own for each tool and after each step of the reference. The columns:

=============  =========================================================================================================
temperature    of the part or the machine when it was measured, °C: mm per K
since_pause    parts since the last pause, at most `warm_up`: from then on the machine is warm. mm per part while it warms up
wear           parts, in order: mm per part
=============  =========================================================================================================

A machine that warms up warms the parts too, and a tool wears in the morning as well: how well the three can be separated is
said by each effect's inflation (`app.core.regression`). Association is no proof of a cause.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from app.core.regression import Regression, regression
from app.core.spc.refusal import Floats
from app.core.temperature import HIGHEST, LOWEST

WARM_UP = 20  # parts after a pause
SHORTEST_PAUSE, OF_USUAL = 10.0, 3.0
"""A pause lasts at least this many minutes, and this many times as long as two readings are apart as a rule."""

NEXT = 5  # readings: the clock of one that is later than most of these ran ahead

Whole = NDArray[np.int64]


class Column(StrEnum):
    """A column that sizes are regressed on."""

    TEMPERATURE = "temperature"
    SINCE_PAUSE = "since_pause"
    WEAR = "wear"


@dataclass(frozen=True, slots=True)
class Drift:
    """The regression with what it was made of, by reading: temperature (°C), and mm `apart`: without level and the other effects.

    pause: minutes that a gap lasts at least to be one. pauses: how many there are. unbelieved: temperatures that cannot be true.
    """

    regression: Regression
    temperature: Floats
    apart: Floats
    sequence: Whole
    pause: float
    pauses: int
    unbelieved: int


def usual_pause(minutes: Floats) -> float:
    """Minutes that a gap between two readings lasts at least to be a pause, from when each was measured.

    >>> usual_pause(np.array([0.0, 2.0, 4.0, 60.0, 62.0])), usual_pause(np.array([0.0, 8.0, 16.0, 24.0]))
    (10.0, 24.0)
    """
    gaps = np.diff(minutes)
    return max(SHORTEST_PAUSE, OF_USUAL * float(np.median(gaps)) if len(gaps) else 0.0)


def since_pause(sequence: Whole, minutes: Floats, pause: float, warm_up: int = WARM_UP) -> tuple[Floats, int]:
    """Parts since the last pause, at most `warm_up`, and the number of pauses. Before the first pause the machine is warm.

    A machine's very first part comes after one. A reading that came late is no pause, and one whose clock ran ahead hides none.

    >>> since_pause(np.arange(5, 10), np.array([0.0, 1.0, 60.0, 61.0, 62.0]), 10.0, 20)[0].tolist()
    [20.0, 20.0, 0.0, 1.0, 2.0]
    """
    minutes = _not_ahead(minutes)
    latest = np.maximum.accumulate(minutes)
    begins = np.concatenate((sequence[:1] == 1, minutes[1:] - latest[:-1] >= pause))
    starts = np.flatnonzero(begins)
    if not len(starts):
        return np.full(len(sequence), float(warm_up)), 0
    last = np.searchsorted(starts, np.arange(len(sequence)), side="right") - 1
    parts = np.where(last >= 0, sequence - sequence[starts[last]], warm_up)
    return np.minimum(parts, warm_up).astype(np.float64), len(starts)


def _not_ahead(minutes: Floats) -> Floats:
    """Moments, none of them later than most of the next few."""
    if len(minutes) <= NEXT:
        return minutes
    following = np.median(np.lib.stride_tricks.sliding_window_view(minutes[1:], NEXT), axis=1)
    return np.concatenate((np.minimum(minutes[: len(following)], following), minutes[len(following) :]))


def drift(
    sequence: Whole,
    worn: Floats,
    edge: Whole,
    minutes: Floats,
    temperature: Floats,
    *,
    cut: tuple[Whole, Floats] | None = None,
    pause: float | None = None,
    warm_up: int = WARM_UP,
) -> Drift:
    """Regress the wear curve (mm) of readings in order; edge: the stretch of each; minutes: when it was measured.

    cut: sequence and minutes of all parts, where some are left out: the machine went on at those. Readings without a temperature (NaN), or with one that cannot be true, count as parts and no more. Raises `Refused`.
    """
    numbers, moments = (sequence, minutes) if cut is None else cut
    shortest = usual_pause(moments) if pause is None else pause
    of_all, pauses = since_pause(numbers, moments, shortest, warm_up)
    parts = of_all[np.searchsorted(numbers, sequence)]
    stated = ~np.isnan(temperature)
    good = stated & (temperature >= LOWEST) & (temperature <= HIGHEST)
    columns = {
        Column.TEMPERATURE.value: temperature[good],
        Column.SINCE_PAUSE.value: parts[good],
        Column.WEAR.value: sequence[good].astype(np.float64),
    }
    found = regression(worn[good], columns, edge[good])
    apart = found.residuals.copy()
    if (effect := found.effects.get(Column.TEMPERATURE.value)) is not None:
        apart += effect.value * (temperature[good] - temperature[good].mean())
    return Drift(found, temperature[good], apart, sequence[good], shortest, pauses, int((stated & ~good).sum()))
