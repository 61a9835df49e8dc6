"""How long a photograph takes beside looking for ArUco tags in it, by kind.

Processor time too, which says less of what else the machine does; both of one thread.
"""

import time
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest
from dockpose import estimate

from tests.bench import photographs

DATA, WIDEST_PX = Path("../shared/data"), 1280


def test_photographs_beside_aruco():
    """Each once for the number of lights that is told; the first look at each compiles what it needs."""
    jobs = [job for job in photographs.jobs(DATA, [photographs.LEDS]) if job.told is not None]
    if not jobs:
        pytest.skip(f"{DATA} is not there")
    cv2.setNumThreads(1)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    rows = []
    for job in jobs:
        picture = cv2.imread(str(job.path))
        assert picture is not None
        scale = min(1.0, WIDEST_PX / picture.shape[1])
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        camera, dock = photographs.camera_and_dock_of(job, picture.shape[1], picture.shape[0])
        estimate(picture, camera, dock)
        ours = taken_s(partial(estimate, picture, camera, dock), 2)
        tags = taken_s(partial(detector.detectMarkers, picture), 4)
        rows.append((job.kind, ours[0] / tags[0], *ours, *tags))
    ratios = np.array([row[1] for row in rows])
    sums = np.array([row[2:] for row in rows]).sum(axis=0)
    print(f"\n{len(rows)} photographs, at most {WIDEST_PX} px wide; time beside ArUco:")
    print(f"median {np.median(ratios):.0f}, nine in ten {np.percentile(ratios, 90):.0f}, worst {ratios.max():.0f}")
    print(f"all together {sums[0] / sums[2]:.1f}, by processor time {sums[1] / sums[3]:.1f}")
    for kind in sorted({row[0] for row in rows}):
        print(f"  {kind:24} median {np.median([row[1] for row in rows if row[0] == kind]):.0f}")
    assert len(rows) == len(jobs)


def taken_s(work, times: int) -> tuple[float, float]:
    """The shortest of so many runs, and the processor time of that."""
    runs = []
    for _ in range(times):
        wall, own = time.perf_counter(), time.process_time()
        work()
        runs.append((time.perf_counter() - wall, time.process_time() - own))
    return min(runs)
