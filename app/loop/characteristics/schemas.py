"""Characteristics as JSON. The parameters' schema is made from the core's table of them."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.core.decision.limits import nanometres
from app.core.parameters import (
    FIELDS,
    TWO_POINT_SWITCH,
    FieldKind,
    MachineType,
    ParameterError,
    Problem,
    read,
    unusual_natural,
    unusual_on,
    unusual_switch,
)
from app.core.plausibility import inch_warnings
from app.core.variants import FormResult
from app.loop.characteristics import bridged, queries, wording
from app.loop.tables.characteristics import ParametersVersion
from app.loop.warnings.wording import sentence
from app.web.fields import Body, Reason, Slug, Text200
from app.web.warnings import WarningOut, Warnings, warnings_out


def parameters_schema(*, given: bool = False) -> dict[str, Any]:
    """The JSON schema of `parameters`. given: as they are sent, each under its R number as well."""
    types = {
        FieldKind.LENGTH: "number",
        FieldKind.NUMBER: "number",
        FieldKind.WHOLE: "integer",
        FieldKind.CHOICE: "string",
        FieldKind.YES_NO: "boolean",
    }
    properties: dict[str, Any] = {}
    for field in FIELDS:
        words = [f"{field.r}." if field.r else "", f"{wording.label(field.name)}."]
        words += [wording.explanation(field.name) or "", "In mm." if field.kind is FieldKind.LENGTH else ""]
        properties[field.name] = {
            "type": [types[field.kind], "null"],
            "description": " ".join(word for word in words if word),
            **({"minimum": field.lowest} if field.lowest is not None else {}),
            **({"maximum": field.highest} if field.highest is not None else {}),
            **({"enum": [*field.choices, None]} if field.choices else {}),
            **({"default": field.default} if field.default is not None else {}),
        }
    properties["nominal"]["type"] = ["number", "string", "null"]  # a fit of ISO 286
    properties["accept"] = {  # a default that is an object is more than some generators of programs can write
        "type": ["object", "null"],
        "description": "Acceptance: n of m sections must be inside the tolerance; 1 of 1 where nothing is given.",
        "properties": {"n": {"type": "integer", "minimum": 1}, "m": {"type": "integer", "maximum": 100}},
    }
    if given:
        properties |= _under_r_numbers(properties)
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _under_r_numbers(properties: Mapping[str, Any]) -> dict[str, Any]:
    """Every parameter under its R number; choices by the numbers of the control, too.

    Those without `enum`: generators of programs make no type of one that holds texts and numbers.
    """
    numbered: dict[str, Any] = {}
    for field in FIELDS:
        if field.r is None:
            continue
        schema = dict(properties[field.name])
        schema.pop("default", None)  # is at the name
        words = f"The same as `{field.name}`"
        if field.codes:
            schema = {"type": ["integer", "string", "null"]}
            words += ": " + ", ".join(
                f"{code} is {choice}" for code, choice in zip(field.codes, field.choices, strict=False)
            )
        numbered[field.r] = schema | {"description": f"{words}."}
    numbered[TWO_POINT_SWITCH] = {"type": ["integer", "null"], "description": "Two-point measurement: 1, or 0."}
    return numbered


GivenParameters = Annotated[
    dict[str, Any],
    Field(
        description="The R parameters, by name or R number. R33 < R34 ≤ R35/2 ≤ R37 ≤ R36 must hold. "
        "`target` with `tolerance_width` may be given in place of nominal and deviations.",
        json_schema_extra=parameters_schema(given=True),
    ),
]
Part = Annotated[Text200, Field(description="The part it belongs to: drawing or article number.")]


class FormOf(Body):
    """A result of another characteristic's readings that this one is made of."""

    characteristic: Annotated[
        Slug, Field(description="The key of the characteristic that is probed, on the same machine.")
    ]
    result: Annotated[
        FormResult,
        Field(
            description="Which result of its readings: run_out (part indexed, R25 = 1), out_of_roundness (points round, R25 = 2), "
            "taper or straightness (points along, R25 = 3); taper without its sign."
        ),
    ]


class CharacteristicIn(Body):
    """A characteristic to set up."""

    key: Annotated[Slug, Field(description="Its name in addresses and readings; it cannot be changed later.")]
    name: Annotated[Text200, Field(description="What people call it, as on the drawing.")]
    machine: Annotated[
        str, Field(description="The key of the machine that cuts and measures it; it cannot be changed later.")
    ]
    part: Part | None = None
    unit: Annotated[Literal["mm"], Field(description="Of its lengths.")] = "mm"
    form_of: Annotated[
        FormOf | None,
        Field(
            description="Set up the form of another characteristic: each of its readings that has the result brings one here, in "
            "the same transaction and with the same key. Of `parameters` the limit is enough (`upper_deviation`, R40): 0 is the "
            "natural limit, nothing is corrected. Cannot be changed later.",
            examples=[{"characteristic": "flange-d62", "result": "out_of_roundness"}],
        ),
    ] = None
    parameters: GivenParameters


class CharacteristicChange(Body):
    """Change of a characteristic. Omitted fields and parameters stay; null resets a parameter to its default."""

    key: Annotated[Slug | None, Field(description="May be sent along, unchanged.")] = None
    name: Text200 | None = None
    machine: Annotated[str | None, Field(description="May be sent along, unchanged.")] = None
    part: Part | None = None
    unit: Annotated[Literal["mm"] | None, Field(description="Of its lengths.")] = None
    parameters: GivenParameters | None = None
    parameters_version: Annotated[
        int | None, Field(strict=True, ge=1, description="The version you looked at; 409 if there is a newer one.")
    ] = None
    reason: Annotated[Reason | None, Field(description="Why; required when parameters change.")] = None


class CharacteristicOut(BaseModel):
    """A characteristic as it is."""

    key: Annotated[str, Field(description="Its name in addresses and readings.")]
    name: str
    machine: str
    part: Annotated[str | None, Field(description="The part it belongs to: drawing or article number.")]
    unit: Annotated[str, Field(description="Of its lengths: mm.")]
    parameters: Annotated[
        dict[str, Any],
        Field(
            description="The R parameters by name, computed ones included; lengths in mm.",
            json_schema_extra=parameters_schema(),
        ),
    ]
    form_of: Annotated[
        FormOf | None, Field(description="Of a characteristic of form: what its readings are results of; else null.")
    ]
    parameters_version: Annotated[
        int, Field(description="Counts 1, 2, 3 …; readings keep the one they were judged by.")
    ]
    created_at: datetime
    warnings: Warnings


class VersionOut(BaseModel):
    """One version of the parameters; readings keep the version they were judged by."""

    version: Annotated[int, Field(description="Counts 1, 2, 3 …")]
    at: datetime
    by: str
    reason: str | None
    parameters: Annotated[
        dict[str, Any],
        Field(description="The R parameters by name; lengths in mm.", json_schema_extra=parameters_schema()),
    ]


def warnings_of(
    current: queries.CurrentCharacteristic,
    before: float | None = None,
    given: Mapping[str, Any] | None = None,
    superseded: Sequence[int] = (),
) -> list[WarningOut]:
    """Warn of what is outside the ranges of the sources, does not fit the machine, or is finer than its probe tells.

    before: the target of the version before, mm; one that is the same in inches is named. given: what was sent just now.
    superseded: corrections that fell with it, by number.
    """
    parameters, machine = current.parameters, current.machine
    try:
        unusual = read(parameters.as_dict())[1]
    except ParameterError:  # made when rules were others
        unusual = []
    unusual += unusual_on(parameters.as_dict(), MachineType(machine.type))
    unusual += unusual_switch(given or {})
    unusual += unusual_natural(given or {}, parameters, current.characteristic.name)
    if nanometres(parameters.zero_range) < nanometres(machine.zero_range_floor):
        values = {"value": parameters.zero_range, "floor": machine.zero_range_floor}
        unusual.append(Problem("zero_range", "signal_path", values, warning=True))
    inches = [] if before is None else inch_warnings([("parameters.target", parameters.target, before)])
    return [
        *warnings_out(inches, sentence),
        *wording.warnings(unusual),
        *bridged.warnings(current),
        *wording.superseded_warnings(superseded),
    ]


def characteristic_out(
    current: queries.CurrentCharacteristic,
    before: float | None = None,
    given: Mapping[str, Any] | None = None,
    superseded: Sequence[int] = (),
) -> CharacteristicOut:
    """Return a characteristic as it is answered. before, given, superseded: as `warnings_of` has them."""
    characteristic, machine, version, source = current.characteristic, current.machine, current.version, current.source
    return CharacteristicOut(
        key=characteristic.key,
        name=characteristic.name,
        machine=machine.key,
        part=characteristic.part,
        unit=characteristic.unit,
        parameters=wording.in_order(version.parameters),
        form_of=None
        if source is None or characteristic.form is None
        else FormOf(characteristic=source, result=FormResult(characteristic.form)),
        parameters_version=version.version,
        created_at=characteristic.created_at,
        warnings=warnings_of(current, before, given, superseded),
    )


def version_out(version: ParametersVersion) -> VersionOut:
    return VersionOut(
        version=version.version,
        at=version.created_at,
        by=version.created_by,
        reason=version.reason,
        parameters=wording.in_order(version.parameters),
    )
