"""What a server needs in its first minute, read and compiled once for all that are forked: see `tests.forked`."""

import fcntl
import gc
import importlib
import pkgutil
from pathlib import Path

import app
from app.core.compile_now import compile_each
from app.loop.readings.writer.columnar import compile_now
from app.quality.proof import queries as proofs
from app.simulators import trying
from app.web.templates import environment
from tests import one_connection, quick_passwords  # noqa: F401 - they replace what they are about

gc.disable()
for module in pkgutil.walk_packages(app.__path__, "app."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
with Path(__file__).open() as lock:  # what one of several compiles, the others find
    fcntl.flock(lock, fcntl.LOCK_EX)
    compile_now()
    for _ in compile_each():
        pass
trying.SPEED *= 10  # the simulated lathe of an empty plant: its first parts in a second
proofs.proof()  # each server would prove its statistics again, half a minute after its start
for name in environment().list_templates():
    environment().get_template(name)
gc.freeze()
gc.set_threshold(20_000, 20, 20)  # as in tests/conftest.py
gc.enable()
