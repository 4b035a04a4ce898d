"""People and keys as JSON."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.access.callers import Role
from app.access.tables import ApiKey
from app.web.fields import Body, Text200


class PersonOut(BaseModel):
    """Somebody who signs in."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    name: str
    role: Role
    created_at: datetime
    disabled_at: datetime | None = Field(description="Since when they may not sign in any more; null if they may.")


class PersonChange(Body):
    """Changes of a person; what is left out stays."""

    role: Role | None = None
    disabled: Annotated[
        bool | None,
        Field(
            description="true: they may not sign in any more, and their browser sessions end; false: they may again."
        ),
    ] = None


class InvitationIn(Body):
    """The role that the invited person gets."""

    role: Role


class InvitationOut(BaseModel):
    """A one-time link, shown only this once; it works for seven days."""

    role: Role
    url: Annotated[str, Field(description="The address to open; the first who does becomes the person.")]


class RoleKeyIn(Body):
    """A key for a program, with a person's role."""

    name: Text200
    role: Role


class MachineKeyIn(Body):
    """A key for one machine."""

    name: Annotated[Text200, Field(description="What it is for, which tells it apart from others.")]


class KeyOut(BaseModel):
    """A key without its secret."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    name: str
    role: Role | None = Field(description="null for the key of a machine.")
    created_at: datetime
    last_used_at: datetime | None = Field(description="When it last called, to about a minute; null: never.")
    revoked_at: Annotated[datetime | None, Field(description="When it was revoked; null: it is valid.")]


class NewKeyOut(BaseModel):
    """A key just made. The secret is shown only this once and stored nowhere."""

    id: int
    name: str
    secret: Annotated[str, Field(description="Sent as `Authorization: Bearer SECRET`; shown this once.")]
    role: Role | None = None


def key_out(key: ApiKey) -> KeyOut:
    """Never with its hash."""
    return KeyOut.model_validate(key)


class ScreenIn(Body):
    """A wall screen."""

    name: Annotated[Text200, Field(description="Where it hangs, which tells it apart from others.")]


class ScreenOut(BaseModel):
    """A wall screen, without its key."""

    id: Annotated[int, Field(description="Number of the wall screen.")]
    name: str
    created_at: datetime
    created_by: Annotated[str, Field(description="Who made it.")]
    last_used_at: Annotated[datetime | None, Field(description="When it last looked, to about a minute; null: never.")]


class NewScreenOut(ScreenOut):
    """A wall screen just made. Its link is shown only this once and stored nowhere."""

    url: Annotated[str, Field(description="The link to open on the screen; behind the # is its key.")]
