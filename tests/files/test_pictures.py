"""Pictures of others are drawn again: nothing but their points comes along, and what is none is refused by what it holds."""

from io import BytesIO

import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from app.errors import Invalid, TooLarge
from app.files import pictures
from app.files.formats.delimited import Unusable
from app.files.pictures import LARGEST, LONGEST_SIDE, drawn_again
from app.web.pictures import decoded, picture_of
from tests.pictures import picture

SCRIPT = b"<script>alert(1)</script>"
GPS, ORIENTATION, ON_ITS_SIDE = 0x8825, 0x0112, 6


def opened(content: bytes) -> Image.Image:
    image = Image.open(BytesIO(content))
    image.load()
    return image


def test_a_photo_stands_upright_and_says_nothing_of_where_it_was_taken() -> None:
    exif = Image.Exif()
    exif[ORIENTATION] = ON_ITS_SIDE
    exif[GPS] = {1: "N", 2: (44.0, 48.0, 0.0)}
    photo = picture("JPEG", (400, 300), exif=exif, comment=b"hall 4, lathe 1")
    assert b"Exif" in photo
    kept = drawn_again(photo)
    assert (kept.media_type, kept.width, kept.height) == ("image/jpeg", 300, 400)
    assert b"Exif" not in kept.content
    assert b"hall 4" not in kept.content
    assert opened(kept.content).size == (300, 400)


def test_a_drawing_stays_one_without_its_texts_and_without_what_stands_behind_its_end() -> None:
    said = PngInfo()
    said.add_text("Author", "somebody's name")
    kept = drawn_again(picture(pnginfo=said) + SCRIPT)
    assert kept.media_type == "image/png"
    assert b"somebody" not in kept.content
    assert SCRIPT not in kept.content
    assert kept.columns["size"] == len(kept.content)


@pytest.mark.parametrize(("kind", "media_type"), [("WEBP", "image/jpeg"), ("PNG", "image/png"), ("JPEG", "image/jpeg")])
def test_it_is_as_large_as_a_tablet_shows_it(kind: str, media_type: str) -> None:
    kept = drawn_again(picture(kind, (2000, 100)))
    assert (kept.media_type, kept.width, kept.height) == (media_type, LONGEST_SIDE, 80)


def test_a_photo_that_came_as_a_drawing_is_kept_as_a_photo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "LARGEST_PNG", 10)
    target = BytesIO()
    Image.new("RGBA", (20, 20), (0, 0, 0, 0)).save(target, "PNG")
    kept = drawn_again(target.getvalue())
    assert kept.media_type == "image/jpeg"
    assert opened(kept.content).getpixel((5, 5)) == (255, 255, 255), "what nothing covers is paper"


def test_a_small_file_that_would_be_endless_is_refused_before_it_is_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "MOST_POINTS", 1000)
    with pytest.raises(Unusable, match="million points"):
        drawn_again(picture())


@pytest.mark.parametrize("content", [picture("JPEG")[:-200], picture()[:40], b"\x89PNG\r\n\x1a\n" + SCRIPT])
def test_what_is_cut_off_is_refused_in_words(content: bytes) -> None:
    with pytest.raises(Unusable, match="cannot be read"):
        drawn_again(content)


@pytest.mark.parametrize("content", [b"", b"<svg onload='alert(1)'/>", b"GIF89a", b"%PDF-1.7", b"RIFF1234WAVE"])
def test_what_is_no_picture_is_refused_by_what_it_holds(content: bytes) -> None:
    with pytest.raises(Invalid, match="no PNG, JPEG or WebP"):
        picture_of(content)


def test_what_is_too_much_is_refused_by_its_size() -> None:
    with pytest.raises(TooLarge, match="larger than 8 MB"):
        picture_of(b"\xff\xd8\xff" + bytes(LARGEST))
    with pytest.raises(Invalid, match="not base64"):
        decoded("no?")


def test_a_picture_of_a_camera_with_16_bits_of_grey_keeps_its_shades() -> None:
    content = BytesIO()
    Image.frombytes("I;16", (2, 1), b"\x2c\x01\x00\x80").save(content, "PNG")  # 300 and 32768 of 65535
    kept = opened(drawn_again(content.getvalue()).content).convert("L")
    assert list(kept.tobytes()) == pytest.approx([1, 128], abs=4)


def test_the_process_of_its_own_hands_it_back_or_says_why_not() -> None:
    content = picture()
    assert picture_of(content) == drawn_again(content)
    with pytest.raises(Invalid, match="may be cut off"):
        picture_of(content[:40], "photo")
