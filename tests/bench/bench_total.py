"""95 % intervals of the total errors, by drawers other than the simulator: drawn lamps, and the ray-traced tank."""

import json
import math
from multiprocessing import Pool
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.app.inputs.pictures import camera_and_dock
from dockpose.camera.board import Board
from dockpose.camera.calibrate import calibrate_pictures
from dockpose.camera.sigma import errors_of, moved
from dockpose.pose.circle import CirclePose
from dockpose.study.judge import nearest, signed_errors

from tests.bench.lamps import draw_lamps, unit_normal
from tests.bench.seen_scenes import circle, seen_from
from tests.support.judged import judged

TANK = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "tank"
SCENES = 200
WITHIN = (0.92, 0.98)  # asked of each number
LIGHTS_SIGMA_M, DIAMETER_SIGMA_M = 0.0005, 0.0009
OFF_DIAMETER_M = 0.0005  # of the tank's docks


def held(pose: CirclePose, position_m: np.ndarray, normal: np.ndarray) -> tuple[list[bool], list[bool]]:
    """Whether intervals of the picture's errors alone, and of all, hold x, y, z, theta_x and theta_y."""
    assert pose.errors is not None
    off = np.abs(signed_errors(pose, position_m, normal))
    outcomes = []
    for part in ("picture", None):
        position, theta = pose.errors.sigmas[part]
        outcomes.append((off <= 1.96 * np.array([*position, *np.degrees(theta)])).tolist())
    return outcomes[0], outcomes[1]


def drawn(seed: int) -> tuple[list[bool], list[bool]] | None:
    """A ring whose camera, diameter and lamps are off what the files say by their standard errors."""
    rng = np.random.default_rng([seed, 28])
    told = Camera(700, 700, 319.5, 239.5, 640, 480)
    true = told
    names, errors = errors_of(told)
    for name, off in zip(names, rng.multivariate_normal(np.zeros(len(names)), errors), strict=True):
        true = moved(true, name, float(off))
    lights = int(rng.integers(6, 15))
    dock = Dock(0.30, lights, diameter_sigma_m=DIAMETER_SIGMA_M, lights_sigma_m=LIGHTS_SIGMA_M)
    angles = rng.uniform(0, 2 * math.pi) + 2 * math.pi * np.arange(lights) / lights
    places_m = circle(angles, 0.15 + rng.normal(0, DIAMETER_SIGMA_M) / 2) + rng.normal(0, LIGHTS_SIGMA_M, (lights, 3))
    normal = unit_normal(math.radians(rng.uniform(10, 40)), rng.uniform(0, 2 * math.pi))
    position = np.array([*rng.uniform(-0.15, 0.15, 2), 1.0]) * rng.uniform(0.8, 2.5)
    lamps_px = true.project(seen_from(places_m, position, normal, 0.0))
    radii = np.full(lights, rng.uniform(1.5, 4.0))
    image = draw_lamps((640, 480), lamps_px, radii, np.full(lights, rng.uniform(0.6, 3.0)), rng, halos=())
    found = estimate(image, told, dock)
    return held(nearest(found.candidates, normal), position, normal) if found.status == "ok" else None


def table(title: str, outcomes: list[tuple[list[bool], list[bool]]]) -> np.ndarray:
    print(f"\n{title}, {len(outcomes)} poses; held in 95 % intervals, in %: x y z theta_x theta_y")
    shares = 100 * np.mean(outcomes, axis=0)
    for name, row in zip(("of the picture", "total"), shares, strict=True):
        print(f"  {name:16}" + "".join(f"{value:7.1f}" for value in row))
    return shares[1] / 100


def test_lamps_drawn_off_by_their_sigmas():
    with Pool() as pool:
        outcomes = [one for one in pool.map(drawn, range(SCENES), chunksize=10) if one is not None]
    total = table("Drawn lamps; camera, diameter and lamps off by their standard errors", outcomes)
    assert len(outcomes) > 0.95 * SCENES
    # Two standard deviations of a share of so many.
    chance = 2 * math.sqrt(0.95 * 0.05 / len(outcomes))
    assert (total >= WITHIN[0] - chance).all()
    assert (total <= WITHIN[1] + chance).all()


@pytest.mark.skipif(not TANK.is_dir(), reason="the ray-traced tank is not there")
def test_the_tank_by_its_boards_with_a_wrong_diameter():
    boards = [
        (path.name, cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)) for path in sorted((TANK / "boards_bW").glob("*.jpg"))
    ]
    camera = calibrate_pictures(boards, Board(11, 8, 0.02)).camera
    print(f"\nfx {camera.fx:.1f}, the true camera's is 612.4")
    outcomes = []
    for folder in ("stills", "aquaria"):
        for truth in json.loads((TANK / folder / "truth.json").read_text()):
            spec = truth["spec"]
            if not truth["dock"] or spec["rig"] != "W":
                continue
            path = TANK / folder / truth["file"]
            dock = camera_and_dock(path, None, None)[1]
            # A rim hides a part of the lamps' light, and a dome holds it deeper.
            depth_m = spec["lamp_r"] * (0.4 if spec["lamp_kind"] == "dome" else -0.15)
            wrong = msgspec.structs.replace(dock, diameter=dock.diameter + OFF_DIAMETER_M, lamp_depth_m=depth_m)
            found = estimate(path, camera, wrong)
            position, normal = np.array(truth["position_m"]), np.array(truth["normal"])
            if found.selected is not None and judged(found, position, normal).right:
                outcomes.append(held(found.selected, position, normal))
    total = table("The tank with a camera from its boards and 0.5 mm of diameter too much", outcomes)
    assert len(outcomes) > 20
    assert (total[:3] >= 0.90).all()
