"""The addresses of all acts of a plant, out of what stands in its record: each leads to something that is there."""

import random
from collections.abc import Iterator
from typing import Any

import psycopg

OF_MACHINE = "JOIN machine m ON m.id = t.machine_id"
OF_CHARACTERISTIC = "JOIN characteristic c ON c.machine_id = t.machine_id AND c.id = t.characteristic_id"


def _numbered(table: str, name: str, column: str = "id") -> str:
    return f"SELECT t.{column} AS {name} FROM {table} t ORDER BY 1"  # noqa: S608 - names of this file


def _of_machine(table: str, name: str, column: str) -> str:
    return f"SELECT m.key AS machine, t.{column} AS {name} FROM {table} t {OF_MACHINE} ORDER BY m.id, 2"  # noqa: S608


def _of_characteristic(table: str, name: str) -> str:
    return f"SELECT c.key AS characteristic, t.{name} FROM {table} t {OF_CHARACTERISTIC} ORDER BY c.id, 2"  # noqa: S608


FEATURES = f"SELECT m.key AS machine, t.feature FROM form_measurement t {OF_MACHINE} ORDER BY t.id"  # noqa: S608
CORRECTIONS = (
    f"SELECT m.key AS machine, t.number FROM correction t {OF_MACHINE} "  # noqa: S608
    "ORDER BY t.status IN ('held', 'awaiting_approval', 'pending'), m.id, 2"
)

# What stands for the names of an address, by what the address has in it; the first that fits counts.
KNOWN = (
    ("{machine}/tools/{tool}", _of_machine("tool", "tool", "number")),
    ("{machine}/tools/{number}", _of_machine("tool", "number", "number")),
    ("/corrections/{machine}/tools/{tool}", _of_machine("correction", "tool", "tool_memory")),
    ("/corrections/{machine}/{number}", CORRECTIONS),
    ("{machine}/corrections/{number}", CORRECTIONS),
    (
        "/averages/{location}/pairs/{pair}",
        f"SELECT m.key AS machine, t.location, t.id AS pair FROM paired_reading t {OF_MACHINE} ORDER BY 3",  # noqa: S608
    ),
    ("/averages/{location}", _of_machine("average_memory", "location", "location")),
    ("/calibrations/{number}", _of_machine("calibration", "number", "number")),
    ("/touch-tests/{number}", _of_machine("touch_test", "number", "id")),
    ("/backups/{version}", _of_machine("kinematics_backup", "version", "version")),
    (
        "/machines/{machine}/keys/{key}",
        f"SELECT m.key AS machine, t.id AS key FROM api_key t {OF_MACHINE} WHERE t.name = 'second' ORDER BY 2",  # noqa: S608
    ),
    (
        "/fixtures/{machine}/{fixture}",
        f"SELECT m.key AS machine, t.fixture FROM work_zero t {OF_MACHINE} WHERE t.fixture IS NOT NULL ORDER BY t.id",  # noqa: S608
    ),
    ("/baselines/{version}", _of_characteristic("baseline", "version")),
    ("{characteristic}/{sequence}", _of_characteristic("reading", "sequence")),
    ("{characteristic}/readings/{sequence}", _of_characteristic("reading", "sequence")),
    ("{alarm}/photos/{photo}", "SELECT alarm_id AS alarm, id AS photo FROM alarm_photo ORDER BY 2"),
    ("/alarms/{number}/photos/{photo}", "SELECT alarm_id AS number, id AS photo FROM alarm_photo ORDER BY 2"),
    ("{quarantine}/parts/{number}", "SELECT quarantine_id AS quarantine, number FROM quarantined_part ORDER BY 1, 2"),
    ("{number}/parts/{part}", "SELECT quarantine_id AS number, number AS part FROM quarantined_part ORDER BY 1, 2"),
    (
        "/station/{machine}/alarms/{number}",
        f"SELECT m.key AS machine, t.id AS number FROM alarm t {OF_MACHINE} WHERE t.acknowledged_at IS NULL ORDER BY t.id",  # noqa: S608
    ),
    ("/alarms/{alarm}", "SELECT id AS alarm FROM alarm ORDER BY acknowledged_at IS NULL, 1"),
    ("/alarms/{number}", "SELECT id AS number FROM alarm ORDER BY acknowledged_at IS NULL, 1"),
    ("/quarantines/{number}", _numbered("quarantine", "number")),
    ("/proposals/{proposal}", _numbered("parameter_proposal", "proposal")),
    ("/proposals/{number}", _numbered("parameter_proposal", "number")),
    ("/signals/{signal}", _numbered("signal", "signal")),
    ("/signals/{number}", _numbered("signal", "number")),
    ("/notes/{note}", _numbered("note", "note")),
    ("/notes/{number}", _numbered("note", "number")),
    ("/maintenance/{maintenance}", _numbered("maintenance", "maintenance")),
    ("/maintenance/{number}", _numbered("maintenance", "number")),
    ("/plans/{plan}", "SELECT DISTINCT id AS plan FROM reaction_plan ORDER BY 1"),
    ("/setup/reactions/{plan}", "SELECT DISTINCT id AS plan FROM reaction_plan ORDER BY 1"),
    ("/catalogue/{entry}", _numbered("catalogue_entry", "entry")),
    ("/routes/{route}", _numbered("notification_route", "route")),
    ("/groups/{group}", _numbered("receiver_group", "group")),
    ("/receivers/{receiver}", _numbered("receiver", "receiver")),
    *((part, FEATURES) for part in ("/forms/features/{machine}/{feature}", "{machine}/forms/{feature}")),
    ("/pictures/{picture}", _numbered("reaction_picture", "picture", "digest")),
    ("/quarantines/{quarantine}", _numbered("quarantine", "quarantine")),
    ("/runs/{run}", _numbered("kinematics_run", "run")),
    ("/work-zeros/{number}", _numbered("work_zero", "number")),
    ("/alignments/{number}", _numbered("alignment", "number")),
    ("/forms/{number}", _numbered("form_measurement", "number")),
    ("/forms/{form}", _numbered("form_measurement", "form")),
    ("/gauge-studies/{study}", _numbered("gauge_study", "study")),
    ("/gauges/{number}", _numbered("gauge_study", "number")),
    ("/reports/{number}", _numbered("report_job", "number")),
    ("/screens/{screen}", _numbered("wall_screen", "screen")),
    ("/wall-screens/{screen}", _numbered("wall_screen", "screen")),
    ("/people/{person}", "SELECT id AS person FROM person WHERE name LIKE 'person-%' ORDER BY 1"),
    ("/keys/{key}", "SELECT id AS key FROM api_key WHERE name = 'Dashboard' ORDER BY 1"),
    ("/deliveries/{delivery}", _numbered("delivery", "delivery")),
    ("/{characteristic}", "SELECT key AS characteristic FROM characteristic ORDER BY id"),
    ("/{machine}", "SELECT key AS machine FROM machine ORDER BY id"),
)


class Record:
    """What a walk looks up in the database of a plant."""

    def __init__(self, dsn: str, chance: random.Random) -> None:
        self.connection = psycopg.connect(dsn, autocommit=True, row_factory=psycopg.rows.dict_row)
        self.chance = chance

    def rows(self, query: str) -> list[dict[str, Any]]:
        """Rows by column."""
        return self.connection.execute(query).fetchall()

    def chosen(self, query: str) -> dict[str, Any] | None:
        """One of the rows, twice as often one of the last few; None if there is none."""
        found = self.rows(query)
        if found and self.chance.random() < 0.7:
            found = found[-4:]
        return self.chance.choice(found) if found else None

    def values(self, path: str) -> dict[str, Any] | None:
        """What may stand for the names in the address; None if there is nothing of the kind."""
        return next((self.chosen(query) for part, query in KNOWN if part in path), {})

    def numbers(self, query: str) -> Iterator[Any]:
        """The first column."""
        return (next(iter(row.values())) for row in self.rows(query))
