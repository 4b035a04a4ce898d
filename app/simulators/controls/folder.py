"""A simulated measuring machine that writes a CSV file for each part into a folder, as careless as real ones.

Now and then a file is written in two pieces with a pause between them, under its own name; now and then a file that is done comes a
second time. The machine takes no corrections.
"""

import asyncio
import contextlib
import shutil
import tempfile
from datetime import datetime
from pathlib import Path

from app.core.ring import Register, Slot, Unit
from app.simulators.controls.model import Model

AT = "the folder that files are written into; a new one if left out"
HALVED, TWICE = 5, 7  # of this many files one
HEAD = "Time;Part;Feature;Actual\r\n"


class FolderSimulator:
    """A measuring machine that is running. port: none is used."""

    def __init__(self, model: Model, folder: Path, pause: float = 1.0) -> None:
        self.model = model
        self.folder = folder
        self.pause = pause
        self.port = 0
        self.files = 0
        self._task: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Write a file for each part from now on."""
        await asyncio.to_thread(self.folder.mkdir, parents=True, exist_ok=True)
        self._task = asyncio.create_task(self._write())

    async def stop(self) -> None:
        """End it; the files stay."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task

    def table(self) -> dict[str, object]:
        """The table of a machine in the configuration."""
        return {
            "kind": "folder",
            "unit": "inch" if self.model.unit == Unit.INCH else "mm",
            "secret_file": "machine.key",
            "corrections": "none",
            "folder": {
                "path": str(self.folder),
                "format": "csv",
                "delimiter": ";",
                "decimal": ",",
                "zone": "UTC",
                "columns": {"characteristic": "Feature", "measured": "Actual", "measured_at": "Time", "part": "Part"},
            },
            "characteristics": {f"D{feature.number}": f"shaft-{feature.number}" for feature in self.model.features},
        }

    async def _write(self) -> None:
        done = 0
        while True:
            self.model.registers[Register.ACK] = self.model.registers[Register.WRITTEN]  # a file is never full
            for _, slot in self.model.written[done:]:
                await self._file(slot)
                done += 1
            await asyncio.sleep(0.05)

    async def _file(self, slot: Slot) -> None:
        self.files += 1
        size = f"{slot.measured:.6f}".replace(".", ",")
        at = datetime.now().astimezone()
        line = f"{at.isoformat(timespec='seconds')};P{slot.part};D{slot.characteristic};{size}\r\n"
        path = self.folder / f"part-{self.files:06d}.csv"
        if self.files % HALVED == 0:
            await asyncio.to_thread(path.write_text, HEAD + line[:20], encoding="utf-8", newline="")
            await asyncio.sleep(self.pause)
        await asyncio.to_thread(path.write_text, HEAD + line, encoding="utf-8", newline="")
        if self.files % TWICE == 0:
            await asyncio.to_thread(shutil.copyfile, path, path.with_stem(f"{path.stem}-again"))


def _folder(at: str | None) -> Path:
    return Path(at).absolute() if at else Path(tempfile.mkdtemp(prefix="inband-folder-"))


async def serve(model: Model, port: int, at: str | None = None) -> FolderSimulator:
    """Start one. at: the folder; a new one in the folder of temporary files if it is None."""
    del port
    simulator = FolderSimulator(model, _folder(at))
    await simulator.start()
    return simulator
