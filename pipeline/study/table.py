"""The study's file as columns, and the bins in which a factor is looked at."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

_TEXT = frozenset({"method", "status", "outcome", "selected_by"})
Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Factor:
    """Something that makes it harder to find the dock, in bins."""

    name: str  # of its column
    title: str  # for people, with its unit
    edges: tuple[float, ...]  # of the bins
    is_whole: bool = False  # whether it is counted, so that a bin is named by the first and last number in it
    is_listed: bool = False  # whether it has a few values only, the lower edges, so that each bin is named by its own

    @property
    def labels(self) -> list[str]:
        """Names of the bins."""
        pairs = list(zip(self.edges[:-1], self.edges[1:], strict=True))
        if self.is_listed:
            return [f"{low:g}" for low, _ in pairs]
        if not self.is_whole:
            return [f"{low:g} to {high:g}" for low, high in pairs]
        last = [*(int(high) - 1 for _, high in pairs[:-1]), int(self.edges[-1])]
        firsts = [int(low) for low, _ in pairs]
        return [f"{low}" if low == high else f"{low} to {high}" for low, high in zip(firsts, last, strict=True)]

    def bins_of(self, values: np.ndarray) -> np.ndarray:
        """Number of the bin of each value, -1 for none."""
        found = np.searchsorted(self.edges, values, side="right") - 1
        found = np.where(values == self.edges[-1], len(self.edges) - 2, found)
        return np.where((found < 0) | (found > len(self.edges) - 2) | ~np.isfinite(values), -1, found)


FACTORS = {
    factor.name: factor
    for factor in (
        Factor("turbidity", "turbidity (0 clear, 1 harbour)", (0, 0.2, 0.4, 0.6, 0.8, 1)),
        Factor("attenuation_lengths", "range in attenuation lengths", (0, 0.5, 1, 2, 3, 5, 8.5)),
        Factor("range_m", "range in m", (0, 1, 2, 4, 7, 10, 22)),
        Factor("range_diameters", "range in dock diameters", (0, 2, 4, 8, 12, 20, 60)),
        Factor("ring_radius_px", "ring's radius in pixels", (10, 20, 40, 80, 160, 500)),
        Factor("tilt_deg", "tilt in degrees", (0, 10, 20, 30, 40, 50, 60)),
        Factor("ambient_levels", "ambient light in grey levels", (0, 20, 40, 60, 80, 100, 120)),
        Factor("lit_share", "lit share of the picture", (0, 0.001, 0.003, 0.01, 0.03, 0.1, 1)),
        Factor("read_noise_levels", "read noise in grey levels", (0.5, 1, 1.5, 2, 3, 4, 6)),
        Factor("lights", "number of lights", (4, 5, 6, 8, 11, 15, 20, 24), is_whole=True),
        Factor("missing", "missing lights", (0, 1, 2, 3, 5, 8), is_whole=True),
        Factor("strays", "stray lights", (0, 1, 4, 7, 11, 20, 34), is_whole=True),
        Factor("lamp_spacings", "lamp's radius in spacings of the lights", (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)),
        Factor("focal_widths", "focal length in picture widths", (0.5, 0.75, 1, 1.5, 2, 3)),
        Factor("width_px", "picture's width in pixels", (320, 640, 800, 1280, 1920, 1921), is_listed=True),
    )
}


def columns_of(text: str) -> Columns:
    """Columns of a CSV file: words as text, all else as floats, NaN where a cell is empty."""
    reader = csv.reader(io.StringIO(text))
    head = next(reader)
    cells = list(zip(*reader, strict=True)) or [() for _ in head]
    return {
        name: np.array(values, dtype=object)
        if name in _TEXT
        else np.array([float(value) if value else np.nan for value in values])
        for name, values in zip(head, cells, strict=True)
    }


def of_method(columns: Columns, label: str) -> Columns:
    """The rows of a method, one for each scene."""
    return where(columns, columns["method"] == label)


def where(columns: Columns, rows: np.ndarray) -> Columns:
    """Some of the rows."""
    return {name: values[rows] for name, values in columns.items()}
