"""Many reports in one file: what was asked for, and how the file is put together."""

import csv
import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal, NamedTuple

import msgspec

from app.core.period import Period
from app.files.documents.content import Format, Paper, Report
from app.files.documents.files import MEDIA_TYPES, file_of, workbook
from app.files.formats.delimited import defused
from app.views.reports.request import ReportRequest, SectionName, context_of
from app.web.choice import in_address

BundleFormat = Literal["pdf", "xlsx", "csv", "workbook"]
"""A ZIP of files, or one XLSX with a sheet for each."""
MOST_BYTES = 200_000_000


@dataclass(frozen=True)
class Bundle:
    """Reports of these characteristics and of all those of these machines."""

    request: ReportRequest
    form: BundleFormat
    characteristics: Sequence[str] = ()
    machines: Sequence[str] = ()
    language: str = "en"
    keys: Sequence[str] = field(default=())

    def stored(self, keys: Sequence[str]) -> dict[str, Any]:
        """As it is kept: everything named, so that it means the same tomorrow."""
        request = self.request
        return {
            "characteristics": list(keys),
            **in_address(request.period),
            "last": request.last,
            "sections": [name.value for name in request.sections],
            "paper": request.paper.value,
            "timezone": request.zone,
            "context": {field.value: value for field, value in request.context},
            "format": self.form,
            "language": self.language,
        }

    @classmethod
    def of(cls, stored: Mapping[str, Any]) -> "Bundle":
        """The request as it was kept."""
        start, end = (datetime.fromisoformat(stored[name]) if stored[name] else None for name in ("from", "to"))
        request = ReportRequest(
            Period(start, end),
            stored["last"],
            tuple(SectionName(name) for name in stored["sections"]),
            Paper(stored["paper"]),
            stored["timezone"],
            context=context_of(stored.get("context", {})),
        )
        return cls(request, stored["format"], language=stored["language"], keys=stored["characteristics"])

    def part(self, report: Report) -> bytes:
        """Stored part of one report until all are ready: its file, or for a workbook the report itself."""
        if self.form == "workbook":
            return msgspec.json.encode(report.without_pictures())
        return file_of(report, Format(self.form), self.request.paper)


class Part(NamedTuple):
    """One characteristic: what was made of it, or why nothing was."""

    key: str
    content: bytes | None
    trouble: str | None


def file_name(number: int, form: BundleFormat) -> str:
    """Name of the file."""
    return f"reports-{number}.xlsx" if form == "workbook" else f"reports-{number}.zip"


def media_type(form: BundleFormat) -> str:
    return MEDIA_TYPES[Format.XLSX] if form == "workbook" else "application/zip"


def packed(form: BundleFormat, parts: Sequence[Part], at: datetime) -> bytes:
    """The whole file. `at`: when it was asked for; stands as the time of every file in the ZIP."""
    if form == "workbook":
        reports = [msgspec.json.decode(part.content, type=Report) for part in parts if part.content is not None]
        return workbook(reports, [(part.key, part.trouble) for part in parts if part.trouble is not None])
    file = io.BytesIO()
    how = zipfile.ZIP_DEFLATED if form == "csv" else zipfile.ZIP_STORED
    with zipfile.ZipFile(file, "w") as whole:
        for name, content in [("summary.csv", _summary(form, parts)), *_files(form, parts)]:
            entry = zipfile.ZipInfo(name, max(at.timetuple()[:6], (1980, 1, 1, 0, 0, 0)))
            entry.compress_type = how
            entry.external_attr = 0o644 << 16
            whole.writestr(entry, content)
    return file.getvalue()


def _files(form: str, parts: Sequence[Part]) -> list[tuple[str, bytes]]:
    return [(f"report-{part.key}.{form}", part.content) for part in parts if part.content is not None]


def _summary(form: str, parts: Sequence[Part]) -> bytes:
    """Table with the result for every characteristic."""
    lines = io.StringIO(newline="")
    writer = csv.writer(lines, lineterminator="\r\n")
    writer.writerow(("characteristic", "file", "problem"))
    for part in parts:
        file = f"report-{part.key}.{form}" if part.content is not None else ""
        writer.writerow((defused(part.key), file, defused(part.trouble or "")))
    return ("\ufeff" + lines.getvalue()).encode()
