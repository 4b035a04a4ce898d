"""Delivering one message: by mail, to a webhook, by apprise. Each ends within `LIMIT`, whatever the other side does."""

import asyncio
import hashlib
import hmac
import secrets
import smtplib
import socket
import ssl
import threading
import time
from base64 import b64encode
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from email.message import EmailMessage
from email.utils import formatdate
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import httpx
import msgspec

from app import __version__
from app.language.i18n import _
from app.loop.notifications.addresses import APPRISE, Place, Refused, place_of
from app.loop.notifications.threads import begun
from app.settings import Settings

LIMIT = 15.0
"""Seconds for one delivery, of all its steps together."""
STEP = 10.0
"""Seconds for one step of it: to connect, or to get the next bytes."""
LONGEST_ANSWER = 300
UNKNOWN_AUTHORITY = frozenset({18, 19, 20, 21})
"""Codes of OpenSSL for a certificate whose signer is unknown."""
Result = TypeVar("Result")


class Answer(NamedTuple):
    """The end of a delivery: whether it arrived, and what was answered, or why it was not reached.

    perhaps: nothing was answered to a message that was under way, so it may have arrived.
    """

    delivered: bool
    text: str
    perhaps: bool = False


class Unanswered(OSError):
    """A mail was being handed over, and the mail server has not said what became of it."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message as each means needs it. data: the JSON of webhooks; picture: a PNG in a mail."""

    subject: str
    text: str
    data: dict[str, Any] = field(default_factory=dict)
    picture: bytes | None = None


@dataclass(frozen=True, slots=True)
class Job:
    """A delivery to be made. delivery: its number. cursor: the last event in it, of one about changes; shift_end: of a shift."""

    delivery: int
    receiver: int
    about: str
    means: str
    address: str
    secret: str | None
    message: Message
    alarms: tuple[int, ...] = ()
    cursor: int | None = None
    shift_end: datetime | None = None


async def deliver(job: Job, settings: Settings) -> Answer:
    """Deliver it, once. Never raises for what the other side does."""
    try:
        async with asyncio.timeout(LIMIT):
            if job.means == "webhook":
                return await _to_webhook(job, settings)
            send, slots = (_by_mail, _MAILS) if job.means == "mail" else (_by_apprise, _APPRISE)
            return Answer(delivered=True, text=await _in_thread(slots, lambda: send(job, settings)))
    except TimeoutError:
        return Answer(delivered=False, text=_("no answer within {n} s").format(n=f"{LIMIT:g}"), perhaps=True)
    except (Refused, Unanswered) as error:
        return Answer(delivered=False, text=_short(str(error)), perhaps=isinstance(error, Unanswered))
    except (smtplib.SMTPResponseException, smtplib.SMTPRecipientsRefused) as error:
        return Answer(delivered=False, text=_short(_said(error)))
    except httpx.ReadTimeout:
        return Answer(delivered=False, text=_("no answer within {n} s").format(n=f"{STEP:g}"), perhaps=True)
    except (OSError, smtplib.SMTPException, httpx.HTTPError, httpx.InvalidURL, ValueError) as error:
        text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        if isinstance(error, httpx.ConnectError | httpx.ConnectTimeout):
            text = _("the receiver cannot be reached: check its address, that it runs, and firewalls between")
        return Answer(delivered=False, text=_short(_certificate_refused(error) or text))


_MAILS, _APPRISE, _NAMES = (threading.BoundedSemaphore(32) for _each in range(3))
"""Threads that wait for the mail server, apprise and the name service: of one process, none of those that serve requests."""


async def _in_thread(slots: threading.BoundedSemaphore, work: Callable[[], Result]) -> Result:
    """The result of work in a thread of its own. Nobody waits for one that hangs; while all hang, no more are begun."""
    result = begun(slots, "notification", work)
    if result is None:
        raise OSError(_("too many servers that do not answer are being waited for"))
    return await asyncio.wrap_future(result)


# --- mail


def _by_mail(job: Job, settings: Settings) -> str:
    if settings.mail_server is None:
        raise Refused(_("The server has no mail server: set INBAND_MAIL_SERVER."))
    host, _colon, port = settings.mail_server.partition(":")
    sender = settings.mail_from or f"inband@{host}"
    mail = EmailMessage()
    mail["Subject"] = " ".join(job.message.subject.split())
    mail["From"], mail["To"] = sender, job.address
    mail["Date"] = formatdate()
    mail["Message-ID"] = f"<inband-{job.delivery}-{secrets.token_hex(8)}@{sender.partition('@')[2]}>"
    mail["Auto-Submitted"] = "auto-generated"
    mail.set_content(job.message.text)
    if job.message.picture is not None:
        mail.add_attachment(job.message.picture, "image", "png", filename="readings.png", disposition="inline")
    server = _connected(host, port, settings)
    try:
        _introduced(server, settings)
        try:
            _wait(server, LIMIT)  # some look through a mail for long before they take it
            server.send_message(mail)
        except (smtplib.SMTPServerDisconnected, TimeoutError):
            raise Unanswered(
                _("The mail server has not said whether it took it. The next try waits a minute.")
            ) from None
        with suppress(OSError):  # it has the mail, however it takes the farewell
            _wait(server, 1)
            server.quit()
    finally:
        server.close()
    return _("The mail server has taken it.")


def _connected(host: str, port: str, settings: Settings) -> smtplib.SMTP:
    """The mail server, after its greeting. Raises `Refused` where nobody greets, or with encryption, or without, against the setting."""
    try:
        if settings.mail_security == "tls":
            return smtplib.SMTP_SSL(host, int(port or 465), timeout=STEP, context=_tls(settings.ca_file))
        return smtplib.SMTP(host, int(port or (587 if settings.mail_security == "starttls" else 25)), timeout=STEP)
    except ssl.SSLCertVerificationError:
        raise
    except ssl.SSLError as error:
        reason = _("{server} is not encrypted from the first byte ({error}): INBAND_MAIL_SECURITY=starttls?")
        raise Refused(reason.format(server=settings.mail_server, error=error.reason)) from None
    except smtplib.SMTPServerDisconnected:
        reason = _("{server} did not greet: is it encrypted from the first byte, INBAND_MAIL_SECURITY=tls?")
        raise Refused(reason.format(server=settings.mail_server)) from None
    except (socket.gaierror, ConnectionRefusedError, TimeoutError) as error:
        reason = {
            socket.gaierror: _("the name of the mail server {server} is not known here: check INBAND_MAIL_SERVER"),
            ConnectionRefusedError: _("no mail server listens at {server}: check INBAND_MAIL_SERVER, and that it runs"),
            TimeoutError: _("{server} does not answer: check INBAND_MAIL_SERVER, its port, and firewalls between"),
        }[type(error)]
        raise Refused(reason.format(server=settings.mail_server)) from None


def _introduced(server: smtplib.SMTP, settings: Settings) -> None:
    """Encrypt and sign in as set. Raises `Refused` where the mail server offers no such thing, `SMTPAuthenticationError`."""
    try:
        if settings.mail_security == "starttls":
            server.starttls(context=_tls(settings.ca_file))
    except smtplib.SMTPNotSupportedError:
        reason = _("{server} offers no STARTTLS: INBAND_MAIL_SECURITY=tls, or none for one on this computer?")
        raise Refused(reason.format(server=settings.mail_server)) from None
    try:
        if settings.mail_user:
            _sign_in(server, settings.mail_user, settings.mail_password or "")
    except smtplib.SMTPNotSupportedError:
        reason = _("{server} allows no sign-in this way: is INBAND_MAIL_USER needed, and INBAND_MAIL_SECURITY right?")
        raise Refused(reason.format(server=settings.mail_server)) from None


def _sign_in(server: smtplib.SMTP, user: str, password: str) -> None:
    """Sign in, with letters beyond ASCII too, which `login` cannot send. Raises `SMTPAuthenticationError`."""
    if f"{user}{password}".isascii():
        server.login(user, password)
        return
    server.ehlo_or_helo_if_needed()
    if "PLAIN" in server.esmtp_features.get("auth", "").upper().split():
        said = server.docmd("AUTH", f"PLAIN {_base64(f'{chr(0)}{user}{chr(0)}{password}')}")
    else:
        said = server.docmd("AUTH", f"LOGIN {_base64(user)}")
        if said[0] == 334:
            said = server.docmd(_base64(password))
    if said[0] != 235:
        raise smtplib.SMTPAuthenticationError(*said)


def _base64(text: str) -> str:
    return b64encode(text.encode()).decode()


def _wait(server: smtplib.SMTP, seconds: float) -> None:
    if server.sock is not None:
        server.sock.settimeout(seconds)


def _said(error: smtplib.SMTPResponseException | smtplib.SMTPRecipientsRefused) -> str:
    """The status and the words with which a mail server refused a mail, and the setting that it is about."""
    if isinstance(error, smtplib.SMTPResponseException):
        said: list[tuple[int, bytes | str]] = [(error.smtp_code, error.smtp_error)]
    else:
        said = list(error.recipients.values())
    text = "; ".join(
        f"{code} {words.decode(errors='replace') if isinstance(words, bytes) else words}" for code, words in said
    )
    if isinstance(error, smtplib.SMTPAuthenticationError):
        return text + "; " + _("check INBAND_MAIL_USER and INBAND_MAIL_PASSWORD")
    return text + "; " + _("check INBAND_MAIL_FROM") if isinstance(error, smtplib.SMTPSenderRefused) else text


@cache
def _tls(ca_file: Path | None) -> ssl.SSLContext:
    """Trust in the authorities of this computer, and in those of the file."""
    context = ssl.create_default_context()
    if ca_file is not None:
        context.load_verify_locations(ca_file)
    return context


def _certificate_refused(error: BaseException | None) -> str | None:
    """The reason why a certificate was refused, if that is the cause of the error."""
    while error is not None and not isinstance(error, ssl.SSLCertVerificationError):
        error = error.__cause__ or error.__context__
    if error is None:
        return None
    text = _("certificate refused: {reason}").format(reason=error.verify_message.rstrip("."))
    if error.verify_code in UNKNOWN_AUTHORITY:
        text += "; " + _("if an authority of your own has signed it, name that in INBAND_CA_FILE")
    return text


# --- webhooks


def signature(secret: str, timestamp: str, body: bytes) -> str:
    """Proof for a receiver that a message is ours and fresh: HMAC-SHA256 of time, point and body, in hexadecimal."""
    return hmac.new(secret.encode(), timestamp.encode() + b"." + body, hashlib.sha256).hexdigest()


async def _to_webhook(job: Job, settings: Settings) -> Answer:
    place = await _in_thread(_NAMES, lambda: place_of(job.address, settings))
    body, timestamp = msgspec.json.encode(job.message.data), str(int(time.time()))
    headers = {
        "Content-Type": "application/json",
        "Accept-Encoding": "identity",
        "User-Agent": f"Inband/{__version__}",
        "X-Inband-Delivery": str(job.delivery),
        "X-Inband-Timestamp": timestamp,
        "X-Inband-Signature": f"sha256={signature(job.secret or '', timestamp, body)}",
    }
    async with httpx.AsyncClient(
        verify=_tls(settings.ca_file), timeout=STEP, trust_env=False, follow_redirects=False
    ) as client:
        request = client.build_request("POST", job.address, content=body, headers=headers)
        _connect_to(request, place)
        answer = await client.send(request, stream=True)
        try:
            said = b""
            async for chunk in answer.aiter_raw(LONGEST_ANSWER):
                said += chunk
                if len(said) >= LONGEST_ANSWER:
                    break
        finally:
            await answer.aclose()
    text = f"{answer.status_code} {answer.reason_phrase} {said.decode(errors='replace')}"
    if answer.is_redirect:
        text = _("{status} leads to another address, which is not followed").format(status=answer.status_code)
    return Answer(answer.is_success, _short(text))


def _connect_to(request: httpx.Request, place: Place) -> None:
    """Send a request to the address that was checked, whatever the name service says by now."""
    request.extensions["sni_hostname"] = place.host
    request.url = request.url.copy_with(host=str(place.address))


# --- apprise


def _by_apprise(job: Job, settings: Settings) -> str:
    if not settings.allow_apprise:
        raise Refused(_("INBAND_ALLOW_APPRISE is not set any more."))
    try:
        from apprise import Apprise
    except ImportError:
        raise Refused(_("The library apprise is missing on the server: {command}").format(command=APPRISE)) from None
    service = Apprise()
    service.add(job.address)
    if not service.notify(title=job.message.subject, body=job.message.text):
        raise OSError(_("The service has not taken it."))
    return _("The service has taken it.")


def _short(text: str) -> str:
    """An answer in one line that can be stored."""
    return " ".join(text.replace("\0", "").split())[:LONGEST_ANSWER]
