"""Choice of the points to draw of very many, so that no extreme and no signal is lost. Pure."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_POINTS = 3_000
STRETCHES = 750


def thinned(values: ArrayLike, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Indices of the points to draw: all of few; of many the first, last, lowest and highest of each stretch, and of its signals.

    >>> thinned([1.0, 2.0], np.array([False, False])).tolist()
    [0, 1]
    """
    points = np.asarray(values, np.float64)
    count = len(points)
    if count <= MOST_POINTS:
        return np.arange(count)
    stretch = np.arange(count) * STRETCHES // count
    chosen = [np.flatnonzero(np.diff(stretch, prepend=-1)), np.array([count - 1])]
    chosen += _extremes(points, stretch, np.arange(count))
    chosen += _extremes(points, stretch, np.flatnonzero(wanted))
    return np.unique(np.concatenate(chosen))


def _extremes(
    points: NDArray[np.float64], stretch: NDArray[np.int64], some: NDArray[np.int64]
) -> list[NDArray[np.int64]]:
    """Of these points the lowest and the highest of each stretch."""
    if not len(some):
        return []
    values, within = points[some], stretch[some]
    starts = np.flatnonzero(np.diff(within, prepend=-1))
    sizes = np.diff(np.append(starts, len(some)))
    chosen = []
    for extreme in (np.fmin, np.fmax):
        at = np.flatnonzero(values == np.repeat(extreme.reduceat(values, starts), sizes))
        chosen.append(some[at[np.flatnonzero(np.diff(within[at], prepend=-1))]])
    return chosen
