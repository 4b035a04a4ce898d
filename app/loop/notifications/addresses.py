"""Addresses that notifications may go to, and the connection to exactly the address that was checked."""

import re
import socket
from collections.abc import Callable
from contextlib import suppress
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address, ip_network
from threading import BoundedSemaphore
from typing import NamedTuple
from urllib.parse import urlsplit

from app.language.i18n import _
from app.loop.notifications.threads import begun
from app.settings import Settings

Address = IPv4Address | IPv6Address
MAIL = re.compile(r"[A-Za-z0-9.!#$%&'*+/=?^_`{|}~-]{1,64}@[A-Za-z0-9]([A-Za-z0-9.-]{0,250}[A-Za-z0-9])?")
NAT64 = IPv6Network("64:ff9b::/96")
INSIDE = [IPv6Network(each) for each in ("::/16", "64:ff9b:1::/48", "fec0::/10")]
"""Addresses that lead into the own network, though `is_global` holds for some of them."""
APPRISE = "pip install --require-hashes -r libraries-with-extras.txt"
"""The file is beside Inband's wheel. The name inband is not registered at PyPI: pip would install what anybody puts there."""
LOOK_UP = 2.0
"""Seconds that a request waits for the name service."""
_LOOKING = BoundedSemaphore(8)


class Refused(Exception):
    """An address that nothing is sent to; the message says why and what to do."""


class Unknown(Refused):
    """A name that the name service does not know now; it may know it later."""


class Place(NamedTuple):
    """A web server: the name in its certificate, the address that is connected to, and the port."""

    host: str
    address: Address
    port: int


def check(means: str, address: str, settings: Settings) -> None:
    """Refuse an address that cannot be one of this means, and a webhook that may not lead there. Raises `Refused`.

    Only the name service is asked, for `LOOK_UP` seconds at most: a request waits for it. Each delivery looks again, for a name
    may lead elsewhere by then.
    """
    if means == "mail":
        if not MAIL.fullmatch(address) or ".." in address:
            raise Refused(_("must be one mail address, such as anna@example.com"))
    elif means == "webhook":
        with suppress(Unknown):
            _within(LOOK_UP, lambda: place_of(address, settings))
    else:
        if not settings.allow_apprise:
            raise Refused(
                _(
                    "needs the setting INBAND_ALLOW_APPRISE=true of the server: apprise connects to any address by itself"
                )
            )
        try:
            from apprise import Apprise
        except ImportError:
            raise Refused(_("needs the library apprise on the server: {command}").format(command=APPRISE)) from None
        if not Apprise().add(address):
            raise Refused(_("is no address that apprise knows, such as ntfy://topic"))


def _within(seconds: float, work: Callable[[], Place]) -> Place:
    """The result of work in a thread of its own. Raises what it raises; `Unknown` where it takes longer, or too many hang."""
    answer = begun(_LOOKING, "name service", work)
    try:
        if answer is not None:
            return answer.result(seconds)
    except TimeoutError:
        pass
    raise Unknown(_("the name service does not answer"))


def _parts(url: str) -> tuple[str, str, int]:
    """Scheme, host and port of an address of the web. Raises `Refused`."""
    wrong = Refused(_("must be an address such as https://andon.example/inband"))
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        raise wrong from None
    if (
        parts.scheme not in {"https", "http"}
        or not parts.hostname
        or any(ord(mark) <= 32 or ord(mark) == 127 for mark in url)
    ):
        raise wrong
    if parts.username is not None or parts.password is not None:
        raise Refused(_("must not hold a user or a password: messages are signed"))
    return parts.scheme, parts.hostname, port or (443 if parts.scheme == "https" else 80)


def place_of(url: str, settings: Settings) -> Place:
    """The server that a webhook leads to, asked of the name service. Raises `Refused`.

    Every address of the name has to be permitted: public and by https, or in a network that the server's settings name.
    """
    scheme, host, port = _parts(url)
    try:
        found = [ip_address(each[4][0]) for each in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)]
    except (OSError, UnicodeError) as error:
        raise Unknown(_("{host} is not known to the name service: {error}").format(host=host, error=error)) from None
    networks = [ip_network(each) for each in settings.webhook_networks.split(",") if each]
    for address in found:
        inside = any(_real(address) in network for network in networks)
        if not inside and not is_public(address):
            raise Refused(
                _(
                    "{host} ({address}) lies inside the network; an administrator of the server permits its network in "
                    "INBAND_WEBHOOK_NETWORKS"
                ).format(host=host, address=address)
            )
        if not inside and scheme != "https":
            raise Refused(_("{host} is a public address: it must be reached by https").format(host=host))
    return Place(host, found[0], port)


def is_public(address: Address) -> bool:
    """Tell if an address leads to the internet, by itself and by the one that it carries.

    >>> [is_public(ip_address(each)) for each in ("93.184.215.14", "10.0.0.1", "127.0.0.1", "::ffff:10.0.0.1", "64:ff9b::a00:1")]
    [True, False, False, False, False]
    """
    real = _real(address)
    return real.is_global and not real.is_multicast and not any(real in network for network in INSIDE)


def _real(address: Address) -> Address:
    """The IPv4 address that an IPv6 address carries, if it carries one."""
    if isinstance(address, IPv6Address):
        if address.ipv4_mapped is not None:
            return address.ipv4_mapped
        if address.sixtofour is not None:
            return address.sixtofour
        if address in NAT64:
            return IPv4Address(int(address) & 0xFFFFFFFF)
    return address
