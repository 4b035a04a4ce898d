"""Examples for the OpenAPI document. Lengths in mm."""

from typing import Any

EXAMPLE_FIGURES: dict[str, Any] = {
    "readings": 4988,
    "rejects": 31,
    "oversize": 17,
    "undersize": 13,
    "worn": 1,
    "faults": 0,
    "offset_limit": 0,
    "corrections": 812,
    "of_tool": 1501,
    "held": 1,
    "mean_size": 0.0016,
    "inner": 4987,
    "mean": 0.00008,
    "spread": 0.00151,
    "ppk": 1.59,
    "largest": 0.0121,
    "alarms": 31,
}
EXAMPLE_BETTER = EXAMPLE_FIGURES | {"rejects": 9, "corrections": 240, "spread": 0.00133, "ppk": 1.98}
EXAMPLE_EFFECT: dict[str, Any] = {
    "value": 0.977,
    "low": 0.905,
    "high": 1.049,
    "corrections": 579,
    "readings": 2928,
    "typical": 0.00116,
    "scatter": 0.00081,
    "is_full": True,
    "text": "On this machine a correction of 10 µm moves the part by 9.8 µm (9.1…10.5), by 579 corrections.",
}
EXAMPLE_PERIOD: dict[str, Any] = {
    "characteristic": "shaft-d40",
    "first_sequence": 1,
    "last_sequence": 5000,
    "start": "2026-11-01T06:00:00Z",
    "end": "2026-11-21T08:15:02Z",
    "readings": 4988,
    "left_out": 12,
}
EXAMPLE_SETTINGS = {"weighting_factor": 2.0, "zero_range": 0.001, "averaging_limit": 0.0053, "factor": -1.0}
EXAMPLE_ANSWER: dict[str, Any] = EXAMPLE_PERIOD | {
    "parameters_version": 1,
    "delay": 2,
    "effect": 1.0,
    "truly": EXAMPLE_FIGURES,
    "likeness": {
        "verdict": "well",
        "off": 0.00085,
        "same": 0.33,
        "text": "The simulated loop does what the real one did.",
        "replayed": EXAMPLE_FIGURES,
    },
    "today": {"settings": EXAMPLE_SETTINGS} | EXAMPLE_FIGURES,
    "other": {"settings": EXAMPLE_SETTINGS | {"zero_range": 0.0027}} | EXAMPLE_BETTER,
    "measured_effect": EXAMPLE_EFFECT,
    "cautions": ["The tool is corrected by shaft-d35 as well; they are replayed with it, set as they were."],
}


EXAMPLE_MAP: dict[str, Any] = EXAMPLE_PERIOD | {
    "criterion": "ppk",
    "averaging_limit": 0.0053,
    "delay": 2,
    "today": EXAMPLE_FIGURES,
    "cells": [
        {
            "weighting_factor": 2.0,
            "zero_range": 0.0027,
            "figures": EXAMPLE_BETTER,
            "inside": True,
            "best": True,
            "calmest": True,
            "reason": None,
        }
    ],
}


EXAMPLE_PROPOSAL: dict[str, Any] = {
    "id": 1,
    "characteristic": "shaft-d40",
    "machine": "lathe-1",
    "status": "open",
    "from_version": 1,
    "changes": {"zero_range": 0.0027},
    "reason": "Half the corrections, fewer rejects",
    "proposed_by": "ana",
    "proposed_at": "2026-11-21T08:15:02Z",
    "decided_by": None,
    "decided_at": None,
    "decided_why": None,
    "made_version": None,
    "evidence": EXAMPLE_ANSWER,
}
