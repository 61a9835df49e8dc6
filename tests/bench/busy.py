"""Run ``make test`` beside four processes that hold the cores: ``python -m tests.bench.busy --runs 10``."""

import argparse
import subprocess
import sys
import time
from pathlib import Path

BUSY = 4  # on two cores; each test has a third of a core or less


def main() -> int:
    """Print a line a run, and keep the output of one that fails in build/. Returns 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10)
    runs = parser.parse_args().runs
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(BUSY)]
    passed = 0
    try:
        for run in range(1, runs + 1):
            start_s = time.monotonic()
            done = subprocess.run(["make", "test"], capture_output=True, text=True, check=False)
            passed += done.returncode == 0
            failures = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
            if failures:
                Path("build").mkdir(exist_ok=True)
                Path(f"build/busy-{run}.txt").write_text(done.stdout, encoding="utf-8")
            print(f"run {run}: {time.monotonic() - start_s:.0f} s", *failures or ["all passed"], sep="\n  ", flush=True)
            assert all(one.poll() is None for one in others)
    finally:
        for one in others:
            one.kill()
    print(f"{passed} of {runs} passed beside {BUSY} busy processes")
    return 0 if passed == runs else 1


if __name__ == "__main__":
    sys.exit(main())
