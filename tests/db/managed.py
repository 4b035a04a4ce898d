"""Three PostgreSQL servers that Patroni keeps, with the file of the document; whoever leads holds a key in etcd.

The programs `patroni` and `etcd` are the system's, PostgreSQL is the one that Inband starts. Everything is on loopback.
"""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import psycopg
import yaml  # type: ignore[import-untyped]

from app import HOUSE
from app.db import migrate
from app.db.binaries import binary
from app.db.embedded import ENVIRONMENT, EmbeddedServer, _children, _is_postgres
from app.db.run_as import PATH, give
from tests import keeper
from tests.db.clusters import wait_for

EXAMPLE = HOUSE / "docs/how-to/patroni.yml"
NAMES = ("db1", "db2", "db3")
PASSWORD = "of-inband"
MISSING = [name for name in ("patroni", "etcd") if shutil.which(name, path=PATH) is None]
"""Programs that are not installed."""
QUICK = {"ttl": 10, "loop_wait": 1, "retry_timeout": 3}
"""Seconds; a plant has more patience, and whoever kills servers in a test would only wait."""
RECEIVING = "SELECT count(*) FROM pg_stat_replication WHERE state = 'streaming' AND application_name LIKE 'db_'"
CONFIRMING = {"sync_standby", "quorum_standby"}
"""Roles of members that may lead next: PostgreSQL waits for one some moments before etcd knows it."""
ONLY_HERE = "SELECT pg_logical_emit_message(false, 'test', 'no standby has this', true)"


def free_ports(count: int) -> list[int]:
    """Loopback ports that nobody listens on at this moment."""
    with ExitStack() as stack:
        probes = [stack.enter_context(socket.socket()) for _port in range(count)]
        for probe in probes:
            probe.bind(("127.0.0.1", 0))
        return [int(probe.getsockname()[1]) for probe in probes]


class Member:
    """One server, and the Patroni that keeps it."""

    def __init__(self, folder: Path, name: str, etcd: str) -> None:
        self.data_dir = folder / name
        self.cluster = self.data_dir / "postgres"
        self.log = self.data_dir / "patroni.log"
        self.port, api = free_ports(2)
        self.api = f"http://127.0.0.1:{api}"
        self.process: subprocess.Popen[bytes] | None = None
        self._server = EmbeddedServer(self.data_dir)
        self._ended: tuple[int, ...] = ()
        self.data_dir.mkdir(mode=0o711)
        settings = self._settings(etcd, api)
        superuser = settings["postgresql"]["authentication"]["superuser"]
        self.url = f"postgresql://{superuser['username']}:{superuser['password']}@127.0.0.1:{self.port}/inband"
        """Of the database on this server, for whoever may do everything."""
        (self.data_dir / "patroni.yml").write_text(yaml.safe_dump(settings))
        give(self.data_dir, self._server._owner(), recursive=True)

    def _settings(self, etcd: str, api: int) -> dict[str, Any]:
        """The document's, with names, places and times of a test."""
        settings: dict[str, Any] = yaml.safe_load(EXAMPLE.read_text().replace("10.0.4.0/24", "127.0.0.1/32"))
        settings["name"] = self.data_dir.name
        settings["restapi"] = {"listen": f"127.0.0.1:{api}", "connect_address": f"127.0.0.1:{api}"}
        settings["etcd3"]["hosts"] = etcd
        settings["bootstrap"]["dcs"] |= QUICK
        settings["postgresql"] |= {
            "listen": f"127.0.0.1:{self.port}",
            "connect_address": f"127.0.0.1:{self.port}",
            "bin_dir": str(binary("postgres").parent),
            "data_dir": str(self.cluster),
            "pgpass": str(self.data_dir / "pgpass"),
            # no test pulls the plug
            "parameters": {"fsync": "off", "shared_buffers": "64MB", "unix_socket_directories": str(self.data_dir)},
        }
        del settings["watchdog"]
        return settings

    def start(self) -> None:
        """Start Patroni, which starts the server when it is time."""
        command = [*self._server._as(self._server._owner()), "patroni", str(self.data_dir / "patroni.yml")]
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                command,
                env=ENVIRONMENT | keeper.mark(),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    @property
    def leads(self) -> bool:
        """Tell if Patroni says that this server is written to."""
        try:
            return httpx.get(f"{self.api}/primary", timeout=5).status_code == 200
        except httpx.TransportError:
            return False

    @property
    def said(self) -> str:
        """Log of Patroni and of the server."""
        return self.log.read_text(errors="replace") if self.log.exists() else ""

    def end(self, number: signal.Signals) -> None:
        """Kill Patroni, and end the server by this signal: SIGKILL is for all of its processes, as if the computer had gone."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None
        pid = self._server.pid
        self._ended = () if pid is None else (pid, *_children(pid))
        for process in self._ended if number == signal.SIGKILL else self._ended[:1]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, number)

    def wait_until_ended(self) -> None:
        """Until none of the processes is left."""
        wait_for(
            lambda: not any(_is_postgres(process, self.cluster) for process in self._ended), "the server has ended"
        )


class Managed:
    """So many servers, of which Patroni lets one lead."""

    quorum = True  # Patroni's synchronous_mode: whoever may lead next has everything that was answered

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        client, peer = free_ports(2)
        self._etcd, self._peer = f"127.0.0.1:{client}", f"127.0.0.1:{peer}"
        self._etcd_process: subprocess.Popen[bytes] | None = None
        self.members = [Member(folder, name, self._etcd) for name in NAMES]
        self.primary = self.members[0]
        places = ",".join(f"127.0.0.1:{member.port}" for member in self.members)
        self.url = f"postgresql://inband:{PASSWORD}@{places}/inband"
        """Of the one that is written to, as Inband is told it."""

    def start(self) -> None:
        """Start etcd, then all servers, and make the database as the document says."""
        command = ["etcd", "--name=etcd", f"--data-dir={self._folder / 'etcd'}", "--unsafe-no-fsync"]
        command += [f"--{kind}-client-urls=http://{self._etcd}" for kind in ("listen", "advertise")]
        command += [f"--listen-peer-urls=http://{self._peer}", f"--initial-advertise-peer-urls=http://{self._peer}"]
        command += [f"--initial-cluster=etcd=http://{self._peer}"]
        with (self._folder / "etcd.log").open("ab") as log:
            self._etcd_process = subprocess.Popen(
                command,
                env=ENVIRONMENT | keeper.mark(),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self.primary.start()
        wait_for(lambda: self.primary.leads, "the first server leads", 120)
        for member in self.members[1:]:
            member.start()
        with psycopg.connect(self.primary.url.removesuffix("inband") + "postgres", autocommit=True) as connection:
            connection.execute(f"CREATE ROLE inband LOGIN PASSWORD '{PASSWORD}'")
            connection.execute("GRANT pg_read_all_stats TO inband")
            connection.execute("CREATE DATABASE inband OWNER inband")
        migrate.upgrade(self.url)
        self._wait_until_whole()

    def stop(self) -> None:
        """End whatever runs."""
        for member in self.members:
            member.end(signal.SIGQUIT)
        for member in self.members:
            member.wait_until_ended()
        if self._etcd_process is not None:
            self._etcd_process.kill()
            self._etcd_process.wait()

    def fall_behind(self) -> None:
        """Nothing more leaves the one that is written to, and it has something that no standby has."""
        with psycopg.connect(self.primary.url, autocommit=True) as connection:
            for (sender,) in connection.execute("SELECT pid FROM pg_stat_replication").fetchall():
                os.kill(sender, signal.SIGSTOP)
            connection.execute(ONLY_HERE)

    def kill(self, member: Member) -> None:
        """Kill it and its Patroni, in such a state that it has to be rewound."""
        self.fall_behind()
        member.end(signal.SIGKILL)
        member.wait_until_ended()

    def promote(self) -> Member:
        """Wait until another leads."""
        old = self.primary
        others = [member for member in self.members if member is not old]
        wait_for(lambda: any(member.leads for member in others), "another leads", 120)
        self.primary = next(member for member in others if member.leads)
        return self.primary

    def rejoin(self, member: Member) -> str:
        """Start the old one again; the line in which Patroni tells how pg_rewind ended, if it had to."""
        before = len(member.said)
        member.start()
        self._wait_until_whole()
        return "\n".join(line for line in member.said[before:].splitlines() if "pg_rewind exit code" in line)

    def _wait_until_whole(self) -> None:
        def whole() -> bool:
            with psycopg.connect(self.primary.url, autocommit=True, connect_timeout=5) as connection:
                receiving = connection.execute(RECEIVING).fetchone()
            with contextlib.suppress(httpx.TransportError):
                members = httpx.get(f"{self.primary.api}/cluster", timeout=5).json()["members"]
                return receiving == (len(self.members) - 1,) and any(each["role"] in CONFIRMING for each in members)
            return False

        wait_for(whole, "all standbys receive, and one of them may lead next", 120)


@contextmanager
def managed(folder: Path) -> Iterator[Managed]:
    """Servers that run, and end with the block."""
    made = Managed(folder)
    try:
        made.start()
        yield made
    finally:
        made.stop()
