"""The PostgreSQL that Inband starts itself: the only file that knows how.

The programs are the wheel's or the system's (`app.db.binaries`). The Python code of the wheel, which manages servers in a way
of its own (it changes permissions of home folders and ends processes), is never imported.

In the data directory::

    postgres/      the cluster        start.lock    held while the server is started or stopped
    postgres.log   what it says       users.lock    held (shared) by everyone who uses the server
    run/           its socket

Several processes may use one data directory: the first starts the server, the last one out stops it. Anyone who is killed
leaves no trace but perhaps a running server, which the next one uses. The server listens on no network, only on a unix
socket that its owner alone may enter, and therefore asks for no password.

PostgreSQL refuses to run as root, so root lends it the system user ``inband-postgres``. That user owns nothing but the
cluster and the socket. Where program or data lie in a home that others may not enter, the server gets the right to pass
through (a capability) instead of the home being opened.
"""

import contextlib
import errno
import hashlib
import logging
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import psycopg

with contextlib.suppress(
    ModuleNotFoundError
):  # Windows has neither, and no server is embedded there: `EmbeddedServer.start`
    import fcntl
    import pwd

from app.db.binaries import MAJOR, BinariesError, binary
from app.db.locks import LockError, exclusive, open_lock
from app.db.run_as import PATH, RunAsError, give, is_root, run_as, system_user

NAME = "inband"  # of the database and of its role
SYSTEM_USER = "inband-postgres"
PORT = "5432"  # only names the socket file
PATIENCE = 600.0  # seconds: recovery after a crash may take its time
FAST, AT_ONCE = (
    120.0,
    30.0,
)  # seconds that its end may take: by the fast way, which writes everything down, and without that
PROC = Path("/proc")
NO_PROCESS = 2**31 - 2  # a process number that no system gives out
MOST_LOG = 10 * 2**20  # bytes
ROOM = 200 * 2**20  # bytes a new cluster wants before it is begun

ENVIRONMENT = {"PATH": PATH, "LC_ALL": "C", "TZ": "UTC"}
"""Environment that the server inherits: nothing of a person's PG… or locale variables."""

DEFAULTS = {
    "shared_buffers": "256MB",
    "max_connections": "100",
    "max_wal_size": "2GB",
    "random_page_cost": "1.1",
    "jit": "off",
    "log_checkpoints": "off",
    "timezone": "UTC",
    "log_timezone": "UTC",
}
"""Written once into postgresql.conf, where people may change them. fsync and synchronous_commit stay on."""


LOOK_EVERY = 2.0
"""Seconds between two looks whether the server still runs."""
log = logging.getLogger("inband")


class EmbeddedServerError(Exception):
    """The embedded PostgreSQL cannot run; the message says why and what to do."""


class EmbeddedServer:
    """The PostgreSQL of one data directory; ``with EmbeddedServer(path) as url: ...`` also starts it again if it dies.

    ``options`` are server settings for this start only, such as ``{"fsync": "off"}`` in tests; they have no effect on a
    server that is running already.
    """

    def __init__(self, data_dir: Path, options: Mapping[str, str] | None = None) -> None:
        self.data_dir = data_dir.absolute()
        self.cluster = self.data_dir / "postgres"
        self.log = self.data_dir / "postgres.log"
        self.options = dict(options or {})
        self._users_lock: int | None = None
        self._log_begins = 0
        self._ended = threading.Event()
        self._watch: threading.Thread | None = None

    def __enter__(self) -> str:
        url = self.start()
        self._ended.clear()
        self._watch = threading.Thread(target=self._keep_alive, name="embedded PostgreSQL", daemon=True)
        self._watch.start()
        return url

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        if self._watch is not None:
            self._watch.join()
        self.stop()

    def _keep_alive(self) -> None:
        while not self._ended.wait(LOOK_EVERY):
            with contextlib.suppress(OSError):  # a full disk: another look may do
                self._trim_log()
            try:
                if self.pid is None:
                    log.error("PostgreSQL has ended unexpectedly; starting it again. Its log: %s", self.log)
                    self.start()
            except EmbeddedServerError as error:
                log.error("%s", error)  # noqa: TRY400 - the message says it all; the next look tries again
            except Exception:  # such as no file descriptors left: nothing is known, so nothing is done
                log.exception("the embedded PostgreSQL cannot be watched for now")

    def _trim_log(self) -> None:
        """Begin a long log again and keep the old one beside it, also while the server runs: it may do so for years."""
        if not self.log.exists() or self.log.stat().st_size <= MOST_LOG:
            return
        older = os.open(self.log.with_suffix(".log.1"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with self.log.open("rb") as log, os.fdopen(older, "wb") as copy:
            shutil.copyfileobj(log, copy)
        os.truncate(self.log, 0)  # the server appends, so it goes on from the beginning

    @property
    def url(self) -> str:
        """URL of the database; the same as long as the data directory is not moved."""
        return self._url(NAME)

    @property
    def pid(self) -> int | None:
        """The server's process, None when it does not run.

        Raises `OSError` where this process can open no file, so that a living server is never taken for a dead one.
        """
        try:
            pid = int((self.cluster / "postmaster.pid").read_text().split("\n", 1)[0])
        except OSError as error:
            _raise_if_unknown(error)
            return None
        except ValueError:
            return None
        return pid if _is_postgres(pid, self.cluster) else None

    @property
    def exists(self) -> bool:
        """Tell if there is a database in this data directory, or something else in its place."""
        try:
            return self.cluster.exists()
        except OSError:  # it lies where this user may not look; `start` says so
            return True

    def start(self) -> str:
        """Make the cluster if there is none, start the server if it does not run, and say where it is."""
        if not hasattr(os, "posix_spawn"):
            raise EmbeddedServerError(
                "On Windows no PostgreSQL comes with Inband. Install PostgreSQL 18, make a database, and name it: "
                "--database-url or INBAND_DATABASE_URL."
            )
        make_data_dir(self.data_dir)
        used_before = self._users_lock is not None
        try:
            with self._alone():
                if self._users_lock is None:
                    self._users_lock = open_lock(self.data_dir / "users.lock")
                    fcntl.flock(self._users_lock, fcntl.LOCK_SH)
                self._clean()
                if not self.cluster.exists():
                    self._initdb()
                self._check_version()
                if self.pid is None:
                    self._launch()
                self._await()
                self._make_database()
        except (RunAsError, LockError, BinariesError) as error:
            if not used_before:
                self._leave()
            raise EmbeddedServerError(
                str(error)
                if "INBAND_DATABASE_URL" in str(error)
                else f"{error} Or set INBAND_DATABASE_URL to a PostgreSQL server of your own."
            ) from None
        except BaseException:
            if not used_before:  # anyone who goes on using it keeps the lock: the next one out would stop the server
                self._leave()
            raise
        return self.url

    def stop(self) -> bool:
        """Leave; stop the server when nobody else uses it. True when it was stopped."""
        if self._users_lock is None:
            return False
        with self._alone():
            try:
                fcntl.flock(self._users_lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            finally:
                self._leave()
            self._end(self.pid)
        return True

    # --- who may do what when

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Nobody else starts or stops this server meanwhile. An unlucky second waits for the first one's initdb."""
        try:
            with exclusive(self.data_dir / "start.lock", PATIENCE):
                yield
        except TimeoutError:
            raise EmbeddedServerError(
                f"another process has been starting or stopping the database in {self.data_dir} for "
                f"{PATIENCE / 60:.0f} minutes. See {self.log}, end that process and try again."
            ) from None

    def _leave(self) -> None:
        if self._users_lock is not None:
            os.close(self._users_lock)
            self._users_lock = None

    # --- the cluster

    def _clean(self) -> None:
        """Remove what a killed first start left, and the pid file whose number now belongs to some other program."""
        for leftover in self.data_dir.glob("postgres.new-*"):
            shutil.rmtree(leftover, ignore_errors=True)
        if self.pid is not None:
            return
        pid_file = self.cluster / "postmaster.pid"
        with contextlib.suppress(OSError, ValueError):
            first, rest = pid_file.read_text().split("\n", 1)
            if (PROC / first).exists():  # the server would take that program for itself and refuse to start
                # The rest stays: by it the server sees whether children of the dead one still write.
                pid_file.write_text(f"{NO_PROCESS}\n{rest}")
        for file in (f".s.PGSQL.{PORT}", f".s.PGSQL.{PORT}.lock"):
            (self._socket_dir() / file).unlink(missing_ok=True)

    def _initdb(self) -> None:
        """Make the cluster beside its place and move it there when it is whole."""
        if (free := shutil.disk_usage(self.data_dir).free) < ROOM:
            raise EmbeddedServerError(
                f"{self.data_dir} has {free / 2**20:.0f} MB free; a new database needs {ROOM / 2**20:.0f} MB. "
                "Make room or choose another folder with --data-dir."
            )
        new = Path(tempfile.mkdtemp(prefix="postgres.new-", dir=self.data_dir))
        give(new, self._owner())
        done = subprocess.run(  # noqa: S603 - our own words
            [
                *self._as(self._owner()), str(binary("initdb")), "--pgdata", str(new), "--username", NAME,
                "--encoding", "UTF8", "--locale", "C", "--locale-provider", "builtin", "--builtin-locale", "C.UTF-8",
                "--data-checksums", "--auth-local", "trust", "--auth-host", "reject", "--no-instructions",
                *(f"--set={key}={value}" for key, value in DEFAULTS.items()),
            ],
            env=ENVIRONMENT, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, start_new_session=True,
        )  # fmt: skip
        if done.returncode:
            shutil.rmtree(new, ignore_errors=True)
            raise EmbeddedServerError(
                f"PostgreSQL could not make a database in {self.data_dir}:\n{(done.stderr or done.stdout).strip()}"
            )
        new.rename(self.cluster)

    def _check_version(self) -> None:
        try:
            version = (self.cluster / "PG_VERSION").read_text().strip()
        except OSError as error:
            raise EmbeddedServerError(
                f"{self.cluster} is not a PostgreSQL database this user can read ({error.strerror}). "
                "Run Inband as the user it belongs to, restore it from a backup, or choose another --data-dir."
            ) from None
        if version != str(MAJOR):
            raise EmbeddedServerError(
                f"{self.cluster} was made by PostgreSQL {version}, this Inband carries {MAJOR}. Dump it with the Inband that "
                "made it (pg_dump), start this one with a new --data-dir and restore the dump there (pg_restore)."
            )

    def _owner(self) -> "pwd.struct_passwd":
        """Whom the server runs as: this user, or for root the one the cluster belongs to, or the system user."""
        if os.geteuid() != 0:
            return pwd.getpwuid(os.geteuid())
        with contextlib.suppress(OSError, KeyError):
            owner = pwd.getpwuid(self.cluster.stat().st_uid)
            if owner.pw_uid != 0:
                return owner
        return system_user(SYSTEM_USER)

    def _as(self, owner: "pwd.struct_passwd") -> list[str]:
        return run_as(owner, reads=[binary("postgres")], enters=[self.data_dir])

    # --- the process

    def _launch(self) -> None:
        """Start it. Where a server was killed, its children may need a moment to notice; till then it does not start."""
        for patience in (0.2, 1, 5, None):
            try:
                self._spawn()
                break
            except EmbeddedServerError as error:
                if patience is None or "pre-existing shared memory" not in str(error):
                    raise
                time.sleep(patience)

    def _spawn(self) -> None:
        owner, settings = self._owner(), dict(self.options)
        settings |= {
            "listen_addresses": "",
            "unix_socket_directories": str(self._socket_dir()),
            "unix_socket_permissions": "0700",
            "port": PORT,
        }
        if self.cluster.stat().st_uid != owner.pw_uid:  # a backup that root copied back
            give(self.cluster, owner, recursive=True)
        give(self._socket_dir(), owner)
        self._trim_log()
        self._log_begins = self.log.stat().st_size if self.log.exists() else 0
        command = [*self._as(owner), str(binary("postgres")), "-D", str(self.cluster)]
        command += [f"--{key}={value}" for key, value in settings.items()]
        # A session of its own: Ctrl-C in the terminal is for Inband, which then ends the server in order.
        child = os.posix_spawn(
            command[0], command, ENVIRONMENT, setsid=True,
            file_actions=[
                (os.POSIX_SPAWN_OPEN, 0, "/dev/null", os.O_RDONLY, 0),
                (os.POSIX_SPAWN_OPEN, 1, str(self.log), os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600),
                (os.POSIX_SPAWN_DUP2, 1, 2),
            ],
        )  # fmt: skip
        while self.pid is None:  # it writes its pid file, or it ends
            if os.waitpid(child, os.WNOHANG)[0]:
                raise EmbeddedServerError(f"PostgreSQL did not start. {self._said()}")
            time.sleep(0.02)

    def _await(self) -> None:
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                psycopg.connect(self._url("postgres"), connect_timeout=5).close()
            except psycopg.OperationalError as error:
                if self.pid is None or time.monotonic() > deadline:
                    raise EmbeddedServerError(f"PostgreSQL does not answer: {error} {self._said()}") from None
                time.sleep(0.05)
            else:
                return

    def _said(self) -> str:
        text = self.log.read_bytes()[self._log_begins :].decode(errors="replace").strip() if self.log.exists() else ""
        return f"It says in {self.log}:\n{text}"

    def _make_database(self) -> None:
        with psycopg.connect(self._url("postgres"), autocommit=True, connect_timeout=5) as connection:
            if not connection.execute("SELECT 1 FROM pg_database WHERE datname = %s", [NAME]).fetchone():
                connection.execute(f'CREATE DATABASE "{NAME}"')

    def _end(self, pid: int | None) -> None:
        """Fast shutdown: transactions under way are rolled back, everything committed is on disk.

        What does not end by that is ended at once; its log brings everything committed back at the next start.
        """
        if pid is None:
            return
        for ending, patience in ((signal.SIGINT, FAST), (signal.SIGQUIT, AT_ONCE)):
            _signal(pid, ending)
            for process in (pid, *_children(pid)):  # one that was stopped would not hear it
                _signal(process, signal.SIGCONT)
            deadline = time.monotonic() + patience
            while _is_postgres(pid, self.cluster) and time.monotonic() < deadline:
                with contextlib.suppress(ChildProcessError):  # started by someone else
                    os.waitpid(pid, os.WNOHANG)
                time.sleep(0.02)
            if not _is_postgres(pid, self.cluster):
                return
            log.error("PostgreSQL (process %s) does not end within %.0f s", pid, patience)

    # --- the socket

    def _url(self, database: str) -> str:
        return f"postgresql://{NAME}@/{database}?host={self._socket_dir()}&port={PORT}"

    def _socket_dir(self) -> Path:
        """In the data directory, unless its path is longer than the system allows for a socket (some 107 bytes)."""
        near = self.data_dir / "run"
        if len(os.fsencode(near)) <= 85:  # room for /.s.PGSQL.5432.lock
            _make_private(near)
            return near
        digest = hashlib.sha256(os.fsencode(self.data_dir)).hexdigest()[:24]
        far = Path("/tmp") / f"inband-{digest}"  # noqa: S108 - private and checked, see below
        _make_private(far)
        status = far.lstat()
        if (
            not far.is_dir()
            or far.is_symlink()
            or status.st_mode & 0o077
            or status.st_uid not in {os.geteuid(), self._owner().pw_uid}
        ):
            raise EmbeddedServerError(f"{far} belongs to somebody else. Remove it, or choose a shorter --data-dir.")
        return far


def clusters_in_use() -> set[Path]:
    """Data directories whose server runs at this moment, as far as this user may see. None where there is no /proc."""
    clusters: set[Path] = set()
    for process in PROC.glob("[0-9]*"):
        with contextlib.suppress(OSError, ValueError):
            words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
            if Path(words[0]).name == "postgres" and "-D" in words:
                cluster = Path(words[words.index("-D") + 1])
                if cluster.name == "postgres" and (cluster.parent / "users.lock").exists():
                    clusters.add(cluster.parent)
    return clusters


def make_data_dir(path: Path) -> None:
    """Make the data folder, closed for everybody else. Raises `EmbeddedServerError`.

    Root's server runs as someone else, who must pass through; nothing in it is open to him but what is his.
    """
    _make_private(path, 0o711 if is_root() else 0o700)


def _make_private(path: Path, mode: int = 0o700) -> None:
    try:
        path.mkdir(mode=mode, parents=True, exist_ok=True)
    except OSError as error:
        raise EmbeddedServerError(
            f"the folder {path} cannot be made ({error.strerror}). Choose another with --data-dir."
        ) from None


def _signal(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def _children(pid: int) -> list[int]:
    """The processes that a server has started; none where the system does not tell."""
    try:
        return [int(child) for child in (PROC / f"{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def _is_postgres(pid: int, cluster: Path) -> bool:
    """Tell if ``pid`` is the server of this cluster, and not a program that got its number after a restart."""
    try:
        if not (PROC / "self").exists():  # macOS
            os.kill(pid, 0)
            return True
        name, state = (PROC / f"{pid}/stat").read_text().partition("(")[2].rpartition(") ")[::2]
        if not name.startswith("postgres") or state.startswith("Z"):
            return False
        try:
            return (PROC / f"{pid}/cwd").samefile(cluster)
        except PermissionError:  # root in a container may not look; then the owner must do
            return (PROC / str(pid)).stat().st_uid == cluster.stat().st_uid
    except OSError as error:
        _raise_if_unknown(error)
        return False


def _raise_if_unknown(error: OSError) -> None:
    """Raise the error again where it is about this process (no files, no memory) and says nothing about the server."""
    if error.errno in {errno.EMFILE, errno.ENFILE, errno.ENOMEM}:
        raise error
