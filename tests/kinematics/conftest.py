"""A shop of its own for every test of the rotary axes."""

import pytest

from tests.conftest import Server
from tests.shop import Shop


@pytest.fixture
def shop(server: Server) -> Shop:
    return Shop(server)
