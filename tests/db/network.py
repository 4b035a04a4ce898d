"""A way to a database that can be made to swallow everything: TCP in front of the socket of an embedded server.

Bytes go to and fro until ``swallow``. From then on nothing passes and nothing is closed, as where a cable was pulled: who
has sent waits for an answer, who connects waits for the first word.
"""

import contextlib
import socket
import threading
from pathlib import Path
from typing import Self


class Way:
    """To the PostgreSQL whose unix socket this is."""

    def __init__(self, target: Path) -> None:
        self.target = target
        self._open = threading.Event()
        self._open.set()
        self._ends: list[socket.socket] = []
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listening.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for end in (self._listening, *self._ends):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        self._open.set()

    def swallow(self) -> None:
        """Let nothing pass any more."""
        self._open.clear()

    def forward(self) -> None:
        """Let everything pass again, what has waited first."""
        self._open.set()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _address = self._listening.accept()
                server = socket.socket(socket.AF_UNIX)
                server.connect(str(self.target))
                self._ends += [client, server]
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                self._open.wait()
                sink.sendall(data)
        with contextlib.suppress(OSError):
            self._open.wait()
            sink.shutdown(socket.SHUT_WR)
