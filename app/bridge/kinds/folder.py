"""Folders into which measuring machines write files; see `app.bridge.file_content` for what a file holds.

The folder is looked at again and again: shares tell nobody of a new file. A file is read when two looks find it the same. It is
moved when all its readings are stored durably, into the folder of done files or, with a text that says why, of failed
ones. It is never deleted. Nothing goes back to the machine. Links are not followed: anyone who may write into the folder would have
the bridge read what only the bridge may.
"""

import asyncio
import contextlib
import hashlib
import json
import logging
import os
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict
from datetime import datetime
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

from app.bridge.configuration import Machine
from app.bridge.fields import left_out_since
from app.bridge.file_content import NAMES, NOT_ALONE, Content, read_content
from app.bridge.file_rows import Fault, reasons
from app.bridge.file_settings import Settings
from app.bridge.links import STOPPING, Clock, ControlAway, Decided, Misconfigured, OneWay, Position, Received
from app.bridge.moments import learn_ahead
from app.bridge.plain_files import NotPlain, is_plain, read_plain, write_new

__all__ = ["Folder", "Settings", "link"]
log = logging.getLogger(__name__)
T = TypeVar("T")
IDENTITY: Final = "inband-identity.txt"
"""A file in the folder that says whose it is; a share that is not mounted has none."""
UNFINISHED: Final = (".tmp", ".part", ".partial", ".filepart", ".crdownload", ".why.txt")
SAME_FOR: Final = 0.9  # of the time between two looks
LOCKED_FOR: Final = 60.0  # s until it is said
MOST_REASONS: Final = 100


class Seen(NamedTuple):
    """One file, or a pair, as a look found it: sizes and times of modification."""

    paths: tuple[Path, ...]
    state: tuple[tuple[int, int], ...]

    @property
    def name(self) -> str:
        """The name of the file, of a pair that of the values."""
        return self.paths[-1].name

    @property
    def modified(self) -> int:
        """Last modification, ns."""
        return max(modified for _, modified in self.state)


class _Known(NamedTuple):
    """A file that is watched. since: it has been the same; first: it was there. By the bridge's clock, s."""

    seen: Seen
    since: float
    first: float


class Folder(OneWay):
    """The link to one folder."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.settings: Settings = machine.settings
        self.clock = Clock()
        self.path = Path(self.settings.path)
        self._known: dict[str, _Known] = {}
        self._locked: dict[str, tuple[float, str]] = {}
        self._taken: dict[str, tuple[Seen, Content]] = {}  # read; moved when it is stored
        self._stored: dict[str, tuple[Seen, Content]] = {}  # stored; to be moved
        self._grown: dict[str, tuple[str, str]] = {}  # digest and stamp of what is stored of files that changed since
        self._reading = ""  # the file that is being read
        self._unmoved = ""
        self._link = ""  # one that is not followed
        self._left_out: dict[str, str] = {}
        self._looked = 0.0
        self._pool: ThreadPoolExecutor | None = None
        self._work: Future[object] | None = None

    @property
    def remark(self) -> str:
        """A link that is not followed, and temperatures that are left out, in words."""
        return " ".join(filter(None, (self._link, *self._left_out.values())))

    async def connect(self) -> str:
        """Look if the folder is there; answer what `IDENTITY` in it says, or else its path."""
        return await self._in_thread(self._connect)

    def _connect(self) -> str:
        if not self.path.is_dir():
            raise ControlAway(f"The folder {self.path} is not there: is the share mounted, and the path right?")
        try:
            next(self.path.iterdir(), None)
            identity = self.path / IDENTITY
            return read_plain(identity)[0].decode().strip() if os.path.lexists(identity) else str(self.path)
        except (OSError, UnicodeDecodeError) as error:
            raise Misconfigured(
                f"The folder {self.path} cannot be read: {error}. The bridge needs the right."
            ) from error

    async def close(self) -> None:
        """Let go of the folder."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None

    async def fetch(self, stored: Position) -> Sequence[Received]:
        """The readings of the oldest file that is complete."""
        del stored
        now = time.monotonic()
        if self._looked and now < self._looked + self.settings.every:
            return []
        first = not self._looked
        received = await self._in_thread(self._look)
        if first and self._known and not received:
            await asyncio.sleep(min(self.settings.every, self.machine.patience / 2))
            received = await self._in_thread(self._look)
        self._looked = 0.001 if received else time.monotonic()  # there may be more: look again at once
        if received:
            learn_ahead(self.clock, received, datetime.now().astimezone())
        return received

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """The file of these is stored: move it."""
        for name in {each.mark for each in received}:
            if name in self._taken:
                self._stored[name] = self._taken.pop(name)
        await self._in_thread(self._move_stored)

    @property
    def carries_decisions(self) -> bool:
        """A stop reaches those who look at the file."""
        return self.settings.decisions is not None

    async def decide(self, decided: Sequence[Decided]) -> None:
        """Write the file that says `stop` or `hold`, as a whole; a stop that is not removed stays."""
        stopping = [each for each in decided if each.action in STOPPING]
        if stopping and self.settings.decisions is not None:
            worst = max(reversed(stopping), key=lambda each: each.action == "stop")
            await self._in_thread(partial(self._write_decision, Path(self.settings.decisions), worst))

    def _write_decision(self, place: Path, decided: Decided) -> None:
        try:
            if decided.action != "stop" and place.exists():
                return
            new, content = place.with_name(f"{place.name}.new"), asdict(decided)
            del content["measure_next"]  # the file says stop or hold, and nothing in between
            write_new(new, json.dumps(content).encode())
            new.replace(place)
        except OSError as error:
            raise ControlAway(
                f"The decision {decided.action} cannot be written to {place}: {error.strerror or error}. May the bridge write"
                " there?"
            ) from error

    async def try_out(self) -> list[str]:
        """Make, move and delete a file as the bridge will do with those of the machine."""
        return await self._in_thread(self._try_out)

    async def _in_thread(self, work: Callable[[], T]) -> T:
        """Do something that a share may hold up, one at a time."""
        if self._work is not None and not self._work.done():
            if name := self._reading:
                raise ControlAway(f"The file {name} is still being read: it is large, or the share is slow.")
            raise ControlAway(f"The folder {self.path} has not answered yet: look at the share and the network.")
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, "folder")
        future = self._pool.submit(work)
        self._work = future  # type: ignore[assignment]
        try:
            return await asyncio.wrap_future(future)
        except OSError as error:
            raise ControlAway(f"The folder {self.path} does not answer: {error}.") from error

    # --- in the thread

    def _try_out(self) -> list[str]:
        return [words for words in (self._files_moved(), self._decision_written()) if words]

    def _decision_written(self) -> str:
        """The obstacle to writing the file of decisions, in words."""
        if self.settings.decisions is None:
            return ""
        place = Path(self.settings.decisions)
        probe = place.with_name(f".inband-check-{os.getpid()}.tmp")
        try:
            write_new(probe, b"")
            probe.unlink()
        except OSError as error:
            return f"A decision to stop cannot be written to {place} ({error.strerror or error}): the bridge needs the right to write in {place.parent}."
        return ""

    def _files_moved(self) -> str:
        """The obstacle to making and moving files, in words."""
        probe = self.path / f".inband-check-{os.getpid()}.tmp"
        made = []
        try:
            write_new(probe, b"")
            for name in (self.settings.done, self.settings.failed):
                folder = self.path / name
                if not folder.exists():
                    folder.mkdir(parents=True)
                    made.append(folder)
                probe = probe.rename(self._plain_folder(name) / probe.name)
        except OSError as error:
            return (
                f"A file cannot be written and moved in {self.path} ({error.strerror or error}): the bridge needs the right to"
                " write there, and in done and failed, which lie on the same disk or share. Nothing could be taken."
            )
        finally:
            with contextlib.suppress(OSError):
                probe.unlink(missing_ok=True)
                for folder in made:
                    folder.rmdir()
        return ""

    def _plain_folder(self, name: str) -> Path:
        folder = self.path / name
        if folder.parent == self.path and folder.is_symlink():
            raise NotPlain(0, f"{folder} is a link; make it a folder, or name the other place in the configuration")
        return folder

    def _look(self) -> list[Received]:
        self._move_stored()
        now = time.monotonic()
        before = self._known
        self._known = {}
        for seen in self._files():
            known = before.get(seen.name)
            since = known.since if known is not None and known.seen == seen else now
            self._known[seen.name] = _Known(seen, since, known.first if known is not None else now)
        for name in self._locked.keys() - self._known.keys():
            del self._locked[name]
        self._taken = {name: taken for name, taken in self._taken.items() if name in self._known}
        for seen, since, first in sorted(self._known.values(), key=lambda each: (each.seen.modified, each.seen.name)):
            if seen.name in self._stored:
                continue
            unchanged = now - since
            read = self._taken.get(seen.name)
            if read is not None and read[0] == seen:  # nobody waited any more for it: it took longer than a call may
                return read[1].received(self.machine.key, seen.name)
            content = self._read(seen, unchanged) if unchanged >= SAME_FOR * self.settings.every else None
            if content is None:
                if now - first < self.settings.settle:
                    break  # it is being written: later ones come after it
                continue
            if content.entries or content.faults:
                self._taken[seen.name] = (seen, content)
                self._note_temperatures(seen.name, content)
                return content.received(self.machine.key, seen.name)
            self._stored[seen.name] = (seen, content)  # all of it is passed over
        late = [(name, why) for name, (since, why) in self._locked.items() if now - since >= LOCKED_FOR]
        if late:
            name, why = late[0]
            raise ControlAway(
                f"The file {name} cannot be read: {why}. Does a program still hold it, has the bridge the right?"
            )
        if self._unmoved:
            raise Misconfigured(self._unmoved)
        return []

    def _files(self) -> list[Seen]:
        """Files, and pairs of AQDEF, that are there."""
        pattern = (self.settings.names or NAMES[self.settings.format]).lower()
        groups: dict[str, list[Path]] = {}
        links = []
        try:
            for path in self.path.iterdir():
                name = path.name.lower()
                hidden = name.startswith((".", "~")) or name.endswith(UNFINISHED) or name == IDENTITY
                if hidden or not fnmatch(name, pattern.lower()):
                    continue
                if path.is_symlink():
                    links.append(path.name)
                elif path.is_file():
                    pair = self.settings.format == "aqdef" and path.suffix.lower() in {".dfd", ".dfx"}
                    groups.setdefault(f"{path.stem.lower()}.df" if pair else path.name, []).append(path)
        except FileNotFoundError:
            raise ControlAway(f"The folder {self.path} is gone: is the share mounted?") from None
        self._link = (
            f"{min(links)} is a link, which is not followed: put the file itself into {self.path}." if links else ""
        )
        found = []
        for paths in groups.values():
            try:
                ordered = tuple(sorted(paths, key=lambda path: path.suffix.lower()))
                stats = [path.lstat() for path in ordered]
            except FileNotFoundError:
                continue  # renamed or taken away meanwhile
            found.append(Seen(ordered, tuple((stat.st_size, stat.st_mtime_ns) for stat in stats)))
        return found

    def _read(self, seen: Seen, unchanged: float) -> Content | None:
        """Read a file that two looks found the same; None where it has to be waited for."""
        size = sum(size for size, _ in seen.state)
        content = Content(digest=hashlib.sha256(repr((seen.name, seen.state)).encode()).hexdigest())
        pair = seen.paths[0].suffix.lower() in {".dfd", ".dfx"}
        lacks = pair and len(seen.paths) < NOT_ALONE
        if lacks or not all(size for size, _ in seen.state):
            if unchanged < self.settings.empty_after:
                return None
            words = "Of the pair .dfd and .dfx one file is missing." if lacks else "The file is empty."
            content.faults.append(Fault(None, "", f"{words} Let the measuring machine write it again."))
            return content
        if size > self.settings.largest * 1e6:
            words = (
                f"The file has {size / 1e6:.1f} MB, the most is {self.settings.largest:g}: part it, or raise largest."
            )
            content.faults.append(Fault(None, "", words))
            return content
        try:
            with tempfile.TemporaryDirectory(prefix="inband-") as folder:
                copies = []
                for path, state in zip(seen.paths, seen.state, strict=True):
                    held, about = read_plain(path)
                    if (about.st_size, about.st_mtime_ns) != state:
                        return None
                    copies.append(Path(folder, path.name))
                    copies[-1].write_bytes(held)
                if not self._is_as_seen(seen):
                    return None
                self._reading = seen.name
                content = read_content(
                    self.machine, tuple(copies), f"{seen.name}\0{seen.state}", self._grown.get(seen.name)
                )
        except FileNotFoundError:
            return None
        except OSError as error:
            since, _ = self._locked.get(seen.name, (time.monotonic(), ""))
            self._locked[seen.name] = (since, error.strerror or str(error))
            return None
        finally:
            self._reading = ""
        self._locked.pop(seen.name, None)
        if (content.faults or not content.complete) and unchanged < self.settings.settle:
            return None
        return content

    def _note_temperatures(self, name: str, content: Content) -> None:
        if content.faults:
            return  # nothing of it is stored
        for entry in content.entries:
            self._left_out = left_out_since(self._left_out, entry.body, {})
        self._left_out |= {field: f"File {name}, {words}." for field, words in content.left_out.items()}

    def _is_as_seen(self, seen: Seen) -> bool:
        stats = [path.lstat() for path in seen.paths if is_plain(path)]
        return tuple((stat.st_size, stat.st_mtime_ns) for stat in stats) == seen.state

    def _move_stored(self) -> None:
        self._unmoved = ""
        for name, (seen, content) in list(self._stored.items()):
            try:
                if not self._is_as_seen(seen):  # it has grown: read again; what is stored does not come twice
                    self._grown[name] = (content.digest, content.stamp)
                    del self._stored[name]
                    continue
                self._move(seen, content)
            except FileNotFoundError:
                pass  # renamed: it comes again under its new name, and nothing of it twice
            except OSError as error:
                self._unmoved = (
                    f"The file {name} is stored, but cannot be moved ({error.strerror or error}): the bridge needs the"
                    f" right to write in {self.path}; done and failed lie on the same disk or share."
                )
                continue
            del self._stored[name]
            self._grown.pop(name, None)
            self._known.pop(name, None)

    def _move(self, seen: Seen, content: Content) -> None:
        folder = self._plain_folder(self.settings.failed if content.faults else self.settings.done)
        folder.mkdir(parents=True, exist_ok=True)
        count = 1
        while any((folder / _numbered(path, count)).exists() for path in seen.paths):
            count += 1
        if content.faults:
            text = folder / f"{_numbered(seen.paths[-1], count)}.why.txt"
            write_new(text, _why(seen, content, self.path).encode())
            log.warning("%s: file %s has failed: %s", self.machine.key, seen.name, reasons(content.faults)[0])
        for path in seen.paths:
            path.rename(folder / _numbered(path, count))


def _numbered(path: Path, count: int) -> str:
    return path.name if count == 1 else f"{path.stem}-{count}{path.suffix}"


def _why(seen: Seen, content: Content, folder: Path) -> str:
    why = reasons(content.faults)
    lines = [
        f"Inband could not take this file ({seen.name}). Nothing of it was stored.",
        f"{datetime.now().astimezone().isoformat(timespec='seconds')}",
        "",
        *(f"- {reason}" for reason in why[:MOST_REASONS]),
    ]
    if len(why) > MOST_REASONS:
        lines.append(f"- and {len(why) - MOST_REASONS} more")
    lines += [
        "",
        f"What to do: correct the file, or the configuration of the bridge, and put the file back into {folder}.",
        "“inband bridge preview MACHINE FILE” says what each line would become.",
    ]
    return "\n".join(lines) + "\n"


def link(machine: Machine) -> Folder:
    """The link to a folder."""
    return Folder(machine)
