"""constraints.txt: complete, with a hash for each file, in sections that `make`, the Dockerfile and `make wheel` cut it into."""

import re
import runpy
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from app import HOUSE

TEXT = (HOUSE / "constraints.txt").read_text()
SECTIONS = {
    body.partition("\n")[0]: dict(re.findall(r"^([a-z0-9-]+)==([^ ;]+)", body, re.MULTILINE))
    for body in re.split(r"^# (?=For )", TEXT, flags=re.MULTILINE)[1:]
}


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=!~; ]", name, maxsplit=1)[0]).lower()


def test_each_version_has_the_hashes_of_its_files_and_no_address() -> None:
    blocks = re.findall(r"^[a-z0-9].*\n(?:    .*\n?)*", TEXT, re.MULTILINE)
    assert len(blocks) == sum(map(len, SECTIONS.values()))
    for block in blocks:
        assert re.fullmatch(r"[a-z0-9-]+==\S+( ; .+)? \\\n(    --hash=sha256:[0-9a-f]{64}( \\)?\n?)+", block), block
    assert "//" not in TEXT


def test_each_section_holds_what_it_is_for() -> None:
    project = tomllib.loads((HOUSE / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    so_far: set[str] = set()
    for heading, wanted in {
        "For the server": project["dependencies"],
        "For extras": [each for name in ("opcua", "heidenhain", "mqtt", "serial", "notify") for each in extras[name]],
        "For building": ["hatchling", "editables"],
        "For tests": extras["dev"],
        "For make lock and make audit": extras["tools"],
    }.items():
        assert so_far.isdisjoint(SECTIONS[heading])
        so_far |= set(SECTIONS[heading])
        assert {plain(each) for each in wanted} <= so_far, heading
    assert len(SECTIONS) == 5


def test_make_and_docker_install_by_hash_from_sections_that_are_there() -> None:
    for name in ("Makefile", "Dockerfile"):
        text = (HOUSE / name).read_text()
        named = set(re.findall(r"/\^# (For[\w ]+)/", text))
        assert named, name
        assert all(any(heading.startswith(each) for heading in SECTIONS) for each in named), named
        fetching = [line for line in text.splitlines() if re.search(r"pip install -(?!q)|\$\(PIP\)", line)]
        assert fetching, name
        assert all("--require-hashes" in line or "--no-deps" in line for line in fetching), fetching


@pytest.mark.skipif(shutil.which("sed") is None, reason="needs sed")
def test_libraries_of_an_installation_are_those_of_the_server(tmp_path: Path) -> None:
    recipe = re.search(r"@(sed .*constraints.txt) > dist/libraries.txt", (HOUSE / "Makefile").read_text())
    assert recipe is not None
    done = subprocess.run(["sh", "-c", recipe[1].replace("$$", "$")], cwd=HOUSE, capture_output=True, text=True)
    assert set(re.findall(r"^([a-z0-9-]+)==", done.stdout, re.MULTILINE)) == set(SECTIONS["For the server"])


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (
            "INFO\nrequests.exceptions.ConnectionError: Max retries exceeded\n",
            (
                "Not judged: no database of known vulnerabilities can be reached from here, so nothing is known of any library; run "
                "make audit where one can be reached (requests.exceptions.ConnectionError: Max retries exceeded).\n"
            ),
        ),
        (
            "/usr/bin/python: No module named pip_audit\n",
            "Not judged: pip-audit, which looks the libraries up, has failed (/usr/bin/python: No module named pip_audit).\n",
        ),
    ],
)
def test_an_audit_that_hears_nothing_says_so_in_one_sentence(
    said: str, sentence: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    audit = runpy.run_path(str(HOUSE / ".ci" / "audit.py"))
    unheard = subprocess.CompletedProcess[str]([], 1, stdout="", stderr=said)
    monkeypatch.setattr(subprocess, "run", lambda *_command, **_how: unheard)
    assert audit["main"]() == 2, "no answer is no clean bill"
    assert capsys.readouterr().out == sentence
