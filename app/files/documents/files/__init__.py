"""Reports as files. Pure: a report in, bytes out; the same report gives the same bytes."""

from app.files.documents.content import Format, Paper, Report
from app.files.documents.files.csv_file import csv_of
from app.files.documents.files.sheets import workbook

MEDIA_TYPES = {
    Format.PDF: "application/pdf",
    Format.XLSX: "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    Format.CSV: "text/csv; charset=utf-8",
}


def file_of(report: Report, as_: Format, paper: Paper = Paper.A4) -> bytes:
    """The report as one file."""
    match as_:
        case Format.PDF:
            from app.files.documents.files.pdf import (
                pdf_of,  # a second of fonts and layout that a server starts well without
            )

            return pdf_of(report, paper)
        case Format.XLSX:
            return workbook([report])
        case Format.CSV:
            return csv_of(report)


def file_name(report: Report, as_: Format) -> str:
    """A name that every file system takes: keys are slugs."""
    return f"report-{report.key}.{as_.value}"


__all__ = ["MEDIA_TYPES", "csv_of", "file_name", "file_of", "workbook"]
