"""From the rows of a study to what they say. Pure; lengths in mm."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, TypeVar

import numpy as np

from app.core.plausibility import inch_warnings
from app.core.spc.gauge import crossed
from app.core.spc.gauge.linearity import Linearity, linearity
from app.core.spc.gauge.single import Bias, TypeOne, bias, type_one
from app.core.spc.refusal import Floats, Refused
from app.core.warning import CodedWarning
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.quality.gauge_studies.schemas import MOST_VALUES

Row = Mapping[str, Any]
Result = TypeVar("Result")


@dataclass(frozen=True)
class Evaluation:
    """Results of a study; of each kind what belongs to it, or the `Refused` with the reason why there is none.

    block: parts x operators x trials. cut: values left out of cells that were longer than the shortest (method
    `fewest`). repeatability: sigma of one value, None where there is none.
    """

    bias: Bias | Refused | None = None
    type_one: TypeOne | Refused | None = None
    linearity: Linearity | Refused | None = None
    anova: crossed.Study | Refused | None = None
    ranges: crossed.Study | Refused | None = None
    parts: tuple[str, ...] = ()
    operators: tuple[str, ...] = ()
    block: Floats | None = None
    cut: int = 0

    @property
    def repeatability(self) -> float | None:
        """Sigma of one value."""
        if isinstance(self.anova, crossed.Study):
            return self.anova.equipment
        if isinstance(self.bias, Bias):
            return self.bias.repeatability
        return self.linearity.s if isinstance(self.linearity, Linearity) else None

    @property
    def freedom(self) -> int:
        """Degrees of freedom of that sigma."""
        if isinstance(self.anova, crossed.Study):
            return next(line.freedom for line in self.anova.table if line.source == "repeatability")
        if isinstance(self.bias, Bias):
            return self.bias.readings - 1
        return self.linearity.readings - 2 if isinstance(self.linearity, Linearity) else 0

    @property
    def refused(self) -> Refused | None:
        """Reason why the study has no result."""
        every = (self.bias, self.type_one, self.linearity, self.anova, self.ranges)
        return next((result for result in every if isinstance(result, Refused)), None)


def evaluate(kind: str, settings: Mapping[str, Any], rows: Sequence[Row]) -> Evaluation:
    """Evaluate rows that `design` has accepted."""
    if kind == "linearity":
        studies = {row["reference"]: row["values"] for row in rows}
        return Evaluation(linearity=_or_refused(lambda: linearity(studies)))
    if kind == "grr":
        parts, operators, cells = _cells(rows)
        fewest = min(map(len, cells.values()))
        block = np.array([[cells[part, operator][:fewest] for operator in operators] for part in parts], np.float64)
        return Evaluation(
            anova=_or_refused(lambda: crossed.by_anova(block)),
            ranges=_or_refused(lambda: crossed.by_average_and_range(block)),
            parts=parts,
            operators=operators,
            block=block,
            cut=sum(map(len, cells.values())) - block.size,
        )
    values, reference = rows[0]["values"], settings["reference"]
    result = _or_refused(lambda: bias(values, reference))
    if kind == "bias":
        return Evaluation(bias=result)
    first = _or_refused(
        lambda: type_one(values, reference, settings["tolerance"], resolution=settings.get("resolution"))
    )
    return Evaluation(bias=result, type_one=first)


def inches_in(settings: Mapping[str, Any], rows: Sequence[Row], target: float | None = None) -> list[CodedWarning]:
    """Return a warning for each reference and each value that looks like inches.

    target: of the characteristic that the study serves, mm. A value is held against the middle of all values of its
    reference, where these agree with each other.

    >>> [each.field for each in inches_in({"reference": 1.5748}, [{"values": [40.001, 40.0, 40.002]}])]
    ['reference']
    >>> [each.field for each in inches_in({}, [{"part": "1", "values": [40.001, 40.0, 1.5748]}])]
    ['rows[0].values[2]']
    """
    sizes: list[tuple[str, float, float]] = []
    middle_of_all = _middle([value for row in rows for value in row["values"]])
    for at, row in enumerate(rows):
        own = f"rows[{at}].reference" if row.get("reference") is not None else "reference"
        reference = row.get("reference", settings.get("reference"))
        middle = _middle(row["values"]) if row.get("reference") is not None else middle_of_all
        if reference is not None and middle is not None:
            sizes += [(own, reference, middle), (f"rows[{at}].values", middle, reference)]
        if middle is not None:
            sizes += [(f"rows[{at}].values[{n}]", value, middle) for n, value in enumerate(row["values"])]
            sizes += [(f"rows[{at}].values", middle, target)] if target is not None and at == 0 else []
    return inch_warnings(sizes)


def _middle(values: Sequence[float]) -> float | None:
    """Return the median, mm; None where most values are further from it than a tenth of it."""
    middle = median(values)
    return middle if median(abs(value - middle) for value in values) < abs(middle) / 10 else None


def _or_refused(compute: Callable[[], Result]) -> Result | Refused:
    try:
        return compute()
    except Refused as refused:
        return refused


def _cells(rows: Sequence[Row]) -> tuple[tuple[str, ...], tuple[str, ...], dict[tuple[str, str], list[float]]]:
    parts = tuple(dict.fromkeys(str(row["part"]) for row in rows))
    operators = tuple(dict.fromkeys(str(row["operator"]) for row in rows))
    return parts, operators, {(str(row["part"]), str(row["operator"])): list(row["values"]) for row in rows}


def design(kind: str, settings: Mapping[str, Any], rows: Sequence[Row]) -> None:
    """Refuse what is no study of this kind. Raises `Invalid` that names the rows."""
    wrong = [*_settings(kind, settings), *_rows(kind, rows)]
    if sum(len(row["values"]) for row in rows) > MOST_VALUES:
        wrong.append(FieldError("rows", _("holds more than {most} values").format(most=MOST_VALUES)))
    if not wrong and kind == "grr":
        wrong += _crossed(settings, rows)
    if wrong:
        raise Invalid(
            f"{wrong[0].field}: {wrong[0].message}.",
            _("Correct the named rows and send the study again."),
            errors=wrong,
        )


def _settings(kind: str, settings: Mapping[str, Any]) -> list[FieldError]:
    wrong = []
    if kind in {"type_one", "bias"} and settings.get("reference") is None:
        wrong.append(FieldError("reference", _("is missing: the true size of what was measured")))
    if kind == "type_one" and settings.get("tolerance") is None:
        wrong.append(FieldError("tolerance", _("is missing: Cg is a share of the tolerance")))
    return wrong


def _rows(kind: str, rows: Sequence[Row]) -> list[FieldError]:
    wrong = []
    if kind in {"type_one", "bias"}:
        if len(rows) > 1:
            wrong.append(FieldError("rows", _("one reference is measured here: one row holds all values")))
        if len(rows[0]["values"]) < 2:
            wrong.append(FieldError("rows[0].values", _("at least two values are needed")))
    for place, row in enumerate(rows):
        if kind == "linearity" and row.get("reference") is None:
            wrong.append(FieldError(f"rows[{place}].reference", _("is missing: the true size")))
        if kind == "grr":
            wrong += [
                FieldError(f"rows[{place}].{name}", _("is missing"))
                for name in ("part", "operator")
                if row.get(name) is None
            ]
    if kind == "linearity" and not wrong:
        references = [row["reference"] for row in rows]
        wrong += [
            FieldError(f"rows[{place}].reference", _("is there twice; put all values of a reference into one row"))
            for place, reference in enumerate(references)
            if reference in references[:place]
        ]
        if len(rows) < 2:
            wrong.append(FieldError("rows", _("a line needs two references at least; five are usual")))
    return wrong


def _crossed(settings: Mapping[str, Any], rows: Sequence[Row]) -> list[FieldError]:
    """Every operator measures every part once, each equally often."""
    wrong, seen = [], set()
    for place, row in enumerate(rows):
        cell = (str(row["part"]), str(row["operator"]))
        if cell in seen:
            words = _("part {part} by {operator} is there twice; put all its values into one row")
            wrong.append(FieldError(f"rows[{place}]", words.format(part=cell[0], operator=cell[1])))
        seen.add(cell)
    parts, operators, cells = _cells(rows)
    if len(parts) < 2:
        wrong.append(
            FieldError(
                "rows",
                _("one part does not show the differences between parts: at least two are needed, ten are usual"),
            )
        )
    missing = [(part, operator) for part in parts for operator in operators if (part, operator) not in cells]
    if missing:
        words = _("part {part} was not measured by {operator}: every operator measures every part")
        wrong.append(FieldError("rows", words.format(part=missing[0][0], operator=missing[0][1])))
    sizes = {len(values) for values in cells.values()}
    if not missing and len(sizes) > 1 and settings.get("unbalanced") != "fewest":
        fewest = min(cells, key=lambda cell: len(cells[cell]))
        words = _(
            "part {part} by {operator} has {have} values, others have {most}; measure what is missing, or take the fewest of every cell"
        )
        wrong.append(
            FieldError(
                "rows", words.format(part=fewest[0], operator=fewest[1], have=len(cells[fewest]), most=max(sizes))
            )
        )
    if not missing and min(sizes) < 2:
        wrong.append(FieldError("rows", _("every cell needs at least two values: one does not show repeatability")))
    return wrong
