"""The measurements of the paper: Tables 2 to 4 of Ghosh et al. 2016, doi 10.1007/s00138-015-0736-4."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from dockpose.dock import Dock

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
