"""Docks so close that their lamps fill much of the picture and run together, drawn without the project's simulator."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from multiprocessing import Pool

import numpy as np
from dockpose import estimate

from tests.bench.lamps import draw_close

PICTURES = 200
SHARES = (0.05, 0.1, 0.2, 0.35)
ASKED_RIGHT = 98.0


@dataclass(frozen=True)
class Result:
    """What came of one picture."""

    lit_share: float
    right: bool
    status: str
    error_px: float


def run(seed: int) -> Result:
    drawn = draw_close(seed)
    found = estimate(drawn.image, drawn.camera, drawn.dock)
    right, error_px = False, np.nan
    if found.markers is not None and len(found.markers):
        apart = np.linalg.norm(found.markers.points_px[:, None] - drawn.lamps_px[None], axis=2).min(axis=0)
        error_px = float(np.sqrt((apart**2).mean()))
    if found.selected is not None:
        angle_deg = np.degrees(np.arccos(np.clip(found.selected.normal @ drawn.normal, -1, 1)))
        apart_m = np.linalg.norm(found.selected.position_m - drawn.position_m)
        right = bool(angle_deg < 5 and apart_m < 0.03 * np.linalg.norm(drawn.position_m))
    return Result(drawn.lit_share, right, found.status, error_px)


@cache
def results() -> list[Result]:
    with Pool() as pool:
        return pool.map(run, range(PICTURES), chunksize=5)


def test_close_lights_are_told_apart():
    print("\nlit share      pictures  right %  wrong but ok  centres off by, px (median)")
    for low, high in pairwise(SHARES):
        part = [r for r in results() if low <= r.lit_share <= high]
        wrong = sum(r.status == "ok" and not r.right for r in part)
        right = 100 * float(np.mean([r.right for r in part]))
        off = float(np.nanmedian([r.error_px for r in part]))
        print(f"{low:.2f} to {high:.2f} {len(part):10}{right:9.1f}{wrong:14}{off:12.2f}")
    assert 100 * np.mean([r.right for r in results()]) >= ASKED_RIGHT
