"""Sinumerik: what the R numbers of one program come to. Which of two sizes counts, the misprint R44, codes as words."""

from typing import Any, NamedTuple

from app.core.parameters import BY_NAME, TWO_POINT_SWITCH, FieldKind, Variant
from app.core.programs.lines import DESCRIBING, Note, Program, ProgramKind, in_mm, mixed

ONLY_CALIBRATION = ("R21", "R22")
PROBES = {1: "axial", 2: "radial"}
RESULTS = ("R43", "R44", "R46", "R47", "R49")
POINTS_OF_CALIBRATION = "R23"  # which surface of the gauge is touched, as R21
RESULT_LENGTHS = ("R43", "R44", "R49")
OF_CALIBRATION = (*ONLY_CALIBRATION, *RESULTS, "points")


class Assigned(NamedTuple):
    """A value as it was assigned, lengths in mm. inch: the unit in effect was the inch; None where nothing said."""

    value: Any
    line: int
    r: str | None
    inch: bool | None = None


class Building:
    """One program while its lines are read."""

    def __init__(self, first_line: int) -> None:
        self.first_line = self.last_line = first_line
        self.kind: ProgramKind | None = None
        self.called = False
        self.mean_nominal = False
        self.called_in: list[bool | None] = []  # the unit in effect at each call
        self.assigned: dict[str, Assigned] = {}

    def __bool__(self) -> bool:
        return bool(self.assigned) or self.called


class _Assembly:
    """Makes a program of what was assigned; says beside the lines what was not taken as it is."""

    def __init__(self, built: Building, notes: list[list[Note]]) -> None:
        self.built, self.line_notes = built, notes
        self.values = dict(built.assigned)
        self.notes: list[Note] = []

    def made(self) -> Program:
        inch = self._unit()
        results = self._results()
        self._misprint()
        kind = self.built.kind or (ProgramKind.RESULTS if results else ProgramKind.ASSIGNMENTS)
        about: dict[str, str] = {name: self.values.pop(name).value for name in DESCRIBING if name in self.values}
        if kind is ProgramKind.CALIBRATION:
            parameters = self._calibration()
        elif kind is ProgramKind.RESULTS:
            parameters = {}
        else:
            parameters = self._measuring()
            if kind is ProgramKind.MEASURING and "tool_memory" not in parameters:
                self.notes.append(Note("no_tool", {}))
        return Program(
            kind,
            self.built.first_line,
            self.built.last_line,
            parameters,
            about,
            {},
            results,
            tuple(self.notes),
            inch,
        )

    def _unit(self) -> bool:
        """Tell if the lengths were in inches. Lengths of an ambiguous unit are dropped."""
        lengths = [
            name for name, assigned in self.values.items() if assigned.r is not None and _is_length(name, self.values)
        ]
        if not lengths:
            return False
        if mixed([*(self.values[name].inch for name in lengths), *self.built.called_in]):
            for name in lengths:
                self._drop(name, "unit_mixed")
            return False
        if not self.values[lengths[0]].inch:
            return False
        if "index" in lengths:  # R26 along the part: a distance, which only the variant tells
            index = self.values["index"]
            self.values["index"] = index._replace(value=in_mm(index.value, True))
            self._beside("index", "from_inch", value=self.values["index"].value)
        self.notes.append(Note("from_inch", {}))
        return True

    def _beside(self, name: str, code: str, **data: Any) -> None:
        assigned = self.values[name]
        self.line_notes[assigned.line - 1].append(Note(code, {"r": assigned.r or name} | data))

    def _rename(self, name: str, meaning: str) -> None:
        """Give the note of an assignment the meaning that the number has in this program."""
        notes = self.line_notes[self.values[name].line - 1]
        notes[:] = [
            Note(note.code, note.data | {"name": meaning})
            if note.code == "assigned" and note.data["name"] == name
            else note
            for note in notes
        ]

    def _drop(self, name: str, code: str = "not_used") -> None:
        if name in self.values:
            self._beside(name, code)
            del self.values[name]

    def _results(self) -> dict[str, float]:
        """Results that L92 leaves in R42 to R49. R43, the measured size, distinguishes them from the input of L75."""
        if "R43" not in self.values:
            for name in ("R46", "R47", "R49"):
                self._drop(name)
            return {}
        names = [*RESULTS, "nominal"]
        return {(self.values[name].r or name): self.values.pop(name).value for name in names if name in self.values}

    def _misprint(self) -> None:
        """The source prints R44 where R34 is meant."""
        if "R44" not in self.values:
            return
        if "averaging_limit" in self.values:
            self._drop("R44")
            return
        self._rename("R44", "averaging_limit")
        self._beside("R44", "r44_for_r34")
        self.values["averaging_limit"] = self.values.pop("R44")

    def _calibration(self) -> dict[str, Any]:
        if "points" in self.values:
            self._rename("points", POINTS_OF_CALIBRATION)
        points = self.values.pop("points", None)
        surface = self.values.pop("R21", None)
        probe = self.values.pop("R22", None)
        size = self.values.pop("target", None)
        if probe is not None and probe.value not in PROBES:
            self.values["R22"] = probe
            self._drop("R22")
            probe = None
        self._drop(TWO_POINT_SWITCH)
        parameters = self._named()
        if size is not None:
            parameters["gauge"] = size.value
        if surface is not None or points is not None:
            free = (surface is None or surface.value == 1) and (points is None or points.value == 0)
            parameters["surface"] = "free" if free else "groove"
        if probe is not None:
            parameters["probe"] = PROBES[probe.value]
        return parameters

    def _measuring(self) -> dict[str, Any]:
        for name in ONLY_CALIBRATION:
            self._drop(name)
        switch = self.values.pop(TWO_POINT_SWITCH, None)
        if switch is not None and switch.value != 0:
            if "variant" in self.values and self.values["variant"].r is not None:
                self._drop("variant", "two_point")
            self.values["variant"] = Assigned(Variant.TWO_POINT.value, switch.line, switch.r)
        self._size()
        return self._named()

    def _size(self) -> None:
        """Choose between the size of the drawing (L75) and the target."""
        drawing = ("nominal", "upper_deviation", "lower_deviation")
        direct = ("target", "tolerance_width")
        here = self.values
        if {"upper_deviation", "lower_deviation", "target"} <= here.keys() and not {
            "nominal",
            "tolerance_width",
        } & here.keys():
            here["nominal"] = here.pop("target")  # the later cycles: a set value with limits about it
        elif self.built.mean_nominal and all(name in here for name in drawing):
            for name in direct:
                self._drop(name, "l75_wins")
        elif all(name in here for name in direct):
            for name in drawing:
                self._drop(name)
        elif all(name in here for name in drawing):
            self.notes.append(Note("l75_missing", {}))
            for name in direct:
                self._drop(name)

    def _named(self) -> dict[str, Any]:
        order = [*BY_NAME, *(name for name in self.values if name not in BY_NAME)]
        return {name: _plain(name, self.values[name].value) for name in order if name in self.values}


def _is_length(name: str, values: dict[str, Assigned]) -> bool:
    if name == "index":
        variant = values.get("variant")
        return variant is not None and variant.value in (3, Variant.ALONG.value)
    field = BY_NAME.get(name)
    return name in RESULT_LENGTHS or (field is not None and field.kind is FieldKind.LENGTH)


def _plain(name: str, value: Any) -> Any:
    """A number as its parameter has it: whole, or the word for a code of the control."""
    field = BY_NAME.get(name)
    if field is None or not isinstance(value, float) or value != int(value):
        return value
    if field.kind is FieldKind.CHOICE:
        return field.choices[field.codes.index(int(value))] if value in field.codes else int(value)
    return int(value) if field.kind is FieldKind.WHOLE else value


def program_of(built: Building, notes: list[list[Note]]) -> Program:
    """The program of what was assigned. What was not taken as it is is said in the notes of its line."""
    return _Assembly(built, notes).made()
