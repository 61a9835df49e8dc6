"""Compiling goes on where its result cannot be kept."""

import subprocess
import sys

import pytest

PROGRAM = """
import resource, signal
from dockpose.thresholds.compiled import compiled
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))  # as on a full disk: no file gets further

from dockpose.thresholds.bright import bright_pixels
import numpy as np
print(len(bright_pixels(np.full((2, 2), 9, np.uint8), 5)))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limit on files here")
def test_a_full_disk_does_not_end_the_run(tmp_path):
    pytest.importorskip("resource")
    environment = {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert (done.returncode, done.stdout.strip()) == (0, "4"), done.stderr[-500:]
