"""The study: ten kills at random moments change no byte."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

SCENES, KILLS, SEED = 100, 10, 11
PROGRAM = [sys.executable, "-m", "dockpose.app.cli", "study", "--seed", str(SEED), "--jobs", "2"]
BEGUN = 0.995  # share of the moments of 0.05 s for which a kill waits on until the first block is done


def start(folder: Path) -> subprocess.Popen:
    program = [*PROGRAM, "--scenes", str(SCENES), "--out", str(folder)]
    return subprocess.Popen(program, start_new_session=True, stderr=subprocess.DEVNULL)


def done(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "scenes").glob("*.csv"))


def test_ten_kills_change_no_byte(tmp_path):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    assert start(whole).wait() == 0
    rng = np.random.default_rng(SEED)
    print("\nBlocks of scenes that were done at each kill:", end="")
    before: dict[str, bytes] = {}
    for _ in range(KILLS):
        process, had = start(killed), len(before)
        while rng.random() < BEGUN and len(done(killed)) == had:  # mostly after its first block, sometimes before
            time.sleep(0.05)
        time.sleep(rng.uniform(0, 3))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        now = {name: (killed / "scenes" / name).read_bytes() for name in done(killed)}
        assert {name: now[name] for name in before} == before  # none is lost, none done again
        before = now
        print(f" {len(now)}", end="", flush=True)
    assert start(killed).wait() == 0
    print(f"; of {len(done(killed))}")
    for name in ("study.csv", "summary.json"):
        assert (killed / name).read_bytes() == (whole / name).read_bytes()
