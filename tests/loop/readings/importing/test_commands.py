"""`inband import`, `export` and `replay` as somebody types them."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select, text

from app.access.audit.tables import AuditEntry
from app.core.decision.decide import LoopState, decide
from app.core.parameters import read
from app.db.engine import Database
from tests.forked import inband
from tests.loop.readings.importing.test_history import set_up


@pytest.fixture
def plant(database: Database) -> Database:
    set_up(database)
    return database


def count(database: Database) -> int:
    with database.begin() as session:
        found: int = session.execute(text("SELECT count(*) FROM reading")).scalar_one()
    return found


GERMAN = "Messwert [µm];Datum;Uhrzeit;Teil\n39992,5;02.03.2026;06:00:00;Дугме\n39998,1;02.03.2026;06:01:00;=1+1\n"


def test_import_says_what_it_understood_and_what_it_came_to(plant: Database, tmp_path: Path) -> None:
    file = tmp_path / "messung.csv"
    file.write_text(GERMAN)
    done = inband(
        "import",
        file,
        "--characteristic",
        "shaft-d40",
        "--timezone",
        "Europe/Belgrade",
        INBAND_DATABASE_URL=plant.dsn,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    assert "measured ← Messwert [µm], measured_at ← Datum+Uhrzeit, part ← Teil (in um)" in done.stderr
    assert (
        "2 readings of shaft-d40, numbers 1 to 2, measured 2026-03-02 06:00 – 2026-03-02 06:01 Europe/Belgrade."
        in done.stderr
    )
    assert "no correction, no alarm" in done.stderr
    again = inband(
        "import",
        file,
        "--characteristic",
        "shaft-d40",
        "--timezone",
        "Europe/Belgrade",
        INBAND_DATABASE_URL=plant.dsn,
    )
    assert "2 were stored before" in again.stderr
    assert count(plant) == 2


def test_import_names_every_bad_line_and_fails_with_1(plant: Database, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(
        "measured,measured_at\nabout 40,2026-03-02T06:00Z\n39.99,2026-03-02 06:00\n39.99,2026-03-02T06:00Z\n"
    )
    done = inband("import", file, "--characteristic", "shaft-d40", INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 1
    assert "line 2, measured: 'about 40' is not a number" in done.stderr
    assert "line 3, measured_at: '2026-03-02 06:00' does not say in which time zone; name the time zone" in done.stderr
    said = done.stderr[done.stderr.index("2 things are wrong with the file.") :]
    assert said.index("line 2, measured") < said.index("Nothing was imported."), "the reason first, what to do last"
    assert "Traceback" not in done.stderr
    assert count(plant) == 0


def test_what_is_wrong_with_every_line_is_not_said_for_every_line(plant: Database, tmp_path: Path) -> None:
    file = tmp_path / "no-zone.csv"
    times = [f"2026-03-{day:02} 06:00{'Z' if day == 20 else ''}" for day in range(1, 29)]
    file.write_text("Durchmesser,Zeit\n" + "".join(f"39.99,{time}\n" for time in times))
    done = inband("import", file, "--characteristic", "shaft-d40", INBAND_DATABASE_URL=plant.dsn)
    said = [line.partition(":")[0] for line in done.stderr.splitlines() if line.startswith("line")]
    assert said == [
        "line 2, Zeit", "line 3, Zeit", "line 4, Zeit", "lines 5 to 20, Zeit",
        "line 22, Zeit", "line 23, Zeit", "line 24, Zeit", "lines 25 to 29, Zeit",
    ]  # fmt: skip
    assert "27 things are wrong with the file." in done.stderr


@pytest.mark.parametrize(
    ("options", "words", "status"),
    [
        (("--map", "measured"), "measured=COLUMN", 2),
        (("--map", "measured=Höhe"), "no column 'Höhe'", 1),
        (("--encoding", "ebcdic"), "utf-8, utf-8-sig", 1),
        (("--timezone", "Belgrade"), "no time zone 'Belgrade'", 1),
        (("--unit", "ell"), "'ell' is not one of", 2),
        (("--characteristic", "shaft-d99"), "no characteristic 'shaft-d99'", 1),
    ],
)
def test_wrong_options_are_said_in_words(
    plant: Database, tmp_path: Path, options: tuple[str, ...], words: str, status: int
) -> None:
    file = tmp_path / "a.csv"
    file.write_text("measured\n39.99\n")
    done = inband("import", file, "--characteristic", "shaft-d40", *options, INBAND_DATABASE_URL=plant.dsn)
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.returncode == status


def test_what_is_exported_can_be_imported_and_no_spreadsheet_runs_it(plant: Database, tmp_path: Path) -> None:
    file = tmp_path / "messung.csv"
    file.write_text(GERMAN)
    imported = ("import", file, "--characteristic", "shaft-d40", "--timezone", "UTC")
    assert inband(*imported, INBAND_DATABASE_URL=plant.dsn).returncode == 0
    done = inband("export", "--characteristic", "shaft-d40", INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [row["measured"] for row in rows] == ["39.9925", "39.9981"]
    assert [row["part"] for row in rows] == ["Дугме", "'=1+1"]
    assert rows[0]["code"] == "imported"
    target = tmp_path / "out.csv"
    inband("export", "--characteristic", "shaft-d40", "-o", target, INBAND_DATABASE_URL=plant.dsn)
    assert target.read_text() == done.stdout
    back = inband("import", target, "--characteristic", "shaft-d40", INBAND_DATABASE_URL=plant.dsn)
    assert "2 were stored before" in back.stderr, back.stderr
    other = inband("import", target, "--characteristic", "shaft-d41", INBAND_DATABASE_URL=plant.dsn)
    assert other.returncode == 0
    assert count(plant) == 4


def test_export_of_some_and_as_ndjson(plant: Database, tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("measured,measured_at\n" + "".join(f"39.99{n},2026-03-0{n}T06:00Z\n" for n in range(1, 8)))
    assert inband("import", file, "--characteristic", "shaft-d40", INBAND_DATABASE_URL=plant.dsn).returncode == 0

    def exported(*options: str) -> list[Any]:
        done = inband(
            "export", "--characteristic", "shaft-d40", "--format", "ndjson", *options, INBAND_DATABASE_URL=plant.dsn
        )
        assert done.returncode == 0, done.stderr
        return [json.loads(line)["sequence"] for line in done.stdout.splitlines()]

    assert exported() == [1, 2, 3, 4, 5, 6, 7]
    assert exported("--last", "2") == [6, 7]
    assert exported("--last", "100") == [1, 2, 3, 4, 5, 6, 7]
    with plant.begin() as session:
        newest = session.scalars(select(AuditEntry).order_by(AuditEntry.id.desc())).first()
        assert newest is not None
        assert (newest.action, newest.subject) == ("readings exported", "characteristic/shaft-d40")
        assert newest.after == {"readings": 7, "format": "ndjson"}
    assert exported("--from", "2026-03-03", "--to", "2026-03-05T06:00Z") == [3, 4]
    assert exported("--from", "2030-01-01") == []


PARAMETERS = (
    "R10=1 R11=1 R29=2 ; the published example\nR33=0.004 R34=0.0133 R36=1 R37=0.3\nR40=0.02 R41=-0.02 R42=10\n"
)
PUBLISHED = [3, 5, 6, 2, 4, 5, 5, 3, 7, 7]  # domain §3, deviations in µm


def test_replay_of_the_published_example_needs_no_database(tmp_path: Path) -> None:
    file, parameters = tmp_path / "a.csv", tmp_path / "l93.txt"
    file.write_text("measured\n" + "".join(f"{10 + d / 1000:.3f}\n" for d in PUBLISHED))
    parameters.write_text(PARAMETERS)
    done = inband("replay", file, "--parameters", parameters, "--factor", "-1", INBAND_DATA_DIR=str(tmp_path / "data"))
    assert done.returncode == 0, done.stderr
    decisions = [json.loads(line) for line in done.stdout.splitlines()]
    corrections = [d["correction"]["amount"] if d["correction"] else None for d in decisions]
    assert corrections == [None, None, -0.004625, None, None, None, -0.004375, None, -0.00425, None]
    assert not (tmp_path / "data").exists()


def test_replay_decides_as_the_core_does_whatever_the_file_says_of_corrections(tmp_path: Path) -> None:
    file, parameters = tmp_path / "a.csv", tmp_path / "p.json"
    deviations = [0.006, 0.012, -0.015, 0.03, 0.4, 1.5, 0.001, -0.006]
    file.write_text(
        "measured,correction_in_effect,machined_at\n"
        + "".join(f"{10 + d:.3f},{n},2026-03-02T06:00Z\n" for n, d in enumerate(deviations))
    )
    given = {"tool_memory": 3, "average_memory": 5, "weighting_factor": 2, "factor": -1, "nominal": 10,
             "upper_deviation": 0.02, "lower_deviation": -0.02, "zero_range": 0.004, "averaging_limit": 0.0133,
             "wear_limit": 0.3, "confidence_limit": 1}  # fmt: skip
    parameters.write_text(json.dumps({"key": "x", "parameters": given}))
    done = inband("replay", file, "--parameters", parameters, "--json")
    assert done.returncode == 0, done.stderr
    state, expected = LoopState(), []
    for deviation in deviations:
        decision = decide(read(given)[0], state, deviation)
        state = LoopState(decision.average_after)
        expected.append((decision.zone.value, decision.action.value, decision.amount))
    decisions = [json.loads(line) for line in done.stdout.splitlines()]
    assert [(d["zone"], d["action"], d["correction"] and d["correction"]["amount"]) for d in decisions] == expected


def test_replay_says_what_is_wrong_with_parameters_and_lines(tmp_path: Path) -> None:
    file, parameters = tmp_path / "a.csv", tmp_path / "l93.txt"
    file.write_text("measured\n10.001\nten\n")
    parameters.write_text(PARAMETERS)
    done = inband("replay", file, "--parameters", parameters)
    assert done.returncode == 1
    assert "--factor -1" in done.stderr
    done = inband("replay", file, "--parameters", parameters, "--factor", "-1")
    assert done.returncode == 1
    assert "line 3, measured: 'ten' is not a number" in done.stderr
    assert len(done.stdout.splitlines()) == 1
    parameters.write_text(PARAMETERS.replace("R34=0.0133", "R34=0.05"))
    done = inband("replay", file, "--parameters", parameters, "--factor", "-1")
    assert "R35/2" in done.stderr
    assert "Traceback" not in done.stderr
