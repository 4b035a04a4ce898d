"""The server's log, on standard error: lines for people, or JSON objects for programs that collect them.

A line names the request that it belongs to by the id that its answer carries (`X-Request-ID`, and `request_id` in problem
documents). Bodies are never logged, and what is known to be secret is taken out of whatever is: passwords in addresses, keys,
cookies, links of invitations, values of database statements.
"""

import json
import logging
import re
import sys
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Any

OURS = ("app", "inband")
"""Loggers that the level is for; of libraries only warnings and errors are logged."""
REQUEST: ContextVar[str | None] = ContextVar("request", default=None)
"""Id of the request that is being answered."""

_SECRETS = (
    (re.compile(r"(?i)(postgres(?:ql)?(?:\+\w+)?://[^:@/\s]*:)\S*@"), r"\1***@"),
    (re.compile(r"(?i)\b(password\s*=\s*)('[^']*'|\S+)"), r"\1***"),
    (re.compile(r"(?i)\b(bearer\s+)\S+"), r"\1***"),
    (re.compile(r"\binband_[\w-]{20,}"), "inband_***"),
    (re.compile(r"(inband_session=)[^;\s]+"), r"\1***"),
    (re.compile(r"(/(?:invitation|import)/)[\w-]+"), r"\1***"),
    (re.compile(r"\[parameters: .*"), "[parameters: not shown]"),
    (re.compile(r"Failing row contains .*"), "Failing row: not shown"),
)
_CONTROL = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160), 0x2028, 0x2029)}
_STANDARD = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime"}


def configure(level: str, form: str) -> None:
    """Send this process's log to standard error, as `form` says; `level` is the least that is logged."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonLines() if form == "json" else TextLines())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.WARNING)
    for name in OURS:
        logging.getLogger(name).setLevel(level.upper())
    logging.captureWarnings(capture=True)


def without_secrets(text: str) -> str:
    """The text with what is secret replaced.

    >>> without_secrets("cannot reach postgresql://inband:hunter2@db.example/inband")
    'cannot reach postgresql://inband:***@db.example/inband'
    """
    for pattern, instead in _SECRETS:
        text = pattern.sub(instead, text)
    return text


def _time(record: logging.LogRecord) -> str:
    return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


class TextLines(logging.Formatter):
    """``2026-11-22T08:15:02.123Z WARNING app.web.request_log: POST /sign-in 401 … [request 5f0c-1a]``."""

    def format(self, record: logging.LogRecord) -> str:
        """One line, and below it the trace of an error."""
        message = without_secrets(record.getMessage()).translate(_CONTROL)
        request = getattr(record, "request_id", None) or REQUEST.get()
        line = (
            f"{_time(record)} {record.levelname} {record.name}: {message}{f' [request {request}]' if request else ''}"
        )
        if record.exc_info:
            line += "\n" + without_secrets(self.formatException(record.exc_info))
        return line


class JsonLines(logging.Formatter):
    """One JSON object per line: time, level, logger, message, process, what the call adds, and the trace of an error."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        about: dict[str, Any] = {
            "time": _time(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": without_secrets(record.getMessage()),
            "process": record.process,
        }
        if request := REQUEST.get():
            about["request_id"] = request
        for name, value in vars(record).items():
            if name not in _STANDARD and value is not None:
                about[name] = without_secrets(value) if isinstance(value, str) else value
        if record.exc_info:
            about["error"] = without_secrets(self.formatException(record.exc_info))
        return json.dumps(about, ensure_ascii=False, default=str)
