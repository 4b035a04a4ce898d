"""Readings out of a real database as AQDEF, by the command; read back by the reader and imported again."""

from pathlib import Path

import pytest

from app.db.engine import Database
from app.files.formats import aqdef, aqdef_values
from app.files.formats.aqdef import Source
from app.files.formats.aqdef_values import Measured, Value
from app.loop.readings import queries
from app.loop.readings.actions import exclude
from tests.conftest import Server
from tests.loop.importing.test_commands import inband
from tests.loop.importing.test_history import run, scalar, set_up, table
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
        "export", "--characteristic", keys, "--timezone", "Europe/Berlin", "-o", path, database=plant, folder=tmp_path
    )
    assert (done.returncode, "6 readings written to AQDEF." in done.stderr) == (0, True), done.stderr
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
    assert [description.named("K4223", event) for event in last.events] == ["probe fault", "excluded"]
    assert description.named("K4063", last.machine) == "Lathe 1"
    assert scalar(plant, "SELECT count(*) FROM audit_entry WHERE action = 'readings exported'") == 2


def test_what_was_written_is_imported_as_it_was(plant: Database, tmp_path: Path) -> None:
    path = tmp_path / "out.dfq"
    inband("export", "--characteristic", "shaft-d40", "-o", path, database=plant, folder=tmp_path)
    done = inband("import", path, "--map", "shaft-d40=shaft-d41", database=plant, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "4 readings of shaft-d41" in done.stderr
    assert "2 are excluded, as the file marks them (K0002)." in done.stderr
    again = inband("import", path, "--map", "shaft-d40=shaft-d41", database=plant, folder=tmp_path)
    assert "4 were stored before" in again.stderr


def test_the_command_teaches(plant: Database, tmp_path: Path) -> None:
    done = inband("export", "--characteristic", "shaft-d40", "--format", "dfq", database=plant, folder=tmp_path)
    assert (done.returncode, "name the file" in done.stderr) == (2, True)
    path = tmp_path / "out.dfq"
    done = inband("export", "--characteristic", "nobody", "-o", path, database=plant, folder=tmp_path)
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
