"""The way to a server, for both clients: its address, the key, and whom to trust. Pure but for a certificate's file."""

import ssl
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

BASE = "/api/v1"
TIMEOUT = 10.0  # s
PATIENCE = 60.0  # s

Verify = bool | str | Path | ssl.SSLContext


def options(url: str, key: str, *, verify: Verify, timeout: float) -> dict[str, Any]:
    """Options of an `httpx` client. Raises `ValueError` for an address or a key that cannot be one."""
    return {
        "base_url": base_of(url),
        "headers": {"Authorization": f"Bearer {_checked(key)}", "User-Agent": "inband-client"},
        "timeout": timeout,
        "verify": _trusted(verify),
        "trust_env": False,  # a proxy of the office is none of the shop floor's
    }


def base_of(url: str) -> str:
    """The address of the API on a server; a plant's prefix stays.

    >>> base_of("https://inband.example/p/east/"), base_of("http://127.0.0.1:8000/api/v1")
    ('https://inband.example/p/east/api/v1', 'http://127.0.0.1:8000/api/v1')
    """
    parts = urlsplit(url.strip())
    if parts.scheme not in {"http", "https"} or not parts.hostname or parts.query or parts.fragment:
        raise ValueError(
            f"{url!r} is no address of a server; write it as https://inband.example or http://10.0.0.5:8000."
        )
    if parts.username is not None:
        raise ValueError("The address holds a name or password; give the key as the second argument, and nothing here.")
    return parts._replace(path=parts.path.rstrip("/").removesuffix(BASE) + BASE).geturl()


def _checked(key: str) -> str:
    key = key.strip()
    if not key or not key.isascii() or not key.isprintable() or " " in key:
        raise ValueError("This is no key: one is a single word of plain letters, as `inband key add` prints it.")
    return key


def _trusted(verify: Verify) -> bool | ssl.SSLContext:
    if isinstance(verify, str | Path):
        path = Path(verify)
        if not path.exists():
            raise ValueError(f"There is no file {path}; verify= names the certificate of the authority (PEM).")
        try:
            return ssl.create_default_context(
                cafile=None if path.is_dir() else str(path), capath=str(path) if path.is_dir() else None
            )
        except ssl.SSLError as error:
            raise ValueError(f"{path} holds no certificate that can be read (PEM): {error.reason}.") from error
    return verify
