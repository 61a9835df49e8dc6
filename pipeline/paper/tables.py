"""The measurements of the paper: Tables 2 to 4 of Ghosh et al. 2016, doi 10.1007/s00138-015-0736-4."""

from __future__ import annotations

from dataclasses import dataclass

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


TABLES = {
    "2": Table(
        10,
        np.array(
            [
                [8, -15.5, 145, 8, 16],
                [8, -13.5, 131, 8, 18],
                [7, -11.5, 113, 7, 21],
                [-12.5, 11.5, 157, 30, 30],
                [7, 5, 96, 16, 23],
            ]
        ),
        np.array(
            [
                [8.07, -15.85, 145.32, 8, 16.2],
                [7.96, -13.58, 130.81, 8, 18.3],
                [7.01, -11.59, 113.15, 7.3, 20.9],
                [-12.79, 11.52, 157.36, 29.5, 29.5],
                [6.75, 4.92, 96.5, 16.2, 23.2],
            ]
        ),
    ),
    "3": Table(
        10,
        np.array(
            [[-2, 0, 70, 32, 0], [0, 4, 80, 30, -5], [-5, 0, 80, -30, -19], [-2, 1, 80, 35, 26], [3, 6, 95, 7, -15.0]]
        ),
        np.array(
            [
                [-1.72, -0.22, 70.76, 33.3, 0],
                [0.03, 4.17, 79.4, 28.2, -6],
                [-5.12, 0.28, 78.96, -30.8, -18.4],
                [-1.92, 1.04, 79.45, 34.6, 27.1],
                [3.33, 6.27, 97.01, 7.06, -16.2],
            ]
        ),
    ),
    "4": Table(
        12,
        np.array([[-24, 2.5, 137, 25, 24], [-10, -1, 85, 30, 32.0]]),
        np.array([[-24.6, 2.5, 139.9, 25.2, 24.4], [-10.2, -0.65, 87.8, 30.4, 32.9]]),
        np.array([[-24.3, 1.96, 135.1, 25.3, 22.23], [-9.6, -1.4, 82.2, 29.1, 31.6]]),
    ),
}
