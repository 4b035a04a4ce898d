"""Patroni and etcd keep the servers, as in a plant and with the file of the document: the one that is written to is killed."""

from collections.abc import Iterator

import pytest

from bench import failover
from tests.databases import short_folder
from tests.db.managed import MISSING, Managed, managed
from tests.forked import inband
from tests.servers import RunServer

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)} (packages patroni and etcd-server)"),
]


@pytest.fixture(scope="module")
def servers() -> Iterator[Managed]:
    with short_folder() as folder:
        folder.chmod(0o711)
        with managed(folder) as made:
            yield made


def test_killed_under_load_nothing_that_was_answered_is_lost_and_the_old_one_is_rewound(
    servers: Managed, run_server: RunServer
) -> None:
    with run_server(servers.url) as server:
        result = failover.play(servers, [server.url], 1)
    (played,) = result.rounds
    assert "pg_rewind exit code=0" in played.rewound
    assert result.answered == result.stored > played.answered > 0
    assert result.corrections > 0
    assert result.lost == 0


def test_the_check_finds_nothing_to_mend(servers: Managed) -> None:
    """`inband check` takes what Patroni keeps for what it is: a commit waits for a standby, and another is there."""
    done = inband("check", "--database-url", servers.url)
    told = " ".join(done.stderr.split())
    assert "standby db" in told, told
    assert ": synchronous" in told, told
    assert "synchronous_standby_names" not in told, told
