"""Both clients behind one face, so that a test is written once: `call` waits for what the asynchronous one gives."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from typing import Any

import pytest

from inband_client import AsyncClient, Client


class Loop:
    """A loop of asyncio in a thread of its own."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self._thread.start()

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(120)

    def close(self) -> None:
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join()
        self.loop.close()


class Either:
    """One of the two clients; its answers are those of the synchronous one."""

    def __init__(self, client: Client | AsyncClient, loop: Loop | None) -> None:
        self.client = client
        self._loop = loop

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*words: Any, **named: Any) -> Any:
            answer = getattr(self.client, name)(*words, **named)
            if self._loop is None:
                return answer
            return self._each(answer) if hasattr(answer, "__anext__") else self._loop.run(answer)

        return call

    def _each(self, items: AsyncIterator[Any]) -> Iterator[Any]:
        assert self._loop is not None

        async def following() -> Any:
            return await anext(items)

        while True:
            try:
                yield self._loop.run(following())
            except StopAsyncIteration:
                return

    def stop(self) -> None:
        if self._loop is None:
            self.client.stop()
        else:
            self._loop.loop.call_soon_threadsafe(self.client.stop)


Connect = Callable[..., Either]


@pytest.fixture(params=["sync", "async"])
def connect(request: pytest.FixtureRequest) -> Iterator[Connect]:
    """Makes a client for an address and a key; it is closed when the test ends."""
    made: list[Either] = []
    loop = Loop() if request.param == "async" else None

    def make(url: str, key: str, **options: Any) -> Either:
        client = Client(url, key, **options) if loop is None else AsyncClient(url, key, **options)
        made.append(Either(client, loop))
        return made[-1]

    yield make
    for each in made:
        each.close()
    if loop is not None:
        loop.close()
