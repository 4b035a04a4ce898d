"""A plant for the tests of imports that call all doors in this process."""

from collections.abc import Iterator

import pytest

from app.bridge import file_content
from app.loop.readings import table_api
from app.loop.readings.aqdef import actions as aqdef_actions
from app.loop.readings.aqdef import content as aqdef_content
from app.loop.readings.importing import lines as importing
from app.loop.readings.importing import uploads
from tests.databases import NewDatabase, drop_database
from tests.in_process import in_process
from tests.loop.readings.importing.doors import ZONE, Plant


@pytest.fixture(scope="module")
def plant(new_database: NewDatabase) -> Iterator[Plant]:
    url = new_database()
    with pytest.MonkeyPatch.context() as patch, in_process(url, timezone=ZONE) as house:
        for module in (
            importing,
            aqdef_actions,
            aqdef_content,
            table_api,
            uploads,
            file_content,
        ):  # tests/files/test_apart.py has the other process
            patch.setattr(module, "apart", lambda work, *given: work(*given))
        yield Plant(house)
    drop_database(url)
