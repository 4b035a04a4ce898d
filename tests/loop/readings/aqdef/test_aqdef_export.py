"""Readings out of a real database as AQDEF, by the command; read back by the reader and imported again."""

from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from app.db.engine import Database
from app.files.aqdef import description as aqdef
from app.files.aqdef import values as aqdef_values
from app.files.aqdef.description import Source
from app.files.aqdef.values import OF_FIELD as F
from app.files.aqdef.values import Measured, Value
from app.loop.readings import queries
from app.loop.readings.actions import exclude
from tests.forked import inband
from tests.loop.readings.importing.test_history import run, scalar, set_up, table
from tests.servers import Server
from tests.shop import Shop


@pytest.fixture
def plant(database: Database, tmp_path: Path) -> Database:
    set_up(database)
    parts = [f"SN-{at}" for at in range(4)]
    run(database, table(tmp_path / "a.csv", [39.992, 39.9935, 39.9981, 41.2], part=parts))
    run(database, table(tmp_path / "b.csv", [39.991, 39.9915], part=parts[:2]), "shaft-d41")
    with database.begin() as session:
        entry = queries.entry_of(session, "shaft-d40")
        assert entry is not None
        exclude(session, entry, 2, "tests", "chip")
        exclude(session, entry, 4, "tests", "no part")
    return database


def read(path: Path) -> tuple[aqdef.Description, list[tuple[int, Measured]]]:
    description = aqdef.describe(Source.at(path))
    found = []
    for value in aqdef_values.values(Source.at(path), description):
        assert isinstance(value, Value)
        measured = aqdef_values.read_value(value)
        if isinstance(measured, Measured):
            found.append((value.characteristic, measured))
    return description, found


def test_readings_of_several_are_written_with_what_belongs_to_them(plant: Database, tmp_path: Path) -> None:
    path = tmp_path / "out.dfq"
    keys = "shaft-d40,shaft-d41"
    done = inband(
        "export", "--characteristic", keys, "--timezone", "Europe/Berlin", "-o", path, INBAND_DATABASE_URL=plant.dsn
    )
    assert (done.returncode, "6 readings written to AQDEF." in done.stderr) == (0, True), done.stderr
    assert "shaft-d40, numbers 1 to 4, measured 2026-" in " ".join(done.stderr.split()), "which ones, as of CSV"
    description, found = read(path)
    first, second = description.characteristics.values()
    assert (first.number, second.number, first.fields["K2142"]) == ("shaft-d40", "shaft-d41", "mm")
    assert (first.fields["K2110"], first.fields["K2111"]) == ("39.984", "40")
    assert [(each.part, each.attribute) for at, each in found if at == 1] == [
        ("SN-0", 0), ("SN-1", 129), ("SN-2", 0), ("SN-3", 290),
    ]  # fmt: skip
    assert [each.measured for at, each in found if at == 2] == [39.991, 39.9915]
    assert found[0][1].at is not None
    assert found[0][1].at.isoformat() == "2026-03-02T06:00:00"
    last = next(each for at, each in found if each.part == "SN-3")
    assert [description.named(event, "K4223") for event in last.events] == ["probe fault", "excluded"]
    assert description.named(last.machine, "K4063") == "Lathe 1"
    assert scalar(plant, "SELECT count(*) FROM audit_entry WHERE action = 'readings exported'") == 2


def test_what_was_written_is_imported_as_it_was(plant: Database, tmp_path: Path) -> None:
    path = tmp_path / "out.dfq"
    inband("export", "--characteristic", "shaft-d40", "-o", path, INBAND_DATABASE_URL=plant.dsn)
    done = inband("import", path, "--map", "shaft-d40=shaft-d41", INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 0, done.stderr
    assert "4 readings of shaft-d41" in done.stderr
    assert "2 are excluded, as the file marks them (K0002)." in done.stderr
    again = inband("import", path, "--map", "shaft-d40=shaft-d41", INBAND_DATABASE_URL=plant.dsn)
    assert "4 were stored before" in again.stderr


CIRCUMSTANCES = [
    "K0100 1", "K1001 shaft-0815", "K2001/1 shaft-d40", "K2002/1 Seat", "K2142/1 mm",
    "K4062/1 M1", "K4062/2 M2", "K4063/2 Lathe", "K4092/1 EV", "K4093/1 Eva", "K4072/1 Probe",
    "K4222/1 1", "K4223/1 tool changed", "K4222/2 2", "K4223/2 door opened", "K4243/1 temperature, °C", "K4243/2 part temperature, °C",
    F.join(["39,991", "0", "02.03.2026/06:00:00", "1,2", "#C1", "3", "1", "2", "1/21.5,2/24.5", "1"]),
    "K0014/0 SN-1", "K0053/0 A-77", "K0009/1 chip, washed", "K0081/1 7",
    F.join(["39,992", "290", "02.03.2026/06:01:00", "", "#", "0", "0", "1", "", "0"]),
    F.join(["39,993", "0", "02.03.2026/06:02:00", "", "", "A", "", "0"]),
]  # fmt: skip


def contexts(database: Database, key: str) -> list[dict[str, Any] | None]:
    with database.begin() as session:
        rows = session.execute(
            text(
                "SELECT x.context FROM reading r LEFT JOIN reading_context x USING (machine_id, characteristic_id, sequence) "
                "JOIN characteristic c ON c.machine_id = r.machine_id AND c.id = r.characteristic_id "
                "WHERE c.key = :key ORDER BY sequence"
            ),
            {"key": key},
        )
        return list(rows.scalars())


def test_the_circumstances_of_readings_are_kept_and_handed_on(database: Database, tmp_path: Path) -> None:
    set_up(database)
    path, out = tmp_path / "in.dfq", tmp_path / "out.dfq"
    path.write_bytes("\r\n".join([*CIRCUMSTANCES, ""]).encode("cp1252"))
    done = inband("import", path, INBAND_DATABASE_URL=database.dsn)
    assert (done.returncode, "'A' is not the number of a nest; it is kept as a text" in done.stderr) == (0, True)
    kept = contexts(database, "shaft-d40")
    assert kept == [
        {
            "order": "A-77",
            "batch": "C1",
            "nest": 3,
            "operator": "Eva",
            "machine": "Lathe",
            "gauge": "Probe",
            "comment": "chip, washed",
            "events": ["tool changed", "door opened"],
            "process": {"temperature, °C": 21.5},
            "part_temperature": 24.5,
            "fields": {"K0081": "7"},
        },
        {"machine": "M1", "fields": {"K0002": "290"}},
        {"fields": {"K0007": "A"}},
    ]
    inband("export", "--characteristic", "shaft-d40", "-o", out, INBAND_DATABASE_URL=database.dsn)
    again = inband("import", out, "--map", "shaft-d40=shaft-d41", INBAND_DATABASE_URL=database.dsn)
    assert (again.returncode, "1 is excluded" in again.stderr) == (0, True), again.stderr
    probe = {"gauge": "probe of Lathe 1"}
    assert contexts(database, "shaft-d41") == [
        kept[0],
        (kept[1] or {}) | probe | {"events": ["excluded"]},
        (kept[2] or {}) | probe | {"machine": "Lathe 1"},
    ]


def test_the_command_teaches(plant: Database, tmp_path: Path) -> None:
    done = inband("export", "--characteristic", "shaft-d40", "--format", "dfq", INBAND_DATABASE_URL=plant.dsn)
    assert (done.returncode, "name the file" in done.stderr) == (2, True)
    path = tmp_path / "out.dfq"
    done = inband("export", "--characteristic", "nobody", "-o", path, INBAND_DATABASE_URL=plant.dsn)
    assert (done.returncode, "There is no characteristic 'nobody'" in done.stderr) == (1, True), done.stderr
    assert not path.exists()


def test_readings_by_the_api(server: Server, tmp_path: Path) -> None:
    shop = Shop(server)
    other = f"{shop.characteristic}-b"
    shop.add(other)
    for key, measured in ((shop.characteristic, 39.992), (other, 39.993)):
        shop.call("POST", "/readings", 201, characteristic=key, measured=measured, part="SN-1")
    client = shop.admin
    answer = client.get(f"/api/v1/readings.dfq?characteristic={shop.characteristic},{other}")
    assert answer.status_code == 200, answer.text
    assert 'filename="readings.dfq"' in answer.headers["content-disposition"]
    path = tmp_path / "got.dfq"
    path.write_bytes(answer.content)
    assert [(at, each.measured, each.part) for at, each in read(path)[1]] == [(1, 39.992, "SN-1"), (2, 39.993, "SN-1")]
    assert client.get("/api/v1/readings.dfq?characteristic=nobody").status_code == 404
    assert client.get("/api/v1/readings.dfq?characteristic=,").status_code == 422
    several = client.get(f"/api/v1/readings.dfq?characteristic={shop.characteristic},{other}&last=200000")
    assert (several.status_code, "ask for fewer" in several.text) == (422, True)


def test_further_fields_of_a_sender_are_no_values(server: Server) -> None:
    shop = Shop(server)
    fields = {"K0001": "99", "K0002": "255", "K0004": "x", "K0014": "SN-9", "K0053": "B", "K0081": "7"}
    context = {"order": "A", "fields": fields}
    shop.call(
        "POST", "/readings", 201, characteristic=shop.characteristic, measured=39.992, part="SN-1", context=context
    )
    lines = shop.admin.get(f"/api/v1/readings.dfq?characteristic={shop.characteristic}").text.splitlines()
    assert [line for line in lines if line[:3] == "K00"][:3] == ["K0014/0 SN-1", "K0053/0 A", "K0081/1 7"]
