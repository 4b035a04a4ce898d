"""Pictures for tests, drawn here."""

from base64 import b64encode
from io import BytesIO
from itertools import count
from typing import Any

from PIL import Image

_colours = count(1)


def picture(kind: str = "PNG", size: tuple[int, int] = (48, 32), **how: Any) -> bytes:
    """A picture that no other test has: the same one sent twice is one."""
    target = BytesIO()
    Image.new("RGB", size, next(_colours) * 997).save(target, kind, **how)
    return target.getvalue()


def as_json(content: bytes) -> dict[str, Any]:
    """It as the body of a request."""
    return {"content": b64encode(content).decode()}
