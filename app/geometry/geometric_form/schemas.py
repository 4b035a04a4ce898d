"""Form measurements as they are sent. Lengths in mm."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from app.core.geometry.form import FormKind
from app.core.parameters import LARGEST_LENGTH
from app.language.i18n import _
from app.web.fields import IN_UM, Body, LatelyOrNow, Length, RecordKey, Slug, Text200

MOST_TOUCHES = 2000
MOST_SECTIONS = 200

KindName = Literal[
    "roundness",
    "straightness",
    "axis_straightness",
    "flatness",
    "coaxiality",
    "position",
    "parallelism",
    "perpendicularity",
]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
Flat = Annotated[list[Length], Field(min_length=2, max_length=2, examples=[[-6.096, 24.249]])]
Point = Annotated[list[Length], Field(min_length=2, max_length=3)]

OF_SECTIONS = {FormKind.ROUNDNESS, FormKind.AXIS_STRAIGHTNESS, FormKind.COAXIALITY, FormKind.POSITION}
OF_POINTS = {FormKind.STRAIGHTNESS, FormKind.FLATNESS}
WITH_DATUM = {FormKind.COAXIALITY, FormKind.PARALLELISM, FormKind.PERPENDICULARITY}
WITH_LENGTH = {FormKind.PARALLELISM, FormKind.PERPENDICULARITY}
ONLY_OF = {"datum": WITH_DATUM, "nominal": {FormKind.POSITION}, "length": WITH_LENGTH}


class FormSectionIn(Body):
    """One section of a bore or shaft: its touches, or its centre as the control says it."""

    height: Annotated[Length | None, Field(description="Z at which it was taken.")] = None
    touches: Annotated[
        list[Flat],
        Field(
            default_factory=list,
            max_length=MOST_TOUCHES,
            description="X and Y of each touch, of the tip's centre or of the surface.",
        ),
    ]
    centre: Annotated[Flat | None, Field(description="In place of touches: X and Y of the centre.")] = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if bool(self.touches) == (self.centre is not None):
            raise PydanticCustomError("section", _("say either touches or centre"))
        return self


class TouchedIn(Body):
    """Probed points of a datum: a bore or shaft in sections, or a surface in points."""

    sections: Annotated[
        list[FormSectionIn],
        Field(description="Of a bore or shaft: its sections.", default_factory=list, max_length=MOST_SECTIONS),
    ]
    points: Annotated[
        list[Point],
        Field(description="Of a surface: its points, X Y Z, mm.", default_factory=list, max_length=MOST_TOUCHES),
    ]


class FormIn(Body):
    """A form measurement: what was touched, of what kind it is, and what it is held against."""

    machine: Annotated[Slug, Field(description="The key of the machine.")]
    feature: Annotated[Slug, Field(description="A key of yours for what was touched: its measurements make a trend.")]
    kind: Annotated[KindName, Field(description="What is looked at.")]
    method: Annotated[
        Literal["minimum_zone", "least_squares", "printed"] | None,
        Field(
            description="By which the verdict goes; every method is answered. Not said: minimum zone, as ISO 1101 has it, "
            "where the kind has one. `printed` is the published method for axis straightness, which ignores heights."
        ),
    ] = None
    sections: Annotated[
        list[FormSectionIn], Field(default_factory=list, max_length=MOST_SECTIONS, description="Of a bore or shaft.")
    ]
    points: Annotated[
        list[Point],
        Field(
            default_factory=list,
            max_length=MOST_TOUCHES,
            description="Of a surface: X, Y, Z. Of a profile: along and across it.",
        ),
    ]
    datum: Annotated[
        TouchedIn | None, Field(description="For coaxiality, parallelism, perpendicularity: what it is held against.")
    ] = None
    nominal: Annotated[Flat | None, Field(description="For position: X and Y where the centre should be.")] = None
    length: Annotated[
        Positive | None,
        Field(
            description="For parallelism and perpendicularity: over which a tilt counts; else over the whole feature."
        ),
    ] = None
    tolerance: Annotated[NotNegative | None, IN_UM, Field(description="Greatest deviation that is good.")] = None
    repeatability: Annotated[
        NotNegative | None,
        IN_UM,
        Field(le=1, description="Standard deviation of a single touch; without it no uncertainty."),
    ] = None
    tip_diameter: Annotated[
        NotNegative | None, Field(description="Of the probe's tip, if the touches are those of its centre.")
    ] = None
    side: Annotated[
        Literal["inside", "outside"] | None, Field(description="Bore or shaft: the tip adds to it, or is taken off.")
    ] = None
    part: Annotated[Text200 | None, Field(max_length=128, description="Serial number of the part.")] = None
    measured_at: Annotated[LatelyOrNow | None, Field(description="If left out, when it came in.")] = None
    characteristic: Annotated[
        Slug | None, Field(description="A characteristic of the machine whose reading the result becomes.")
    ] = None
    key: RecordKey | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        kind = FormKind(self.kind)
        count = _touches(self.sections) + len(self.points)
        if self.datum is not None:
            count += _touches(self.datum.sections) + len(self.datum.points)
        if count > MOST_TOUCHES:
            raise PydanticCustomError(
                "touches",
                _("{count} touches are more than the {most} that are taken at once").format(
                    count=count, most=MOST_TOUCHES
                ),
            )
        for name, kinds in ONLY_OF.items():  # a datum that is passed over would make a verdict of something else
            if kind not in kinds and getattr(self, name) is not None:
                raise PydanticCustomError(
                    "not_of_kind", _("{name} means nothing for this kind").format(name=name), {"at": name}
                )
        if self.sections and self.points:
            raise PydanticCustomError("both", _("say either sections or points of the feature"), {"at": "points"})
        if kind in OF_SECTIONS and not self.sections:
            raise PydanticCustomError("sections", _("this kind needs sections"), {"at": "sections"})
        if kind in OF_POINTS and not self.points:
            raise PydanticCustomError("points", _("this kind needs points"), {"at": "points"})
        if kind in WITH_DATUM:
            self._with_datum()
        _depth(self.points, 2 if kind is FormKind.STRAIGHTNESS else 3, "points")
        if kind is FormKind.POSITION and self.nominal is None:
            raise PydanticCustomError(
                "nominal", _("position needs nominal: where the centre should be"), {"at": "nominal"}
            )
        if bool(self.tip_diameter) and self.side is None:
            raise PydanticCustomError(
                "side", _("tip_diameter needs side: inside for a bore, outside for a shaft"), {"at": "side"}
            )
        return self

    def _with_datum(self) -> None:
        if self.datum is None or not (self.datum.sections or self.datum.points):
            raise PydanticCustomError("datum", _("this kind needs a datum with sections or points"), {"at": "datum"})
        if self.datum.sections and self.datum.points:
            raise PydanticCustomError("both", _("say either sections or points of the datum"), {"at": "datum.points"})
        if not (self.sections or self.points):
            raise PydanticCustomError(
                "touched", _("this kind needs sections or points of the feature"), {"at": "sections"}
            )
        if FormKind(self.kind) is FormKind.COAXIALITY and not self.datum.sections:
            raise PydanticCustomError("datum", _("coaxiality needs a datum in sections"), {"at": "datum.sections"})
        _depth(self.datum.points, 3, "datum.points")


def _touches(sections: Sequence[FormSectionIn]) -> int:
    return sum(len(section.touches) or 1 for section in sections)


def _depth(points: Sequence[Sequence[float]], coordinates: int, name: str) -> None:
    wrong = next((at for at, point in enumerate(points, start=1) if len(point) != coordinates), None)
    if wrong is not None:
        raise PydanticCustomError(
            "coordinates",
            _("point {at} of {name} has not {count} coordinates").format(at=wrong, name=name, count=coordinates),
            {"at": name},
        )


def stored(body: FormIn) -> dict[str, Any]:
    """Inputs of a result as they are stored."""
    return body.model_dump(
        include={"sections", "points", "datum", "nominal", "length", "tip_diameter", "side"}, exclude_none=True
    )
