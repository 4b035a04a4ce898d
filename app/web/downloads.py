"""Files to keep."""

from fastapi import Response


def download(content: bytes | str, name: str, media_type: str = "text/plain; charset=utf-8") -> Response:
    """A file with a name: never shown in the browser's place, never guessed at, never kept on the way."""
    headers = {
        "Content-Disposition": f'attachment; filename="{name}"',
        "Cache-Control": "no-store",
        "X-Content-Type-Options": "nosniff",
    }
    return Response(content, media_type=media_type, headers=headers)
