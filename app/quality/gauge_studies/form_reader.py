"""Reader of the form of a gauge study: settings, a grid of cells, tables pasted into it.

The grid has one line per part (gauge R&R) or reference (linearity), or as many as it takes (one reference); its cells are
fields `c_ROW_COLUMN`, counted from 0. Everything stays text until it is a study, so that nothing typed is lost.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from app.errors import FieldError, Invalid
from app.language.formatting import as_typed
from app.language.i18n import _
from app.quality.gauge_studies import table_reader
from app.quality.gauge_studies.table_reader import Unreadable, number
from app.web.forms import length

MOST_CELLS = 1_500  # of a grid on a page; the API takes more
PER_LINE = 10  # cells in a line where one reference is measured
SETTINGS = ("gauge", "reference", "tolerance", "resolution", "each", "unbalanced")
USUAL = {
    "type_one": {"lines": "5"},
    "bias": {"lines": "2"},
    "linearity": {"lines": "5", "trials": "10"},
    "grr": {"lines": "10", "operators": "A, B, C", "trials": "3"},
}


class Grid(NamedTuple):
    """Lines of cells as text. names: of the lines (parts, or references); operators: each has `trials` columns."""

    names: list[str]
    operators: list[str]
    trials: int
    cells: list[list[str]]

    @property
    def columns(self) -> int:
        """Cells in a line."""
        return max(1, len(self.operators)) * self.trials


def begun(kind: str, form: Mapping[str, str]) -> dict[str, str]:
    """The form with what is usual where nothing was typed."""
    return USUAL[kind] | {"each": "reading", "unbalanced": "refuse"} | {k: v for k, v in form.items() if v.strip()}


def shape(kind: str, form: Mapping[str, str]) -> Grid:
    """The empty grid of the lines, operators and trials that were typed. Raises `Invalid`."""
    typed = begun(kind, form)
    operators = operators_of(typed["operators"]) if kind == "grr" else []
    trials = _whole(typed, "trials", _("readings in a cell")) if kind in {"grr", "linearity"} else PER_LINE
    lines = _whole(typed, "lines", _("lines"))
    columns = max(1, len(operators)) * trials
    if lines * columns > MOST_CELLS:
        wrong = _("makes {cells} cells; at most {most} fit a page").format(cells=lines * columns, most=MOST_CELLS)
        raise _wrong("lines", wrong)
    names = [str(place + 1) for place in range(lines)] if kind == "grr" else [""] * lines
    return Grid(names, operators, trials, [[""] * columns for _line in range(lines)])


def operators_of(text: str) -> list[str]:
    """Names between commas. Raises `Invalid` for two of the same name, or none."""
    names = [name.strip() for name in text.replace(";", ",").split(",") if name.strip()]
    if not names or len(names) > 20 or len(set(names)) < len(names) or any(len(name) > 64 for name in names):
        raise _wrong("operators", _("needs 1 to 20 names, each once, with commas between them"))
    return names


def _whole(typed: Mapping[str, str], name: str, what: str) -> int:
    text = typed.get(name, "").strip()
    if not (text.isascii() and text.isdigit() and 0 < len(text) < 7 and int(text) > 0):
        raise _wrong(name, _("needs a whole number of {what}").format(what=what))
    return int(text)


def whole(form: Mapping[str, str], name: str) -> int:
    """The number of a reading. Raises `Invalid`."""
    text = form.get(name, "").strip()
    if not (text.isascii() and text.isdigit() and 0 < len(text) < 16 and int(text) > 0):
        raise _wrong(name, _("needs the number of a reading"))
    return int(text)


def typed_grid(kind: str, form: Mapping[str, str]) -> Grid:
    """The grid with what was typed into its cells. Raises `Invalid` as `shape` does."""
    grid = shape(kind, form)
    names = [form.get(f"name_{row}", name) for row, name in enumerate(grid.names)]
    cells = [[form.get(f"c_{row}_{column}", "") for column in range(grid.columns)] for row in range(len(grid.cells))]
    return grid._replace(names=names, cells=cells)


def stored_grid(kind: str, form: Mapping[str, str]) -> Grid:
    """Grid to store: the cells, or the table that was pasted while all cells are empty. Raises `Invalid`."""
    grid = typed_grid(kind, form)
    empty = not any(text.strip() for line in grid.cells for text in line)
    return pasted_grid(kind, form)[1] if empty and form.get("table", "").strip() else grid


def pasted_grid(kind: str, form: Mapping[str, str]) -> tuple[dict[str, str], Grid]:
    """The grid that a pasted table makes, and the form with its shape. Raises `Invalid` that names row and column."""
    text = form.get("table", "")
    if len(text) > table_reader.MOST_CHARACTERS:
        raise _wrong(
            "table", _("is longer than {most} characters; send it to the API").format(most=table_reader.MOST_CHARACTERS)
        )
    rows = table_reader.cells_of(text)
    heading = rows[0] if rows and table_reader.is_heading(rows[0]) else None
    body, first = (rows[1:], 2) if heading else (rows, 1)
    if not body:
        raise _wrong("table", _("holds no numbers; copy the cells of the spreadsheet and paste them here"))
    typed = begun(kind, form)
    long = table_reader.long_columns(heading) if kind == "grr" and heading else None
    try:
        body = table_reader.sizes_in_mm(heading, body, long.sizes if long else None)
    except Unreadable as wrong:
        raise _in_table(wrong, first, 1) from None
    if kind in {"type_one", "bias"}:
        single = [value for row in _numbers(body, first, 1) for value in row if value is not None]
        lines = -(-len(single) // PER_LINE)
        grid = shape(kind, typed | {"lines": str(lines)})
        texts = [as_typed(value) for value in single] + [""] * (lines * PER_LINE - len(single))
        cells = [texts[at : at + PER_LINE] for at in range(0, len(texts), PER_LINE)]
        return typed | {"lines": str(lines), "table": ""}, grid._replace(cells=cells)
    if long:
        return _long_grid(typed, body, first, long)
    columns = max(map(len, body))
    operators = operators_of(typed["operators"]) if kind == "grr" else []
    named = _has_names(kind, body, columns, max(1, len(operators)))
    names = [row[0] for row in body] if named else None
    values = _numbers([row[1:] if named else row for row in body], first, 2 if named else 1)
    width = columns - (1 if named else 0)
    if not width or width % max(1, len(operators)):
        words = _("has {columns} columns of values: they do not divide among {n} operators")
        raise _wrong("table", words.format(columns=width, n=len(operators)))
    typed |= {"lines": str(len(body)), "trials": str(width // max(1, len(operators))), "table": ""}
    grid = shape(kind, typed)
    cells = [[as_typed(value) for value in row] + [""] * (width - len(row)) for row in values]
    return typed, grid._replace(names=names or grid.names, cells=cells)


def _long_grid(
    typed: dict[str, str], body: Sequence[Sequence[str]], first: int, long: table_reader.Long
) -> tuple[dict[str, str], Grid]:
    """The grid of a table with one row a reading, or a part and an operator in each: trials in the order of the rows."""
    cells: dict[tuple[str, str], list[str]] = {}
    for at, row in enumerate(body, first):
        padded = [*row, *[""] * (1 + max(long.part, long.operator, *long.sizes) - len(row))]
        part, operator = padded[long.part], padded[long.operator]
        if not part or not operator:
            raise _wrong("table", _("row {row}: part or operator is empty").format(row=at))
        for place in long.sizes:
            [[size]] = _numbers([[padded[place]]], at, place + 1)
            cells.setdefault((part, operator), []).extend([] if size is None else [as_typed(size)])
    parts, operators = (list(dict.fromkeys(names)) for names in zip(*cells, strict=True))
    trials = max(map(len, cells.values()))
    typed |= {"lines": str(len(parts)), "trials": str(trials), "operators": ", ".join(operators), "table": ""}
    grid = shape("grr", typed)
    filled = {name: values + [""] * (trials - len(values)) for name, values in cells.items()}
    nothing = [""] * trials
    rows = [[text for operator in operators for text in filled.get((part, operator), nothing)] for part in parts]
    return typed, grid._replace(names=parts, cells=rows)


def _has_names(kind: str, body: Sequence[Sequence[str]], columns: int, operators: int) -> bool:
    """Tell if the first column names the lines: always the reference of linearity; of parts, if it must be."""
    if kind == "linearity":
        return True
    if any(row and row[0] and number(row[0]) is None for row in body):
        return True
    return columns % operators == 1 and operators > 1


def _numbers(body: Sequence[Sequence[str]], first: int, column: int) -> list[list[float | None]]:
    try:
        return table_reader.numbers(body)
    except Unreadable as wrong:
        raise _in_table(wrong, first, column) from None


def _in_table(wrong: Unreadable, first: int, column: int) -> Invalid:
    words = _("row {row}, column {column}: {what}")
    return _wrong("table", words.format(row=wrong.row + first - 1, column=wrong.column + column - 1, what=wrong))


def rows_of(kind: str, grid: Grid) -> list[dict[str, Any]]:
    """The filled grid as rows of the study. Raises `Invalid` that names each cell that is not a number, or empty in between."""
    wrong: list[FieldError] = []
    rows: list[dict[str, Any]] = []
    single: list[float] = []
    for row, (name, cells) in enumerate(zip(grid.names, grid.cells, strict=True)):
        if not any(cell.strip() for cell in cells):
            continue
        if kind in {"type_one", "bias"}:
            single += _values(grid, row, 0, cells, wrong, gaps=True)
        elif kind == "linearity":
            reference = length(name)
            if not isinstance(reference, float):
                wrong.append(FieldError(f"name_{row}", _("line {row} needs its true size").format(row=row + 1)))
            rows.append({"reference": reference, "values": _values(grid, row, 0, cells, wrong)})
        else:
            for place, operator in enumerate(grid.operators):
                at = place * grid.trials
                values = _values(grid, row, at, cells[at : at + grid.trials], wrong)
                rows.append({"part": name.strip() or str(row + 1), "operator": operator, "values": values})
    if wrong:
        raise Invalid(_("Some cells have to be corrected."), errors=wrong)
    if kind in {"type_one", "bias"}:
        rows = [{"values": single}] if single else []
    if not rows:
        raise _wrong("c_0_0", _("type the values into the grid, or paste them below"))
    for entry in rows:
        if not entry["values"]:
            words = _("part {part} was not measured by {operator}: every operator measures every part")
            raise _wrong("c_0_0", words.format(part=entry.get("part"), operator=entry.get("operator")))
    return rows


def _values(
    grid: Grid, row: int, at: int, cells: Sequence[str], wrong: list[FieldError], *, gaps: bool = False
) -> list[float]:
    """The numbers of a cell of the study, in order; empty fields at its end were not measured."""
    values: list[float] = []
    filled = [place for place, cell in enumerate(cells) if cell.strip()]
    for place in range(filled[-1] + 1 if filled else 0):
        value = number(cells[place]) if cells[place].strip() else None
        field, where = f"c_{row}_{at + place}", heading(grid, at + place)
        line = grid.names[row].strip() or str(row + 1)
        if value is not None:
            values.append(value)
        elif cells[place].strip():
            words = _("row {row}, column {column}: “{text}” is not a number")
            wrong.append(FieldError(field, words.format(row=line, column=where, text=cells[place].strip()[:30])))
        elif not gaps:
            wrong.append(FieldError(field, _("row {row}, column {column} is empty").format(row=line, column=where)))
    return values


def heading(grid: Grid, column: int) -> str:
    """Heading of a column.

    >>> heading(Grid([], ["A", "B"], 2, []), 3), heading(Grid([], [], 10, []), 3)
    ('B 2', '4')
    """
    if not grid.operators:
        return str(column + 1)
    return f"{grid.operators[column // grid.trials]} {column % grid.trials + 1}"


def grid_of(kind: str, rows: Sequence[Mapping[str, Any]]) -> tuple[dict[str, str], Grid]:
    """The grid, and the fields of its shape, that a stored study fills."""
    if kind in {"type_one", "bias"}:
        texts = [as_typed(value) for value in rows[0]["values"]]
        lines = -(-len(texts) // PER_LINE)
        texts += [""] * (lines * PER_LINE - len(texts))
        cells = [texts[at : at + PER_LINE] for at in range(0, len(texts), PER_LINE)]
        return {"lines": str(lines)}, Grid([""] * lines, [], PER_LINE, cells)
    trials = max(len(row["values"]) for row in rows)
    if kind == "linearity":
        names = [as_typed(row["reference"]) for row in rows]
        cells = [_filled(row["values"], trials) for row in rows]
        return {"lines": str(len(rows)), "trials": str(trials)}, Grid(names, [], trials, cells)
    names = list(dict.fromkeys(str(row["part"]) for row in rows))
    operators = list(dict.fromkeys(str(row["operator"]) for row in rows))
    by_cell = {(str(row["part"]), str(row["operator"])): row["values"] for row in rows}
    cells = [[text for o in operators for text in _filled(by_cell.get((name, o), []), trials)] for name in names]
    fields = {"lines": str(len(names)), "trials": str(trials), "operators": ", ".join(operators)}
    return fields, Grid(names, operators, trials, cells)


def _filled(values: Sequence[float], trials: int) -> list[str]:
    return [as_typed(value) for value in values] + [""] * (trials - len(values))


def even(grid: Grid) -> Grid:
    """The grid as one reads it: every value with as many decimals as the one that has most."""
    most = max((len(text.partition(".")[2]) for line in grid.cells for text in line), default=0)
    return grid._replace(cells=[[f"{float(text):.{most}f}" if text else "" for text in line] for line in grid.cells])


def typed_settings(settings: Mapping[str, Any]) -> dict[str, str]:
    """The settings as they would have been typed."""
    return {
        name: as_typed(value) if isinstance(value, float) else str(value)
        for name in SETTINGS
        if (value := settings.get(name)) is not None
    }


def _wrong(field: str, message: str) -> Invalid:
    return Invalid(message[:1].upper() + message[1:] + ".", errors=[FieldError(field, message)])
