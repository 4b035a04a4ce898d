"""The public REST API as a machine's gateway calls it: with a key, and patient when the server is away for a while."""

import logging
import threading
from collections.abc import Iterator
from typing import Any

import httpx

log = logging.getLogger(__name__)
FIRST_PAUSE, LONGEST_PAUSE = 0.2, 10.0  # s


class Ending(Exception):
    """The plant is being shut down."""


class Refused(Exception):
    """The server understood the call and will not do it; sending it again would not help."""

    def __init__(self, call: str, status: int, detail: str) -> None:
        super().__init__(f"{call}: {status} {detail}")
        self.status = status
        self.detail = detail


class Client:
    """Calls until there is an answer. Everything the plant sends may be sent twice: readings carry a key, and
    confirming or acknowledging a second time changes nothing.
    """

    def __init__(self, url: str, key: str, ending: threading.Event) -> None:
        self._http = httpx.Client(
            base_url=f"{url}/api/v1", headers={"Authorization": f"Bearer {key}"}, timeout=10, trust_env=False
        )
        self._ending = ending

    def close(self) -> None:
        """Hang up."""
        self._http.close()

    def get(self, path: str, **query: Any) -> Any:
        """The JSON answer. Raises `Refused` and `Ending`, as all do."""
        return self.call("GET", path, params=query)

    def post(self, path: str, json: Any = None) -> Any:
        """The JSON answer."""
        return self.call("POST", path, json=json)

    def items(self, path: str, **query: Any) -> Iterator[dict[str, Any]]:
        """Everything in a list, page after page."""
        after: dict[str, Any] = {}
        while True:
            page = self.get(path, **query, **after)
            yield from page["items"]
            if page["next"] is None:
                return
            after = {"after": page["next"]}

    def call(self, method: str, path: str, **options: Any) -> Any:
        """Call until there is an answer that is not about the server's own trouble."""
        pause = FIRST_PAUSE
        while not self._ending.is_set():
            try:
                answer = self._http.request(method, path, **options)
            except httpx.TransportError as error:
                trouble = str(error) or type(error).__name__
            else:
                if answer.is_success:
                    return answer.json() if answer.content else None
                if answer.status_code < 500 and answer.status_code != httpx.codes.TOO_MANY_REQUESTS:
                    raise Refused(f"{method} {path}", answer.status_code, _detail(answer))
                trouble = str(answer.status_code)
                pause = max(pause, _asked_for(answer))
            log.info("%s %s: %s; again in %.1f s", method, path, trouble, pause)
            self._ending.wait(pause)
            pause = min(2 * pause, LONGEST_PAUSE)
        raise Ending


def _detail(answer: httpx.Response) -> str:
    try:
        problem = answer.json()
    except ValueError:
        return answer.text[:200]
    errors = "; ".join(f"{error['field']}: {error['message']}" for error in problem.get("errors", [])[:5])
    return f"{problem.get('detail', '')} {errors}".strip()


def _asked_for(answer: httpx.Response) -> float:
    """The seconds of Retry-After."""
    seconds = answer.headers.get("Retry-After", "")
    return min(float(seconds), LONGEST_PAUSE) if seconds.isdigit() else 0.0
