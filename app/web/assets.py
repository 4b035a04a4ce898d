"""Files the browser loads: our own under `frontend/static` and plotly.js out of the installed plotly package.

Their URLs carry a hash of the content (`/static/<hash>/css/base.css`), so browsers may keep them for ever and still see
every new version. Our own tree has one hash for all its files: scripts name each other by relative paths, which stay inside
the tree. What belongs together is joined (`app.web.joining`) and hashed once, at start.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
import re
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from app import HOUSE
from app.web.joining import joined

STATIC_DIR = HOUSE / "frontend" / "static"
PLOTLY = "plotly.min.js"
FOREVER = "public, max-age=31536000, immutable"
COMPRESSIBLE = (".js", ".css", ".svg", ".json", ".txt", ".html")

mimetypes.add_type("text/javascript", ".js")


def _hash(*contents: bytes) -> str:
    digest = hashlib.sha256()
    for content in contents:
        digest.update(len(content).to_bytes(8, "big"))
        digest.update(content)
    return digest.hexdigest()[:12]


@dataclass
class Asset:
    """One file, read once; compressed on first demand."""

    name: str
    content: bytes
    version: str = ""
    media_type: str = field(init=False)

    def __post_init__(self) -> None:
        self.media_type = mimetypes.guess_type(self.name)[0] or "application/octet-stream"

    @cached_property
    def gzipped(self) -> bytes | None:
        return gzip.compress(self.content, 6, mtime=0) if self.name.endswith(COMPRESSIBLE) else None


class Assets:
    """The files by name; an ASGI application for `/static`."""

    def __init__(self, directory: Path = STATIC_DIR, prefix: str = "/static") -> None:
        self.prefix = prefix
        found = {
            path.relative_to(directory).as_posix(): path.read_bytes()
            for path in sorted(directory.rglob("*"))
            if path.is_file()
        }
        self._assets = {name: Asset(name, content) for name, content in joined(found).items()}
        tree = _hash(*(part for name, asset in self._assets.items() for part in (name.encode(), asset.content)))
        for asset in self._assets.values():
            asset.version = tree
        plotly = files("plotly").joinpath("package_data", PLOTLY).read_bytes()
        self._assets[PLOTLY] = Asset(PLOTLY, plotly, _hash(plotly))

    def url(self, name: str) -> str:
        """The address of a file. An unknown name is an error of the template, said at once.

        Raises:
            LookupError: no such file
        """
        try:
            return f"{self.prefix}/{self._assets[name].version}/{name}"
        except KeyError:
            raise LookupError(f"no static file named {name!r} in frontend/static") from None

    @cached_property
    def plotly_style_ids(self) -> str:
        """Ids of the style sheets that plotly.js would inject when it is loaded, which our CSP forbids.

        It skips a sheet whose element is there already; `plotly-chart.js` puts an empty one in its place.
        """
        ids = re.findall(rb'getElementById\("([0-9a-f]{64})"\)', self._assets[PLOTLY].content)
        return " ".join(sorted({i.decode() for i in ids}))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path: str = scope["path"].removeprefix(scope.get("root_path", "")).removeprefix(self.prefix).lstrip("/")
        version, _, name = path.partition("/")
        asset = self._assets.get(name)
        if asset is None or scope["method"] not in ("GET", "HEAD"):
            await PlainTextResponse("There is no such file.", 404)(scope, receive, send)
            return
        headers = {"Cache-Control": FOREVER if version == asset.version else "no-cache"}
        body = asset.content
        if asset.gzipped is not None:
            headers["Vary"] = "Accept-Encoding"
            if "gzip" in Headers(scope=scope).get("accept-encoding", ""):
                body, headers["Content-Encoding"] = asset.gzipped, "gzip"
        if scope["method"] == "HEAD":
            headers["Content-Length"] = str(len(body))
            body = b""
        await Response(body, media_type=asset.media_type, headers=headers)(scope, receive, send)
