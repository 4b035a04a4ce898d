"""One story for all tests that only read what is reported of it."""

import pytest

from tests.servers import Server
from tests.shop import Shop
from tests.views.reports.story import told


@pytest.fixture(scope="session")
def story(common_server: Server) -> Shop:
    """Six hundred readings with everything a report may hold; nobody changes anything there."""
    shop = Shop(common_server)
    told(shop)
    common_server.keep(shop.admin, shop.machine_client)
    return shop
