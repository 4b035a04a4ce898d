"""Starting the command line, against starting Python: ``python -c pass``.

What a command takes is mostly the reading of what it imports. Rounds are interleaved; wall time and the processor time of the
process and what it starts. ``python -m bench.cli [--rounds 7]``
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from app.db.embedded import EmbeddedServer
from app.db.migrate import upgrade
from bench.plant import median

WANTED = 0.5  # s of wall time on a machine that does nothing else
INBAND = [sys.executable, "-m", "app"]


def measured(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Wall and processor seconds of one run."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, env=environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory(prefix="inband-bench-") as folder:
        server = EmbeddedServer(Path(folder) / "data")
        try:
            url = server.start()
            upgrade(url)
            commands = {
                "python -c pass": [sys.executable, "-c", "pass"],
                "inband --version": [*INBAND, "--version"],
                "inband --help": [*INBAND, "--help"],
                "inband key add --help": [*INBAND, "key", "add", "--help"],
                "inband key add": [*INBAND, "key", "add", "--role", "viewer", "--data-dir", str(Path(folder) / "data")],
            }
            times: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
            for turn in range(rounds + 1):
                for name, command in commands.items():
                    times_of_run = measured(command, dict(os.environ))
                    if turn:  # the first ones compile what was never read before
                        times[name].append(times_of_run)
        finally:
            server.stop()
    alone = median([wall for wall, _cpu in times["python -c pass"]])
    print(f"{'':<24} wall s   processor s   ratio to python -c pass   (wanted < {WANTED:g} s)")
    for name, runs in times.items():
        wall, cpu = median([run[0] for run in runs]), median([run[1] for run in runs])
        print(f"{name:<24} {wall:6.3f} {cpu:13.3f} {wall / alone:25.1f}")


if __name__ == "__main__":
    main()
