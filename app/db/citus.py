"""Citus: schemas of plants on several nodes behind one coordinator, which Inband is connected to.

A schema is made where it is ordinary and then distributed: all its tables go to one node together, and its statements are
routed there. Triggers on statements, by which facts are protected, have to be permitted for that. A migration of a distributed
schema gives its commands one by one, and drops one thing with each; a schema with identity columns is never gathered again.
Source: https://docs.citusdata.com, *Schema-based sharding*; tried with Citus 14.0.1 on PostgreSQL 18.
"""

from typing import Any, NamedTuple

import psycopg

CITUS = "SELECT extversion FROM pg_extension WHERE extname = 'citus'"
_NODES = "SELECT nodename, nodeport FROM pg_dist_node WHERE noderole = 'primary' AND isactive ORDER BY groupid"
_PLACE = """
SELECT n.nodename, n.nodeport FROM pg_dist_schema s
JOIN pg_dist_partition t ON t.colocationid = s.colocationid
JOIN pg_dist_shard h ON h.logicalrelid = t.logicalrelid
JOIN pg_dist_placement p ON p.shardid = h.shardid
JOIN pg_dist_node n ON n.groupid = p.groupid AND n.noderole = 'primary'
WHERE s.schemaid = to_regnamespace(%s) LIMIT 1
"""


class Node(NamedTuple):
    """A PostgreSQL server of the cluster."""

    host: str
    port: int

    def __str__(self) -> str:
        """Return it as people type it."""
        return f"{self.host}:{self.port}"


def version(connection: psycopg.Connection[Any]) -> str | None:
    """Version of Citus; None where the database has none."""
    row = connection.execute(CITUS).fetchone()
    return str(row[0]) if row else None


def nodes(connection: psycopg.Connection[Any]) -> list[Node]:
    """Every node that takes data, the coordinator first."""
    return [Node(*row) for row in connection.execute(_NODES)]


def node_of(connection: psycopg.Connection[Any], schema: str) -> Node | None:
    """The node that a schema lies on; None for one that is not distributed: it lies on the coordinator."""
    row = connection.execute(_PLACE, (schema,)).fetchone()
    return Node(*row) if row else None


def move(connection: psycopg.Connection[Any], schema: str, node: Node) -> None:
    """Move a schema to a node; one that is not distributed yet is, first. Readings wait at the end of it, for a moment.

    Raises psycopg's errors, as Citus words them.
    """
    if node_of(connection, schema) is None:
        connection.execute("SET citus.enable_unsafe_triggers = on")
        connection.execute("SELECT citus_schema_distribute(%s::regnamespace)", (schema,))
    if node_of(connection, schema) != node:
        connection.execute("SELECT citus_schema_move(%s::regnamespace, %s, %s)", (schema, node.host, node.port))


def in_words(connection: psycopg.Connection[Any]) -> str:
    """The cluster in one line, with the node of the connection's schema and what is missing; empty without Citus."""
    release = version(connection)
    if release is None:
        return ""
    known = nodes(connection)
    row = connection.execute("SELECT current_schema()").fetchone()
    node = node_of(connection, row[0]) if row and row[0] else None
    place = f"this plant lies on {node}" if node else "this plant lies on the coordinator, not distributed"
    words = f"{release}, nodes {', '.join(map(str, known)) or 'none'}; {place}"
    if len(known) < 2:
        words += ". Add a node: SELECT citus_add_node('HOST', PORT)"
    return words
