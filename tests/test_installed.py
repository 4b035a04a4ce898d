"""The wheel as people install it: no tree beside it, started from an empty folder, where nothing can be written but data."""

import os
import pwd
import re
import shutil
import stat
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import httpx
import pytest
import yaml  # type: ignore[import-untyped]

from app import HOUSE, __version__
from app.db import migrate
from app.db.embedded import EmbeddedServer
from app.db.engine import Database
from app.db.run_as import run_as
from app.settings import Settings
from tests import keeper
from tests.databases import short_folder
from tests.servers import Process, Server, free_port, wait_ready
from tests.shop import Shop

NAME = f"inband-{__version__}"
WHEEL = f"{NAME}-py3-none-any.whl"


def build(tree: Path, folder: Path, *targets: str) -> Path:
    """Build a tree without any network; the folder."""
    words = [word for target in targets for word in ("-t", target)]
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(folder), *words]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a wheel."""
    return build(HOUSE, tmp_path_factory.mktemp("dist"), "wheel")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources that are published beside the wheel."""
    return build(HOUSE, tmp_path_factory.mktemp("source"), "sdist") / f"{NAME}.tar.gz"


@pytest.fixture(scope="module")
def programs(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Programs of an environment with the wheel; the libraries are those of this one, without its Inband."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    venv.create(folder, symlinks=True, with_pip=True)
    install: list[str | Path] = [
        folder / "bin/python",
        "-m",
        "pip",
        "install",
        "-q",
        "--no-index",
        "--no-deps",
        built / WHEEL,
    ]
    subprocess.run(install, check=True, env=bare())
    (site,) = folder.glob("lib/python*/site-packages")
    # A folder that such a file names brings its packages, not its own *.pth: an editable Inband is not found there.
    (site / "libraries.pth").write_text("\n".join({sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}))
    closed = [site / "app", *(path for path in (site / "app").rglob("*") if path.is_dir())]
    for each in closed:  # it belongs to somebody else, or lies on a disk that is read only
        each.chmod(0o555)
    yield folder / "bin"
    for each in closed:
        each.chmod(0o755)


def bare(**more: str) -> dict[str, str]:
    """The environment of somebody who has set nothing, and has no home."""
    return {"PATH": os.environ["PATH"], "LANG": "C.UTF-8", "HOME": "/nonexistent"} | keeper.mark() | more


def run(command: Sequence[object], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        list(map(str, command)), cwd=folder, env=bare(**environment), capture_output=True, text=True, timeout=120
    )


def image_environment() -> dict[str, str]:
    """Of a container, as the Dockerfile and the command in the documentation set it; the port and the folder are a test's own."""
    last = (HOUSE / "Dockerfile").read_text().split("\nFROM ")[2].replace("\\\n", " ")
    (command,) = re.findall(
        r"^    (docker run -d .+ inband)$", (HOUSE / "docs/how-to/run-for-real.md").read_text(), re.MULTILINE
    )
    found = re.findall(r"(?:^ENV | )(INBAND_\w+)=(\S+)", f"{last}\n{command}", re.MULTILINE)
    return {name: value for name, value in found if name not in {"INBAND_PORT", "INBAND_DATA_DIR"}}


class Installed(Server):
    """A server from the wheel, as the image runs it: on the embedded PostgreSQL, as a user who may write the data folder only."""

    data_dir: Path

    def client(self, key: str | None = None, **headers: str) -> httpx.Client:
        """A client with patience: a first call compiles, and compiled loops of the tree are none of this program."""
        client = super().client(key, **headers)
        client.timeout = httpx.Timeout(300)
        return client


@pytest.fixture(scope="module")
def installed(programs: Path) -> Iterator[Installed]:
    with short_folder() as home:
        empty, stderr, port = home / "empty", home / "stderr", free_port()
        home.chmod(0o755)
        empty.mkdir()
        (home / "mine").mkdir()
        become: list[str] = []
        if os.geteuid() == 0:
            nobody = pwd.getpwnam("nobody")
            os.chown(home / "mine", nobody.pw_uid, nobody.pw_gid)
            become = run_as(
                nobody, reads=[Path(sys.executable).resolve(), Path(sysconfig.get_path("purelib"))], enters=[]
            )
        data_dir = home / "mine" / "data"
        command: list[str | Path] = [*become, programs / "inband", "serve", "--port", str(port), "--data-dir", data_dir]

        def start() -> Process:
            with stderr.open("ab") as log:
                process = subprocess.Popen(
                    command,
                    cwd=empty,
                    env=bare(**image_environment()),
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                )
            wait_ready(f"http://127.0.0.1:{port}", process, stderr)
            return process

        process = start()
        database = Database(EmbeddedServer(data_dir).url, pool_size=1)
        server = Installed(f"http://127.0.0.1:{port}", database, process, start, stderr)
        server.data_dir = data_dir
        try:
            yield server
        finally:
            server.close()
            database.close()
            assert list(empty.iterdir()) == []


def compiled_in(data_dir: Path) -> dict[Path, int]:
    """Each compiled loop that is kept there, and when it was written."""
    folder = data_dir / "compiled"
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.nbc")}


class TestContent:
    def test_the_wheel_holds_what_the_program_reads_and_nothing_else(self, built: Path) -> None:
        beside = [
            "frontend",
            "migrations",
            *(f"docs/{each}" for each in ("decisions", "how-to", "images", "reference")),
        ]
        wanted = {
            (path.relative_to(HOUSE) if folder == "app" else Path("app") / path.relative_to(HOUSE)).as_posix()
            for folder in ("app", *beside)
            for path in (HOUSE / folder).rglob("*")
            if path.is_file() and "__pycache__" not in path.parts and path.name != "inband.pot"
            if not path.is_relative_to(HOUSE / "app" / "simulators")
        }
        wanted = {name.removeprefix("app/client/") for name in wanted}
        for folder in ("", "app/bridge/"):  # of the distributions inband-client and inband-bridge
            wanted -= {f"{folder}{name}" for name in ("pyproject.toml", "README.md", "LICENSE")}
        there = {name for name in ZipFile(built / WHEEL).namelist() if not name.startswith(f"{NAME}.dist-info/")}
        assert there == wanted

    def test_the_wheel_carries_the_licence_and_the_command(self, built: Path) -> None:
        wheel = ZipFile(built / WHEEL)
        assert wheel.read(f"{NAME}.dist-info/licenses/LICENSE") == (HOUSE / "LICENSE").read_bytes()
        assert b"inband = app.__main__:main" in wheel.read(f"{NAME}.dist-info/entry_points.txt")
        assert f"\nVersion: {__version__}\n" in wheel.read(f"{NAME}.dist-info/METADATA").decode()

    @pytest.mark.long
    def test_the_source_builds_the_same_wheel(self, built: Path, source: Path, tmp_path: Path) -> None:
        with tarfile.open(source) as archive:
            archive.extractall(tmp_path, filter="data")
        again = build(tmp_path / NAME, tmp_path / "dist", "wheel")
        assert (again / WHEEL).read_bytes() == (built / WHEEL).read_bytes()

    @pytest.mark.long
    def test_the_source_holds_what_is_kept_and_nothing_that_was_made(self, source: Path) -> None:
        with tarfile.open(source) as archive:
            names = {name.removeprefix(f"{NAME}/") for name in archive.getnames()}
        assert names >= {"Makefile", "constraints.txt", "CHANGELOG.md", "Dockerfile", "docker-compose.yml", "LICENSE"}
        assert names >= {"tests/conftest.py", "docs/how-to/upgrade.md", "frontend/static/css/base.css"}
        assert [
            name for name in names if "__pycache__" in name or re.match(r"\.venv|\.git/|dist|build|data", name)
        ] == []


@pytest.mark.long
class TestProgram:
    def test_it_runs_from_the_wheel_and_says_its_version(self, programs: Path, tmp_path: Path) -> None:
        where = run([programs / "python", "-c", "import app; print(app.__file__); print(app.HOUSE)"], tmp_path)
        file, house = map(Path, where.stdout.split("\n")[:2])
        assert (file.parent, house.parents[3]) == (house, programs.parent), where.stderr
        done = run([programs / "inband", "--version"], tmp_path)
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(f"inband {__version__} (Python 3.")
        assert done.stdout.endswith(f", schema {migrate.head()})\n")

    def test_the_published_examples_come_out(self, programs: Path, tmp_path: Path) -> None:
        done = run([programs / "inband", "proof"], tmp_path, NUMBA_DISABLE_JIT="1")
        assert done.returncode == 0, done.stdout + done.stderr

    def test_the_sign_in_page_comes_with_all_that_it_loads(self, installed: Installed) -> None:
        client = installed.client()
        page = client.get("/sign-in")
        assert page.status_code == 200, page.text
        assets = set(re.findall(r'(?:href|src)="(/static/[^"]+)"', page.text))
        assert len(assets) >= 3
        assert {asset: client.get(asset).status_code for asset in assets} == dict.fromkeys(assets, 200)

    def test_the_documentation_of_the_api_has_its_examples(self, installed: Installed) -> None:
        client = installed.client()
        assert client.get("/api/docs").status_code == 200
        body = client.get("/api/v1/openapi.json").json()["components"]["schemas"]["ReadingIn"]
        assert "measured" in str(body["example"] if "example" in body else body["examples"])

    def test_a_reading_is_decided_and_reported(self, installed: Installed) -> None:
        shop = Shop(installed)
        assert shop.read(6.0)["action"] == "correct"
        report = shop.admin.get(f"/api/v1/characteristics/{shop.characteristic}/report.pdf")
        assert (report.status_code, report.content[:5]) == (200, b"%PDF-")

    def test_compiled_loops_are_kept_in_the_data_folder_for_the_next_start(self, installed: Installed) -> None:
        shop = Shop(installed)
        what = f"/api/v1/characteristics/{shop.characteristic}/capability"
        for number in range(60):
            shop.read(number % 3)
        assert shop.admin.get(what).status_code == 200
        kept = compiled_in(installed.data_dir)
        assert kept
        installed.stop()
        installed.restart()
        assert shop.admin.get(what).status_code == 200
        assert kept.items() <= compiled_in(installed.data_dir).items(), "more are compiled in the background"

    def test_an_older_program_leaves_the_database_of_a_newer_one_alone(
        self, installed: Installed, programs: Path, tmp_path: Path
    ) -> None:
        """The program of the wheel without its last migration is such an older one."""
        (site,) = programs.parent.glob("lib/python*/site-packages/app")
        shutil.copytree(site, tmp_path / "app", ignore=shutil.ignore_patterns("__pycache__", "static"))
        versions = tmp_path / "app" / "migrations" / "versions"
        (last,) = (path for path in versions.glob("*.py") if f'revision = "{migrate.head()}"' in path.read_text())
        versions.chmod(0o755)
        last.unlink()
        older = [programs / "python", "-m", "app", "serve", "--port", str(free_port())]
        done = run([*older, "--database-url", installed.database.dsn], tmp_path)
        assert done.returncode == 1, done.stderr
        assert f"at revision {migrate.head()}, which this Inband does not know: a newer one has used it" in done.stderr
        assert migrate.current(installed.database.dsn) == migrate.head()


class TestContainer:
    @pytest.mark.long
    def test_the_dockerfile_builds_the_same_wheel_from_what_it_copies(self, built: Path, tmp_path: Path) -> None:
        first = (HOUSE / "Dockerfile").read_text().split("\nFROM ")[1]
        for line in re.findall(r"^COPY (.+)$", first, re.MULTILINE):
            *sources, target = line.split()
            for source in sources:
                if (HOUSE / source).is_dir():
                    shutil.copytree(HOUSE / source, tmp_path / target, ignore=shutil.ignore_patterns("__pycache__"))
                else:
                    shutil.copy(HOUSE / source, tmp_path / target)
        again = build(tmp_path, tmp_path / "wheels", "wheel")
        assert (again / WHEEL).read_bytes() == (built / WHEEL).read_bytes()

    def test_one_container_listens_to_others_and_wants_no_other_database(self) -> None:
        environment = image_environment()
        assert environment["INBAND_HOST"] == "0.0.0.0"
        assert "INBAND_DATABASE_URL" not in environment
        said: dict[str, Any] = {name.removeprefix("INBAND_").lower(): value for name, value in environment.items()}
        assert Settings(**said).database_url is None

    def test_the_dockerfile_may_copy_what_it_copies(self) -> None:
        first = (HOUSE / "Dockerfile").read_text().split("\nFROM ")[1]
        copied = {source for line in re.findall(r"^COPY (.+)$", first, re.MULTILINE) for source in line.split()[:-1]}
        sent = {line[1:] for line in (HOUSE / ".dockerignore").read_text().splitlines() if line.startswith("!")}
        assert copied == sent
        project = tomllib.loads((HOUSE / "pyproject.toml").read_text())
        for folder in project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"]:
            assert any(Path(folder).is_relative_to(each) for each in copied), f"{folder} is not in the image"

    @pytest.mark.parametrize(("to", "library"), [("server", "fastapi"), ("building", "hatchling")])
    def test_the_dockerfile_takes_the_libraries_by_hash(self, to: str, library: str) -> None:
        (program,) = re.findall(rf"(sed [^&]+ constraints\.txt) > {to}\.txt", (HOUSE / "Dockerfile").read_text())
        done = subprocess.run(["/bin/sh", "-c", program], cwd=HOUSE, capture_output=True, text=True, check=True)
        found = re.search(rf"^{library}==\S+ \\\n    --hash=sha256:", done.stdout, re.MULTILINE)
        assert found, done.stdout[:300]
        assert "pytest==" not in done.stdout

    def test_compose_gives_the_server_no_rights_and_no_disk_but_its_data(self) -> None:
        services = yaml.safe_load((HOUSE / "docker-compose.yml").read_text())["services"]
        server = services["inband"]
        assert (server["read_only"], server["cap_drop"], server["tmpfs"]) == (True, ["ALL"], "/tmp")  # noqa: S108 - its own
        assert server["security_opt"] == ["no-new-privileges:true"]
        assert server["volumes"] == ["data:/var/lib/inband"]
        assert all(port.startswith("127.0.0.1:") for port in server["ports"])

    def test_compose_understands_its_file(self, tmp_path: Path) -> None:
        file = HOUSE / "docker-compose.yml"
        if shutil.which("docker") and run(["docker", "compose", "version"], HOUSE).returncode == 0:
            config = ["docker", "compose", "-f", str(file), "config", "--quiet"]
        elif shutil.which("docker-compose"):  # Debian 12's, which does not know `name` yet
            (tmp_path / file.name).write_text(file.read_text().replace("\nname: inband\n", "\n"))
            config = ["docker-compose", "-f", str(tmp_path / file.name), "config", "--quiet"]
        else:
            pytest.skip("there is no `docker compose` here")
        done = run(config, HOUSE, POSTGRES_PASSWORD="a test's")
        assert (done.returncode, done.stderr) == (0, "")
        refused = run(config, HOUSE)
        assert refused.returncode != 0
        assert "POSTGRES_PASSWORD" in refused.stderr
