"""A file of which some characteristics cannot be imported: nothing is stored, and it is said how the others are."""

import html
import re
import shlex
from pathlib import Path
from typing import Any

from app.db.engine import Database
from app.files.aqdef.values import OF_CHARACTERISTIC as C
from app.files.aqdef.values import OF_FIELD as F
from app.loop.readings.aqdef.matching import leaving_out, said
from tests.forked import inband
from tests.loop.readings.aqdef.test_aqdef_import import plant, send, written
from tests.loop.readings.aqdef.test_matching import content
from tests.loop.readings.importing.test_history import scalar
from tests.shop import Person, Shop

__all__ = ["plant"]


def lines(part: str, *rows: tuple[str, ...]) -> list[str]:
    """Two diameters, and operators in numbers, as uncertainty studies have them."""
    head = ["K0100 3", f"K1001 {part}"]
    for number, name in enumerate(("Seat, rear", "Bore", "Operator"), 1):
        head += [f"K2001/{number} {'DDO'[number - 1]}{number % 3}", f"K2002/{number} {name}", f"K2142/{number} mm"]
        head += [f"K2101/{number} 20", f"K2110/{number} 19.9", f"K2111/{number} 20.1"]
    return head + [C.join(f"{size}{F}0{F}02.03.2026/06:0{at}:00" for size in row) for at, row in enumerate(rows)]


GOOD, FAR = ("20.001", "20.002", "1"), ("20.003", "20.004", "2")


def test_the_command_says_how_the_others_are_imported(plant: Database, tmp_path: Path) -> None:
    path = written(tmp_path / "study.dfq", lines("ring", GOOD, FAR))
    how = ("import", path, "--create-missing", "--machine", "lathe-1")
    for more in ((), ("--dry-run",)):
        done = inband(*how, *more, INBAND_DATABASE_URL=plant.dsn)
        told = " ".join(done.stderr.split())
        assert done.returncode == 1, told
        assert "ring-o0-operator: Every value lies more than" in told
        assert "--map 'O0='" in told
        assert scalar(plant, "SELECT count(*) FROM reading") == 0
    argument = re.search(r"--map '\S+'", told)
    assert argument is not None
    done = inband(*how, *shlex.split(argument[0]), INBAND_DATABASE_URL=plant.dsn)
    assert done.returncode == 0, done.stderr
    assert "O0 Operator: left out: --map says so." in done.stderr
    assert scalar(plant, "SELECT count(*) FROM reading") == 4
    assert scalar(plant, "SELECT count(*) FROM characteristic WHERE key LIKE '%o0%'") == 0


def test_lines_that_are_wrong_in_one_characteristic_leave_the_others(plant: Database, tmp_path: Path) -> None:
    path = written(tmp_path / "a.dfq", lines("ring", GOOD[:2], ("20.003", "twenty")))
    done = inband("import", path, "--create-missing", "--machine", "lathe-1", INBAND_DATABASE_URL=plant.dsn)
    told = " ".join(done.stderr.split())
    assert "K0001/2: 'twenty' is not a number" in told
    assert "--map 'D2='" in told
    both = written(tmp_path / "b.dfq", lines("ring", GOOD[:2], ("x", "twenty")))
    done = inband("import", both, "--map", "D1=+,D2=+", "--machine", "lathe-1", INBAND_DATABASE_URL=plant.dsn)
    assert "--map '" not in done.stderr, "nothing is left"


def test_the_page_leaves_them_out_by_one_press(shop: Shop, engineer: Person) -> None:
    part = f"{shop.machine}-ring"
    sent = send(engineer, ("study.dfq", "\n".join([*lines(part, GOOD, FAR), ""])))
    address, browser = sent.headers["location"], engineer.browser
    shown = html.unescape(browser.get(f"{address}?all=new&machine={shop.machine}").text)
    assert "1 characteristic cannot be imported: its row says why." in shown
    form = shown[: shown.index("Leave out what cannot be imported")].rpartition("<form")[2]
    fields = dict(re.findall(r'name="(\w+)" value="([^"]*)"', form))
    again = browser.get(address, params=fields).text
    assert "cannot be imported" not in again
    stored = engineer.post(address, **fields)
    assert "stored=4" in stored.headers["location"]


def test_over_rest_an_empty_key_leaves_out(shop: Shop) -> None:
    part = f"{shop.machine}-rest"
    body: dict[str, Any] = {
        "name": "a.dfq",
        "content": "\n".join([*lines(part, GOOD, FAR), ""]),
        "create_missing": True,
    }
    refused = shop.admin.post("/api/v1/readings/aqdef", json=body | {"machine": shop.machine})
    assert (refused.status_code, "--map 'O0='" in refused.text) == (422, True), refused.text
    done = shop.call("POST", "/readings/aqdef", machine=shop.machine, characteristics={"O0": ""}, **body)
    assert (done["stored"], done["characteristics"][2]["left_out"]) == (4, "characteristics says so")


def test_the_argument_names_each_so_that_it_is_understood() -> None:
    found = [
        content(1, "D40", "Seat"),
        content(2, "D40", "Bore"),
        content(3, "2", "a,b"),
        content(4, "x,y", "p,q", "sh"),
    ]
    for some in (found[:1], found[1:2], found[2:3], found[3:], found):
        assert said(leaving_out(some, found), found) == {each.index: "" for each in some}
