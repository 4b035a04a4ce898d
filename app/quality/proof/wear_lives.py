"""Tool lives made up in the shapes that are published, for the proof of forecasts; docs/reference/wear.md states parameters and sources."""

from typing import Any

import numpy as np

from app.core.wear import Values

KINDS = ("phases", "power", "line", "milling")


def operation(rng: np.random.Generator) -> dict[str, Any]:
    """An operation, about which its tools vary: shape of the wear curve, parts of a life, scatter in shares of the wear at its end.

    phases: run-in, even wear, steep end. power: a power of the time. line: straight. milling: half of the wear in the first tenth,
    nearly none, then the rest, as cutters in public data.
    """
    return {
        "kind": KINDS[rng.integers(len(KINDS))],
        "parts": rng.uniform(120, 900),
        "run_in": rng.uniform(0.05, 0.35),
        "soon": rng.uniform(0.02, 0.15),
        "even": rng.uniform(0.3, 0.7),
        "begin": rng.uniform(0.5, 0.9),
        "steep": rng.uniform(0.1, 0.6),
        "bend": rng.uniform(1.5, 3),
        "power": rng.uniform(0.5, 2.2),
        "scatter": rng.choice([0.003, 0.01, 0.03, 0.06]),
    }


def steeper(rng: np.random.Generator, most: float) -> dict[str, Any]:
    """An operation with a steeper end than `operation` has any: 30 % of the wear and more in the last 5 to 25 % of a life."""
    share = rng.uniform(0.3, most)
    of = {"kind": "phases", "run_in": 0.1, "soon": 0.05, "even": 0.9 - share, "steep": share, "bend": 1.5}
    return operation(rng) | of | {"begin": rng.uniform(0.75, 0.95), "scatter": rng.choice([0.003, 0.01, 0.03])}


def life(of: dict[str, Any], rng: np.random.Generator) -> Values:
    """One tool life, measured, to the part at which its true wear comes to 1; parameters 15 % about those of the operation."""

    def varied(value: float, by: float = 0.15) -> float:
        return float(value * np.exp(rng.normal(0, by)))

    parts = int(varied(of["parts"], 0.2))
    t = np.arange(1, 2 * parts) / parts
    if of["kind"] == "phases":
        begin = min(0.95, varied(of["begin"], 0.08))
        worn = varied(of["run_in"]) * (1 - np.exp(-t / varied(of["soon"]))) + varied(of["even"]) * t
        worn += varied(of["steep"], 0.3) * (np.maximum(t - begin, 0) / (1 - begin)) ** varied(of["bend"])
    elif of["kind"] == "power":
        worn = t ** varied(of["power"], 0.1)
    elif of["kind"] == "line":
        worn = t
    else:
        begin = min(0.9, varied(0.6, 0.1))
        worn = 0.45 * (1 - np.exp(-t / varied(0.1))) + varied(0.25) * t
        worn += varied(0.3, 0.3) * (np.maximum(t - begin, 0) / 0.4) ** 1.5
    worn = worn / np.interp(1, t, worn)
    count = int(np.argmax(worn >= 1)) + 1
    measured: Values = worn[:count] + rng.normal(0, of["scatter"], count)
    return measured
