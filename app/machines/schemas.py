"""Machines as JSON."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from app.web.fields import Body, Slug, Text200

Control = Annotated[
    Literal["sinumerik", "fanuc", "heidenhain", "other"], Field(description="Which family its control belongs to.")
]
MACHINE: dict[str, JsonValue] = {"key": "lathe-1", "name": "Lathe 1, hall B", "control": "sinumerik"}


class MachineIn(Body):
    """A machine to set up."""

    model_config = ConfigDict(json_schema_extra={"example": dict(MACHINE)})

    key: Annotated[Slug, Field(description="Its name in addresses and keys; it stays for good.")]
    name: Annotated[Text200, Field(description="What people call it.")]
    control: Control


class MachineChange(Body):
    """What to change; what is left out stays. The key stays for good, because programs call the machine by it."""

    model_config = ConfigDict(json_schema_extra={"example": {"name": "Lathe 1, hall C"}})

    key: Annotated[Slug | None, Field(description="May be sent along, unchanged.")] = None
    name: Text200 | None = None
    control: Control | None = None


class MachineOut(BaseModel):
    """A machine."""

    model_config = ConfigDict(
        from_attributes=True, json_schema_extra={"example": MACHINE | {"created_at": "2026-11-21T07:00:00Z"}}
    )

    key: str
    name: str
    control: Control
    created_at: datetime
