"""The distribution `inband-client` alone, as people install it: with httpx beside it, and nothing of the server."""

import json
import subprocess
import sys
import tarfile
import venv
from collections.abc import Iterator
from importlib.metadata import distribution
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement

from app import HOUSE, __version__
from tests.servers import Server
from tests.shop import Shop
from tests.test_installed import bare, build

NAME = f"inband_client-{__version__}"
WHEEL = f"{NAME}-py3-none-any.whl"
SERVER_ONLY = ["app", "sqlalchemy", "psycopg", "pydantic", "fastapi", "numba", "numpy", "msgspec"]
PROGRAM = """
import asyncio, json, sys
from importlib.util import find_spec
from inband_client import AsyncClient, Client
url, key, characteristic = sys.argv[1:4]
with Client(url, key) as inband:
    first = inband.push(characteristic=characteristic, measured=40.006, key="one")
async def again():
    async with AsyncClient(url, key) as inband:
        return await inband.push(characteristic=characteristic, measured=40.006, key="one")
same = asyncio.run(again()) == first
print(json.dumps({"action": first.action, "same": same, "there": [n for n in sys.argv[4:] if find_spec(n)]}))
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a wheel and the source beside it."""
    return build(HOUSE / "app" / "client", tmp_path_factory.mktemp("dist"), "wheel", "sdist")


def needed(name: str) -> Iterator[str]:
    """A distribution and what it cannot be without."""
    yield name
    for line in distribution(name).requires or []:
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
            yield from needed(requirement.name)


def test_it_holds_the_package_and_nothing_else(built: Path) -> None:
    package = HOUSE / "app" / "client" / "inband_client"
    wanted = {f"inband_client/{path.name}" for path in package.iterdir() if path.name != "__pycache__"}
    wheel = ZipFile(built / WHEEL)
    assert {name for name in wheel.namelist() if not name.startswith(f"{NAME}.dist-info/")} == wanted
    assert "inband_client/py.typed" in wanted
    assert wheel.read(f"{NAME}.dist-info/licenses/LICENSE") == (HOUSE / "LICENSE").read_bytes()
    said = wheel.read(f"{NAME}.dist-info/METADATA").decode()
    assert f"\nVersion: {__version__}\n" in said
    assert [line for line in said.splitlines() if line.startswith("Requires-Dist")] == ["Requires-Dist: httpx>=0.28"]


def test_the_source_builds_the_same_wheel_without_the_house(built: Path, tmp_path: Path) -> None:
    with tarfile.open(built / f"{NAME}.tar.gz") as source:
        source.extractall(tmp_path, filter="data")
    again = build(tmp_path / NAME, tmp_path / "dist", "wheel")
    assert (again / WHEEL).read_bytes() == (built / WHEEL).read_bytes()


def test_it_works_where_nothing_of_the_server_is(built: Path, server: Server, tmp_path: Path) -> None:
    libraries = tmp_path / "libraries"
    libraries.mkdir()
    for name in set(needed("httpx")):
        found = distribution(name)
        for top in {file.parts[0] for file in found.files or [] if file.parts[0] not in {"..", "__pycache__"}}:
            (libraries / top).symlink_to(Path(str(found.locate_file(top))))
    venv.create(tmp_path / "venv", symlinks=True)
    (site,) = (tmp_path / "venv").glob("lib/python*/site-packages")
    (site / "libraries.pth").write_text(str(libraries))
    install = [sys.executable, "-m", "zipfile", "-e", str(built / WHEEL), str(site)]
    subprocess.run(install, check=True)
    shop = Shop(server)
    words = [server.url, server.key(machine=shop.machine), shop.characteristic, *SERVER_ONLY]
    done = subprocess.run(
        [tmp_path / "venv" / "bin" / "python", "-c", PROGRAM, *words],
        cwd=tmp_path,
        env=bare(),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {"action": "correct", "same": True, "there": []}
