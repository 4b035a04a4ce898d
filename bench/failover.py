"""Servers of the database killed under load, again and again: what is lost, what is doubled, and how long nobody is served.

Three PostgreSQL servers (quorum `ANY 1`), two `inband serve`, 16 machines that send readings with keys. In each round the
server that is written to is killed (SIGKILL, all of its processes), the standby that has received most is promoted, and
the old one comes back by pg_rewind. At the end every answered reading has to be in the record once, the numbers without
gaps, and the corrections those of a replay. With --asynchronous no commit waits for a standby: machines that see their
numbers go back send again what was answered. With --patroni the servers are Patroni's, which promotes and rewinds by itself;
`patroni` and `etcd` have to be installed. ``python -m bench.failover [--rounds 10] [--asynchronous | --patroni]``
"""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

import httpx

from app.access.keys import add_key
from app.core.parameters import read
from app.db.engine import Database
from bench.plant import free_port, wait_until_ready
from tests.databases import make_whole
from tests.db.clusters import cluster, wait_for
from tests.db.managed import MISSING, managed
from tests.loop.readings.load import Sender, all_at_once, scattered
from tests.loop.readings.record import history, must_be_stored, must_hold, must_replay
from tests.shop import PARAMETERS

MACHINES, SPINDLES = 4, 4
AT_WORK = 1.0  # s of load before each kill
BEHIND = 0.3  # s that an asynchronous standby lacks when the other server ends
PATIENCE = 180.0  # s that a machine sends a reading again: Patroni promotes nobody before its key has run out


class Node(Protocol):
    """One server."""

    data_dir: Path

    @property
    def url(self) -> str:
        """Of the database on this server."""


AnyNode = TypeVar("AnyNode", bound=Node)


class Servers(Protocol[AnyNode]):
    """Servers, one of which is written to."""

    quorum: bool
    primary: AnyNode
    url: str

    def fall_behind(self) -> None:
        """Nothing more leaves the one that is written to."""

    def kill(self, node: AnyNode, /) -> None:
        """Kill it, as if the computer had gone."""

    def promote(self) -> AnyNode:
        """Let another be written to, or wait until one is."""

    def rejoin(self, node: AnyNode, /) -> str:
        """Bring it back as a standby; what pg_rewind said."""


class Round(NamedTuple):
    """One server killed, another promoted. outage: seconds from the kill until every machine had been answered again."""

    promoted: str
    answered: int
    outage: float
    rewound: str


class Result(NamedTuple):
    """All rounds. lost: readings that were answered, were gone, and had to be sent again. Seconds."""

    rounds: list[Round]
    answered: int
    stored: int
    sent_again: int
    lost: int
    corrections: int
    longest: float


def play(
    servers: Servers[AnyNode], urls: Sequence[str], rounds: int, *, at_work: float = AT_WORK, run: str = "m"
) -> Result:
    """Play so many rounds on servers that run, with `inband serve` at these addresses, and check the record.

    Raises `AssertionError` for a reading that is lost or doubled, a gap, a decision that a replay does not take.
    """
    senders = crew(servers, urls, run)
    played: list[Round] = []
    stop = threading.Event()
    with ThreadPoolExecutor(1) as pool:
        working = pool.submit(all_at_once, senders, stop)
        try:
            served(senders, working.done)
            for _round in range(rounds):
                time.sleep(at_work)
                played.append(one(servers, senders, working.done))
            served(senders, working.done)  # one more, by which a machine sees that numbers went back
        finally:
            stop.set()
        working.result(120)
    corrections = check(servers, senders, run)
    return Result(
        played,
        sum(len(sender.answers) for sender in senders),
        sum(len(history(servers.primary.url, name)) for name in names(run)),
        sum(sender.again for sender in senders),
        sum(sender.lost for sender in senders),
        corrections,
        max(sender.longest for sender in senders),
    )


def names(run: str) -> list[str]:
    """The characteristics, one for each machine and spindle."""
    return [f"{run}{machine}-s{spindle}" for machine in range(MACHINES) for spindle in range(SPINDLES)]


def crew(servers: Servers[AnyNode], urls: Sequence[str], run: str) -> list[Sender]:
    """Set up the machines; one sender for each characteristic, which has its tool and its average to itself."""
    database = Database(servers.url, pool_size=1)
    with database.begin() as session:
        admin = add_key(session, role="admin", machine=None, name="failover", actor="failover").secret
    with httpx.Client(base_url=f"{urls[0]}/api/v1", headers={"Authorization": f"Bearer {admin}"}, timeout=60) as client:
        for machine in range(MACHINES):
            client.post(
                "/machines", json={"key": f"{run}{machine}", "name": "M", "control": "other"}
            ).raise_for_status()
            for spindle in range(SPINDLES):
                parameters = PARAMETERS | {"tool_memory": spindle + 1, "average_memory": spindle + 1}
                added = {
                    "key": f"{run}{machine}-s{spindle}",
                    "name": "S",
                    "machine": f"{run}{machine}",
                    "parameters": parameters,
                }
                client.post("/characteristics", json=added).raise_for_status()
    keys = {}
    with database.begin() as session:
        for machine in range(MACHINES):
            keys[f"{run}{machine}"] = add_key(
                session, role=None, machine=f"{run}{machine}", name="failover", actor="failover"
            ).secret
    database.close()
    return [
        Sender(
            urls[at % len(urls)],
            keys[name.partition("-")[0]],
            scattered(name, 10_000_000, at),
            patience=PATIENCE,
            pause=0.01,
            alone=True,
        )
        for at, name in enumerate(names(run))
    ]


def one(servers: Servers[AnyNode], senders: list[Sender], ended: Callable[[], bool]) -> Round:
    """Kill, promote, bring back."""
    old, before = servers.primary, sum(len(sender.answers) for sender in senders)
    if not servers.quorum:
        servers.fall_behind()
        time.sleep(BEHIND)
    servers.kill(old)
    begun = time.monotonic()
    promoted = servers.promote()
    served(senders, ended)
    outage = time.monotonic() - begun
    rewound = servers.rejoin(old)
    return Round(promoted.data_dir.name, before, outage, rewound)


def served(senders: list[Sender], ended: Callable[[], bool]) -> None:
    """Until everybody has been answered twice from now on: the first answer may have been on its way."""
    before = [len(sender.answers) for sender in senders]
    wait_for(
        lambda: ended() or all(len(s.answers) > count + 1 for s, count in zip(senders, before, strict=True)),
        "everybody is served",
        PATIENCE,
    )


def check(servers: Servers[AnyNode], senders: list[Sender], run: str) -> int:
    """Check the record on the server that is written to, and count its corrections."""
    url = servers.primary.url
    must_be_stored(url, [answer for sender in senders for answer in sender.answers])
    for sender, name in zip(senders, names(run), strict=True):
        stored = [reading["key"] for reading in history(url, name)]
        assert sorted(stored) == sorted(answer["key"] for answer in sender.answers), "there are others"
    must_hold(url)
    return sum(must_replay(read(PARAMETERS)[0], history(url, name)) for name in names(run))


def behind_two(servers: Servers[AnyNode], folder: Path, rounds: int) -> Result:
    """Play the rounds with two `inband serve` of their own."""
    with ExitStack() as stack:
        urls = []
        for number in range(2):
            port = free_port()
            process = subprocess.Popen(
                [sys.executable, "-m", "app", "serve", "--port", str(port)],
                env=os.environ
                | {"INBAND_DATABASE_URL": servers.url, "INBAND_DATA_DIR": str(folder / f"serve-{number}")},
                stdout=subprocess.DEVNULL,
                stderr=(folder / f"serve-{number}.log").open("wb"),
            )
            stack.callback(process.wait, 30)
            stack.callback(process.terminate)
            urls.append(f"http://127.0.0.1:{port}")
            wait_until_ready(urls[-1], process)
        return play(servers, urls, rounds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--asynchronous", action="store_true")
    parser.add_argument("--patroni", action="store_true")
    arguments = parser.parse_args()
    if arguments.patroni and MISSING:
        parser.error(f"--patroni needs {' and '.join(MISSING)}. Install the packages patroni and etcd-server.")
    if arguments.patroni and arguments.asynchronous:
        parser.error("--asynchronous is not for --patroni: Patroni promotes nobody who lacks what was answered.")
    with tempfile.TemporaryDirectory(prefix="inband-") as name:
        folder = Path(name)
        folder.chmod(0o711)
        if arguments.patroni:
            with managed(folder) as kept:
                result = behind_two(kept, folder, arguments.rounds)
        else:
            make_whole(folder / "whole")
            with cluster(folder, folder / "whole") as servers:
                servers.ask_for(quorum=not arguments.asynchronous)
                result = behind_two(servers, folder, arguments.rounds)
    print("round  promoted  answered before  seconds until all were served again  pg_rewind")
    for number, each in enumerate(result.rounds, 1):
        last = each.rewound.strip().splitlines()[-1:] or ["-"]
        print(f"{number:>5}  {each.promoted:<8}  {each.answered:>15}  {each.outage:>35.1f}  {last[0]}")
    print(
        f"answered {result.answered}, stored {result.stored}, corrections as in a replay {result.corrections}; "
        f"sent more than once {result.sent_again}, answered and gone, then sent again {result.lost}; "
        f"longest wait of one reading {result.longest:.1f} s. None is missing, none is doubled."
    )


if __name__ == "__main__":
    main()
