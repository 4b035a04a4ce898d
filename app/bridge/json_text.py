"""JSON of others, read so that it can be stored and sent on: what cannot be written again is refused here."""

import json
from typing import Any, Final

LARGEST: Final = 1e18
"""Of a number: more is not a size, and may become infinite when it is converted."""


def read_json(text: str | bytes) -> Any:
    """Read JSON.

    Raises `json.JSONDecodeError` or `UnicodeDecodeError` where it is no JSON, and `ValueError` with words that go behind a
    name, such as “holds NaN, which is not a number”.
    """
    try:
        content = json.loads(text, parse_constant=_no_number, parse_float=_number, parse_int=_whole)
        json.dumps(content, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("is no reading: its JSON is nested too deep") from None
    except UnicodeEncodeError:
        raise ValueError("holds half a character (a surrogate), which is no text") from None
    return content


def _no_number(text: str) -> None:
    raise ValueError(f"holds {text[:40]}, which is not a number")


def _number(text: str) -> float:
    value = float(text)
    if abs(value) > LARGEST:
        _no_number(text)
    return value


def _whole(text: str) -> int:
    if len(text) > len(f"{LARGEST:.0f}"):
        _no_number(text)
    return int(text)
