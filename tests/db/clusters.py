"""Three PostgreSQL servers that hold one another's copies: one is written to, two stand by. One of them can be killed, and come back.

They are the embedded server's, each with a folder and a socket of its own. Standbys look for whichever of the three can be
written to, so nothing has to be told to the others when one is promoted.
"""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psycopg

from app.db.binaries import binary
from app.db.embedded import ENVIRONMENT, EmbeddedServer, _children
from app.db.run_as import give
from tests.databases import copied

NODES = ("one", "two", "three")
ALWAYS = {"fsync": "off"}  # no test pulls the plug
# In the file, not with the command: pg_rewind lets the dead server recover by itself, which reads the file alone.
KEEP_LOG = "ALTER SYSTEM SET wal_keep_size = '512MB'"
STREAMING = "SELECT count(*) FROM pg_stat_replication WHERE application_name <> 'pg_basebackup' AND state = 'streaming'"
RECEIVED = "SELECT greatest(pg_last_wal_receive_lsn(), pg_last_wal_replay_lsn()) - '0/0'::pg_lsn"


def wait_for(condition: Callable[[], Any], what: str, seconds: float = 60) -> None:
    """Until the condition holds; a server that does not answer yet does not fulfil it."""
    deadline = time.monotonic() + seconds
    while True:
        with contextlib.suppress(psycopg.OperationalError):
            if condition():
                return
        if time.monotonic() > deadline:
            raise AssertionError(f"it did not come to that: {what}")
        time.sleep(0.02)


def kill(node: EmbeddedServer) -> None:
    """The whole server at once, as if the computer had gone: SIGKILL to each of its processes."""
    pid = node.pid
    assert pid is not None
    children = _children(pid)
    for process in (pid, *children):
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):  # a zombie would be taken for a server that runs
        os.waitpid(pid, 0)
    wait_for(lambda: not any(Path(f"/proc/{child}").exists() for child in children), "all of its processes are gone")


def commits_wait_for(url: str, names: str) -> None:
    """From now on each commit of this server waits for these standbys (`synchronous_standby_names`); for none if empty."""
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute(f"ALTER SYSTEM SET synchronous_standby_names = '{names}'")
        connection.execute("SELECT pg_reload_conf()")
        for _ in range(2):  # the checkpointer tells the others, between two checkpoints
            wait_for(lambda: _shown(url) == names, "new connections know")
            connection.execute("CHECKPOINT")


def _shown(url: str) -> str:
    with psycopg.connect(url, autocommit=True) as connection:
        row = connection.execute("SHOW synchronous_standby_names").fetchone()
        return str(row and row[0])


class Cluster:
    """So many servers."""

    def __init__(self, folder: Path, names: Sequence[str] = NODES) -> None:
        self.quorum = False
        """Every commit waits until one of the standbys has it; else no commit waits for any."""
        self.nodes = [EmbeddedServer(folder / name, dict(ALWAYS)) for name in names]
        self.primary = self.nodes[0]
        self._places = ",".join(node.url.partition("host=")[2].partition("&")[0] for node in self.nodes)
        self.url = f"postgresql://inband@/inband?host={self._places}&port=5432"
        """Of the one that is written to, whichever it is."""

    @property
    def standbys(self) -> list[EmbeddedServer]:
        """Those that run and are not written to."""
        return [node for node in self.nodes if node is not self.primary and node.pid is not None]

    def start(self, whole: Path) -> None:
        """Make them all from a data folder that has Inband's schema, and begin."""
        copied(whole, self.primary.data_dir)
        for node in self.nodes:
            node.options |= self._settings(node)  # each has all that it needs to change its part
        self.primary.start()
        with psycopg.connect(self.primary.url, autocommit=True) as connection:
            connection.execute(KEEP_LOG)
            connection.execute("SELECT pg_reload_conf()")
        others = [node for node in self.nodes if node is not self.primary]
        for node in others:
            self._copy_to(node)
            node.start()
        self.wait_until_whole()

    def ask_for(self, *, quorum: bool) -> None:
        """Let commits wait for one of the standbys, or for none: here, and on whichever is promoted."""
        self.quorum = quorum
        names = f"ANY 1 ({', '.join(node.data_dir.name for node in self.nodes)})" if quorum else ""
        for node in self.nodes:
            commits_wait_for(node.url, names)
        states = "SELECT count(*) FROM pg_stat_replication WHERE sync_state = 'quorum'"
        wait_for(lambda: self.ask(self.primary, states) == (len(self.nodes) - 1) * quorum, "they know")

    def mend(self) -> None:
        """Bring back whoever is away; there must be one that is written to."""
        for node in self.nodes:
            if node.pid is not None:
                continue
            if (node.cluster / "standby.signal").exists():
                node.start()
            else:
                self.rejoin(node)
        self.wait_until_whole()

    def stop(self) -> None:
        """End whatever runs."""
        for node in [*self.standbys, self.primary]:
            node.stop()

    def wait_until_whole(self) -> None:
        """Until every standby receives what is written."""
        wait_for(lambda: self.ask(self.primary, STREAMING) == len(self.nodes) - 1, "all standbys receive")

    def ask(self, node: EmbeddedServer, query: str) -> Any:
        """The one value that a query returns there."""
        with psycopg.connect(node.url, autocommit=True, connect_timeout=5) as connection:
            row = connection.execute(query).fetchone()
        return row[0] if row else None

    def fall_behind(self) -> None:
        """Nothing more leaves the one that is written to for its standbys, until it is killed."""
        with psycopg.connect(self.primary.url, autocommit=True) as connection:
            for (sender,) in connection.execute("SELECT pid FROM pg_stat_replication").fetchall():
                os.kill(sender, signal.SIGSTOP)

    def kill(self, node: EmbeddedServer) -> None:
        """Kill one of them, as if the computer had gone."""
        kill(node)

    def promote(self) -> EmbeddedServer:
        """Promote the standby that has received most; it has everything that a quorum has confirmed."""
        waiting = self.standbys
        receiving = "SELECT count(*) FROM pg_stat_wal_receiver WHERE status = 'streaming'"
        wait_for(  # what was on its way when the old one ended has come in
            lambda: not any(self.ask(node, receiving) for node in waiting), "nothing is received any more"
        )
        best = max(waiting, key=self._received)
        self.ask(best, "SELECT pg_promote()")
        self.primary = best
        wait_for(lambda: self.ask(best, "SELECT pg_is_in_recovery()") is False, "the standby is promoted")
        return best

    def _received(self, node: EmbeddedServer) -> int:
        """How far it has got, once it gets no further: one that was started just now reads what it has."""
        before = None
        while before != (now := self.ask(node, RECEIVED)):
            before = now
            time.sleep(0.3)
        return int(now)

    def rejoin(self, node: EmbeddedServer) -> str:
        """Bring the old one back as a standby, without what only it had; what pg_rewind says."""
        done = self._run(
            node, "pg_rewind", f"--target-pgdata={node.cluster}", f"--source-server={self.primary.url}", "--no-sync"
        )
        _touch(node.cluster / "standby.signal", node)
        node.start()
        self.wait_until_whole()
        return done.stderr

    def _copy_to(self, node: EmbeddedServer) -> None:
        node.data_dir.chmod(0o711)
        node.cluster.mkdir(mode=0o700)
        give(node.cluster, node._owner())
        self._run(
            node,
            "pg_basebackup",
            f"--pgdata={node.cluster}",
            f"--dbname={self.primary.url}",
            "--checkpoint=fast",
            "--no-sync",
        )
        _touch(node.cluster / "standby.signal", node)

    def _run(self, node: EmbeddedServer, program: str, *words: str) -> "subprocess.CompletedProcess[str]":
        command = [*node._as(node._owner()), str(binary(program)), *words]
        done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{program}: {done.stderr}"
        return done

    def _settings(self, node: EmbeddedServer) -> dict[str, str]:
        found = f"host={self._places} port=5432 user=inband dbname=postgres target_session_attrs=read-write connect_timeout=2"
        return {
            "primary_conninfo": f"{found} application_name={node.data_dir.name}",
            "wal_retrieve_retry_interval": "200ms",
            "wal_receiver_timeout": "5s",
        }


def _touch(path: Path, node: EmbeddedServer) -> None:
    path.touch(mode=0o600)
    give(path, node._owner())


@contextmanager
def cluster(folder: Path, whole: Path, names: Sequence[str] = NODES) -> Iterator[Cluster]:
    """Servers that run, and end with the block. whole: of `tests.databases.whole_cluster`."""
    made = Cluster(folder, names)
    try:
        made.start(whole)
        yield made
    finally:
        made.stop()
