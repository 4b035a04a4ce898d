"""Pictures of others: PNG, JPEG and WebP by what they hold, whatever they are called, drawn again from their points alone.

What a file carries besides – place, camera, texts, further pictures, anything behind its end – does not come along. Read by
`app.files.apart`; Pillow, which ReportLab brings, is imported there and nowhere in the server.
"""

from hashlib import sha256
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

from app.files.formats.delimited import Unusable
from app.language.i18n import _

if TYPE_CHECKING:
    from PIL.Image import Image

LARGEST = 8_000_000
"""Bytes of a file as it is sent."""
MOST_POINTS = 60_000_000
LONGEST_SIDE = 1600
"""Points of a picture as it is kept: readable on a tablet, some hundred kB."""
QUALITY = 82
LARGEST_PNG = 400_000
"""Bytes of a drawing that stays without loss; a larger one is kept as a photo."""


class Picture(NamedTuple):
    """A picture as it is kept. width, height: points."""

    content: bytes
    media_type: str
    width: int
    height: int

    @property
    def digest(self) -> str:
        """The SHA-256 of its content, in hexadecimal digits: the same picture has the same everywhere."""
        return sha256(self.content).hexdigest()

    @property
    def columns(self) -> dict[str, Any]:
        """The columns that a table keeps of it."""
        return {**self._asdict(), "digest": self.digest, "size": len(self.content)}


def looks_like_one(content: bytes) -> bool:
    """Tell if it begins as a PNG, JPEG or WebP does: anything else needs no process to be refused in.

    >>> looks_like_one(b"<svg onload='alert(1)'/>"), looks_like_one(bytes.fromhex("89504e470d0a1a0a"))
    (False, True)
    """
    webp = content[:4] == b"RIFF" and content[8:12] == b"WEBP"
    return webp or content.startswith((b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"))


def drawn_again(content: bytes) -> Picture:
    """The picture, upright and at most `LONGEST_SIDE` wide and high. Raises `Unusable`."""
    from PIL import Image, ImageOps

    Image.MAX_IMAGE_PIXELS = None  # ours is checked here, in words
    try:
        with Image.open(BytesIO(content), formats=("PNG", "JPEG", "WEBP")) as opened:
            if opened.width * opened.height > MOST_POINTS:
                most = MOST_POINTS // 1_000_000
                raise Unusable(_("This picture has more than {most} million points.").format(most=most))
            as_png = opened.format == "PNG"
            opened.draft("RGB", (LONGEST_SIDE, LONGEST_SIDE))  # a JPEG is read no finer than it is kept
            image = ImageOps.exif_transpose(opened)
            if image.mode.startswith("I"):  # 16 bits of grey, which `convert` cuts off at 255
                image = image.point(lambda grey: grey / 256).convert("L")
            image = image.convert("RGBA" if image.has_transparency_data else "RGB")
    except (OSError, SyntaxError) as error:
        raise Unusable(_("This picture cannot be read; it may be cut off: {error}.").format(error=error)) from None
    image.info.clear()
    image.thumbnail((LONGEST_SIDE, LONGEST_SIDE))
    if as_png:
        drawing = _written(image, "PNG", optimize=True)
        if len(drawing) <= LARGEST_PNG:
            return Picture(drawing, "image/png", *image.size)
    if image.mode == "RGBA":
        image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB")
    return Picture(_written(image, "JPEG", quality=QUALITY, optimize=True), "image/jpeg", *image.size)


def _written(image: "Image", kind: str, **how: Any) -> bytes:
    target = BytesIO()
    image.save(target, kind, **how)
    return target.getvalue()
