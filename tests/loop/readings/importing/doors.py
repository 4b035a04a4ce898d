"""The doors by which files of others come in – command, page, REST, the bridge's preview – on one plant in this process."""

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import click
import typer

from app.bridge.configuration import configuration_from
from app.bridge.file_content import read_content
from app.cli import data
from app.errors import InbandError
from app.loop.readings import exporting, queries
from tests.in_process import InProcess
from tests.shop import Person, Shop

ZONE = "Europe/Belgrade"
D40: dict[str, Any] = {"target": 40.0, "tolerance_width": 0.1, "averaging_limit": 0.033333}
LENGTHS = {
    "40": D40,
    "0.1": D40 | {"target": 0.1, "tolerance_width": 0.2, "confidence_limit": 1.0},
    "16": D40 | {"target": 16.0},
    "2.167": D40 | {"target": 2.167},
    "1.25": D40 | {"target": 1.25},
    "0": D40 | {"target": 0.0},
    "1.016": D40 | {"target": 1.016},
}
MORNING = "2025-11-18T05:0{}:00"
Readings = list[tuple[float, str | None]]


def morning(*sizes: float) -> Readings:
    """Sizes of 18 November 2025, one a minute from 06:05 on."""
    return [(size, MORNING.format(5 + at)) for at, size in enumerate(sizes)]


class Plant:
    """The plant of these tests, and what came of a file at each door."""

    def __init__(self, house: InProcess) -> None:
        self.house, self.shop, self.engineer = house, Shop(house), Person(house, "engineer")

    def stored(self, key: str) -> Readings:
        with self.house.database.begin() as session:
            entry = queries.entry_of(session, key)
            assert entry is not None
            return [
                (row["measured"], row["measured_at"].astimezone(UTC).replace(tzinfo=None).isoformat())
                for row in exporting.rows(session, entry)
            ]

    def command(self, path: Path, **options: Any) -> str:
        """What the command says; the error that it ends with."""
        try:
            data.import_file(path, timezone=ZONE, database_url=self.house.database.dsn, **options)
        except (typer.Exit, typer.BadParameter, click.ClickException, InbandError) as error:
            return f"refused {error}"
        return ""

    def table(self, path: Path, text: str, **given: Any) -> dict[str, Any]:
        """The answer of REST, and its status."""
        sent = {"name": path.name, "content": text, **given}
        answer = self.shop.admin.post("/api/v1/readings/table", json=sent)
        assert answer.status_code in {200, 422}, answer.text
        content: dict[str, Any] = answer.json()
        return content | {"status": answer.status_code}

    def page(self, path: Path, characteristic: str = "", **said: str) -> str:
        """The page of the refusal, after the preview said the same; nothing where it was imported."""
        browser, csrf = self.engineer.browser, self.engineer.csrf()
        sent = browser.post(
            "/import",
            data={"csrf": csrf, "characteristic": characteristic},
            files={"file": (path.name, path.read_bytes())},
        )
        if sent.status_code == 422:
            return f"refused {sent.text}"
        assert sent.status_code == 200, sent.text
        token = re.search(r"/import/([\w-]{22})", str(sent.url))
        assert token is not None
        said = {"characteristic": characteristic, "timezone": ZONE} | said
        preview = browser.get(f"/import/{token[1]}", params=said)
        assert preview.status_code == 200
        if not characteristic:
            said |= dict(re.findall(r'<input type="hidden" name="(to_\d+)" value="([^"]*)"', preview.text))
        answer = browser.post(f"/import/{token[1]}", data=said | {"csrf": csrf}, follow_redirects=False)
        refused = answer.status_code != 303
        assert refused == ("disabled" in preview.text[: preview.text.index("Import all")][-200:]), "preview and import"
        return f"refused {answer.text}" if refused else ""


def bridged(path: Path, names: dict[str, str], **settings: Any) -> tuple[Readings, list[int | None], str]:
    """Sizes and moments that the bridge would send, the lines of its faults, and their words."""
    table = {"kind": "folder", "unit": "mm", "secret": "x", "corrections": "none", "characteristics": names}
    folder = {"path": str(path.parent), "format": "csv", "zone": ZONE} | settings
    content = {"server": {"url": "http://127.0.0.1:1"}, "machine": {"cmm-1": table | {"folder": folder}}}
    found = read_content(configuration_from(content, path.parent).machines[0], (path,), path.name)
    readings = [(each.body["measured"], in_utc(each.body.get("measured_at"))) for each in found.entries]
    return readings, [fault.line for fault in found.faults], " ".join(map(str, found.faults))


def in_utc(moment: str | None) -> str | None:
    return moment and datetime.fromisoformat(moment).astimezone(UTC).replace(tzinfo=None).isoformat()
