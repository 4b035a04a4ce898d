"""Serving every plant of the list from one process: each has an application of its own, which is begun and ended by itself.

The list is read every few seconds, so a plant that is added or removed needs no restart. A plant that cannot be begun takes no
other along; it is tried again.
"""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from typing import NamedTuple
from urllib.parse import urlsplit

import psycopg
from fastapi import FastAPI
from pydantic import ValidationError
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from app.db.connections import Connections, in_schema
from app.db.migrate import current, head
from app.db.outage import Outage
from app.errors import PROBLEM_JSON, DatabaseAway
from app.language.times import PlantTime, keep_time_of, plant_time
from app.plants.prefix import OwnCookies
from app.plants.registry import Plant, plants
from app.settings import Settings
from app.web.problems import is_for_programs

log = logging.getLogger(__name__)

EVERY = 3.0  # s between two looks at the list


class PlantSettings(Settings):
    """The settings of the server as they hold for one plant."""

    plant: str = ""
    """Its name, which is beside the program's on every page."""
    prefix: str = ""

    @property
    def address(self) -> str:
        """Address that a person types to get to this plant."""
        return super().address + self.prefix


class Application(NamedTuple):
    """The application of one plant: what begins and ends, and what requests go to."""

    app: FastAPI
    asgi: ASGIApp


MakeApplication = Callable[[Settings, str], Application]
"""Makes the application of a plant with these settings, served below this prefix."""


def settings_of(plant: Plant, settings: Settings) -> PlantSettings:
    """The settings for a plant. Raises `ValidationError` for a time zone or shifts that do not exist."""
    assert settings.database_url is not None
    own = {"timezone": plant.timezone, "shifts": plant.shifts}
    if plant.host:
        address = urlsplit(settings.address)
        port = f":{address.port}" if address.port else ""
        own["public_url"] = f"{address.scheme}://{plant.host}{port}"
    return PlantSettings(
        **settings.model_dump()
        | {name: value for name, value in own.items() if value}
        | {
            "database_url": in_schema(settings.database_url, plant.schema),
            "schema_name": plant.schema,
            "prefix": plant.prefix,
            "plant": plant.name,
        }
    )


class Served:
    """A plant that is served: its application runs in a task of its own, which keeps the time of the plant."""

    def __init__(self, plant: Plant, settings: Settings, make: MakeApplication) -> None:
        self.plant = plant
        self.settings = settings_of(plant, settings)
        self.application = make(self.settings, plant.prefix)
        self.time: PlantTime = plant_time(self.settings)
        asgi = self.application.asgi
        self._asgi: ASGIApp = OwnCookies(asgi, plant.key, plant.prefix) if plant.prefix else asgi
        self.ready = asyncio.Event()
        self._ending = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Begin; `ready` is set when requests are taken."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name=f"plant {self.plant.key}")

    async def end(self) -> None:
        """End the application in order."""
        self._ending.set()
        if self._task is not None:
            await self._task

    @property
    def failed(self) -> bool:
        """Tell if the application has ended by itself."""
        return self._task is not None and self._task.done()

    async def _run(self) -> None:
        keep_time_of(self.time)
        try:
            async with self.application.app.router.lifespan_context(self.application.app):
                self.ready.set()
                await self._ending.wait()
        except Exception:
            log.exception("plant %s could not be served; it is tried again", self.plant.key)
        finally:
            self.ready.clear()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, with a path from the root of the plant."""
        keep_time_of(self.time)
        await self._asgi(scope, receive, send)


class Plants:
    """ASGI application of a server process: hands each request to the plant of its address.

    The plant in the server's own schema is served from the root, the overview of all plants at ``/plants``. Where plants are
    listed and the own schema holds none, everything else leads to the overview.
    """

    def __init__(
        self,
        settings: Settings,
        make: MakeApplication,
        front: FastAPI,
        process: AbstractAsyncContextManager[None],
    ) -> None:
        """front: the application of the overview; its lifespan becomes that of all. process: what runs once for all plants."""
        assert settings.database_url is not None
        self.settings = settings
        self._make = make
        self.front = front
        self._process = process
        url = settings.database_url
        if settings.schema_name is not None:
            url = in_schema(url, settings.schema_name)
        self.own = make(settings.model_copy(update={"database_url": url}), "")
        self._own_there = True
        self._url = url
        self._head = head()
        self._connections = Connections(url, settings.database_patience)
        self._served: dict[str, Served] = {}
        self._listed: Sequence[Plant] = []
        self._withheld: dict[str, str] = {}
        self._reported: dict[str, str] = {}
        self._outage = Outage(log, "looks at the list of plants")
        front.state.plants = self
        front.router.lifespan_context = self._lifespan

    @property
    def served(self) -> Sequence[Served]:
        """The plants that take requests, by name."""
        return [each for each in self._served.values() if each.ready.is_set()]

    @property
    def not_served(self) -> Sequence[Plant]:
        """The plants of the list that take no requests."""
        return [
            plant for plant in self._listed if not (known := self._served.get(plant.key)) or not known.ready.is_set()
        ]

    @asynccontextmanager
    async def _lifespan(self, _app: FastAPI) -> AsyncIterator[None]:
        follows = self.settings.schema_name is None  # else it is the server of one plant
        async with AsyncExitStack() as stack:
            if follows:
                await self._look()
            if self._own_there:
                await stack.enter_async_context(self.own.app.router.lifespan_context(self.own.app))
            stack.push_async_callback(self._end)
            for each in self._served.values():
                with suppress(TimeoutError):
                    async with asyncio.timeout(self.settings.database_patience):
                        await each.ready.wait()
            following = (
                asyncio.get_running_loop().create_task(self._follow(), name="list of plants") if follows else None
            )
            async with self._process:
                yield
            if following is not None:
                following.cancel()

    async def _end(self) -> None:
        await asyncio.gather(*(each.end() for each in self._served.values()))
        self._served.clear()

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(EVERY)
            try:
                await self._look()
            except Exception:
                log.exception("unhandled error in following the list of plants")

    async def _look(self) -> None:
        try:
            listed, there = await asyncio.to_thread(self._read)
        except psycopg.Error as error:
            self._outage.goes_on(error)
            return
        self._outage.is_over()
        self._listed = listed
        self._own_there = self._own_there and there
        for key, each in list(self._served.items()):
            if each.plant not in listed or each.failed:
                await self._served.pop(key).end()
                log.info("plant %s is not served any more", key)
        for plant in listed:
            if plant.key in self._withheld:
                self._tell(plant, self._withheld[plant.key])
            elif plant.key not in self._served:
                self._begin(plant)
        self._served = {plant.key: self._served[plant.key] for plant in listed if plant.key in self._served}

    def _read(self) -> tuple[list[Plant], bool]:
        with self._connections.connect(autocommit=True, application_name="inband-plants") as connection:
            row = connection.execute("SELECT to_regclass('alembic_version') IS NOT NULL").fetchone()
            listed = plants(connection)
        looked = {plant.key: self._hindrance(plant) for plant in listed if plant.key not in self._served}
        self._withheld = {key: why for key, why in looked.items() if why}
        return listed, not listed or row is None or bool(row[0])

    def _hindrance(self, plant: Plant) -> str | None:
        """The hindrance to serving a plant now; None if there is none."""
        try:
            revision = current(in_schema(self._url, plant.schema))
        except (
            psycopg.Error
        ) as error:  # the node of Citus that it lies on is unreachable: the others are served all the same
            return str(error).strip().splitlines()[0]
        return None if revision == self._head else "its schema is of another Inband; `inband migrate` brings it here"

    def _begin(self, plant: Plant) -> None:
        try:
            self._served[plant.key] = served = Served(plant, self.settings, self._make)
        except ValidationError as error:
            self._tell(plant, error.errors()[0]["msg"])
            return
        served.begin()
        self._reported.pop(plant.key, None)
        log.info("plant %s is served at %s", plant.key, served.settings.address if plant.prefix else plant.host)

    def _tell(self, plant: Plant, why: str) -> None:
        """Log once why a plant is not served; the list is looked at every few seconds."""
        if self._reported.get(plant.key) != why:
            self._reported[plant.key] = why
            log.error("plant %s is not served: %s", plant.key, why)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request."""
        if scope["type"] != "http":
            await self.front(scope, receive, send)
            return
        if not self._listed:
            await self.own.asgi(scope, receive, send)
            return
        plant, path = self._plant_of(scope)
        served = self._served.get(plant.key) if plant else None
        if plant is not None and path == "":
            await RedirectResponse(f"{plant.prefix}/", 308)(scope, receive, send)
        elif plant is not None and served is not None and served.ready.is_set():
            below = {"path": path, "root_path": plant.prefix, "raw_path": path.encode()} if plant.prefix else {}
            await served({**scope, **below}, receive, send)
        elif plant is not None:
            await _not_served(plant, path)(scope, receive, send)
        elif self._is_front(path):
            await self.front(scope, receive, send)
        else:
            await self.own.asgi(scope, receive, send)

    def _plant_of(self, scope: Scope) -> tuple[Plant | None, str]:
        """The plant of a request, and its path from the root of that plant."""
        path: str = scope["path"]
        key, slash, rest = path.removeprefix("/p/").partition("/") if path.startswith("/p/") else ("", "", "")
        host = next((value for name, value in scope["headers"] if name == b"host"), b"").decode("latin-1").lower()
        for plant in self._listed:
            if plant.host is None and plant.key == key:
                return plant, slash + rest
            if plant.host is not None and plant.host == host.partition(":")[0]:
                return plant, path
        return None, path

    def _is_front(self, path: str) -> bool:
        """Tell if the overview answers: its own pages, and everything but health and assets where no plant is at the root."""
        if path == "/plants" or path.startswith("/plants/"):
            return True
        return not self._own_there and not path.startswith(("/static/", "/health/"))


def _not_served(plant: Plant, path: str) -> Response:
    """The answer for a plant that is being started or cannot be served: people see on the overview which it is."""
    if not is_for_programs(path):
        return RedirectResponse("/plants", 303)
    error = DatabaseAway(f"The plant {plant.name} is being started, or cannot be served; the server's log says why.")
    return JSONResponse(error.as_problem(), error.status, error.headers, PROBLEM_JSON)
