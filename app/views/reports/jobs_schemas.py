"""Many reports at once as JSON."""

from datetime import datetime
from typing import Annotated, Any, Literal
from zoneinfo import ZoneInfo

from pydantic import Field

from app.core.context import ContextField
from app.files.documents.content import Paper
from app.language.i18n import current_language
from app.language.times import plant_zone
from app.views.reports.actions import KEPT_DAYS, MOST_AT_ONCE
from app.views.reports.bundle import Bundle, BundleFormat
from app.views.reports.request import ReportRequest, SectionName, context_of, section_names, zone_or_plants
from app.views.reports.tables import ReportJob
from app.web.choice import PeriodBody
from app.web.fields import LARGEST_ID, Body, Slug

Keys = Annotated[list[Slug], Field(max_length=MOST_AT_ONCE)]

Value = Annotated[str, Field(min_length=1, max_length=128)] | Annotated[int, Field(strict=True, ge=0, le=999_999)]


class ReportsIn(PeriodBody):
    """Request for reports: the characteristics (by name, or all of these machines), the period and the format.

    `format`: a ZIP of files, or one `workbook` with a sheet for each characteristic.
    """

    characteristics: Keys = Field(default=[], description="Keys of characteristics.")
    machines: Keys = Field(default=[], description="Keys of machines: all of their characteristics.")
    last: int | None = Field(
        default=None,
        strict=True,
        ge=1,
        le=LARGEST_ID,
        description="Of each only the last N readings; without period and context the last 1000. A very large number means all.",
    )
    sections: list[SectionName] = Field(
        default=[], max_length=len(SectionName), description="Only these sections; all of them where none is named."
    )
    format: Annotated[
        BundleFormat,
        Field(description="Of the files: a ZIP of them, or one `workbook` with a sheet for each characteristic."),
    ] = "pdf"
    paper: Paper = Paper.A4
    timezone: str | None = Field(
        default=None, max_length=64, description="In which moments are written; the plant's if left out."
    )
    context: dict[ContextField, Value] = Field(
        default={},
        description="Only readings with these values in their context; without `last` and period all of them.",
    )

    @classmethod
    def zone(cls, body: dict[str, Any]) -> ZoneInfo:
        """The time zone that is named, else the plant's."""
        name = body.get("timezone")
        return zone_or_plants(name if isinstance(name, str) else None)

    def bundle(self) -> Bundle:
        """Return the reports to make. Raises `Invalid`."""
        request = ReportRequest(
            self.period,
            self.last,
            section_names(self.sections),
            self.paper,
            self.timezone or plant_zone().key,
            context=context_of({field.value: str(value) for field, value in self.context.items()}),
        )
        return Bundle(request, self.format, self.characteristics, self.machines, current_language())


class TroubleOut(Body):
    """A characteristic without a report, and why."""

    characteristic: str
    problem: Annotated[str, Field(description="Why it has none, in words.")]


class ReportsOut(Body):
    """Progress of a request for reports. `done` of `total` characteristics are ready; `current` is worked on."""

    id: int
    state: Annotated[
        Literal["queued", "running", "done", "failed", "cancelled"],
        Field(description="Whether it waits, is worked on, or has ended."),
    ]
    done: Annotated[int, Field(description="Number of characteristics that are ready.")]
    total: Annotated[int, Field(description="Number of characteristics in all.")]
    current: Annotated[str | None, Field(description="Key of the characteristic that is worked on.")]
    format: Annotated[BundleFormat, Field(description="Of the files.")]
    asked_by: Annotated[str, Field(description="Who asked for them.")]
    asked_at: Annotated[datetime, Field(description="When.")]
    finished_at: Annotated[datetime | None, Field(description="When they ended; null: they have not.")]
    problem: str | None = Field(description="Why they failed.")
    problems: int = Field(description="How many characteristics have no report, once done.")
    without_report: list[TroubleOut] = Field(description="Which these are, and why; only where one job is asked for.")
    file: str | None = Field(description=f"Where the file is, once done; kept for {KEPT_DAYS} days.")
    size: int | None = Field(description="Of the file, in bytes.")

    @classmethod
    def of(cls, job: ReportJob, troubles: list[tuple[str, str]] | None = None) -> "ReportsOut":
        """As it is now."""
        return cls.model_validate(
            {
                "id": job.id,
                "state": job.state,
                "done": job.done,
                "total": job.total,
                "current": job.current,
                "format": job.request["format"],
                "asked_by": job.asked_by,
                "asked_at": job.asked_at,
                "finished_at": job.finished_at,
                "problem": job.trouble,
                "problems": job.problems,
                "without_report": [{"characteristic": key, "problem": why} for key, why in troubles or ()],
                "file": f"/api/v1/reports/{job.id}/file" if job.state == "done" else None,
                "size": job.size,
            }
        )
