"""The distribution `inband-bridge` alone: what it holds, and that it brings a reading to a server without the server's libraries."""

import json
import runpy
import shutil
import signal
import subprocess
import sys
import tomllib
import venv
from importlib.metadata import distribution
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement

from app import HOUSE, __version__
from tests.bridge.test_windows import plant, stored
from tests.client.test_wheel import needed
from tests.shop import Shop
from tests.test_installed import bare, build
from tests.waits import until

NAME = f"inband_bridge-{__version__}"
ROOM = HOUSE / "app" / "bridge"
PROJECT = tomllib.loads((ROOM / "pyproject.toml").read_text())["project"]
MOST = 120.0  # MB, with OPC UA
SERVER_ONLY = [
    "alembic",
    "fastapi",
    "jinja2",
    "numba",
    "numpy",
    "psycopg",
    "scipy",
    "sqlalchemy",
    "starlette",
    "uvicorn",
    "uvloop",
]


def test_what_it_requires_is_what_the_server_requires_too() -> None:
    """One set of constraints: the same names, the same lowest versions."""
    house = tomllib.loads((HOUSE / "pyproject.toml").read_text())["project"]
    assert set(PROJECT["dependencies"]) <= set(house["dependencies"])
    extras = house["optional-dependencies"]
    assert PROJECT["optional-dependencies"] == {name: extras[name] for name in PROJECT["optional-dependencies"]}


def test_its_libraries_can_be_distinguished_in_the_constraints() -> None:
    text = runpy.run_path(str(HOUSE / ".ci" / "lock.py"))["libraries_of_the_bridge"]()
    pinned = {line.partition("==")[0] for line in text.splitlines() if "==" in line}
    wanted = PROJECT["dependencies"] + [each for extra in PROJECT["optional-dependencies"].values() for each in extra]
    assert {Requirement(each).name.lower() for each in wanted} <= pinned
    assert pinned.isdisjoint(SERVER_ONLY)
    assert text.count("--hash=sha256:") > len(pinned)


def test_it_holds_the_bridge_and_what_it_imports(tmp_path: Path) -> None:
    wheel = ZipFile(build(ROOM, tmp_path, "wheel") / f"{NAME}-py3-none-any.whl")
    names = {name for name in wheel.namelist() if not name.startswith(f"{NAME}.dist-info/")}
    assert names >= {path.relative_to(HOUSE).as_posix() for path in ROOM.rglob("*.py")}
    assert names >= {"app/cli/bridge.py", "app/core/ring.py", "inband_client/client.py"}
    rooms = {"/".join(name.split("/")[:2]) for name in names if name.startswith("app/")}
    files = {f"app/{name}.py" for name in ("__init__", "__main__", "errors", "logs", "memory")}
    assert rooms == files | {f"app/{room}" for room in ("bridge", "cli", "core", "files", "language")}
    assert wheel.read(f"{NAME}.dist-info/licenses/LICENSE") == (HOUSE / "LICENSE").read_bytes()


@pytest.mark.long
def test_it_runs_where_nothing_of_the_server_is_and_takes_little_room(shop: Shop, tmp_path: Path) -> None:
    venv.create(tmp_path / "venv", symlinks=True)
    (site,) = (tmp_path / "venv").glob("lib/python*/site-packages")
    wheel = build(ROOM, tmp_path / "dist", "wheel") / f"{NAME}-py3-none-any.whl"
    subprocess.run([sys.executable, "-m", "zipfile", "-e", str(wheel), str(site)], check=True)
    names = {Requirement(each).name for each in PROJECT["dependencies"] + PROJECT["optional-dependencies"]["opcua"]}
    sizes = 0
    for name in {each for top in names - {"tzdata"} for each in needed(top)}:
        found = distribution(name)
        for file in found.files or []:
            if file.parts[0] not in {"..", "__pycache__"} and file.suffix != ".pyc":
                source = Path(str(found.locate_file(file)))
                sizes += source.stat().st_size
                (site / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, site / file)
    assert sizes / 1e6 < MOST
    python = tmp_path / "venv" / "bin" / "python"
    look = "import json, sys; from importlib.util import find_spec; print(json.dumps([n for n in sys.argv[1:] if find_spec(n)]))"
    there = subprocess.run(
        [python, "-c", look, *SERVER_ONLY], cwd=tmp_path, env=bare(), capture_output=True, text=True, check=True
    )
    assert json.loads(there.stdout) == []
    log = tmp_path / "log"
    with log.open("w") as stderr:
        command = [str(python), "-m", "app", "bridge", "--config", str(plant(shop, tmp_path))]
        bridge = subprocess.Popen(command, cwd=tmp_path, env=bare(), stderr=stderr)
    try:
        until(lambda: stored(shop) or bridge.poll() is not None, 180)
        assert stored(shop) == [40.006], log.read_text()
        bridge.send_signal(signal.SIGTERM)
        assert bridge.wait(60) == 0, log.read_text()
    finally:
        bridge.kill()
        bridge.wait()
