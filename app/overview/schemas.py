"""The ranking as JSON."""

from pydantic import BaseModel, ConfigDict, Field

from app.overview import wording
from app.overview.queries import Ranked


class ReasonOut(BaseModel):
    """Why somebody is needed."""

    code: str
    text: str


class RankedOut(BaseModel):
    """A characteristic with what it is ranked by."""

    characteristic: str
    name: str
    machine: str
    state: str
    reasons: list[ReasonOut] = Field(description="The most urgent first; empty where nobody is needed.")
    ppk: float | None = Field(
        description="Of the last 200 readings at most, as if normally distributed; null of fewer than 20. Which index may be quoted, the capability of each says."
    )
    readings: int = Field(description="How many readings that is told of.")
    parts_left: float | None = Field(description="Parts until wear comes to the first limit, as foretold.")
    signals: list[int] = Field(description="Numbers of the open signals.")
    alarms: int = Field(description="Active alarms.")
    alarms_per_shift: float = Field(description="Alarms that parts gave per 8 hours, over the last 7 days.")


class Overview(BaseModel):
    """A page of the ranking."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "items": [
                    {
                        "characteristic": "plate-d30",
                        "name": "Bore Ø30 H7",
                        "machine": "mill-1",
                        "state": "correcting",
                        "reasons": [
                            {"code": "hunting", "text": "over-corrects"},
                            {"code": "barely_capable", "text": "Barely capable"},
                        ],
                        "ppk": 1.21,
                        "readings": 200,
                        "parts_left": 312.0,
                        "signals": [],
                        "alarms": 0,
                        "alarms_per_shift": 0.3,
                    }
                ],
                "next": None,
            }
        }
    )

    items: list[RankedOut]
    next: int | None = Field(description="`after` of the next page; null at the end.")

    @classmethod
    def of(cls, ranked: list[Ranked], after: int, limit: int) -> "Overview":
        """The page behind the first `after` ones."""
        shown = ranked[after : after + limit]
        return cls(
            items=[
                RankedOut(
                    characteristic=each.row.characteristic.key,
                    name=each.row.characteristic.name,
                    machine=each.machine.key,
                    state=each.told.state.value,
                    reasons=[ReasonOut(code=r.why.name.lower(), text=r.text) for r in wording.reasons(each)],
                    ppk=each.told.ppk,
                    readings=each.readings,
                    parts_left=each.told.parts_left,
                    signals=each.signals,
                    alarms=each.told.alarms,
                    alarms_per_shift=round(each.told.per_shift, 3),
                )
                for each in shown
            ],
            next=after + limit if after + limit < len(ranked) else None,
        )
