"""A report as JSON. Numbers in the unit that is beside them; lengths as people read them, in µm and mm."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from app.files.documents.content import Fact, Report, Section, Value


class ReportValueOut(BaseModel):
    """One value: the plain number or text, its unit, and the words of the page."""

    value: float | int | str | None = Field(description="A number in `unit`; moments in RFC 3339; else the text.")
    unit: str = Field(description="Of `value`; empty: it has none.")
    text: str

    @classmethod
    def of(cls, value: Value, report: Report) -> "ReportValueOut":
        """As the report words it."""
        plain = value.value if value.number is None else value.number
        return cls(value=plain, unit=value.unit, text=report.words(value))


class FactOut(ReportValueOut):
    """A value with its name and R number; `low` and `high` are the ends of its confidence interval."""

    key: str = Field(description="A stable name, for programs.")
    name: str
    code: str = Field(description="Its R number; empty: it has none.")
    note: str = Field(description="What belongs to it, in words; may be empty.")
    low: Annotated[float | int | None, Field(description="Low end of its confidence interval, in `unit`.")] = None
    high: Annotated[float | int | None, Field(description="High end of its confidence interval, in `unit`.")] = None

    @classmethod
    def of_fact(cls, fact: Fact, report: Report) -> "FactOut":
        """With everything that is beside it."""
        return cls(
            **ReportValueOut.of(fact.value, report).model_dump(),
            key=fact.key,
            name=fact.name,
            code=fact.code,
            note=fact.note,
            low=fact.low.number if fact.low else None,
            high=fact.high.number if fact.high else None,
        )


class ColumnOut(BaseModel):
    """A column of a table."""

    key: str = Field(description="A stable name, for programs.")
    name: str


class ReportTableOut(BaseModel):
    """Rows of values, one for each column; `more` rows are left out, the oldest."""

    columns: list[ColumnOut] = Field(description="The columns, from left to right.")
    rows: list[list[ReportValueOut]] = Field(description="The rows, each with a value for each column.")
    more: int = Field(description="Number of rows that are left out, the oldest.")


class SectionOut(BaseModel):
    """One part of the report."""

    key: str = Field(description="A stable name, for programs.")
    title: str = Field(description="Its heading.")
    sentences: list[str] = Field(description="What it says, in words.")
    warnings: list[str] = Field(description="What the numbers should not be read without.")
    facts: list[FactOut] = Field(description="Its numbers.")
    table: ReportTableOut | None = Field(description="Its table; null: it has none.")
    charts: list[str] = Field(description="Charts shown here on the page and in the PDF.")

    @classmethod
    def of(cls, section: Section, report: Report) -> "SectionOut":
        """All of it but the charts."""
        table = section.table
        return cls(
            key=section.key,
            title=section.title,
            sentences=list(section.sentences),
            warnings=list(section.warnings),
            facts=[FactOut.of_fact(fact, report) for fact in section.facts],
            table=None
            if table is None
            else ReportTableOut(
                columns=[ColumnOut(key=column.key, name=column.name) for column in table.columns],
                rows=[[ReportValueOut.of(value, report) for value in row] for row in table.rows],
                more=table.more,
            ),
            charts=[picture.key for picture in section.pictures],
        )


class ReportOut(BaseModel):
    """Report on a characteristic and a period, with the same content as page, PDF, XLSX and CSV."""

    characteristic: str
    name: str
    machine: str
    part: str = Field(description="What the characteristic belongs to; empty: it is not said.")
    period: str = Field(description="The readings that it is about, in words.")
    timezone: str = Field(description="In which moments are written.")
    made_at: datetime = Field(description="When the report was made.")
    warnings: list[str] = Field(description="Heading above everything else.")
    head: list[FactOut] = Field(description="What it is about: characteristic, machine, tolerance, period.")
    sections: list[SectionOut] = Field(description="Its sections, in the order of the page.")

    @classmethod
    def of(cls, report: Report) -> "ReportOut":
        """The whole report."""
        assert report.made_at.moment is not None
        return cls(
            characteristic=report.key,
            name=report.name,
            machine=report.machine,
            part=report.part,
            period=report.period,
            timezone=report.zone,
            made_at=report.made_at.moment,
            warnings=list(report.warnings),
            head=[FactOut.of_fact(fact, report) for fact in report.head],
            sections=[SectionOut.of(section, report) for section in report.sections],
        )
