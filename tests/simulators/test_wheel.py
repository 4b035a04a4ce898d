"""The distribution `inband-simulators`: what it holds, and what the commands say where it is not installed."""

import shutil
import sys
import tarfile
from pathlib import Path
from zipfile import ZipFile

import pytest
import typer
from typer.testing import CliRunner

from app import HOUSE, __version__
from app.cli import simulators
from app.errors import InbandError
from tests.test_installed import build, run

NAME = f"inband_simulators-{__version__}"
WHEEL = f"{NAME}-py3-none-any.whl"
ROOM = HOUSE / "app" / "simulators"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a wheel and the source beside it."""
    return build(ROOM, tmp_path_factory.mktemp("dist"), "wheel", "sdist")


def test_it_holds_the_room_at_its_place_and_nothing_else(built: Path) -> None:
    wanted = {f"app/simulators/{path.relative_to(ROOM).as_posix()}" for path in ROOM.rglob("*.py")}
    wheel = ZipFile(built / WHEEL)
    assert {name for name in wheel.namelist() if not name.startswith(f"{NAME}.dist-info/")} == wanted
    assert wheel.read(f"{NAME}.dist-info/licenses/LICENSE") == (HOUSE / "LICENSE").read_bytes()
    said = wheel.read(f"{NAME}.dist-info/METADATA").decode()
    assert f"\nVersion: {__version__}\n" in said
    assert "Requires-Dist" not in said


@pytest.mark.long
def test_the_source_builds_the_same_wheel_without_the_house(built: Path, tmp_path: Path) -> None:
    with tarfile.open(built / f"{NAME}.tar.gz") as source:
        source.extractall(tmp_path, filter="data")
    again = build(tmp_path / NAME, tmp_path / "dist", "wheel")
    assert (again / WHEEL).read_bytes() == (built / WHEEL).read_bytes()


@pytest.mark.parametrize("words", [[], ["--help"], ["--past", "42", "--bridge"]])
def test_a_command_that_is_missing_says_which_distribution_it_needs(words: list[str]) -> None:
    group = typer.Typer()
    group.callback()(lambda: None)
    simulators.say_how_to_get(group, "demo", "inband demo", "The demonstration plant")
    done = CliRunner().invoke(group, ["demo", *words])
    assert isinstance(done.exception, InbandError)
    assert "inband-simulators" in done.exception.detail
    assert f"Install {WHEEL}" in str(done.exception.what_to_do)


@pytest.mark.long
def test_beside_the_server_s_wheel_the_commands_are_there_and_without_it_they_are_not(
    built: Path, tmp_path: Path
) -> None:
    server = next(build(HOUSE, tmp_path / "dist", "wheel").glob("*.whl"))
    shutil.unpack_archive(server, tmp_path / "there", "zip")
    environment = {"PYTHONPATH": str(tmp_path / "there"), "NUMBA_DISABLE_JIT": "1"}
    for words in (["demo"], ["bridge", "simulate", "haas"]):
        done = run([sys.executable, "-m", "app", *words], tmp_path, **environment)
        assert (done.returncode, done.stdout) == (1, "")
        assert f"Install {WHEEL}" in done.stderr
    shutil.unpack_archive(built / WHEEL, tmp_path / "there", "zip")
    done = run([sys.executable, "-m", "app", "demo", "--help"], tmp_path, **environment)
    assert "--past" in done.stdout, done.stderr
    done = run([sys.executable, "-m", "app", "bridge", "simulate", "none"], tmp_path, **environment)
    assert "No simulated control of kind 'none'; there are dprnt" in done.stderr
