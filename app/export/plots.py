"""Plots: a picture's histogram, a session's errors against range, a sequence's poses over time."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from dockpose.app.drawing.colours import BARS_COLOUR, BLUE, GREEN, GROUPS_COLOUR, ORANGE, PEAKS_COLOUR, THRESHOLD_COLOUR
from dockpose.app.drawing.figures import new_figure
from dockpose.app.drawing.numbers import QUANTITIES
from dockpose.app.experiment.row import Row
from dockpose.thresholds import LEVELS, Threshold

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"), (BLUE, "o"), (ORANGE, "s"))  # one for each of QUANTITIES


def histogram_figure(threshold: Threshold) -> "Figure":
    """Return a plot of the pixels at each grey level, the threshold, the peaks, and the groups each level leaves."""
    figure = new_figure(6.5, 3.0, layout="constrained")
    axes = figure.add_subplot()
    levels = np.arange(LEVELS)
    axes.fill_between(levels, threshold.histogram + 1, 1, step="mid", color=BARS_COLOUR, label="pixels + 1")
    axes.set(yscale="log", xlim=(0, LEVELS - 1), xlabel="grey level (0 to 255)", ylabel="pixels + 1")
    if threshold.level < LEVELS:
        axes.axvline(threshold.level, color=THRESHOLD_COLOUR, label=f"level {threshold.level} ({threshold.method})")
    peaks = [peak.level for peak in threshold.peaks]
    if peaks:
        axes.plot(peaks, threshold.histogram[peaks] + 1, "v", color=PEAKS_COLOUR, label="peaks")
    groups = np.where(threshold.groups_at_level < 0, np.nan, threshold.groups_at_level)
    if np.isfinite(groups).any():
        right = axes.twinx()
        right.plot(levels, groups, "--", color=GROUPS_COLOUR, drawstyle="steps-mid")
        axes.plot([], [], "--", color=GROUPS_COLOUR, label="groups (right)")
        at_level = groups[threshold.level] if threshold.level < LEVELS else np.nan
        right.set(ylabel="groups", ylim=(0, max(10.0, 2 * np.nan_to_num(at_level))))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure


def error_figure(rows: Sequence[Row]) -> "Figure":
    """Return a plot of estimated minus measured against range: position above, angles below."""
    figure = new_figure(6.5, 4.8, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    ranges = [np.nan if row.range_cm is None else row.range_cm / 100 for row in rows]
    for axes, which in ((above, range(3)), (below, range(3, 5))):
        for index in which:
            errors = [np.nan if row.errors[index] is None else row.errors[index] for row in rows]
            if np.isfinite(np.array(errors, dtype=float)).any():
                colour, mark = _STYLES[index]
                axes.plot(ranges, errors, mark, color=colour, markersize=4, label=QUANTITIES[index].split()[0])
        axes.axhline(0, color="grey", lw=0.6)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8)
        else:
            axes.text(0.5, 0.6, "nothing was measured", transform=axes.transAxes, ha="center")
    above.set_ylabel("estimated − measured (cm)")
    below.set(xlabel="range (m)", ylabel="estimated − measured (°)")
    return figure


def sequence_figure(lines: Sequence[dict[str, Any]]) -> "Figure":
    """Return a plot of the chosen pose of each line of schema 1 over time, or over frames where times are unknown."""
    times = [line.get("time_s") for line in lines]
    timed = all(time is not None for time in times) and len(set(times)) == len(times)
    across = np.array(times if timed else range(len(lines)), dtype=float)
    poses = [chosen_of(line) for line in lines]
    figure = new_figure(6.5, 6.4, layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    for index in range(5):
        colour, mark = _STYLES[index]
        axes = top if index < 3 else middle
        values = [np.nan if pose is None else pose[index] for pose in poses]
        axes.plot(across, values, mark, color=colour, markersize=2.5, label=QUANTITIES[index].split()[0])
    chances = [np.nan if pose is None or pose[5] is None else pose[5] for pose in poses]
    bottom.plot(across, chances, "o", color=BLUE, markersize=2.5, label="of the chosen pose, from its frame alone")
    tracked = [(line.get("track") or {}).get("probability") for line in lines]
    if any(chance is not None for chance in tracked):
        values = [np.nan if chance is None else chance for chance in tracked]
        bottom.plot(across, values, "^", color=ORANGE, markersize=2.5, label="with earlier frames")
    for axes, label in ((top, "position (cm)"), (middle, "attitude (°)"), (bottom, "probability")):
        axes.set_ylabel(label)
        axes.legend(fontsize=8)
    bottom.set(ylim=(-0.05, 1.05), xlabel="time (s)" if timed else "frame")
    return figure


def chosen_of(line: Mapping[str, Any]) -> list[Any] | None:
    """Return a line's chosen pose in the order and units of ``QUANTITIES``, then its probability; None without one."""
    if line["selected"] is None:
        return None
    pose = line["candidates"][line["selected"]]
    lengths = (100 * value for value in pose["position_m"])
    return [*lengths, pose["theta_x_deg"], pose["theta_y_deg"], pose["probability"]]
