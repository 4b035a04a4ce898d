"""Build hook of inband-bridge: the files of the tree that its wheel holds, which are the bridge, its command, and what they import."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

HOUSE = Path(__file__).resolve().parents[1]
BEGINS = ("app.__main__", "app.cli.bridge", "app.cli.simulators")
"""And every module of app.bridge: kinds of controls are imported by their names."""
OF_THE_SERVER = {"app.db", "app.settings"}
"""Imported where there is a server: app.cli.base.SERVER."""


def file_of(module: str) -> Path | None:
    """The file of a module of ours; None for what is none, such as a function in one."""
    path = HOUSE.joinpath(*module.split("."))
    return next((each for each in (path / "__init__.py", path.with_suffix(".py")) if each.is_file()), None)


def imported(file: Path) -> Iterator[str]:
    """Names that a file imports of the house, wherever in it."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
            yield from (f"{node.module}.{each.name}" for each in node.names)


def modules() -> dict[str, Path]:
    """Each module of the wheel, and its file."""
    bridge = HOUSE / "app" / "bridge"
    waiting = [*BEGINS, *(".".join(each.relative_to(HOUSE).with_suffix("").parts) for each in bridge.rglob("*.py"))]
    found: dict[str, Path] = {}
    while waiting:
        module = waiting.pop().removesuffix(".__init__")
        parts = module.split(".")
        file = file_of(module) if parts[0] == "app" and ".".join(parts[:2]) not in OF_THE_SERVER else None
        if file is not None and module not in found:
            found[module] = file
            waiting += [".".join(parts[:length]) for length in range(1, len(parts))]
            waiting += imported(file)
    return found


class CustomBuildHook(BuildHookInterface[Any]):
    """Puts the files to the places that they have in the tree, and the client to its own."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add them to what is built."""
        build_data["force_include"] |= {
            str(file): file.relative_to(HOUSE).as_posix() for file in sorted(modules().values())
        }
        client = HOUSE / "app" / "client" / "inband_client"
        build_data["force_include"] |= {
            str(file): f"inband_client/{file.name}" for file in sorted(client.iterdir()) if file.is_file()
        }
