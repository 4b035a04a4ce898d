"""The documents say what is true: commands run, answers are as printed, lists are complete, links lead somewhere."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app import HOUSE
from app.db.embedded import EmbeddedServer
from app.db.engine import Database
from app.settings import Settings, variable_of
from docs import generate
from tests.databases import short_folder
from tests.servers import Server, begun, free_port, wait_ready
from tests.shop import Shop

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)#\s]+)(#[^)\s]*)?\)")
BETWEEN = "----8<----"

# For computers without curl: what the documents use of it.
CURL = """#!{python}
import sys, httpx
words, headers, data, url = sys.argv[1:], {{}}, None, ""
while words:
    word = words.pop(0)
    if word == "-H":
        name, _, value = words.pop(0).partition(": ")
        headers[name] = value
    elif word == "-d":
        data = words.pop(0).encode()
    elif word != "-sS":
        url = word
print(httpx.request("GET" if data is None else "POST", url, headers=headers, content=data).text, end="")
"""


def blocks(path: Path) -> list[tuple[str, str]]:
    """Language and text of every fenced block."""
    return [(kind, text) for kind, text in BLOCK.findall(path.read_text())]


def shell(path: Path, server: Server, folder: Path, **environment: str) -> list[str]:
    """Run the shell blocks of a document one after the other in one shell, against this server; what each printed.

    environment: by which variables the commands find the server's database; else by its address.
    """
    bin_ = folder / ".venv" / "bin"
    bin_.mkdir(parents=True)
    (bin_ / "inband").write_text(f'#!/bin/sh\nPYTHONPATH={HOUSE} exec {sys.executable} -m app "$@"\n')
    if shutil.which("curl") is None:
        (bin_ / "curl").write_text(CURL.format(python=sys.executable))
    for program in bin_.iterdir():
        program.chmod(0o755)
    script = f"echo '{BETWEEN}'\n".join(f"{text}\necho\n" for kind, text in blocks(path) if kind == "sh")
    done = subprocess.run(
        ["sh", "-euc", script.replace("http://127.0.0.1:8000", server.url)],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ
        | {"PATH": f"{os.environ['PATH']}:{bin_}", "NO_PROXY": "*"}
        | (environment or {"INBAND_DATABASE_URL": server.database.dsn}),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split(f"{BETWEEN}\n")


def parts_that_differ(said: Any, printed: Any, where: str = "") -> list[str]:
    """Differences of the printed answer from the real one; it may leave fields out."""
    if isinstance(printed, dict) and isinstance(said, dict):
        return [
            each
            for name, value in printed.items()
            for each in parts_that_differ(said.get(name, "nothing"), value, f"{where}.{name}")
        ]
    if isinstance(printed, list) and isinstance(said, list) and len(printed) == len(said):
        return [
            each for at, value in enumerate(printed) for each in parts_that_differ(said[at], value, f"{where}[{at}]")
        ]
    return [] if said == printed else [f"{where}: {printed!r} is printed, {said!r} was answered"]


@pytest.fixture(scope="module")
def second_example() -> Iterator[tuple[Server, Path]]:
    """A server on a data folder of its own, as `--data-dir ~/six-weeks` starts one, and the folder."""
    with short_folder() as home:
        folder, stderr, port = home / "six-weeks", home / "stderr", free_port()
        process = begun(["serve", "--port", str(port), "--data-dir", str(folder)], stderr)
        try:
            wait_ready(f"http://127.0.0.1:{port}", process, stderr)
            database = Database(EmbeddedServer(folder).url, pool_size=1)
            running = Server(f"http://127.0.0.1:{port}", database, process, lambda: process, stderr)
            yield running, folder
            database.close()
            running.close()
        finally:
            if process.poll() is None:
                process.kill()


class TestReadme:
    def test_its_commands_work_and_answer_as_printed(self, second_example: tuple[Server, Path], tmp_path: Path) -> None:
        """As the README says it for the second example: with the folder in a variable. Then once more, as it says too."""
        readme, (server, folder) = HOUSE / "README.md", second_example
        assert "`export INBAND_DATA_DIR=~/six-weeks`" in readme.read_text()
        printed = shell(readme, server, tmp_path, INBAND_DATA_DIR=str(folder))
        kinds = [kind for kind, _text in blocks(readme)]
        texts = [text for _kind, text in blocks(readme)]
        compared = 0
        for at, kind in enumerate(kinds):
            if kind == "json":
                answer = printed[kinds[:at].count("sh") - 1].strip().splitlines()[-1]
                assert parts_that_differ(json.loads(answer), json.loads(texts[at])) == []
                compared += 1
        assert compared >= 6
        (tmp_path / "again").mkdir()
        again = shell(readme, server, tmp_path / "again", INBAND_DATA_DIR=str(folder))
        answers = [json.loads(each) for each in "".join(again).splitlines() if each.startswith("{")]
        assert [answer.get("status") for answer in answers[:2]] == [409, 409]
        assert [answer["sequence"] for answer in answers if "measured" in answer] == [1, 2, 3]

    def test_it_says_what_it_is_for_in_three_sentences(self) -> None:
        first = re.search(r"^# Inband\n\n(.*?)\n\n!\[", (HOUSE / "README.md").read_text(), re.DOTALL)
        assert first
        assert len(re.findall(r"[.!?](?:\s|$)", first[1])) == 3

    def test_its_reference_names_every_command_and_every_variable(self) -> None:
        text = (HOUSE / "docs" / "reference" / "commands.md").read_text()
        for name, _command in generate.commands():
            assert f"`{name}`" in text
        for name in Settings.model_fields:
            assert f"`{variable_of(name)}`" in text

    def test_the_help_names_the_same_commands(self) -> None:
        done = subprocess.run(
            [sys.executable, "-m", "app", "--help"],
            cwd=HOUSE,
            capture_output=True,
            text=True,
            env=os.environ | {"COLUMNS": "200"},
        )
        for name, _command in generate.commands():
            assert f" {name.split()[1]} " in done.stdout

    def test_pictures_are_small_and_each_is_shown(self) -> None:
        text = "".join(path.read_text() for path in generate.documents())
        for picture in (HOUSE / "docs" / "images").iterdir():
            assert 5_000 < picture.stat().st_size < 80_000
            assert f"images/{picture.name})" in text, "python -m docs.pictures takes pictures that a document shows"


class TestEveryDocument:
    @pytest.mark.parametrize("path", generate.documents(), ids=lambda path: path.relative_to(HOUSE).as_posix())
    def test_generated_parts_are_up_to_date(self, path: Path) -> None:
        text = path.read_text()
        assert text == generate.renewed(text), "run: python -m docs.generate"

    @pytest.mark.parametrize("path", generate.documents(), ids=lambda path: path.relative_to(HOUSE).as_posix())
    def test_links_lead_somewhere(self, path: Path) -> None:
        text = path.read_text()
        for target, heading in LINK.findall(text):
            if "://" in target:
                continue
            found = (path.parent / target).resolve()
            assert found.exists(), target
            if heading:
                headings = re.findall(r"^#+ (.*)$", found.read_text(), re.MULTILINE)
                assert heading[1:] in {re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in headings}

    def test_every_document_can_be_reached_from_the_readme(self) -> None:
        seen: set[Path] = set()
        todo = [HOUSE / "README.md"]
        while todo:
            path = todo.pop()
            if path in seen or path.suffix != ".md":
                continue
            seen.add(path)
            todo += [
                (path.parent / target).resolve() for target, _ in LINK.findall(path.read_text()) if "://" not in target
            ]
        assert seen == set(generate.documents())

    def test_pip_is_given_no_name_that_anybody_can_register(self) -> None:
        """No distribution of Inband is at PyPI: wherever one is installed, in documents and in messages, by its file."""
        by_name = re.compile(
            r"""(?:pip\ install[^\n`]*[\ "']|\bInstall\ `?)inband(?:[-_](?:bridge|client|simulators))?(?=[\s"'`,.[]|$)""",
            re.VERBOSE,
        )
        texts = [*generate.documents(), *(HOUSE / "app").rglob("*.md"), *(HOUSE / "app").rglob("*.py")]
        for path in (*texts, *(HOUSE / "frontend" / "templates").rglob("*.html")):
            found = [line for line in path.read_text().splitlines() if by_name.search(line)]
            assert [line for line in found if "what anybody puts there" not in line] == [], path

    def test_paths_of_the_tree_exist(self) -> None:
        for path in generate.documents():
            for named in re.findall(r"`((?:app|tests|docs|bench|frontend|migrations)/[\w./-]*)`", path.read_text()):
                assert (HOUSE / named).exists(), f"{path.name}: {named}"


class TestReference:
    def test_every_word_is_explained(self) -> None:
        text = "".join(path.read_text() for path in (HOUSE / "docs" / "reference").glob("*.md"))
        missing = {
            (kind, word)
            for kind, words in generate.vocabulary().items()
            for word in words
            if not re.search(rf"`{word}(_total)?`", text)
        }
        assert missing == set()

    def test_every_event_is_explained(self) -> None:
        files = [path for path in (HOUSE / "app").rglob("*.py") if path.stem not in {"schemas", "answers"}]  # examples
        source = "".join(path.read_text() for path in files)
        kinds = set(re.findall(r'"kind": "(\w+)",?\s*"machine"', source)) | {"heartbeat", "hello", "resync"}
        text = (HOUSE / "docs" / "reference" / "events.md").read_text()
        assert kinds >= {"reading", "correction", "alarm", "tool", "average", "characteristic", "machine"}
        assert {kind for kind in kinds if f"| `{kind}` |" not in text} == set()

    def test_a_part_that_nobody_makes_is_an_error(self) -> None:
        with pytest.raises(KeyError):
            generate.renewed("<!-- generated: nothing-like-it -->\n<!-- end -->")


# Pages whose words in italics are mostly those of files and programs of others.
OTHERS_WORDS = re.compile(r"bridge|import-readings|aqdef")
# Examples of what a shop calls its machines and parts.
NOT_OURS = {"Milling machine 1", "SN-0004", "SN-0005", "SN-0006", "SN-0007"}
CONTROL = re.compile(r"(?<!\*)\*([A-Z][^*\n]{1,60})\*(?!\*)")


def sentences_of_the_program() -> str:
    """Templates and code in small letters, strings that follow each other joined, what is filled in as `n`."""
    paths = [*(HOUSE / "frontend" / "templates").rglob("*.html"), *(HOUSE / "app").rglob("*.py")]
    text = re.sub(r'"\s*\n\s*"', "", "\n".join(path.read_text() for path in paths))
    return re.sub(r"%\(\w+\)s|{\w+}", "n", text).lower()


class TestHowTo:
    def test_buttons_and_pages_are_named_as_the_program_names_them(self) -> None:
        """Words in italics with a capital are what stands on a page: each begins a sentence there."""
        program, missing = sentences_of_the_program(), []
        for path in (HOUSE / "docs" / "how-to").glob("*.md"):
            if OTHERS_WORDS.match(path.stem):
                continue
            for named in CONTROL.findall(re.sub(r"```.*?```", "", path.read_text(), flags=re.DOTALL)):
                shown = re.sub(r"(?<![a-z\d])[+−-]?\d+([.,]\d+)?( µm)?", "n", named.lower().rstrip(" .…"))
                ways = ([shown], shown.split(" → "), re.split(" → |: ", shown), re.split(" → |: |, ", shown))
                known = any(all(re.search(rf"[\"']{re.escape(part)}", program) for part in way) for way in ways)
                missing += [] if known or named in NOT_OURS else [f"{path.name}: {named}"]
        assert missing == [], "name it as the page does"

    def test_the_python_client_closes_a_loop_as_it_is_written(self, server: Server) -> None:
        path = HOUSE / "docs" / "how-to" / "python-client.md"
        loop, live = (
            text.replace("http://127.0.0.1:8000", server.url) for kind, text in blocks(path) if kind == "python"
        )
        shop = Shop(server)
        shop.call("POST", "/machines", 201, key="my-lathe", name="My lathe", control="sinumerik")
        parameters = {"R10": 3, "R11": 5, "R42": 40, "R40": 0, "R41": -0.016, "R29": 2, "factor": -1}
        limits = {"R33": 0.001, "R34": 0.0053, "R37": 0.3, "R36": 1}
        seat: dict[str, Any] = {
            "key": "seat-d40",
            "name": "Bearing seat",
            "machine": "my-lathe",
            "parameters": parameters | limits,
        }
        shop.call("POST", "/characteristics", 201, **seat)
        environment = os.environ | {"PYTHONPATH": str(HOUSE / "app" / "client"), "PYTHONIOENCODING": "utf-8"}
        environment["MACHINE_KEY"] = server.key(machine="my-lathe")
        watching = subprocess.Popen([sys.executable, "-c", live], env=environment, stdout=subprocess.PIPE, text=True)
        try:
            assert watching.stdout is not None
            assert watching.stdout.readline() == "[]\n"
            for _again in range(2):
                done = subprocess.run(
                    [sys.executable, "-c", loop], env=environment, capture_output=True, encoding="utf-8"
                )
                assert done.returncode == 0, done.stderr
                assert f"It prints `{done.stdout.strip()}`" in path.read_text()
            applied = shop.call("GET", "/machines/my-lathe/corrections?status=applied")["items"]
            assert [(each["number"], each["offset_after"]) for each in applied] == [(1, -0.0061)]
            assert watching.stdout.readline() in {"[1]\n", "[]\n"}, "it may look when it is applied already"
        finally:
            watching.terminate()
            watching.communicate()

    def test_backing_up_works_as_it_is_written(self, server: Server, tmp_path: Path) -> None:
        text = (HOUSE / "docs" / "how-to" / "back-up.md").read_text()
        assert "inband backup inband-monday.dump" in text
        document = tmp_path / "document.md"
        # Into a database of its own, not into the one that the variable of this test names.
        restore = ".venv/bin/inband restore"
        document.write_text(text.replace(restore, f"env -u INBAND_DATABASE_URL {restore}"))
        shell(document, server, tmp_path)
        assert (tmp_path / "inband-monday.dump").stat().st_size > 10_000
        assert (tmp_path / "restored" / "postgres").is_dir()
