"""AQDEF files into a real database: through the actions and the command."""

import re
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import httpx
import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import text

from app.cli.base import explain
from app.core.parameters import read
from app.db.engine import Database
from app.errors import Invalid
from app.files.aqdef.description import Source
from app.files.aqdef.values import OF_CHARACTERISTIC as C
from app.files.aqdef.values import OF_FIELD as F
from app.loop.characteristics import queries as characteristic_queries
from app.loop.machines import actions as machines
from app.loop.machines.schemas import MachineIn
from app.loop.readings.aqdef import actions, matching
from app.loop.readings.aqdef.actions import Outcome
from app.loop.readings.aqdef.matching import NEW
from app.loop.readings.aqdef.sorting import Wishes
from app.loop.readings.importing.history import Flawed
from tests.forked import inband
from tests.loop.readings.importing.test_history import scalar, set_up, stored
from tests.shop import Person, Shop

BERLIN = Wishes(ZoneInfo("Europe/Berlin"))
HEAD = [
    "K0100 4", "K1001 shaft-0815", "K1002 Shaft",
    "K2001/1 shaft-d40", "K2002/1 Seat", "K2101/1 40", "K2112/1 -0,016", "K2113/1 0", "K2142/1 mm",
    "K2001/2 17", "K2002/2 Roundness Ø40", "K2111/2 0,005", "K2120/2 2", "K2142/2 mm",
    "K2001/3 L1", "K2002/3 Length", "K2110/3 1.0000", "K2111/3 1.0020", "K2142/3 inch",
    "K2001/4 W1", "K2002/4 Angle", "K2110/4 1", "K2111/4 2", "K2142/4 °",
]  # fmt: skip


def row(minute: int, *values: str) -> str:
    """A line of values, each with its attribute behind a colon where it is not 0."""
    time = f"02.03.2026/06:{minute:02}:00"
    pairs = [value.partition(":") for value in values]
    return C.join(f"{value}{F}{attribute or 0}{F}{time}" for value, _sign, attribute in pairs)


ROWS = [
    row(0, "39.991", "0.002", "1.0010", "1.5"),
    "K0014/0 SN-1",
    row(1, "39.992:129", "0.003", "1.0012", "1.5"),
    row(1, "39.992", ":255"),
]


@pytest.fixture
def plant(database: Database) -> Database:
    set_up(database)
    return database


def written(path: Path, lines: list[str]) -> Path:
    path.write_bytes("\r\n".join([*lines, ""]).encode("cp1252"))
    return path


def run(database: Database, path: Path, chosen: dict[int, str] | None = None, **options: Any) -> Outcome:
    source = Source.at(path)
    description = actions.describe(source)
    with database.begin() as session:
        guessed = actions.guess(session, matching.contents(description))
    wishes = options.pop("wishes", BERLIN)
    how = {"machine": "lathe-1", "actor": "tests", "name": path.name} | options
    return actions.import_aqdef(database, source, description, guessed | (chosen or {}), wishes, **how)


def test_what_is_known_is_found_and_what_is_missing_is_set_up(plant: Database, tmp_path: Path) -> None:
    outcome = run(plant, written(tmp_path / "a.dfq", HEAD + ROWS), {2: NEW, 3: NEW})
    seat, roundness, length = outcome.results
    assert [each.key for each in outcome.results] == [
        "shaft-d40",
        "shaft-0815-17-roundness-40",
        "shaft-0815-l1-length",
    ]
    assert [each.created for each in outcome.results] == [False, True, True]
    assert [each.summary.stored for each in outcome.results if each.summary] == [3, 2, 2]
    assert "marked as missing or deleted" in " ".join(outcome.remarks)
    found = stored(plant)
    assert [each["measured"] for each in found] == [39.991, 39.992, 39.992]
    assert [each["part"] for each in found] == ["SN-1", None, None]
    assert found[0]["measured_at"].isoformat() == "2026-03-02T05:00:00+00:00"
    assert seat.excluded == 1
    assert scalar(plant, "SELECT reason FROM exclusion") == "K0002 = 129 (invalid) in a.dfq"
    assert scalar(plant, "SELECT sequence FROM exclusion") == 2
    assert [each["measured"] for each in stored(plant, length.key)] == [25.4254, 25.43048]
    with plant.begin() as session:
        parameters = characteristic_queries.characteristic_named(session, roundness.key).version.parameters
    assert (parameters["target"], parameters["tolerance_width"], parameters["mode"]) == (0, 0.005, "measure_only")
    assert parameters["natural_limit"] == "lower"  # K2120 = 2
    assert scalar(plant, "SELECT (SELECT count(*) FROM correction) + (SELECT count(*) FROM alarm)") == 0


@pytest.mark.parametrize(
    ("lines", "target", "natural"),
    [
        (["K2002/1 Roundness", "K2110/1 0", "K2111/1 0.005", "K2120/1 2"], 0.0, "lower"),
        (["K2002/1 Roundness", "K2111/1 0.005"], 0.0, "lower"),
        (["K2002/1 Roundness", "K2110/1 0", "K2111/1 0.005"], 0.0, "lower"),  # its name says it
        (["K2002/1 Rundlauf", "K2110/1 0", "K2111/1 0.005", "K2120/1 1"], 0.0, "lower"),  # so it does here
        (["K2002/1 Gap", "K2110/1 0", "K2111/1 0.005"], 0.0025, "none"),
        (["K2002/1 Gap", "K2110/1 0", "K2111/1 0.005", "K2120/1 1"], 0.0025, "none"),
        (["K2002/1 Contact", "K2110/1 0.9", "K2111/1 1", "K2121/1 2"], 1.0, "upper"),
        (["K2002/1 Seat", "K2110/1 39.98", "K2111/1 40.02"], 40.0, "none"),
    ],
)
def test_the_target_of_a_form_is_its_natural_limit_where_no_nominal_size_says_it(
    tmp_path: Path, lines: list[str], target: float, natural: str
) -> None:
    path = written(tmp_path / "a.dfq", ["K0100 1", "K2001/1 X", "K2142/1 mm", *lines, row(0, "0.002")])
    [content] = matching.contents(actions.describe(Source.at(path)))
    parameters, _problems = read(matching.parameters_of(content))
    assert (content.target, content.not_new) == (target, "")
    assert (parameters.target, parameters.natural_limit) == (target, natural)


def test_the_same_file_again_and_a_longer_one_store_nothing_twice(plant: Database, tmp_path: Path) -> None:
    assert run(plant, written(tmp_path / "a.dfq", HEAD + ROWS)).stored == 3
    again = run(plant, written(tmp_path / "b.dfq", HEAD + ROWS))
    assert (again.stored, again.repeated) == (0, 3)
    longer = run(plant, written(tmp_path / "c.dfq", [*HEAD, *ROWS, row(2, "39.993")]))
    assert (longer.stored, longer.repeated, scalar(plant, "SELECT count(*) FROM exclusion")) == (1, 3, 1)


def test_like_parts_of_one_second_are_all_stored_wherever_they_stand(plant: Database, tmp_path: Path) -> None:
    like, other = row(0, "39.991"), row(1, "39.992")
    lines = [*HEAD, like, like, other, like, row(0, "39.993"), like]
    assert run(plant, written(tmp_path / "a.dfq", lines)).stored == 6
    again = run(plant, written(tmp_path / "b.dfq", [*lines, like]))
    assert (again.stored, again.repeated) == (1, 6)


SEAT = ["K0100 1", "K2001/1 shaft-d40", "K2142/1 mm"]


@pytest.mark.parametrize("kind", [[], ["K2004/1 0"]], ids=["unsaid", "variable"])
def test_empty_fields_at_the_end_of_a_row_are_nothing(plant: Database, tmp_path: Path, kind: list[str]) -> None:
    rows = [f"39.99{n}{F}0{F}18.11.2025/06:0{n}:00{F}{F}#{F}0{F}0{F}0{F}{F}0{F}{F}" for n in range(3)]
    outcome = run(plant, written(tmp_path / "a.dfq", [*SEAT, *kind, *rows]))
    assert (outcome.stored, outcome.remarks) == (3, [])


def test_rows_that_count_parts_are_known_without_k2004(plant: Database, tmp_path: Path) -> None:
    rows = [f"50{F}{n}{F}{F}0{F}18.11.2025/06:0{n}:00{F}{F}#7" for n in range(3)]
    with pytest.raises(Invalid, match="no size of what is chosen: each of 3 values"):
        run(plant, written(tmp_path / "a.dfq", [*SEAT, *rows]))
    assert scalar(plant, "SELECT count(*) FROM reading") == 0


def test_fields_that_nobody_knows_are_remarked_on_once(plant: Database, tmp_path: Path) -> None:
    rows = [f"39.99{n}{F}0{F}18.11.2025/06:0{n}:00{F}{F}{F}{F}{F}{F}{F}{F}more" for n in range(3)]
    outcome = run(plant, written(tmp_path / "a.dfq", [*SEAT, *rows]))
    assert outcome.stored == 3
    assert [remark for remark in outcome.remarks if "more fields than are known" in remark] == outcome.remarks[:1]


def test_what_is_the_same_of_many_values_is_said_once(plant: Database, tmp_path: Path) -> None:
    rows = [field for n in range(30) for field in (f"K0001/1 39.9{n:02}", f"K0099/1 {n}")]
    outcome = run(plant, written(tmp_path / "a.dfq", [*SEAT, *rows]))
    assert outcome.remarks[0] == (
        "lines 5, 7, 9 and 27 more, K0099: '0' is no field that is known here; it is kept and not used"
    )
    assert len(outcome.remarks) == 2


def test_history_before_2000_is_history(plant: Database, tmp_path: Path) -> None:
    outcome = run(plant, written(tmp_path / "a.dfq", [*SEAT, f"39.991{F}0{F}07.05.1992/13:43:21"]))
    assert outcome.stored == 1
    assert stored(plant)[0]["measured_at"].isoformat() == "1992-05-07T11:43:21+00:00"
    with pytest.raises(Flawed) as refusal:
        run(plant, written(tmp_path / "b.dfq", [*SEAT, f"39.992{F}0{F}07.05.1892/13:43:21"]))
    assert [flaw for flaw in map(str, refusal.value.flaws) if "nothing was measured in the year 1892" in flaw]


def test_bytes_of_graphics_make_no_other_encoding(plant: Database, tmp_path: Path) -> None:
    path = tmp_path / "a.dfq"
    lines = [*SEAT, "K2002/1 Sitz Ø40", "K5003/1 \0", "K5007/1 \xff\0\xff\xff", f"39.991{F}0{F}18.11.2025/06:05:00"]
    path.write_bytes("\r\n".join([*lines, ""]).encode("latin-1"))
    assert run(plant, path).stored == 1


def test_a_value_that_another_program_writes_in_another_way_is_the_same(plant: Database, tmp_path: Path) -> None:
    head = [*HEAD[:3], "K2001/1 shaft-d40", "K2002/1 Seat", "K2142/1 mm"]
    first = run(plant, written(tmp_path / "a.dfq", [*head, f"39.991{F}0{F}02.03.2026/06:00:00{F}{F}#7"]))
    other = [*head, "K0001/1 3.99910000000000E+0001", "K0004/1 2026-03-02 6:00", "K0006/1 7"]
    again = run(plant, written(tmp_path / "b.dfq", other))
    assert (first.stored, again.stored, again.repeated) == (1, 0, 1)
    every_field = [*head, f"39.991{F}0{F}02.03.2026/06:00:00{F}{F}#7{F}0{F}0{F}0{F}{F}0"]
    third = run(plant, written(tmp_path / "c.dfq", every_field))
    assert (third.stored, third.repeated) == (0, 1)


def test_dates_that_may_be_either_are_asked_about(plant: Database, tmp_path: Path) -> None:
    def lines(*dates: str) -> Path:
        fields = [field for date in dates for field in ("K0001/1 39.991", f"K0004/1 {date}")]
        return written(tmp_path / "a.dfq", ["K0100 1", "K2001/1 shaft-d40", "K2142/1 mm", *fields])

    with pytest.raises(Flawed) as refusal:
        run(plant, lines("3/4/2026 6:00", "4/4/2026 6:00"))
    assert [str(flaw) for flaw in refusal.value.flaws] == [
        "line 4, K0004/1: '3/4/2026 6:00' could be day/month or month/day: say which comes first"
    ]
    told = run(plant, lines("3/4/2026 6:00", "3/14/2026 6:00"), dry_run=True)
    assert "Dates with / are read as month/day/year, as '3/14/2026 6:00' says." in told.remarks
    run(plant, lines("3/4/2026 6:00"), wishes=Wishes(BERLIN.zone, "day_first"))
    assert stored(plant)[0]["measured_at"].isoformat() == "2026-04-03T04:00:00+00:00"


def test_a_characteristic_of_another_part_is_not_taken_for_it(plant: Database, tmp_path: Path) -> None:
    head = [
        "K0100 1",
        "K1001 P1",
        "K1002 Shaft",
        "K2001/1 7",
        "K2002/1 Seat",
        "K2110/1 39.9",
        "K2111/1 40.1",
        "K2142/1 mm",
    ]
    values = ["K0001/1 39.991", "K0004/1 2.3.2026/6:00"]
    path = written(tmp_path / "a.dfq", head + values)
    assert run(plant, path, {1: NEW}).results[0].key == "p1-7-seat"
    other = written(tmp_path / "b.dfq", [head[0], "K1001 P2", *head[2:], *values])
    with plant.begin() as session:
        found = matching.contents(actions.describe(Source.at(other)))
        assert actions.guess(session, found) == {}
    assert run(plant, other, {1: NEW}).results[0].key == "p2-7-seat"
    assert run(plant, path).repeated == 1


def test_readings_that_came_in_another_way_are_questioned(plant: Database, tmp_path: Path) -> None:
    head = ["K0100 1", "K1001 P1", "K2001/1 shaft-d40", "K2142/1 mm"]
    values = ["K0001/1 39.991", "K0004/1 2.3.2026/6:00", "K0001/1 39.992", "K0004/1 2.3.2026/6:01"]
    assert run(plant, written(tmp_path / "a.dfq", head + values)).results[0].doubts == ()
    renamed = written(tmp_path / "b.dfq", [head[0], "K1001 P1 (new)", *head[2:], *values, "K0014/1 SN-2"])
    doubts = run(plant, renamed, dry_run=True).results[0].doubts
    assert [each[:40] for each in doubts] == ["1 has time, size and part of a reading t"]


def test_names_however_long_and_with_whatever_signs_are_remembered(plant: Database, tmp_path: Path) -> None:
    name = "".join(chr(33 + number * 7 % 90) for number in range(5000))
    lines = ["K0100 1", f"K1001 {name}\0", f"K2001/1 {name}", f"K2002/1 {name}\1", "K2142/1 mm", "K0001/1 39.991"]
    path = written(tmp_path / "a.dfq", [*lines, "K0004/1 2.3.2026/6:00", "K0014/1 SN"])
    assert run(plant, path, {1: "shaft-d40"}).stored == 1
    assert run(plant, path).repeated == 1


def test_what_was_chosen_once_is_remembered(plant: Database, tmp_path: Path) -> None:
    run(plant, written(tmp_path / "a.dfq", HEAD + ROWS), {1: "shaft-d41"})
    again = run(plant, written(tmp_path / "b.dfq", [*HEAD, *ROWS, row(2, "39.993")]))
    assert [(each.key, each.summary.stored) for each in again.results if each.summary] == [("shaft-d41", 1)]


def test_nothing_is_stored_where_a_line_is_wrong(plant: Database, tmp_path: Path) -> None:
    path = written(tmp_path / "a.dfq", [*HEAD, *ROWS, row(2, "x"), row(3, "39.9", "1", "1", "1", "5")])
    with pytest.raises(Flawed) as refusal:
        run(plant, path, {2: NEW})
    assert [str(flaw) for flaw in refusal.value.flaws] == [
        "line 29, K0001/1: 'x' is not a number",
        "line 30, K0001: '5' belongs to characteristic 5, but the file describes 4",
    ]
    assert scalar(plant, "SELECT (SELECT count(*) FROM reading) + (SELECT count(*) FROM import_mapping)") == 0
    assert scalar(plant, "SELECT count(*) FROM characteristic") == 2


def test_a_trial_stores_nothing(plant: Database, tmp_path: Path) -> None:
    outcome = run(plant, written(tmp_path / "a.dfq", HEAD + ROWS), {2: NEW}, dry_run=True)
    assert outcome.stored == 5
    assert scalar(plant, "SELECT (SELECT count(*) FROM reading) + (SELECT count(*) FROM import_mapping)") == 0


@pytest.mark.parametrize(
    ("chosen", "machine", "said"),
    [
        ({4: NEW}, "lathe-1", "is not a length: its unit is '°'"),
        ({2: "shaft-d40"}, "lathe-1", "shaft-d40 is named for two characteristics"),
        ({2: NEW}, None, "say on which machine"),
    ],
)
def test_what_cannot_be_chosen_is_refused(
    plant: Database, tmp_path: Path, chosen: dict[int, str], machine: str | None, said: str
) -> None:
    with pytest.raises(Invalid, match=said):
        run(plant, written(tmp_path / "a.dfq", HEAD + ROWS), chosen, machine=machine)


def test_where_nothing_is_chosen_it_is_said_why(plant: Database, tmp_path: Path) -> None:
    lines = ["K0100 3", "K2001/1 L1", "K2101/1 40", "K2142/1 mm", "K2001/2 W1", "K2142/2 °", "K0001/1 40"]
    lines += ["K2001/3 M8", "K2110/3 20", "K2111/3 30", "K2142/3 Nm"]
    with pytest.raises(Invalid) as refusal:
        run(plant, written(tmp_path / "a.dfq", lines))
    assert refusal.value.detail == "None of the file's characteristics can be imported."
    assert [(each.field, each.message) for each in refusal.value.errors] == [
        ("line 2", "L1: it has no tolerance: K2111 is missing"),
        ("line 6", "W1: is not a length: its unit is '°' (K2142)"),
        ("line 11", "M8: is not a length: its unit is 'Nm' (K2142)"),
    ]


def test_where_all_could_be_chosen_nothing_is_said_twice(plant: Database, tmp_path: Path) -> None:
    lines = ["K0100 1", "K2001/1 L1", "K2101/1 40", "K2110/1 39.9", "K2111/1 40.1", "K2142/1 mm", "K0001/1 40"]
    with pytest.raises(Invalid, match="is chosen; say which is which") as refusal:
        run(plant, written(tmp_path / "a.dfq", lines))
    assert explain(refusal.value)[0] == "None of the file's characteristics is chosen; say which is which."


def test_a_characteristic_without_a_value_says_so(plant: Database, tmp_path: Path) -> None:
    lines = ["K0100 2", "K2001/1 L1", "K2101/1 40", "K2110/1 39.9", "K2111/1 40.1", "K2142/1 mm"]
    lines += ["K2001/2 L2", "K2101/2 40", "K2110/2 39.9", "K2111/2 40.1", "K2142/2 mm", "K0001/2 40"]
    outcome = run(plant, written(tmp_path / "a.dfq", lines), {1: NEW, 2: NEW}, dry_run=True)
    assert [each.doubts for each in outcome.results] == [("the file has no size of it",), ()]


def test_without_a_tolerance_nothing_is_set_up() -> None:
    def reason(**fields: str) -> str:
        from app.files.aqdef.description import Characteristic, Description

        description = Description(characteristics={1: Characteristic(1, 1, {"K2142": "mm"} | fields)})
        return matching.contents(description)[0].not_new

    assert reason(K2101="40") == "it has no tolerance: K2111 is missing"
    assert reason(K2101="40", K2111="40.1") == "it has no tolerance: K2110 is missing"
    assert reason(K2110="40", K2111="40") == "its upper limit is not above its lower one"
    assert reason(K2111="0.005") == ""


def test_inches_that_nobody_named_are_questioned(plant: Database, tmp_path: Path) -> None:
    lines = ["K0100 1", "K2001/1 shaft-d40", "K2101/1 1.5748", "K2142/1 mm", "K0001/1 39.99", "K0004/1 2.3.2026/6:00"]
    outcome = run(plant, written(tmp_path / "a.dfq", lines), dry_run=True)
    assert "looks like 39.992" in outcome.results[0].doubts[0]
    lines[3], lines[2] = "K2142/1 inch", "K2101/1 39.992"
    outcome = run(plant, written(tmp_path / "b.dfq", lines), dry_run=True)
    assert "are the numbers of the file in mm already?" in outcome.results[0].doubts[0]


def test_limits_that_are_others_here_are_said(plant: Database, tmp_path: Path) -> None:
    lines = ["K0100 1", "K2001/1 shaft-d40", "K2110/1 39.9", "K2111/1 40.1", "K0001/1 39.99", "K0004/1 2.3.2026/6:00"]
    outcome = run(plant, written(tmp_path / "a.dfq", lines), dry_run=True)
    assert outcome.results[0].doubts[0].startswith("The limits in the file, 39.9 to 40.1 mm, are not those")


def test_the_command_says_what_becomes_of_each(plant: Database, tmp_path: Path) -> None:
    path = written(tmp_path / "shift.dfq", HEAD + ROWS)
    done = inband("import", path, "--timezone", "Europe/Berlin", INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 0, done.stderr
    assert "shaft-d40 Seat → shaft-d40" in done.stderr
    assert (
        "17 Roundness Ø40: left out: nothing of its part here has its number or name; --map or --create-missing."
        in done.stderr
    )
    assert "W1 Angle: left out: is not a length: its unit is '°' (K2142)." in done.stderr
    assert "3 readings of shaft-d40, measured 2026-03-02 06:00 – 2026-03-02 06:01." in done.stderr
    assert "1 is excluded" in done.stderr
    with plant.begin() as session:
        machines.add_machine(session, MachineIn(key="mill-1", name="Mill 1", control="fanuc"), "tests")
    done = inband("import", path, "--timezone", "Europe/Berlin", "--create-missing", INBAND_DATABASE_URL=plant.dsn)
    assert (done.returncode, "say on which machine" in done.stderr) == (1, True), done.stderr
    options = ["--timezone", "Europe/Berlin", "--map", "L1=+,shaft-0815:17=shaft-d41", "--machine", "mill-1"]
    done = inband("import", path, *options, INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 1
    assert "shaft-d41: Every value lies more than" in done.stderr
    done = inband("import", path, *options[:2], "--map", "L1=+", "--machine", "mill-1", INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 0, done.stderr
    assert "shaft-0815-l1-length is set up" in done.stderr
    with plant.begin() as session:
        keys = session.execute(
            text("SELECT m.key FROM characteristic c JOIN machine m ON m.id = machine_id WHERE c.key LIKE '%l1%'")
        )
        assert keys.scalars().all() == ["mill-1"]


def test_the_command_teaches(plant: Database, tmp_path: Path) -> None:
    path = written(tmp_path / "shift.dfq", HEAD + ROWS)
    for options, said in (
        (["--map", "X9=shaft-d40"], "X9 is no characteristic of the file; it has: shaft-d40 Seat,"),
        (["--map", "nonsense"], "Write it as D40=shaft-d40"),
        (["--live"], "as history only"),
        (["--characteristic", "shaft-d40"], "say which is which with --map"),
    ):
        done = inband("import", path, *options, INBAND_DATABASE_URL=plant.dsn)
        assert done.returncode == 2, done.stderr
        assert said in " ".join(done.stderr.split()), done.stderr
    lonely = written(tmp_path / "b.dfx", ["1"])
    assert "b.dfd" in inband("import", lonely, INBAND_DATABASE_URL=plant.dsn).stderr


def send(person: Person, *files: tuple[str, str]) -> httpx.Response:
    """What is answered is the address of the preview, or what is wrong."""
    client = person.browser
    csrf = re.search(r'name="csrf" value="([^"]+)"', client.get("/account").text)
    assert csrf
    parts = [("file", (name, content.encode())) for name, content in files]
    return client.post("/import", data={"csrf": csrf[1], "characteristic": ""}, files=parts, follow_redirects=False)


def own_lines(shop: Shop) -> list[str]:
    """The lines for this shop's machine, with characteristics that no other test sets up."""
    own = {"shaft-d40": shop.characteristic, "shaft-0815": shop.machine}
    own |= {
        f"K200{field}/{number} ": f"K200{field}/{number} {shop.machine}-" for field in (1, 2) for number in (2, 3, 4)
    }
    lines = "\n".join(HEAD + ROWS)
    for written_in, here in own.items():
        lines = lines.replace(written_in, here)
    return lines.split("\n")


@pytest.mark.browser
def test_a_file_on_the_page(shop: Shop, engineer: Person, page: Page, tmp_path: Path) -> None:
    lines = own_lines(shop)
    engineer.sign_in(page)
    page.goto("/import")
    page.set_input_files("[name=file]", written(tmp_path / "shift.dfq", lines))
    page.get_by_role("button", name="Preview").click()
    rows = page.locator("tbody tr")
    expect(rows).to_have_count(4)
    expect(rows.nth(0).locator("input")).to_have_value(shop.characteristic)
    expect(rows.nth(0)).to_contain_text("1 is excluded, as the file marks it.")
    expect(rows.nth(3)).to_contain_text("is not a length: its unit is '°'")
    page.select_option("select[name=machine]", shop.machine)
    page.get_by_role("button", name="Set up all 2").click()
    expect(rows.nth(1)).to_contain_text("Set up with the drawing's limits")
    expect(rows.nth(2)).to_contain_text("converted to mm")
    page.get_by_role("button", name="Import all").click()
    expect(page.get_by_role("heading", name="7 readings imported")).to_be_visible()
    found = shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
    assert [each["measured"] for each in found] == [39.991, 39.992, 39.992]


@pytest.mark.long
def test_a_pair_is_sent_together_and_what_is_wrong_is_shown(shop: Shop, engineer: Person) -> None:
    client = engineer.browser
    head = f"K0100 1\nK2001/1 {shop.characteristic}\nK2142/1 mm\n"
    alone = send(engineer, ("a.dfx", "1"))
    assert (alone.status_code, "choose the .dfd that describes them too" in alone.text) == (422, True)
    assert "Choose one file, or a .dfd and its .dfx" in send(engineer, ("a.dfq", head), ("b.csv", "x")).text
    good = send(engineer, ("a.dfx", f"39.99{F}0{F}2.3.2026/6:00\n"), ("a.dfd", head))
    preview = client.get(good.headers["location"]).text
    assert re.search(r'<td class="num"[^>]*>1</td>', preview)
    bad = client.get(send(engineer, ("a.dfx", f"39.99{F}0{F}32.3.2026/6:00\nx\n"), ("a.dfd", head)).headers["location"])
    assert "32.3.2026/6:00" in bad.text
    assert "day is out of range for month" in bad.text
    nothing = client.get(send(engineer, ("a.dfq", "measured\n1\n")).headers["location"])
    assert (nothing.status_code, "no line begins with a K field" in nothing.text) == (200, True)
    address = good.headers["location"]
    for said in (
        "timezone=Mars",
        "unit=%00",
        "to_1=nobody",
        "to_99=%2B",
        "to_x=1",
        "encoding=x",
        "machine=nobody&to_1=%2B",
    ):
        assert client.get(f"{address}?{said}").status_code == 200, said


def test_a_file_by_the_api(shop: Shop) -> None:
    lines = own_lines(shop)
    body: dict[str, Any] = {"name": "shift.dfq", "content": "\r\n".join(lines), "timezone": "Europe/Berlin"}
    tried = shop.call("POST", "/readings/aqdef", **body, dry_run=True)["characteristics"][0]
    assert (tried["stored"], shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]) == (3, [])
    done = shop.call(
        "POST", "/readings/aqdef", **body, characteristics={f"{shop.machine}-L1": "+"}, machine=shop.machine
    )
    seat, roundness, length, angle = done["characteristics"]
    assert (done["stored"], seat["characteristic"], seat["stored"], seat["excluded"]) == (5, shop.characteristic, 3, 1)
    assert (length["created"], length["stored"], length["notes"][0][:17]) == (True, 2, "its unit is inch ")
    assert ("name it under characteristics" in roundness["left_out"], "not a length" in angle["left_out"]) == (
        True,
        True,
    )
    again = shop.call("POST", "/readings/aqdef", **body, create_missing=True, machine=shop.machine)
    assert (again["stored"], again["repeated"], again["characteristics"][1]["created"]) == (2, 5, True)
    pair: dict[str, Any] = {"content": "\n".join(lines[: len(HEAD)]), "values": row(9, "39.994")}
    assert shop.call("POST", "/readings/aqdef", **body | pair)["stored"] == 1


def test_signs_that_nobody_sees_are_in_no_name_that_is_set_up(plant: Database, tmp_path: Path) -> None:
    unseen, turning = "\N{ZERO WIDTH SPACE}", "\N{RIGHT-TO-LEFT OVERRIDE}"
    path = tmp_path / "a.dfq"
    for part, name, set_up_as in (
        (f"P{turning}1", f"{unseen}Seat{turning}", ("P1", "Seat")),
        (unseen, unseen, (None, "aqdef 1")),
    ):
        lines = [f"K1001 {part}", f"K2001/1 {unseen}", f"K2002/1 {name}", "K2110/1 1", "K2111/1 2", row(1, "1.5")]
        path.write_text("\n".join([*lines, ""]))
        [result] = run(plant, path, {1: NEW}).results
        with plant.begin() as session:
            there = characteristic_queries.characteristic_named(session, result.key).characteristic
        assert (there.part, there.name) == set_up_as


@pytest.mark.parametrize(
    ("wrong", "field", "said"),
    [
        ({"content": "measured\n1"}, "file", "no line begins with a K field"),
        ({"content": "\n".join(HEAD)}, "file", "lie in the .dfx that belongs to it"),
        (
            {"content": "\n".join([*HEAD, row(1, "39.9"), row(2, "x")])},
            f"line {len(HEAD) + 2}, K0001/1",
            "is not a number",
        ),
        ({"characteristics": {"X": "shaft"}}, "characteristics", "X is no characteristic of the file"),
        ({"characteristics": {"L1": "+"}, "machine": None}, "machine", "say on which machine"),
        ({"timezone": "Mars"}, "timezone", ""),
        ({"values": ""}, "values", ""),
    ],
)
def test_the_api_says_what_is_wrong(shop: Shop, wrong: dict[str, Any], field: str, said: str) -> None:
    body = {
        "name": "a.dfq",
        "content": "\n".join(HEAD + ROWS),
        "characteristics": {"shaft-d40": shop.characteristic},
    }
    shop.call("POST", "/machines", 201, key=f"{shop.machine}-b", name="Other", control="fanuc")
    answer = shop.admin.post("/api/v1/readings/aqdef", json=body | wrong)
    assert answer.status_code == 422, answer.text
    assert [(each["field"], said in each["message"]) for each in answer.json()["errors"]] == [(field, True)]
