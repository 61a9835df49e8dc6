"""Plots of results beside a trajectory: errors by range, both paths, and the clocks."""

from typing import TYPE_CHECKING, cast

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE
from dockpose.app.drawing.figures import new_figure
from dockpose.app.drawing.numbers import QUANTITIES
from dockpose.app.export.truth.results import Results
from dockpose.truth import TrajectoryComparison
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

_UNITS = np.array([100, 100, 100, np.degrees(1), np.degrees(1)])
_BAND = 1.96  # standard errors of an interval of 95 %
_BINS = 20


def error_figure(found: TrajectoryComparison, results: Results) -> Figure:
    """Error by range of each degree of freedom, with the band that the results claim to hold in 95 %."""
    figure = new_figure(9.0, 5.2, layout="constrained")
    ranges_m = np.linalg.norm(found.true_positions_m, axis=1)
    shown = ~found.is_fitted & np.isfinite(found.errors[:, 0]) & np.isfinite(ranges_m)
    wrong, order = found.is_wrong_pose | found.is_wrong_dock, np.flatnonzero(shown)[np.argsort(ranges_m[shown])]
    parts = [part for part in np.array_split(order, min(_BINS, max(1, len(order) // 5))) if len(part)]
    middles = [float(np.median(ranges_m[part])) for part in parts]
    *panels, last = figure.subplots(2, 3).ravel()
    for axis, (panel, name) in enumerate(zip(panels, QUANTITIES, strict=True)):
        errors, sigmas = found.errors[:, axis] * _UNITS[axis], found.sigmas[:, axis] * _UNITS[axis]
        band = np.array([_BAND * np.nanmedian(sigmas[part]) for part in parts])
        panel.fill_between(middles, -band, band, color=ORANGE, alpha=0.3, linewidth=0, label="95 % as claimed")
        for which, colour, mark, label in ((~wrong, BLUE, "o", "error"), (wrong, GREEN, "x", "wrong pose or dock")):
            panel.plot(ranges_m[shown & which], errors[shown & which], mark, color=colour, markersize=2, label=label)
        good = errors[shown & ~wrong]
        most = max([*np.abs(good), *band[np.isfinite(band)], 1e-6])
        panel.set(ylim=(-1.3 * most, 1.3 * most), ylabel=f"error of {name}", xlabel="range (m)")
    last.axis("off")
    last.legend(*panels[0].get_legend_handles_labels(), loc="center")
    return figure


def path_figure(found: TrajectoryComparison, results: Results) -> Figure:
    """The camera's way in the trajectory's world by both, from above and aside."""
    figure = new_figure(9.0, 4.4, layout="constrained")
    panels = figure.subplots(1, 2)
    for panel, (across, up), title in zip(
        panels, ((0, 1), (0, 2)), ("along the world's z", "along its y"), strict=True
    ):
        for path, colour, line, label in (
            (found.true_camera_m, ORANGE, "-", "trajectory"),
            (found.camera_m, BLUE, ".", "results"),
        ):
            panel.plot(path[:, across], path[:, up], line, color=colour, markersize=2, label=label)
        if found.dock_in_world.position_m is not None:
            dock = np.asarray(found.dock_in_world.position_m)
            panel.plot(dock[across], dock[up], "*", color=GREEN, markersize=9, label="dock")
        panel.set(xlabel=f"{'xyz'[across]} (m)", ylabel=f"{'xyz'[up]} (m)", title=f"seen {title}", aspect="equal")
        panel.set_adjustable("datalim")
    panels[1].legend(fontsize=8)
    return figure


def space_figure(found: TrajectoryComparison, results: Results) -> Figure:
    """Both ways of the camera in the trajectory's world, in 3D."""
    figure = new_figure(6.0, 5.0, layout="constrained")
    axes = cast("Axes3D", figure.add_subplot(projection="3d"))
    axes.plot(*found.true_camera_m.T, color=ORANGE, linewidth=1.2, label="trajectory")
    axes.plot(*found.camera_m.T, ".", color=BLUE, markersize=2, label="results")
    if found.dock_in_world.position_m is not None:
        axes.plot(*np.reshape(found.dock_in_world.position_m, (3, 1)), "*", color=GREEN, markersize=9, label="dock")
    axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize=8)
    return figure


def clock_figure(found: TrajectoryComparison, results: Results) -> Figure:
    """By which time each frame alone is off, once offset and drift are taken out."""
    figure = new_figure(9.0, 2.6, layout="constrained")
    axes, times_s = figure.subplots(), results.track.times_s
    axes.plot(times_s, 1000 * found.clock_residuals_s, ".", color=BLUE, markersize=2)
    axes.axhline(0, color="black", linewidth=0.8)
    known = np.abs(found.clock_residuals_s[np.isfinite(found.clock_residuals_s)])
    most_ms = 1000 * float(np.quantile(known, 0.98)) if len(known) else 1.0
    axes.set(
        xlabel="time of the results (s)", ylabel="clock off (ms)", ylim=(-1.5 * most_ms - 1e-3, 1.5 * most_ms + 1e-3)
    )
    return figure


# Of each file its title and what draws it.
FIGURES = {
    "errors": ("Error by range", error_figure),
    "paths": ("Both paths", path_figure),
    "space": ("Both paths in 3D", space_figure),
    "clocks": ("What is left of the clocks", clock_figure),
}
