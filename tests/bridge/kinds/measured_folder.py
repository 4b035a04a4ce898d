"""A measuring machine that writes files into a folder, and the bridge beside it."""

from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any

from app.bridge.configuration import Machine, configuration_from
from app.bridge.file_content import Content, read_content
from app.bridge.kinds.folder import Folder
from app.bridge.store import Store
from app.bridge.unit import Unit
from tests.bridge.plant import controlled

HEAD = "time;part;feature;actual\n"
LINE = "23.11.2026 06:05:00;P1;D40;40,0123\n"
COLUMNS = {"measured_at": "time", "part": "part", "characteristic": "feature", "measured": "actual"}


def machine(folder: Path, unit: str = "mm", names: dict[str, str] | None = None, **other: Any) -> Machine:
    settings = {"path": str(folder), "format": "csv", "every": 0.05, "settle": 0.3, "zone": "Europe/Belgrade"}
    if other.get("format", "csv") == "csv":
        settings |= {"columns": COLUMNS, "decimal": ","}
    table = {"kind": "folder", "unit": unit, "secret": "x", "corrections": "none", "interval": 0.02, "patience": 30.0}
    content = {
        "server": {"url": "http://127.0.0.1:1"},
        "machine": {"cmm-1": table | {"folder": settings | other, "characteristics": names or {"D40": "shaft-1"}}},
    }
    return configuration_from(content, folder).machines[0]


def fetching(chosen: Machine, store: Store) -> AbstractAsyncContextManager[Unit]:
    return controlled(Unit(chosen, Folder(chosen), store))


def write(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_text(text, encoding=encoding, newline="")
    return path


async def sizes(store: Store) -> list[float]:
    return [row.body["measured"] for row in await store.waiting("cmm-1", 10_000)]


def read(tmp_path: Path, text: str, name: str = "a.csv", stamp: str = "", **other: Any) -> Content:
    return read_content(machine(tmp_path, **other), (write(tmp_path / name, text),), stamp)
