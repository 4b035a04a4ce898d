"""A coordinator and workers of Citus on this computer: the embedded server's, each with a folder and a socket of its own.

`INBAND_TEST_CITUS` names the folder of PostgreSQL's programs with the extension citus built for them.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import psycopg

from app.db.embedded import EmbeddedServer

PROGRAMS = os.environ.get("INBAND_TEST_CITUS", "")
OPTIONS = {
    "shared_preload_libraries": "citus",
    "wal_level": "logical",
    "max_prepared_transactions": "200",
    "citus.node_conninfo": "sslmode=disable",
}


@contextmanager
def nodes(folder: Path, workers: int = 2, options: Mapping[str, str] | None = None) -> Iterator[list[EmbeddedServer]]:
    """The coordinator and its workers, which run and know one another."""
    before = os.environ.get("INBAND_POSTGRES_BIN")
    os.environ["INBAND_POSTGRES_BIN"] = PROGRAMS
    made = [EmbeddedServer(folder / f"node{number}", OPTIONS | dict(options or {})) for number in range(workers + 1)]
    for node in made:  # they are reached by their sockets, by themselves too
        node.options["citus.local_hostname"] = place(node)[0]
    try:
        for node in made:
            node.start()
            with psycopg.connect(node.url, autocommit=True) as connection:
                connection.execute("CREATE EXTENSION citus")
        with psycopg.connect(made[0].url, autocommit=True) as connection:
            connection.execute("SELECT citus_set_coordinator_host(%s, %s)", place(made[0]))
            for node in made[1:]:
                connection.execute("SELECT citus_add_node(%s, %s)", place(node))
        yield made
    finally:
        for node in made:
            node.stop()
        if before is None:
            del os.environ["INBAND_POSTGRES_BIN"]
        else:
            os.environ["INBAND_POSTGRES_BIN"] = before


def place(node: EmbeddedServer) -> tuple[str, int]:
    """Host and port by which the others reach it."""
    parts = psycopg.conninfo.conninfo_to_dict(node.url)
    return str(parts["host"]), int(str(parts["port"]))
