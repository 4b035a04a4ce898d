"""`inband program`: read a text, write one, and the corrections."""

import json
from functools import partial
from pathlib import Path

from tests import forked
from tests.servers import Server
from tests.shop import Shop

L15 = "L15\nN5 R103 R115 R240 R250\nN10 R33=0.001 R440.0053 R361 R370.3\nN12 R33=R50*2\nN15 R400 R41-0.016 R4240\nN20 L75\nN25 L93\nN30 M17\n"


inband = partial(forked.inband, expect=0)


def test_a_text_is_read_without_any_database(tmp_path: Path) -> None:
    file = tmp_path / "L15.spf"
    file.write_text(L15, encoding="latin-1")
    done = inband("program", "read", file)
    found = json.loads(done.stdout)
    assert (found["kind"], found["parameters"]["averaging_limit"]) == ("measuring", 0.0053)
    assert "4: N12 R33=R50*2" in done.stderr
    assert "R44 is taken for R34" in done.stderr
    assert "parameters.zero_range" in done.stderr


def test_what_is_no_program_fails_in_words(tmp_path: Path) -> None:
    file = tmp_path / "picture.png"
    file.write_bytes(bytes(range(256)))
    assert "is not text" in inband("program", "read", file, expect=1).stderr
    file.write_text("hello")
    done = inband("program", "read", file, expect=1)
    assert json.loads(done.stdout) == {}
    assert "hello is not known" in done.stderr


def test_what_is_written_is_what_is_read(shop: Shop, server: Server, tmp_path: Path) -> None:
    database = ("--database-url", server.database.dsn)
    for control in ("sinumerik", "fanuc"):
        file = tmp_path / control
        file.write_text(inband("program", "write", shop.characteristic, "--control", control, *database).stdout)
        found = json.loads(inband("program", "read", file).stdout)
        before = shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]
        assert {name: before[name] for name in found["parameters"]} == found["parameters"]
        assert found["about"]["characteristic"] == shop.characteristic
    calibration = inband(
        "program", "write", shop.characteristic, "--kind", "calibration", "--gauge", 199.852, *database
    )
    assert "R32=199.852" in calibration.stdout
    assert "There is no characteristic" in inband("program", "write", "nothing", *database, expect=1).stderr


def test_programs_for_the_bridge_are_written_at_once_or_each_into_its_file(
    shop: Shop, server: Server, tmp_path: Path
) -> None:
    database = ("--database-url", server.database.dsn)
    ring = ("program", "write", shop.characteristic, "--ring", "--control", "fanuc", "--number", 7, *database)
    text = inband(*ring, "--first-register", 604, "--time-out", 5).stdout
    assert text.count("=604 (FIRST OF 98 REGISTERS)") == 4
    assert text.startswith("%")
    assert text.endswith("%\n")
    inband(*ring, "--folder", tmp_path / "ring")
    assert {file.name for file in (tmp_path / "ring").iterdir()} == {
        "O9820.NC", "O9821.NC", "O9822.NC", "O9823.NC", "CALLS.NC",
    }  # fmt: skip
    assert "C7." in (tmp_path / "ring" / "CALLS.NC").read_text()
    assert "must leave" in inband(*ring, "--first-register", 450, expect=1).stderr


def test_corrections_are_written_and_marked(shop: Shop, server: Server) -> None:
    database = ("--database-url", server.database.dsn)
    shop.read(6.1)
    assert "$TC_DP12[3,1]=-0.0061" in inband("program", "corrections", shop.machine, *database).stdout
    assert shop.correction(1)["fetched_at"] is None
    inband("program", "corrections", shop.machine, "--form", "list", "--fetched", *database)
    assert shop.correction(1)["fetched_by"].startswith("command line")
    assert "form" in inband("program", "corrections", shop.machine, "--form", "g10", *database, expect=1).stderr
