from collections.abc import Callable
from typing import Any

import pytest

from app.core.parameters import Parameters, read
from bench.plant import PARAMETERS

SHAFT: dict[str, Any] = PARAMETERS | {"tool_memory": 3, "average_memory": 5}
"""The bearing seat of the contract, on a tool and an average."""
SEAT = read(SHAFT)[0]


@pytest.fixture
def shaft() -> Callable[..., Parameters]:
    """The bearing seat of the contract, with what is said about it changed."""

    def made(**changes: Any) -> Parameters:
        return read(SHAFT | changes)[0]

    return made
