"""Files that wait to be imported: a workbook of 4 kB may be 200 MB as text, and the disk is the plant's."""

import io
import os
import time
from pathlib import Path

import pytest

from app.errors import NotFound
from app.loop.readings.importing import uploads
from app.settings import Settings


def sent(settings: Settings, owner: str, ago: float) -> str:
    """The token of a file that was sent so many seconds ago."""
    token = uploads.keep_pair(settings, owner, [("a.csv", io.BytesIO(b"measured\n40\n"))]).token
    for path in uploads.folder_of(settings).glob(f"{token}.*"):
        os.utime(path, (time.time() - ago,) * 2)
    return token


def test_of_one_person_the_newest_five_wait(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    other = sent(settings, "ivo", 900)
    first, *newest = [sent(settings, "ana", 700 - 100 * number) for number in range(6)]
    with pytest.raises(NotFound, match="sent five others since"):
        uploads.find(settings, "ana", first)
    kept = {
        token: uploads.find(settings, owner, token).path
        for owner, token in [("ivo", other), *(("ana", token) for token in newest)]
    }
    assert {path.name.partition(".")[0] for path in uploads.folder_of(settings).iterdir()} == kept.keys()


def test_a_file_without_its_description_is_nobodys(tmp_path: Path) -> None:
    """Another request is about to write it."""
    settings = Settings(data_dir=tmp_path)
    sent(settings, "ana", 0)
    (uploads.folder_of(settings) / "half.about").write_text("{")
    assert uploads.find(settings, "ana", sent(settings, "ana", 0))
