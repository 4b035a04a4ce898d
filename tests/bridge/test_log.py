"""What a person finds in the log of the bridge, and in its quarantine."""

import configparser
import logging
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from app.bridge import log_lines
from app.bridge.configuration import read_configuration
from app.bridge.links import Outcome, Received
from app.cli.bridge import bridge as commands
from tests.bridge.plant import store_in
from tests.loops import in_thread, run

PLANT = """
[server]
url = "http://127.0.0.1:9"
[store]
file = "bridge.sqlite3"
[machine.lathe-1]
kind = "dprnt"
unit = "mm"
secret = "x"
corrections = "none"
characteristics = { 1 = "shaft-1" }
[machine.lathe-1.dprnt]
listen = 9
"""
GOOD = Received("lathe-1:7:1", {"characteristic": "shaft-1", "measured": 40.0, "part": "812"})
NO_JSON = Received("lathe-1:refused:ab", {"message": "[1]"}, fault="The message is no JSON object.")


def test_the_quarantine_is_a_table_with_a_head(tmp_path: Path) -> None:
    (tmp_path / "plant.toml").write_text(PLANT, encoding="utf-8")
    store = store_in(tmp_path)
    wrong = Received("lathe-1:7:2", {"measured": 40.0, "number": "9", "characteristic": None}, fault="Nobody named it.")
    run(store.add("lathe-1", [GOOD, wrong, NO_JSON]))
    store.close()
    asked = ["quarantine", "lathe-1", "--config", str(tmp_path / "plant.toml")]
    said = in_thread(lambda: CliRunner().invoke(commands, asked))
    rows = [[cell.strip() for cell in line.split("\t")] for line in said.stdout.splitlines()]
    assert rows[0] == ["KEY", "CAME AT", "CHARACTERISTIC", "MEASURED", "REASON"]
    assert [[row[0], *row[2:]] for row in rows[1:]] == [
        ["lathe-1:refused:ab", "-", "-", "The message is no JSON object."],
        ["lathe-1:7:2", "9", "40.0", "Nobody named it."],
    ]
    assert len({line.index("\t") for line in said.stdout.splitlines()}) == 1, "aligned"


@pytest.mark.parametrize(
    ("words", "read"),
    [
        (["check"], "plant.toml"),
        (["check", "--config", "a.toml"], "a.toml"),
        (["--config", "a.toml", "check"], "a.toml"),
        (["--config", "a.toml", "hold"], "a.toml"),
        (["--config", "a.toml", "check", "--config", "b.toml"], "b.toml"),
    ],
)
def test_a_configuration_may_be_named_before_or_behind_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], read: str
) -> None:
    """Named before it, it was passed over: the command worked with the machines of plant.toml."""
    monkeypatch.chdir(tmp_path)
    said = CliRunner().invoke(commands, words, env={"INBAND_BRIDGE_CONFIG": None})
    assert f"{read} cannot be read" in str(said.exception)


def test_what_is_refused_or_comes_again_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "app.bridge")
    log_lines.readings("lathe-1", [GOOD, NO_JSON], 2)
    log_lines.readings("lathe-1", [GOOD, GOOD], 0)
    log_lines.answered("lathe-1", Outcome(4, False, 0.004, "The step is too large."))
    assert [(each.levelname, each.getMessage()) for each in caplog.records] == [
        ("INFO", "lathe-1: reading lathe-1:7:1: shaft-1, 40.0 mm, part 812"),
        (
            "WARNING",
            f"lathe-1: reading {NO_JSON.key} goes to the quarantine: {NO_JSON.fault} (no characteristic, no size)",
        ),
        ("INFO", "lathe-1: 2 of 2 readings had come before, and are not stored twice"),
        (
            "WARNING",
            "lathe-1: correction 4 is refused by the control: The step is too large.; the control holds 0.004 mm",
        ),
    ]


def test_the_unit_that_is_printed_installs_and_lets_the_store_be_written(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "bridge.md").read_text(encoding="utf-8")
    [text] = re.findall(r"```ini\n(.*?)```", page, re.DOTALL)
    unit = configparser.ConfigParser(strict=False)
    unit.optionxform = str  # type: ignore[assignment,method-assign]
    unit.read_string(re.sub(r"(?m)^ +", "", text))
    assert unit["Install"]["WantedBy"] == "multi-user.target"
    assert "network-online.target" in unit["Unit"]["After"]
    assert unit["Service"]["StateDirectory"] == "inband-bridge"
    (tmp_path / "k").write_text("secret")
    (tmp_path / "plant.toml").write_text(
        PLANT.replace("bridge.sqlite3", re.findall(r'file = "(/var/lib/[^"]+)"', page)[0]), encoding="utf-8"
    )
    assert Path(read_configuration(tmp_path / "plant.toml").store.file).parent == Path("/var/lib/inband-bridge")
