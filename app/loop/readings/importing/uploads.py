"""Files that came by browser, kept between the look at them and the import: readable by nobody else, gone after a day.

The newest five of a person stay: a workbook of 4 kB may be 200 MB as text.
"""

import json
import os
import re
import secrets
import shutil
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

from app.errors import Invalid, NotFound
from app.files.apart import apart, spend, sweep
from app.files.aqdef import description as aqdef
from app.files.formats import delimited, spreadsheet
from app.language.i18n import _
from app.settings import Settings

LASTS = 24 * 3600.0  # s
MOST = 5  # of one person
_TOKEN = re.compile(r"[A-Za-z0-9_-]{22}")


class Upload(NamedTuple):
    """A file that waits to be imported; `name` is what its owner calls it.

    path: its text. values: those of an AQDEF description, where they came in a file of their own. sheets: the sheets of a workbook, of which `sheet` is the one at `path`.
    """

    token: str
    name: str
    path: Path
    sheets: tuple[str, ...] = ()
    sheet: str = ""
    values: Path | None = None

    @property
    def is_aqdef(self) -> bool:
        """Tell by its name."""
        return Path(self.name).suffix.lower() in aqdef.ENDINGS


def keep_pair(settings: Settings, owner: str, files: Sequence[tuple[str, BinaryIO]]) -> Upload:
    """Keep a file, or the description and the values of AQDEF that were sent together; the sheets of a workbook as text.

    Raises `Invalid`, `TooManyRequests`, and `OSError` for a full disk.
    """
    endings = [Path(name).suffix.lower() for name, _content in files]
    if endings == [".dfx"]:
        raise Invalid.at("file", _("These are values alone: choose the .dfd that describes them too, both at once."))
    if len(files) > 1 and sorted(endings) != [".dfd", ".dfx"]:
        raise Invalid.at("file", _("Choose one file, or a .dfd and its .dfx."))
    files = sorted(files, key=lambda file: Path(file[0]).suffix.lower())
    folder = folder_of(settings)
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    _sweep(folder, owner)
    token = secrets.token_urlsafe(16)
    try:
        return _keep(folder, token, owner, files)
    except BaseException:
        _remove(folder, token)  # nothing is left of what was not taken: the disk may be full of it
        raise


def _keep(folder: Path, token: str, owner: str, files: Sequence[tuple[str, BinaryIO]]) -> Upload:
    path = folder / f"{token}.data"
    for target, (_name, content) in zip((path, folder / f"{token}.values"), files, strict=False):
        with _new(target) as file:
            shutil.copyfileobj(content, file)
    name = "".join(character for character in Path(files[0][0]).name if character.isprintable())[:100] or "file.csv"
    sheets = {}
    if Path(name).suffix.lower() in spreadsheet.ENDINGS:
        try:
            sheets = {sheet: text.name for sheet, text in apart(spreadsheet.texts, path, folder, token, spend).items()}
        except delimited.Unusable as error:
            raise Invalid.at("file", str(error).removesuffix(".")) from None
        path.unlink()
    with _new(folder / f"{token}.about") as file:
        file.write(json.dumps({"name": name, "owner": owner, "sheets": sheets}).encode())
    return Upload(token, name, path)


def _new(path: Path) -> BinaryIO:
    """A file that nobody else can read."""
    return os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb")


def _sweep(folder: Path, owner: str) -> None:
    """Make room for one more: files of yesterday go, this person's oldest, and what a killed server has left of one that it read."""
    own = []
    for old in folder.iterdir():
        with suppress(FileNotFoundError, ValueError):  # another request was faster, or still writes it
            at = old.stat().st_mtime
            if at < time.time() - LASTS:
                old.unlink()
            elif old.suffix == ".about" and json.loads(old.read_text())["owner"] == owner:
                own.append((at, old.stem))
    for _at, token in sorted(own)[: 1 - MOST]:
        _remove(folder, token)
    sweep()


def find(settings: Settings, owner: str, token: str, sheet: str = "") -> Upload:
    """The file that this person has sent; of a workbook the named sheet, else the first. Raises `NotFound`."""
    folder = folder_of(settings)
    if _TOKEN.fullmatch(token):
        try:
            about = json.loads((folder / f"{token}.about").read_text())
        except FileNotFoundError:
            about = {}
        sheets: dict[str, str] = about.get("sheets", {})
        sheet = sheet if sheet in sheets else next(iter(sheets), "")
        path = folder / sheets.get(sheet, f"{token}.data")
        if about.get("owner") == owner and path.exists():
            values = folder / f"{token}.values"
            return Upload(token, about["name"], path, tuple(sheets), sheet, values if values.exists() else None)
    raise NotFound(
        _(
            "This file is not here any more: it was imported, you sent it more than a day ago, or you have sent five others since."
        ),
        _("Send it again under Set-up, Import."),
    )


def forget(upload: Upload) -> None:
    """It was imported, or is not wanted."""
    _remove(upload.path.parent, upload.token)


def _remove(folder: Path, token: str) -> None:
    for path in folder.glob(f"{token}.*"):
        path.unlink(missing_ok=True)


def folder_of(settings: Settings) -> Path:
    """The folder in which they wait."""
    return settings.data_dir / "imports"
