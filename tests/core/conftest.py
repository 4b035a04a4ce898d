from collections.abc import Callable
from typing import Any

import pytest

from app.core.parameters import Parameters, read

SHAFT: dict[str, Any] = {
    "tool_memory": 3,
    "average_memory": 5,
    "nominal": 40.0,
    "upper_deviation": 0.0,
    "lower_deviation": -0.016,
    "zero_range": 0.001,
    "averaging_limit": 0.0053,
    "wear_limit": 0.3,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
    "factor": -1,
}


@pytest.fixture
def shaft() -> Callable[..., Parameters]:
    """The bearing seat of the contract, with what is said about it changed."""

    def made(**changes: Any) -> Parameters:
        return read(SHAFT | changes)[0]

    return made
