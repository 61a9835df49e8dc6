"""The study: ten kills at random moments and a Dask cluster change no byte, and what a scene costs of one core."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from dockpose.app.cli import main
from dockpose.study.judge import scene_rows

from tests.support.cluster import dask_cluster

SCENES, KILLS, SEED = 100, 10, 11
PROGRAM = [sys.executable, "-m", "dockpose.app.cli", "study", "--seed", str(SEED), "--jobs", "2"]
TIMED = 100
BEGUN = 0.995  # share of the moments of 0.05 s for which a kill waits on until the first block is done
# 2,000 scenes in ten minutes on two cores.
MOST_S = 2 * 600 / 2000


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


def test_a_dask_cluster_gives_the_same_bytes(tmp_path):
    words = ["study", "--scenes", "10", "--seed", "4"]
    assert main([*words, "--jobs", "1", "--out", str(tmp_path / "alone")]) == 0
    with dask_cluster() as address:
        assert main([*words, "--scheduler", address, "--out", str(tmp_path / "cluster")]) == 0
    for name in ("study.csv", "summary.json"):
        assert (tmp_path / "cluster" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()


def test_a_scene_costs_little():
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    scene_rows(SEED, 0)  # loads what was compiled
    took_s = []
    for index in range(TIMED):
        began_s = time.process_time()
        scene_rows(SEED, index)
        took_s.append(time.process_time() - began_s)
    cv2.setNumThreads(threads)
    print(
        f"\nA scene, drawn, rendered and tried by all methods, takes {np.mean(took_s):.2f} s of one core on average, "
    )
    print(
        f"{np.median(took_s):.2f} s at the median, {max(took_s):.2f} s at most; at most {MOST_S:.2f} s are to be taken"
    )
    assert np.mean(took_s) <= MOST_S
