"""Rights of the role that serves on the stored facts, as PostgreSQL reports them.

Facts are protected by triggers, which only their owner can take away. A role that does not own the tables and may only read
and write rows (SELECT, INSERT, UPDATE, DELETE) can therefore neither alter nor remove them.
"""

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import Connection, text

APPEND_ONLY = frozenset(
    {
        "alignment",
        "audit_entry",
        "calibration",
        "calibration_acceptance",
        "exclusion",
        "form_evaluation",
        "form_measurement",
        "gauge_study",
        "gauge_study_revision",
        "hand_measurement",
        "kinematics_backup",
        "kinematics_decision",
        "kinematics_run",
        "parameters_version",
        "reaction_picture",
        "reaction_plan",
        "reading",
        "reading_context",
        "reading_next",
        "reading_results",
        "reading_summary",
        "reading_touches",
        "rule_set",
        "tool_event",
        "warning_acknowledgement",
        "work_zero",
    }
)
"""Tables whose rows are never updated nor deleted."""
WITH_A_LIFE = frozenset(
    {
        "alarm",
        "alarm_photo",
        "api_key",
        "average_memory",
        "baseline",
        "catalogue_entry",
        "characteristic",
        "correction",
        "machine",
        "machine_state",
        "maintenance",
        "missed_measurement",
        "note",
        "paired_reading",
        "parameter_proposal",
        "person",
        "quarantine",
        "quarantined_part",
        "result_reading",
        "signal",
        "stream",
        "tool",
        "touch_test",
    }
)
"""Tables whose rows change in the columns of their status or state only, and are never deleted."""
ROWS = ("SELECT", "INSERT", "UPDATE", "DELETE")

_ROLE = text("""
SELECT current_user, current_setting('is_superuser')::bool OR EXISTS (
    SELECT FROM pg_class c WHERE c.relnamespace = current_schema()::regnamespace AND c.relkind IN ('r', 'p')
        AND pg_has_role(current_user, c.relowner, 'MEMBER')
)
""")
_UNPROTECTED = text("""
SELECT t FROM unnest(CAST(:tables AS text[])) t WHERE NOT EXISTS (
    SELECT FROM pg_trigger g WHERE g.tgrelid = to_regclass(quote_ident(t)) AND g.tgname IN ('append_only', 'facts_stay')
        AND g.tgenabled IN ('O', 'A')
) ORDER BY t
""")
_MISSING = text("""
SELECT p || ' on ' || c.relname FROM pg_class c, unnest(CAST(:rights AS text[])) p
WHERE c.relnamespace = current_schema()::regnamespace AND c.relkind IN ('r', 'p') AND c.relname <> 'alembic_version'
    AND (p IN ('SELECT', 'INSERT') OR c.relname <> ALL (CAST(:append_only AS text[])))
    AND NOT has_table_privilege(c.oid, p)
UNION ALL
SELECT 'USAGE on ' || c.relname FROM pg_class c
WHERE c.relnamespace = current_schema()::regnamespace
    AND CASE WHEN c.relkind = 'S' THEN NOT has_sequence_privilege(c.oid, 'USAGE') END
    AND NOT EXISTS (SELECT FROM pg_depend d WHERE d.objid = c.oid AND d.deptype = 'i')
ORDER BY 1
""")


class Rights(NamedTuple):
    """The role that this connection has, and how far it is held to what it should do.

    owner: it could remove the protection (it owns tables, is a member of their owner, or a superuser). missing: rights that
    serving needs and it has not, as ``INSERT on reading``. unprotected: tables whose trigger is gone or switched off.
    """

    role: str
    owner: bool
    missing: Sequence[str]
    unprotected: Sequence[str]


def rights_of(connection: Connection) -> Rights:
    """Return the rights of the connection's role in a database that is at the head of the migrations."""
    role, owner = connection.execute(_ROLE).one()
    missing = connection.scalars(_MISSING, {"rights": list(ROWS), "append_only": sorted(APPEND_ONLY)}).all()
    unprotected = connection.scalars(_UNPROTECTED, {"tables": sorted(APPEND_ONLY | WITH_A_LIFE)}).all()
    return Rights(role, owner, missing, unprotected)
