"""Gauge studies as they come in. Lengths in mm."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from app.core.parameters import LARGEST_LENGTH
from app.web.fields import LARGEST_ID, LARGEST_SERIAL, Body, Reason, RecordKey, Slug, Text200

StudyKind = Literal["type_one", "bias", "linearity", "grr"]
Value = Annotated[float, Field(strict=True, ge=-LARGEST_LENGTH, le=LARGEST_LENGTH, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
MOST_ROWS, MOST_IN_ROW, MOST_VALUES = 2_000, 1_000, 10_000


class RowIn(Body):
    """Values of one cell of the study: of one reference, or of one part by one operator."""

    part: Text200 | None = Field(None, max_length=64, description="Gauge R&R: which part.", examples=["3"])
    operator: Text200 | None = Field(
        None,
        max_length=64,
        description="Gauge R&R: who or what measured it; `1` where there is but one.",
        examples=["A"],
    )
    reference: Value | None = Field(None, description="Linearity: the true size, mm.", examples=[None])
    values: list[Value] = Field(
        min_length=1,
        max_length=MOST_IN_ROW,
        description="What was measured, in order of time, mm.",
        examples=[[40.001, 40.002]],
    )


def _in_cells(rows: list[RowIn]) -> list[RowIn]:
    """Rows of one value each are readings, one after the other: those of one part and operator make a cell."""
    if any(row.part is None or row.operator is None or len(row.values) > 1 for row in rows):
        return rows
    cells: dict[tuple[str | None, str | None], RowIn] = {}
    for row in rows:
        cell = cells.setdefault((row.part, row.operator), row.model_copy(update={"values": []}))
        cell.values.extend(row.values)
    return list(cells.values())


Rows = Annotated[
    list[RowIn],
    AfterValidator(_in_cells),
    Field(
        min_length=1,
        max_length=MOST_ROWS,
        description="One row for each cell; of gauge R&R also one for each reading, in order of time.",
    ),
]


class SettingsIn(Body):
    """Subject and settings of a study."""

    gauge: Text200 = Field(description="Which gauge or probe.", examples=["Probe T8, ruby 2 mm"])
    reference: Value | None = Field(None, description="True size of what is measured, mm: type 1 and bias.")
    tolerance: Positive | None = Field(
        None, description="Width of the tolerance, mm; that of the characteristic where it is not said."
    )
    resolution: Positive | None = Field(None, description="Smallest step that the gauge shows, mm.")
    each: Literal["reading", "touch"] = Field(
        "reading", description="Whether each value is a reading (mean of R27 touches) or a single touch."
    )
    unbalanced: Literal["refuse", "fewest"] = Field(
        "refuse",
        description="Gauge R&R with cells of unequal size: refuse them, or take of every cell its first values, as many as "
        "the smallest cell has.",
    )


class StudyIn(SettingsIn):
    """A gauge study with all its values."""

    kind: StudyKind = Field(description="type_one: Cg, Cgk. bias. linearity. grr: repeatability and reproducibility.")
    machine: Slug | None = Field(None, description="If left out, that of the characteristic.", examples=["lathe-1"])
    characteristic: Slug | None = Field(None, description="Which the study is to serve.", examples=["shaft-d40"])
    rows: Rows
    key: RecordKey | None = None


class FromReadingsIn(SettingsIn):
    """A gauge study of readings that are stored already: one part probed again and again."""

    kind: Literal["type_one", "bias", "grr"] = Field(
        description="grr: of touches alone, each reading is a part and its touches are the trials."
    )
    characteristic: Slug = Field(examples=["shaft-d40"])
    first: int = Field(strict=True, ge=1, le=LARGEST_ID, description="From this reading on.", examples=[788])
    through: int = Field(
        strict=True, ge=1, le=LARGEST_ID, description="To this reading, itself included.", examples=[812]
    )
    take: Literal["readings", "touches"] = Field(
        "readings", description="What each reading says, or the repeats at its first point."
    )
    key: Text200 | None = Field(None, max_length=128, description="As of POST /gauge-studies.")


class CorrectionIn(SettingsIn):
    """A study put right: settings and all values again, and why. The revision before stays on record."""

    rows: Rows
    reason: Reason
    seen_revision: Annotated[int, Field(strict=True, ge=1, le=LARGEST_SERIAL)] | None = Field(
        None, description="The revision that is put right: 409 if there is a newer one meanwhile."
    )
