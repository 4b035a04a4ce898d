"""The other ends of notifications: a mail server that keeps its mails, and a web server that misbehaves as it is asked to."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from email import message_from_bytes
from email.message import Message
from email.policy import default
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from ipaddress import ip_address
from pathlib import Path
from ssl import PROTOCOL_TLS_SERVER, SSLContext
from typing import Any, NamedTuple

import msgspec
from aiosmtpd.controller import Controller
from aiosmtpd.smtp import SMTP
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from app.loop.notifications.means import signature

NETWORKS: dict[str, Any] = {"webhook_networks": "127.0.0.0/8"}
"""Settings with which webhooks may lead to these servers."""


class Mails:
    """A mail server. It takes everything, but for addresses that begin with what it does: refused, mute, rude."""

    def __init__(self, context: SSLContext | None = None, *, first: bool = False, **more: Any) -> None:
        """first: encrypted from the first byte. more: as aiosmtpd takes it."""
        self.mails: list[Message] = []
        self.encrypted: list[bool] = []
        if context:
            more |= {"ssl_context": context} if first else {"tls_context": context, "require_starttls": True}
        self.controller = Controller(self, hostname="127.0.0.1", port=0, ready_timeout=60, **more)

    async def handle_MAIL(self, server: SMTP, session: Any, envelope: Any, address: str, options: Any) -> str:  # noqa: N802
        """Refuse a sender, or take it."""
        envelope.mail_from = address
        return "553 Not yours" if address.startswith("refused") else "250 OK"

    async def handle_RCPT(self, server: SMTP, session: Any, envelope: Any, address: str, options: Any) -> str:  # noqa: N802
        """Refuse a recipient, or take it."""
        if address.startswith("refused"):
            return "550 Nema korisnika „Đoka“"
        envelope.rcpt_tos.append(address)
        session.rude = address.startswith("rude")
        return "250 OK"

    async def handle_QUIT(self, server: SMTP, session: Any, envelope: Any) -> str:  # noqa: N802
        """Answer the farewell, or grumble at it."""
        return "421 Closing" if getattr(session, "rude", False) else "221 Bye"

    async def handle_DATA(self, server: SMTP, session: Any, envelope: Any) -> str:  # noqa: N802 - aiosmtpd's name
        """Keep a mail."""
        self.encrypted.append(session.ssl is not None)
        self.mails.append(message_from_bytes(envelope.content, policy=default))
        if envelope.rcpt_tos[0].startswith("mute"):
            await asyncio.sleep(3600)  # until the server ends
        return "250 OK"

    def to(self, address: str) -> list[str]:
        """The subjects and texts of the mails to an address."""
        return [f"{mail['Subject']}\n\n{mail.get_body().get_content()}" for mail in self.mails if mail["To"] == address]  # type: ignore[attr-defined]


@contextmanager
def mail_server(context: SSLContext | None = None, **more: Any) -> Iterator[tuple[Mails, str]]:
    """A mail server, and its address."""
    from tests.servers import free_port

    made = Mails(context, **more)
    made.controller.port = free_port()
    made.controller.start()
    try:
        yield made, f"localhost:{made.controller.port}"
    finally:
        made.controller.stop()


class Post(NamedTuple):
    """One message to a webhook."""

    path: str
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return msgspec.json.decode(self.body)

    def signed_with(self, secret: str) -> bool:
        """As a receiver checks it."""
        said = self.headers["x-inband-signature"]
        return said == f"sha256={signature(secret, self.headers['x-inband-timestamp'], self.body)}"


class Hooks(ThreadingHTTPServer):
    """A web server: `/x-500` answers 500, `/x-302` leads to `/x`, `/x-hang` does not answer; everything else is taken.

    posts: what was taken. mended: paths that are taken too from now on.
    """

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.posts: list[Post] = []
        self.mended: set[str] = set()
        self.over = threading.Event()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def at(self, path: str) -> list[Any]:
        """What was taken at a path."""
        return [post.json for post in self.posts if post.path == path]


class _Handler(BaseHTTPRequestHandler):
    server: Hooks

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        way = "" if self.path in self.server.mended else self.path.rpartition("-")[2]
        if way == "hang":
            self.server.over.wait(60)
            return
        status = int(way) if way in {"500", "302"} else 204
        if status == 204:
            headers = {name.lower(): value for name, value in self.headers.items()}
            self.server.posts.append(Post(self.path, headers, body))
        self.send_response(status)
        if status == 302:
            self.send_header("Location", self.path.removesuffix("-302"))
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_args: Any) -> None:
        """Say nothing."""


@contextmanager
def web_server() -> Iterator[Hooks]:
    """A web server that runs."""
    made = Hooks()
    thread = threading.Thread(target=made.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield made
    finally:
        made.over.set()
        made.shutdown()
        made.server_close()
        thread.join()


def certificate(folder: Path) -> Path:
    """A certificate for localhost, and its key, in one file."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    now = datetime.now(UTC)
    names = x509.SubjectAlternativeName([x509.DNSName("localhost"), x509.IPAddress(ip_address("127.0.0.1"))])
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(names, critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    path = folder / "localhost.pem"
    pem = serialization.Encoding.PEM
    secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    path.write_bytes(secret + made.public_bytes(pem))
    return path


def secure(pem: Path) -> SSLContext:
    """A server's context with that certificate."""
    context = SSLContext(PROTOCOL_TLS_SERVER)
    context.load_cert_chain(pem)
    return context
