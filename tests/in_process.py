"""Inband in the process of the tests: the whole application on a real database, without a socket, for requests by the thousand."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import cache
from typing import Any

import httpx
from anyio.from_thread import BlockingPortal, start_blocking_portal
from fastapi import FastAPI
from starlette.types import ASGIApp, Message

from app.db.engine import Database
from app.language.times import keep_time_of, plant_time
from app.settings import Settings
from tests.servers import Server


class Direct(httpx.BaseTransport):
    """Hands requests to an application whose loop runs in a thread, as a server hands over what it has parsed.

    `httpx.ASGITransport` takes as long as the application. A fault that the application makes no answer of becomes a bare 500.
    """

    def __init__(self, asgi: ASGIApp, portal: BlockingPortal, settings: Settings) -> None:
        self.asgi = asgi
        self.portal = portal
        self.time = plant_time(settings)

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """Its answer, once it is complete."""
        request.read()
        return self.portal.call(self._answer, request)

    async def _answer(self, request: httpx.Request) -> httpx.Response:
        keep_time_of(self.time)
        said: list[Message] = []
        heard = iter([{"type": "http.request", "body": request.content, "more_body": False}])

        async def receive() -> Message:
            for message in heard:
                return message
            await asyncio.Event().wait()  # nobody hangs up
            return {"type": "http.disconnect"}

        async def send(message: Message) -> None:
            said.append(message)

        url = request.url
        scope = {
            "type": "http",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "method": request.method,
            "scheme": url.scheme,
            "server": (url.host, url.port),
            "client": ("127.0.0.1", 1),
            "root_path": "",
            "path": url.path,
            "raw_path": url.raw_path.partition(b"?")[0],
            "query_string": url.query,
            "headers": [(name.lower(), value) for name, value in request.headers.raw],
        }
        with suppress(Exception):
            await self.asgi(scope, receive, send)
        if not said:
            return httpx.Response(500)
        content = httpx.ByteStream(b"".join(part.get("body", b"") for part in said[1:]))
        return httpx.Response(said[0]["status"], headers=said[0]["headers"], stream=content)


@cache
def application() -> FastAPI:
    """One that no database stands behind, for what it says of itself: its OpenAPI document takes some seconds, once."""
    from app.main import create_plant

    return create_plant(Settings(database_url="postgresql://nobody@localhost/nothing")).app


class InProcess(Server):
    """What a running `Server` has, for an application in this process."""

    def __init__(self, database: Database, transport: httpx.BaseTransport, app: FastAPI) -> None:
        self.url, self.database = "http://inband.test", database
        self.transport, self.app = transport, app
        self._clients, self._kept = [], []

    def client(self, key: str | None = None, **headers: str) -> httpx.Client:
        """As `Server.client`."""
        if key is not None:
            headers["Authorization"] = f"Bearer {key}"
        made = httpx.Client(base_url=self.url, headers=headers, transport=self.transport)
        self._clients.append(made)
        return made


@asynccontextmanager
async def life_of(app: FastAPI) -> AsyncIterator[None]:
    """Begin it and end it in order, also after a test that failed."""
    life = app.router.lifespan_context(app)
    await life.__aenter__()
    try:
        yield
    finally:
        await life.__aexit__(None, None, None)


@contextmanager
def in_process(url: str, **settings: Any) -> Iterator[InProcess]:
    """The application on this database, with these settings."""
    from app.main import create_plant

    chosen = Settings(database_url=url, **settings)
    made, database = create_plant(chosen), Database(url, pool_size=2)
    running = None
    try:
        with start_blocking_portal() as portal, portal.wrap_async_context_manager(life_of(made.app)):
            running = InProcess(database, Direct(made.asgi, portal, chosen), made.app)
            yield running
    finally:
        if running is not None:
            running.hang_up()
        database.close()
