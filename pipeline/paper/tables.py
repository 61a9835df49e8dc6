"""Tables 2 to 4 of Ghosh et al. 2016, doi 10.1007/s00138-015-0736-4, and the same poses on rendered pictures."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.pose.pnp import NoPoseError, solve
from dockpose.simulate import Pose, Scene, Sensor, render
from dockpose.study.judge import nearest

COLUMNS = ("x (cm)", "y (cm)", "z (cm)", "theta x (deg)", "theta y (deg)")


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


def coded_dock(diameter: float) -> Dock:
    """The colour-coded dock of Table 4: 12 lights, white but for two red and two blue; no turn looks the same."""
    colours = {0: "red", 3: "red", 6: "blue", 9: "blue"}
    return Dock(diameter, colours=tuple(colours.get(light, "white") for light in range(12)))


def _read(name: str, lights: int) -> Table:
    """A table of the paper, by its number."""
    poses: dict[str, list[list[float]]] = {}
    with Path(__file__).with_name("tables.csv").open(encoding="utf-8") as file:
        for table, _, of, *pose in csv.reader(file):
            if table == name:
                poses.setdefault(of, []).append([float(value) for value in pose])
    return Table(lights, **{of: np.array(rows) for of, rows in poses.items()})


TABLES = {name: _read(name, lights) for name, lights in (("2", 10), ("3", 10), ("4", 12))}


CAMERA = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
DIAMETER_M = 0.30
DRAWS = 20  # pictures of each pose, each with its roll and noise


@dataclass(frozen=True)
class Row:
    """One pose of a table, as estimated from rendered pictures."""

    ours: np.ndarray  # estimates of x, y, z in centimetres and theta_x, theta_y in degrees
    epnp: np.ndarray  # the same by EPnP from the lights that the pipeline found and numbered
    right: np.ndarray  # whether of the two poses the right one was chosen


def tank_scene(row: np.ndarray, dock: Dock, roll_deg: float, seed: int, camera: Camera = CAMERA) -> Scene:
    """The dock at a pose of the paper's tables (5,), in the water of the tank."""
    x, y, z = (row[:3] / 100).tolist()
    pose = Pose(position_m=(x, y, z), theta_x_deg=float(row[3]), theta_y_deg=float(row[4]), roll_deg=roll_deg)
    sensor = Sensor(colour="bgr" if dock.colours else "grey")
    return Scene(camera=camera, dock=dock, pose=pose, sensor=sensor, seed=seed)


def table_dock(name: str) -> Dock:
    """The dock of a table: ten white lights, or twelve of which four are coloured in Table 4."""
    return coded_dock(DIAMETER_M) if TABLES[name].epnp is not None else Dock(DIAMETER_M, TABLES[name].lights)


def reproduce_row(name: str, number: int, seed: int, draws: int = DRAWS) -> Row:
    """Render and estimate one pose of a table of the paper."""
    row, dock = TABLES[name].measured[number], table_dock(name)
    normal = -rotation_from_angles(*np.radians(row[3:]))[:, 2]
    ours, epnp, right = [], [], []
    for draw in range(draws):
        rng = np.random.default_rng([seed, 3, int(name), number, draw])
        image, _ = render(tank_scene(row, dock, rng.uniform(0, 360), int(rng.integers(1 << 30))))
        found = estimate(image, CAMERA, dock)
        ours.append(numbers_of(found.selected))
        epnp.append(numbers_of(_by_epnp(found)))
        right.append(found.selected is not None and found.selected is nearest(found.candidates, normal))
    return Row(np.array(ours), np.array(epnp), np.array(right))


def numbers_of(pose: CirclePose | None) -> list[float]:
    """A pose as the tables have it: x, y, z in centimetres, theta_x and theta_y in degrees; NaN where there is none."""
    if pose is None:
        return [math.nan] * 5
    x, y, z = (100 * pose.position_m).tolist()
    return [x, y, z, math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad)]


def _by_epnp(found: Estimate) -> CirclePose | None:
    if found.markers is None or found.ring is None or found.choice is None or found.choice.lights is None:
        return None
    points = found.markers.points_px[found.ring.on_ring]
    try:
        return solve(points, found.choice.lights, found.camera, found.dock, "epnp")
    except NoPoseError:
        return None
