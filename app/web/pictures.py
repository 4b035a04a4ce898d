"""Pictures that people send, by a form or as JSON, and how they are served.

@router.post("/alarms/{alarm}/photos")
@takes(AS_JSON, by="operator", pictures=True)
def add(..., given: PictureIn): picture_of(decoded(given.content))
"""

from base64 import b64decode
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, NamedTuple, Protocol

from fastapi import Depends, Path, Request, Response
from pydantic import BaseModel, Field
from starlette.datastructures import UploadFile
from starlette.responses import RedirectResponse

from app.errors import Invalid, TooLarge
from app.files.apart import Limits, apart
from app.files.formats.delimited import Unusable
from app.files.pictures import LARGEST, LONGEST_SIDE, Picture, drawn_again, looks_like_one
from app.language.i18n import _
from app.web.fields import Body
from app.web.limits import MEGABYTE

AS_JSON = 11 * MEGABYTE
"""Of `PictureIn` with the largest picture; base64 is a third longer."""
AS_FORM = LARGEST + MEGABYTE
LIMITS = Limits(seconds=10, memory=800 * MEGABYTE, written=20 * MEGABYTE)
Digest = Annotated[
    str,
    Field(pattern="^[0-9a-f]{64}$", description="Names a picture: the SHA-256 of what is kept, 64 hexadecimal digits."),
]
DigestPath = Annotated[str, Path(pattern="^[0-9a-f]{64}$", description="`digest` of the picture.", examples=["0" * 64])]
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The picture",
        "content": {
            media: {"schema": {"type": "string", "format": "binary"}, "example": "(the picture)"}
            for media in ("image/jpeg", "image/png")
        },
    }
}


class PictureIn(Body):
    """A picture."""

    content: Annotated[
        str,
        Field(
            min_length=1,
            max_length=AS_JSON,
            description="PNG, JPEG or WebP in base64, at most 8 MB before. It is drawn again, at most "
            f"{LONGEST_SIDE} points wide and high, without what the file says besides.",
            json_schema_extra={"contentEncoding": "base64"},
        ),
    ]


class PictureFields(BaseModel):
    """Facts about a picture, beside what it shows."""

    digest: Digest
    media_type: Annotated[str, Field(description="`image/jpeg` or `image/png`.")]
    width: Annotated[int, Field(description="In points, as it is kept.")]
    height: Annotated[int, Field(description="In points, as it is kept.")]
    size: Annotated[int, Field(description="Bytes, as it is kept.")]
    made_at: Annotated[datetime, Field(description="When it was sent.")]
    made_by: Annotated[str, Field(description="Who sent it.")]


class Kept(Protocol):
    """A stored picture."""

    @property
    def digest(self) -> str: ...

    @property
    def media_type(self) -> str: ...

    @property
    def content(self) -> bytes | None: ...


class SentFile(NamedTuple):
    """A file of a form. field: its name there."""

    field: str
    content: bytes


def decoded(text: str) -> bytes:
    """The bytes of a picture that came as JSON. Raises `Invalid`."""
    try:
        return b64decode(text, validate=True)
    except ValueError:
        raise Invalid.at("content", _("is not base64"), do=_("Encode the bytes of the picture in base64.")) from None


async def _files(request: Request) -> list[SentFile]:
    form = await request.form()
    sent = [(name, value) for name, value in form.multi_items() if isinstance(value, UploadFile) and value.filename]
    return [SentFile(name, await file.read(LARGEST + 1)) for name, file in sent]


FilesDep = Annotated[list[SentFile], Depends(_files)]
"""The files of the form that was sent; fields left empty are left out."""


def picture_of(content: bytes, field: str = "content") -> Picture:
    """The picture as it is kept, read in a process of its own: no transaction is held meanwhile.

    Raises `Invalid` for what is no picture, `TooLarge`, `TooManyRequests` while others are read.
    """
    if len(content) > LARGEST:
        raise TooLarge(
            _("The picture is larger than {most} MB.").format(most=LARGEST // MEGABYTE), _("Send a smaller one.")
        )
    kinds = _("Send a PNG, a JPEG or a WebP.")
    if not looks_like_one(content):
        raise Invalid.at(field, _("is no PNG, JPEG or WebP by what it holds"), do=kinds)
    try:
        return apart(drawn_again, content, limits=LIMITS, remedy="")
    except Unusable as error:
        raise Invalid.at(field, str(error).rstrip("."), do=kinds) from None


def pictures_of(files: Sequence[SentFile], most: int, field: str | None = None) -> list[tuple[str, Picture]]:
    """The pictures of a form with the field of each; `field` names it in an error, else its own. Raises as `picture_of`.

    Raises `Invalid` for more than `most`, before any of them is read: each takes a process.
    """
    if len(files) > most:
        raise Invalid.at(field or files[0].field, _("more than {most} pictures at once").format(most=most))
    return [(file.field, picture_of(file.content, field or file.field)) for file in files]


def served(request: Request, picture: Kept, cache: str) -> Response:
    """A picture, or 304 for the browser that has it. cache: for how long that may go without asking."""
    tag = f'"{picture.digest}"'
    headers = {"ETag": tag, "Cache-Control": f"private, {cache}", "X-Content-Type-Options": "nosniff"}
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(picture.content, media_type=picture.media_type, headers=headers)


def sent(request: Request, to: str) -> Response:
    """The answer to pictures that were kept: for a form the way to go on, for a script of ours nothing."""
    return Response(status_code=204) if request.headers.get("x-sent-by") == "script" else RedirectResponse(to, 303)
