"""Input of the examples, and the readings in it."""

from typing import Any

import numpy as np

from app.core.spc.refusal import Floats

Given = dict[str, Any]
Got = dict[str, Any]


def readings_of(given: Given) -> Floats:
    """The readings of an example: written out, alternating, in steps of one, or made to have a mean and an s."""
    if "alternating" in given:
        return np.array([given["first"], *(given["alternating"] * given["times"])], dtype=np.float64)
    if "count" in given:
        steps: Floats = np.linspace(-1.0, 1.0, given["count"])
        return float(given["mean"]) + steps * float(given["standard_deviation"]) / float(steps.std(ddof=1))
    if "last" in given:
        return np.arange(given["first"], given["last"] + 1, dtype=np.float64)
    return np.array(given["values"], dtype=np.float64)
