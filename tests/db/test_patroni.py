"""Patroni and etcd keep the servers, as in a plant and with the file of the document: the one that is written to is killed."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import mkdtemp

import pytest

from app import HOUSE
from bench import failover
from tests.conftest import RunServer
from tests.db.managed import MISSING, Managed, managed

pytestmark = pytest.mark.skipif(
    bool(MISSING), reason=f"not installed: {', '.join(MISSING)} (packages patroni and etcd-server)"
)


@pytest.fixture(scope="module")
def servers() -> Iterator[Managed]:
    folder = Path(mkdtemp(prefix="inband-"))
    folder.chmod(0o711)
    with managed(folder) as made:
        yield made
    shutil.rmtree(folder)


def test_killed_under_load_nothing_that_was_answered_is_lost_and_the_old_one_is_rewound(
    servers: Managed, run_server: RunServer
) -> None:
    with run_server(servers.url) as inband:
        result = failover.play(servers, [inband.url], 1)
    (played,) = result.rounds
    assert "pg_rewind exit code=0" in played.rewound
    assert result.answered == result.stored > played.answered > 0
    assert result.corrections > 0
    assert result.lost == 0


def test_the_check_finds_nothing_to_mend(servers: Managed) -> None:
    """`inband check` takes what Patroni keeps for what it is: a commit waits for a standby, and another is there."""
    command = [sys.executable, "-m", "app", "check", "--database-url", servers.url]
    done = subprocess.run(command, cwd=HOUSE, capture_output=True, text=True, check=False)
    told = " ".join(done.stderr.split())
    assert "standby db" in told, told
    assert ": synchronous" in told, told
    assert "synchronous_standby_names" not in told, told
