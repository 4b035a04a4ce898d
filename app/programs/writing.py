"""A characteristic as program text of a control."""

import re
from typing import Literal, NamedTuple

from app.characteristics.queries import Standing
from app.core.programs import fanuc
from app.core.programs.sinumerik_writing import Calibration, write_calibration, write_measuring
from app.errors import FieldError, Invalid
from app.web.i18n import _

Kind = Literal["measuring", "calibration"]
WRITTEN = ("sinumerik", "fanuc")


def control_of(standing: Standing, control: str | None) -> str:
    """The control that was asked for, else the machine's. Raises `Invalid` where nothing is written for it."""
    control = control or standing.machine.control
    if control not in WRITTEN:
        wrong = _("must be sinumerik or fanuc: measuring programs are not written for {control}").format(
            control=control
        )
        raise Invalid(
            f"control: {wrong}.",
            _("Say for which control, for example control=sinumerik."),
            errors=[FieldError("control", wrong)],
        )
    return control


def program_of(
    standing: Standing,
    control: str,
    kind: Kind = "measuring",
    *,
    gauge: float | None = None,
    surface: Literal["free", "groove"] = "free",
    probe: Literal["axial", "radial"] = "axial",
) -> str:
    """The measuring program of a characteristic, or the calibration for its axis, direction and memory location.

    gauge: size of the gauge or ring, R32 or #505, mm; without it the target stands there, and the text says so.
    """
    characteristic, parameters = standing.characteristic, standing.parameters
    about = {"characteristic": characteristic.key, "name": characteristic.name, "part": characteristic.part or ""}
    if kind == "measuring":
        if control == "fanuc":
            return fanuc.write_measuring(parameters, about, {})
        return write_measuring(parameters, about)
    size = parameters.target if gauge is None else gauge
    if control == "fanuc":
        text = fanuc.write_calibration(size, about, {})
    else:
        text = write_calibration(Calibration(parameters, size, surface == "free", probe == "radial"), about)
    if gauge is not None:
        return text
    head, rest = text.split("\n", 1)
    where = "#505" if control == "fanuc" else "R32"
    return f"{head}\n({where} IS THE TARGET: WRITE THE SIZE OF YOUR GAUGE THERE)\n{rest}"


class Shown(NamedTuple):
    """A program text as pages show it."""

    text: str
    download: str
    file: str


def shown(standing: Standing) -> Shown | None:
    """The measuring program for the machine's own control; None where nothing is written for it."""
    control = standing.machine.control
    if control not in WRITTEN:
        return None
    download = f"/api/v1/characteristics/{standing.characteristic.key}/program"
    return Shown(program_of(standing, control), download, file_name(standing, control, "measuring"))


def file_name(standing: Standing, control: str, kind: Kind) -> str:
    """What the control calls such a program, with the key in front: `shaft-d40-L15.spf`."""
    key = re.sub(r"[^a-z0-9-]", "-", standing.characteristic.key)
    if control == "fanuc":
        return f"{key}-{kind}.nc"
    return f"{key}-{'L15' if kind == 'measuring' else 'L05'}.spf"
