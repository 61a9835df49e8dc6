"""Run a command of the program where no file may grow beyond some bytes, as on a disk that fills up."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

_PROGRAM = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from dockpose.app.cli import main
limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
sys.exit(main(sys.argv[2:]))
"""


def run_on_full_disk(limit_bytes: int, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", _PROGRAM, str(limit_bytes), *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
