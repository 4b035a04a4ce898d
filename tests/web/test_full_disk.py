"""A full disk is said to be one, leaves nothing behind, and is no reason to stop."""

import errno
import io
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import psycopg
import pytest
from fastapi import FastAPI
from sqlalchemy.exc import OperationalError

from app.db import disk
from app.loop.readings.importing import uploads
from app.settings import Settings
from app.web import health
from app.web.problems import add_problem_handlers
from tests.loops import run


def application() -> FastAPI:
    async def nobody(_request: Any) -> None:
        raise AssertionError("no page is asked for")

    app = FastAPI()
    add_problem_handlers(app, nobody)
    return app


def get(app: FastAPI, path: str) -> httpx.Response:
    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://inband.test") as client:
            return await client.get(path)

    return run(ask())


FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    "error",
    [FULL, psycopg.errors.DiskFull("could not extend file"), OperationalError("", {}, psycopg.errors.DiskFull())],
)
def test_requests_are_answered_503_and_why(error: Exception) -> None:
    app = application()

    @app.get("/api/v1/anything")
    def anything() -> None:
        raise error

    answer = get(app, "/api/v1/anything")
    assert (answer.status_code, answer.json()["type"]) == (503, "urn:inband:problem:disk-full")
    assert "The disk of the server is full" in answer.json()["detail"]
    assert int(answer.headers["Retry-After"]) > 0


def test_the_server_is_not_ready_until_there_is_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    app = application()
    app.include_router(health.router)
    app.state.settings, app.state.replica = Settings(data_dir=tmp_path), None
    session = SimpleNamespace(execute=lambda _statement: None)
    app.state.database = SimpleNamespace(begin=lambda: nullcontext(session))
    assert get(app, "/health/ready").status_code == 200
    monkeypatch.setattr(disk, "NOTHING", 2**62)
    assert get(app, "/health/ready").json()["type"] == "urn:inband:problem:disk-full"
    monkeypatch.setattr(disk, "NOTHING", 0)
    assert get(app, "/health/ready").status_code == 200
    health.compiling.set()
    answer = get(app, "/health/ready")
    health.compiling.clear()
    assert (answer.status_code, answer.json()["type"]) == (503, "urn:inband:problem:compiling")
    assert "compiles what decides readings, once after an installation or upgrade" in answer.json()["detail"]
    assert get(app, "/health/ready").status_code == 200


@pytest.mark.parametrize("name", ["a.csv", "a.xlsx", "a.dfd"])
def test_nothing_is_left_of_a_file_that_was_not_taken(tmp_path: Path, name: str) -> None:
    class Cut(io.BytesIO):
        def read(self, _size: int | None = -1) -> bytes:
            if self.tell():
                raise FULL
            return super().read(10)

    files = (
        [(name, io.BytesIO(b"K0100 1\n")), ("a.dfx", Cut(b"0" * 99))] if name == "a.dfd" else [(name, Cut(b"0" * 99))]
    )
    settings = Settings(data_dir=tmp_path)
    with pytest.raises(OSError, match="No space left"):
        uploads.keep_pair(settings, "ana", files)
    assert list((tmp_path / "imports").iterdir()) == []
