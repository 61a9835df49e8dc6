"""Tables 2 to 4 of Ghosh et al. 2016, doi 10.1007/s00138-015-0736-4, and the same poses on rendered pictures."""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.paper.scenes import CAMERA, DIAMETER_M
from dockpose.pose.circle import CirclePose
from dockpose.pose.pnp import NoPoseError, solve
from dockpose.simulate import Lights, Pose, Scene, Sensor, Truth, render
from dockpose.study.judge import nearest

COLUMNS = ("x (cm)", "y (cm)", "z (cm)", "theta x (deg)", "theta y (deg)")
DRAWS = 20  # pictures of each pose, each with its roll and noise


@dataclass(frozen=True)
class Table:
    """Poses of one table of the paper, one per row: x, y, z in centimetres, theta_x and theta_y in degrees."""

    lights: int  # number of lights of the ring, 0.30 m in diameter
    measured: np.ndarray  # (N, 5): measured by hand in the tank
    estimated: np.ndarray  # (N, 5): estimated by the paper's method
    epnp: np.ndarray | None = None  # (N, 5): estimated by EPnP from the coloured lights

    @property
    def mean_errors(self) -> np.ndarray:
        """The paper's own mean absolute error of each column (5,)."""
        return np.abs(self.estimated - self.measured).mean(axis=0)

    @property
    def dock(self) -> Dock:
        """Ten lights, or twelve in Table 4."""
        return Dock(DIAMETER_M, self.lights)

    @property
    def colours(self) -> tuple[str, ...]:
        """Of each light in Table 4, white but for two red and two blue; empty in the others, where all are white."""
        colours = {0: "red", 3: "red", 6: "blue", 9: "blue"}
        return () if self.epnp is None else tuple(colours.get(light, "white") for light in range(self.lights))


def _read(name: str, lights: int) -> Table:
    """A table of the paper, by its number."""
    text = Path(__file__).with_name("tables.csv").read_text(encoding="utf-8")
    rows = [row for row in csv.reader(text.splitlines()) if row[0] == name]
    poses = {of: np.array([row[3:] for row in rows if row[2] == of], dtype=float) for of in {row[2] for row in rows}}
    return Table(lights, **poses)


TABLES = {name: _read(name, lights) for name, lights in (("2", 10), ("3", 10), ("4", 12))}


def tank_picture(
    row: np.ndarray, dock: Dock, key: list[int], camera: Camera = CAMERA, colours: tuple[str, ...] = (), **sensor: Any
) -> tuple[Estimate, Truth]:
    """What is found in a picture of the dock at a pose (5,) of the tables in the tank's water, and the truth."""
    rng = np.random.default_rng(key)
    x, y, z = (row[:3] / 100).tolist()
    attitude = dict(zip(("theta_x_deg", "theta_y_deg"), row[3:].tolist(), strict=True))
    pose = Pose(position_m=(x, y, z), **attitude, roll_deg=rng.uniform(0, 360))
    how = Sensor(colour="bgr" if colours else "grey", **sensor)
    lights, seed = Lights(colours=colours), int(rng.integers(1 << 30))
    image, truth = render(Scene(camera=camera, dock=dock, pose=pose, lights=lights, sensor=how, seed=seed))
    return estimate(image, camera, dock), truth


def reproduced(name: str, seed: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """For each pose of a table, of ``DRAWS`` pictures: our estimates and EPnP's (DRAWS, 5), and where ours is right."""
    table = TABLES[name]
    for number, row in enumerate(table.measured):
        keys = ([seed, 3, int(name), number, draw] for draw in range(DRAWS))
        pictures = [tank_picture(row, table.dock, key, colours=table.colours) for key in keys]
        # EPnP has the lights that the pipeline found, and is told which is which, as colours tell it in the paper;
        # right is who chose the nearer of both poses.
        right = [bool(f.candidates) and f.selected is nearest(f.candidates, truth.normal) for f, truth in pictures]
        ours = [numbers_of(found.selected) for found, _ in pictures]
        epnp = [numbers_of(_by_epnp(found, truth)) for found, truth in pictures]
        yield np.array(ours), np.array(epnp), np.array(right)


def numbers_of(pose: CirclePose | None) -> list[float]:
    """A pose as the tables have it: x, y, z in centimetres, theta_x and theta_y in degrees; NaN where there is none."""
    if pose is None:
        return [math.nan] * 5
    x, y, z = (100 * pose.position_m).tolist()
    return [x, y, z, math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad)]


def _by_epnp(found: Estimate, truth: Truth) -> CirclePose | None:
    if found.markers is None or found.ring is None:
        return None
    points = found.markers.points_px[found.ring.on_ring]
    lights = np.linalg.norm(points[:, None] - truth.lights_px, axis=2).argmin(axis=1)
    try:
        return solve(points, lights, found.camera, found.dock, "epnp")
    except NoPoseError:
        return None
