import os
import subprocess
import sys

from app import HOUSE


def test_linear_algebra_keeps_to_one_thread() -> None:
    """Matrices are small here: more threads would only take the processors from others."""
    program = "import os, app, numpy; numpy.linalg.eigvalsh(numpy.eye(400)); print(len(os.listdir('/proc/self/task')))"
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run([sys.executable, "-c", program], cwd=HOUSE, env=environment, capture_output=True, text=True)
    assert done.stdout == "1\n", done.stderr
