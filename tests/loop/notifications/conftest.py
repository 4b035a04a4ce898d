"""Where messages arrive: a web server and a mail server."""

from collections.abc import Iterator

import pytest

from tests.loop.notifications.sinks import Hooks, Mails, mail_server, web_server


@pytest.fixture(scope="module")
def hooks() -> Iterator[Hooks]:
    with web_server() as made:
        yield made


@pytest.fixture(scope="module")
def mails() -> Iterator[tuple[Mails, str]]:
    with mail_server() as made:
        yield made
