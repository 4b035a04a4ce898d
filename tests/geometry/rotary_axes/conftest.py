"""Who comes to the rotary axes, and a shop for every test of them."""

import pytest

from tests.conftest import Server
from tests.shop import Person, Shop


@pytest.fixture
def shop(server: Server) -> Shop:
    return Shop(server)


@pytest.fixture(scope="module")
def operator(server: Server) -> Person:
    return Person(server, "operator")


@pytest.fixture(scope="module")
def engineer(server: Server) -> Person:
    return Person(server, "engineer")
