"""Addresses that messages may go to: none inside the network, unless it is permitted."""

import socket
from threading import BoundedSemaphore, Event
from typing import Any

import pytest

from app.loop.notifications import addresses
from app.loop.notifications.addresses import Refused, place_of
from app.loop.notifications.means import Answer, Job, Message, deliver
from app.settings import Settings
from tests.loop.notifications.sinks import NETWORKS, Hooks
from tests.loops import run
from tests.shop import unique


def found(monkeypatch: pytest.MonkeyPatch, *addresses: str) -> None:
    """Let the name service answer this."""

    def answers(_host: str, port: int, **_more: Any) -> list[Any]:
        return [(socket.AF_INET6 if ":" in each else socket.AF_INET, 1, 6, "", (each, port)) for each in addresses]

    monkeypatch.setattr("app.loop.notifications.addresses.socket.getaddrinfo", answers)


PUBLIC = "93.184.215.14"


@pytest.mark.parametrize(
    "inside",
    ["127.0.0.1", "10.1.2.3", "169.254.169.254", "::1", "::ffff:10.0.0.1", "64:ff9b::a00:1", "2002:a00:1::", "fd00::1",
     "0.0.0.0", "224.0.0.1", "::10.0.0.1", "::ffff:0:10.0.0.1", "64:ff9b:1::a00:1", "fec0::1", "fe80::1%1"],
)  # fmt: skip
def test_addresses_inside_the_network_are_refused_unless_permitted(
    monkeypatch: pytest.MonkeyPatch, inside: str
) -> None:
    found(monkeypatch, PUBLIC, inside)
    with pytest.raises(Refused, match="INBAND_WEBHOOK_NETWORKS"):
        place_of("https://andon.example/x", Settings())


def test_public_addresses_need_https(monkeypatch: pytest.MonkeyPatch) -> None:
    found(monkeypatch, PUBLIC)
    with pytest.raises(Refused, match="https"):
        place_of("http://andon.example/x", Settings())
    assert str(place_of("https://andon.example/x", Settings()).address) == PUBLIC
    permitted = Settings(webhook_networks="93.184.0.0/16")
    assert place_of("http://andon.example/x", permitted).port == 80


def test_a_name_service_that_hangs_holds_no_request_and_each_delivery_looks_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    over = Event()
    monkeypatch.setattr(addresses, "LOOK_UP", 0.05)
    monkeypatch.setattr(addresses, "_LOOKING", BoundedSemaphore(2))
    monkeypatch.setattr(
        "app.loop.notifications.addresses.socket.getaddrinfo", lambda *_args, **_more: over.wait(60) and []
    )
    try:
        for _each in range(4):  # beyond as many as may hang, too
            addresses.check("webhook", "https://andon.example/x", Settings())
        assert not over.is_set()
    finally:
        over.set()


def test_a_name_that_leads_inside_is_refused_when_it_is_added(monkeypatch: pytest.MonkeyPatch) -> None:
    found(monkeypatch, "10.1.2.3")
    with pytest.raises(Refused, match="INBAND_WEBHOOK_NETWORKS"):
        addresses.check("webhook", "https://andon.example/x", Settings())


def webhook(url: str) -> Job:
    return Job(1, 1, "test", "webhook", url, "secret", Message("Test", "", {"type": "test"}))


def test_the_address_that_was_checked_is_the_one_connected_to(monkeypatch: pytest.MonkeyPatch, hooks: Hooks) -> None:
    found(monkeypatch, "127.0.0.1")  # only that look is answered; the connection asks nobody
    path = f"/{unique('hook')}"
    url = f"http://no-such-name.invalid:{hooks.server_port}{path}"
    answer = run(deliver(webhook(url), Settings(**NETWORKS)))
    assert answer == Answer(delivered=True, text="204 No Content")
    (post,) = [post for post in hooks.posts if post.path == path]
    assert post.headers["host"] == f"no-such-name.invalid:{hooks.server_port}"


def test_a_webhook_that_nobody_answers_says_what_to_look_at() -> None:
    answer = run(deliver(webhook("http://127.0.0.1:9/"), Settings(**NETWORKS)))
    assert not answer.delivered
    assert "check its address" in answer.text


def test_webhooks_do_not_lead_to_a_server_that_only_listens_inside(hooks: Hooks) -> None:
    answer = run(deliver(webhook(f"{hooks.url}/secret"), Settings()))
    assert not answer.delivered
    assert "INBAND_WEBHOOK_NETWORKS" in answer.text
    assert hooks.at("/secret") == []
