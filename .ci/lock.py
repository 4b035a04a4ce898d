"""Write constraints.txt: every library with the hashes of all its files, in sections that `make` and the Dockerfile install from.

Versions that stand there are kept; `make lock ARGS=--upgrade` takes the newest, `ARGS="--upgrade-package fastapi"` one.
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HEAD = """\
# The exact versions that everything is tested with, and the hashes of their files. Written by `make lock`.
# `make wheel` writes the part that an installation needs: dist/libraries.txt, for pip install --require-hashes -r
"""
EXTRAS = ["pyproject.toml", *(f"--extra={each}" for each in ("opcua", "heidenhain", "mqtt", "serial", "notify"))]
BRIDGE = ["app/bridge/pyproject.toml", "--all-extras"]
# What each section is for, and what it holds beyond those before it. `make` and the Dockerfile know the headings.
SECTIONS = {
    "# For the server": ["pyproject.toml"],
    "# For extras": EXTRAS,
    "# For building": [*EXTRAS, "build"],
    "# For tests": [*EXTRAS, "build", "--extra=dev"],
    "# For make lock and make audit": ["pyproject.toml", "build", "--all-extras"],
}
OF_BRIDGE = "# inband-bridge, with all of its extras, needs of these:\n"
BUILD = "hatchling\neditables\n"  # pip builds an editable installation with them
PIN = re.compile(r"^([A-Za-z0-9._-]+)==", re.MULTILINE)


def compiled(uv: str, folder: Path, to: Path, *words: str) -> str:
    """The versions, as uv finds them for every system and every Python from 3.11 on."""
    words = tuple(str(folder / "build.in") if word == "build" else word for word in words)
    usual = ["--universal", "--python-version", "3.11", "--no-header", "--no-annotate", "--no-emit-index-url", "-q"]
    subprocess.run([uv, "pip", "compile", *usual, "-o", str(to), *words], check=True)
    return to.read_text()


def main(uv: str, *more: str) -> None:
    place = Path("constraints.txt")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "build.in").write_text(BUILD)
        whole = folder / "whole.txt"
        shutil.copy(place, whole)  # uv keeps the versions that stand in its output
        text = compiled(uv, folder, whole, "--generate-hashes", *SECTIONS["# For make lock and make audit"], *more)
        pins = {PIN.match(block)[1]: block for block in re.split(r"\n(?=\S)", text.strip())}  # type: ignore[index]
        parts, written = [HEAD], set[str]()
        for heading, words in SECTIONS.items():
            names = PIN.findall(compiled(uv, folder, folder / "part.txt", "-c", str(whole), *words))
            parts += ["\n", heading, "\n", *(f"{pins[each]}\n" for each in names if each not in written)]
            written.update(names)
        of_bridge = PIN.findall(compiled(uv, folder, folder / "part.txt", "-c", str(whole), *BRIDGE))
        place.write_text("".join([*parts, "\n", OF_BRIDGE, *(f"#     {each}\n" for each in of_bridge)]))


def libraries_of_the_bridge() -> str:
    """The part of constraints.txt that inband-bridge needs, with all of its extras."""
    text, _, names = Path("constraints.txt").read_text().partition(OF_BRIDGE)
    pins = {PIN.match(block)[1]: block for block in re.findall(r"^\S+==(?:.*\\\n)+.*\n", text, re.MULTILINE)}  # type: ignore[index]
    return "".join(pins[each] for each in names.replace("#", "").split())


if __name__ == "__main__":
    if sys.argv[1:] == ["--bridge"]:
        print(libraries_of_the_bridge(), end="")
    else:
        main(*sys.argv[1:])
