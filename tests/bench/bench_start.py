"""How long the program takes to start, in processor time, which other processes of the machine hardly lengthen."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

resource = pytest.importorskip("resource")

ROOT = Path(__file__).resolve().parents[2]
TRIES = 5
FIRST_ANSWER_S = 15  # of processor time, which is all of it on a quiet machine, with nothing compiled yet
NUMPY_S = 0.1  # of processor time that importing numpy takes on a machine with nothing else to do
PROGRAM = [sys.executable, "-m", "dockpose.app.cli"]


def processor_s(command, **environment):
    """User and system seconds of a command, and what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=600, cwd=ROOT, env=os.environ | environment
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stderr


def least_s(command):
    return min(processor_s(command)[0] for _ in range(TRIES))


@pytest.mark.parametrize(
    ("name", "command", "most_s"),
    [
        ("--version", [*PROGRAM, "--version"], 0.15),
        ("--help", [*PROGRAM, "--help"], 0.15),
        ("import dockpose", [sys.executable, "-c", "import dockpose"], 0.3),
        ("estimate of one picture, warm", [*PROGRAM, "estimate", "tilted"], 0.9),
    ],
)
def test_a_start_is_short(name, command, most_s):
    processor_s(command)  # compiles what is not
    took_s, numpy_s = least_s(command), least_s([sys.executable, "-c", "import numpy"])
    print(f"\n{name}: {took_s:.2f} s of processor time; importing numpy takes {numpy_s:.2f} s")
    # Beside busy processes the same work takes more of it, as much more as importing numpy does.
    assert took_s < most_s * max(1.0, numpy_s / NUMPY_S)


def test_the_first_answer_of_a_new_environment_is_compiled_with_a_word_on_it(tmp_path):
    began_s = time.monotonic()
    took_s, told = processor_s([*PROGRAM, "estimate", "tilted"], NUMBA_CACHE_DIR=str(tmp_path))
    waited_s, numpy_s = time.monotonic() - began_s, least_s([sys.executable, "-c", "import numpy"])
    lines = [line for line in told.splitlines() if "compiling" in line]
    print(f"\nthe first answer: {took_s:.1f} s of processor time in {waited_s:.1f} s; numpy {numpy_s:.2f} s")
    print("\n".join(lines))
    assert len(lines) == 1
    assert took_s < FIRST_ANSWER_S * max(1.0, numpy_s / NUMPY_S)
