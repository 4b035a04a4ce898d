"""Citus: schemas of plants on several nodes behind one coordinator, which Inband is connected to.

A schema is made where it is ordinary and then distributed: all its tables go to one node together, and its statements are
routed there. Triggers on statements, by which facts are protected, have to be permitted for that. A migration of a distributed
schema gives its commands one by one, and drops one thing with each; a schema with identity columns is never gathered again.
Source: https://docs.citusdata.com, *Schema-based sharding*; tried with Citus 14.0.1 on PostgreSQL 18.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import psycopg

CITUS = "SELECT extversion FROM pg_extension WHERE extname = 'citus'"
_NODES = "SELECT nodename, nodeport FROM pg_dist_node WHERE noderole = 'primary' AND isactive ORDER BY groupid"
_SETTINGS = """
SELECT n.nodename, n.nodeport, r.success, r.result FROM run_command_on_all_nodes(
    'SELECT concat_ws('', '', CASE WHEN current_setting(''wal_level'') <> ''logical'' THEN ''wal_level = logical'' END,'
    ' CASE WHEN current_setting(''max_prepared_transactions'') = ''0'' THEN ''max_prepared_transactions = 200'' END)',
    give_warning_for_connection_errors := true
) r JOIN pg_dist_node n USING (nodeid) ORDER BY n.groupid
"""
_PLACE = """
SELECT n.nodename, n.nodeport FROM pg_dist_schema s
JOIN pg_dist_partition t ON t.colocationid = s.colocationid
JOIN pg_dist_shard h ON h.logicalrelid = t.logicalrelid
JOIN pg_dist_placement p ON p.shardid = h.shardid
JOIN pg_dist_node n ON n.groupid = p.groupid AND n.noderole = 'primary'
WHERE s.schemaid = to_regnamespace(%s) LIMIT 1
"""

# Citus gives a new trigger of a distributed table to its shard, except one that is for TRUNCATE too.
_UNPROTECTED = """
WITH there AS (
    SELECT unnest(string_to_array(result, ',')) AS name FROM run_command_on_all_nodes(format(
        'SELECT string_agg(tgname, '','') FROM pg_trigger g JOIN pg_class c ON c.oid = g.tgrelid'
        ' WHERE c.relnamespace = to_regnamespace(%L)', quote_ident(current_schema())))
)
SELECT c.relname, g.tgname || '_' || s.shardid, pg_get_triggerdef(g.oid), quote_ident(current_schema())
FROM pg_trigger g JOIN pg_class c ON c.oid = g.tgrelid JOIN pg_dist_shard s ON s.logicalrelid = c.oid
WHERE c.relnamespace = current_schema()::regnamespace AND NOT g.tgisinternal AND g.tgtype & 32 > 0
    AND g.tgname || '_' || s.shardid NOT IN (SELECT name FROM there WHERE name IS NOT NULL)
ORDER BY c.relname
"""
_ON_SHARDS = "SELECT success, result FROM run_command_on_shards(%s::regclass, %s)"


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


def permit_triggers(connection: psycopg.Connection[Any]) -> None:
    """Let this connection give triggers to distributed tables, by which facts are protected: their statements stay on one node."""
    connection.execute("SET citus.enable_unsafe_triggers = on")


def distribute(connection: psycopg.Connection[Any], schema: str) -> None:
    """Put an ordinary schema on a node; Citus takes one after the other. Raises psycopg's errors."""
    permit_triggers(connection)
    connection.execute("SELECT citus_schema_distribute(%s::regnamespace)", (schema,))


def move(connection: psycopg.Connection[Any], schema: str, node: Node) -> None:
    """Move a schema to a node; one that is not distributed yet is, first. Readings wait at the end of it, for a moment.

    Raises psycopg's errors, as Citus words them.
    """
    if node_of(connection, schema) is None:
        distribute(connection, schema)
    if node_of(connection, schema) != node:
        connection.execute("SELECT citus_schema_move(%s::regnamespace, %s, %s)", (schema, node.host, node.port))


def unprotected(connection: psycopg.Connection[Any]) -> list[str]:
    """Tables of the connection's schema whose facts could be changed, because their shard lacks the trigger that they have."""
    return sorted({str(row[0]) for row in connection.execute(_UNPROTECTED)})


def protect(connection: psycopg.Connection[Any]) -> None:
    """Give shards the triggers that they lack: after a migration of a distributed schema has made some."""
    for table, name, definition, schema in connection.execute(_UNPROTECTED).fetchall():
        when = definition.partition(" BEFORE ")[2].partition(" ON ")[0]
        what = definition.rpartition(" EXECUTE FUNCTION ")[2]
        command = f"CREATE TRIGGER {name} BEFORE {when} ON %s FOR EACH STATEMENT EXECUTE FUNCTION {schema}.{what}"
        for success, result in connection.execute(_ON_SHARDS, (table, command)).fetchall():
            if not success:
                raise psycopg.DatabaseError(f"the facts in {table} could not be protected: {result}")


def in_words(connection: psycopg.Connection[Any], *, of_plant: bool = True) -> str:
    """The cluster in one line, with the node of the connection's schema; empty without Citus."""
    release = version(connection)
    if release is None:
        return ""
    words = f"{release}, nodes {', '.join(map(str, nodes(connection))) or 'none'}"
    if not of_plant:
        return words
    row = connection.execute("SELECT current_schema()").fetchone()
    node = node_of(connection, row[0]) if row and row[0] else None
    return f"{words}; this plant lies on {node or 'the coordinator, not distributed'}"


def missing(connection: psycopg.Connection[Any], schemas: Sequence[str]) -> list[str]:
    """Lacks of the cluster that is to hold these schemas of plants, and what to do; empty without Citus."""
    if version(connection) is None:
        return []
    known, remarks = nodes(connection), []
    if len(known) < 2:
        remarks.append("there is no other node. As a superuser: SELECT citus_add_node('HOST', PORT)")
    for host, port, answers, lacks in connection.execute(_SETTINGS):
        if not answers:
            remarks.append(f"{Node(host, port)} does not answer, so its plants are stopped; the others go on: {lacks}")
        elif lacks:
            remarks.append(
                f"no plant can be moved from or to {Node(host, port)}: set {lacks} there, and start it again"
            )
    here = [schema for schema in schemas if node_of(connection, schema) is None]
    if len(known) > 1 and here:
        remarks.append(
            f"not distributed: {', '.join(here)}. `inband plant move PLANT HOST:PORT` takes a plant to a node"
        )
    return remarks
