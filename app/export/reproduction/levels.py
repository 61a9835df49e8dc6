"""Figures 3, 8, 14 and 16: the level of HATS, and what depends on the level."""

from collections.abc import Mapping, Sequence

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, THRESHOLD_COLOUR
from dockpose.app.drawing.numbers import count
from dockpose.app.export import plots as draw
from dockpose.app.export.parts import Part
from dockpose.app.export.plots import PHOTO_DPI, SMALL, canvas, show
from dockpose.paper import levels as sweeps
from dockpose.paper.levels import AtLevel, Picture, are_the_lights, centre_errors_px, group_centres
from dockpose.paper.scenes import near_ring, tank_scenes
from dockpose.thresholds import LEVELS
from dockpose.thresholds.hats import background_mode
from matplotlib.axes import Axes

_DEAD = (2, 3, 4)  # three neighbours
_CENTRES = {"mass moment": (BLUE, "-"), "centre of the ellipse": (ORANGE, "--"), "centre by the pose": (GREEN, ":")}
_PICTURES = 40
_AGREE = 2.0  # standard errors


def figure_3(seed: int) -> Part:
    """Too low, right and too high a level on one picture."""
    picture = Picture(near_ring(seed))
    below = np.flatnonzero(picture.groups[: picture.hats.level] <= picture.lights / 2)
    levels = {
        # The highest level below HATS's that leaves at most half as many groups as there are lights.
        "lights run together": int(below[-1]) if len(below) else 0,
        # Just above the most frequent level, where noise keeps about half of the background.
        "background shows": background_mode(picture.histogram.counts) + 1,
        "HATS": picture.hats.level,
        "lights are lost": picture.losing_level(),
    }
    seen = {name: picture.at(level) for name, level in levels.items()}
    figure = canvas(8.6, 5.9, PHOTO_DPI)
    axes = figure.subplots(2, 3).ravel()
    titled = {f"{name}: level {one.level}, {count(one.groups, 'group')}": one for name, one in seen.items()}
    _show_levels(axes, picture, titled)
    draw.draw_groups(axes[5], picture.groups, picture.hats.level, picture.lights)
    axes[5].set_xlabel("level", fontsize=SMALL)
    axes[5].set_title("groups at each level", fontsize=SMALL)
    rows = []
    for name, one in seen.items():
        ellipse = one.found.ellipse
        shape = (None,) * 4 if ellipse is None else (*ellipse.centre_px, *ellipse.semi_axes_px)
        rows.append((name, one.level, one.kept, one.groups, one.found.lights_on_ring, *shape, *one.off))
    return Part.of("figure_3", {"main": figure}, {"main": rows}, picture=picture, seen=seen)


def figure_8(seed: int) -> Part:
    """The histogram and the level on five scenes."""
    pictures = {name: Picture(scene) for name, scene in tank_scenes(seed).items()}
    seen = {name: picture.at(picture.hats.level) for name, picture in pictures.items()}
    figure = canvas(8.6, 9.2, PHOTO_DPI)
    grid = figure.subplots(len(pictures), 3, width_ratios=(2, 3, 3))
    rows, exact = [], []
    for axes, (name, picture) in zip(grid, pictures.items(), strict=True):
        one = seen[name]
        counts = picture.hats.floor, picture.lights, one.groups, one.found.lights_on_ring
        rows.append((name, one.level, *counts, *one.off))
        show(axes[0], picture.image, f"{name}\nlevel {one.level}, {one.groups} groups", found=one.found)
        draw.draw_histogram(axes[1], picture.histogram.counts, one.level)
        draw.draw_groups(axes[2], picture.groups, one.level, picture.lights)
        if are_the_lights(group_centres(picture.histogram, one.level), picture.lights_px):
            exact.append(name)
    for column, title in ((1, "histogram"), (2, "groups at each level")):
        grid[0, column].set_title(title, fontsize=SMALL)
        grid[-1, column].set_xlabel("grey level", fontsize=SMALL)
    return Part.of("figure_8", {"main": figure}, {"main": rows}, exact=exact, seen=seen)


def figure_14(seed: int) -> Part:
    """The dock's centre by three ways, against the level."""
    cases = {"all lights": ("all twelve lights", ()), "three missing": ("three neighbours missing", _DEAD)}
    pictures = [Picture(near_ring(seed, missing)) for _, missing in cases.values()]
    levels = np.arange(1, LEVELS)
    figure = canvas(8.6, 4.6)
    axes = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2, 1))
    rows, curves, at_hats = [], [], []
    for (above, below), picture, (case, (title, _)) in zip(axes.T, pictures, cases.items(), strict=True):
        found = [picture.at(level).found for level in levels.tolist()]
        errors = np.array([centre_errors_px(one, picture.truth.centre_px) for one in found])
        curves.append(errors)
        at_hats.append(errors[picture.hats.level - 1])
        for column, (name, (colour, line)) in enumerate(_CENTRES.items()):
            rows.append((name, case, float(at_hats[-1][column]), *_span(errors[:, column])))
            above.plot(levels, np.maximum(errors[:, column], 1e-3), line, color=colour, label=name, lw=1.6)
        above.axvline(picture.hats.level, color=THRESHOLD_COLOUR, ls="-.", lw=1.2, label="level of HATS")
        above.set_yscale("log")
        above.set_title(title, fontsize=SMALL + 1)
        draw.draw_groups(below, picture.groups, picture.hats.level, pictures[0].lights)
        below.set_xlabel("level")
    axes[0, 0].set_ylabel("error of the centre (px)")
    axes[1, 1].set_ylabel("")
    draw.legend_above(figure, axes[0, 0], ncols=4)
    head = ("level", *(f"{name}, {case} (px)" for case in ("all", "three missing") for name in _CENTRES))
    return Part.of(
        "figure_14",
        {"main": figure},
        {"main": rows, "curves": [head, *np.column_stack([levels, *curves]).tolist()]},
        pictures=pictures,
        at_hats=at_hats,
        moved=at_hats[1] - at_hats[0],
        found=int(np.isfinite(curves[0][:, 2]).sum()),
        spans=[_span(one) for one in curves[0].T],
    )


def _span(values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)


def figure_16(seed: int) -> Part:
    """The ellipse at two levels."""
    picture = Picture(near_ring(seed))
    levels, lights, errors = sweeps.two_levels(picture, _PICTURES)
    figure = canvas(8.6, 3.3, PHOTO_DPI)
    seen = {f"level {one.level}: {count(one.groups, 'group')}": one for one in map(picture.at, levels)}
    _show_levels(figure.subplots(1, 3), picture, seen)
    exact = sweeps.ellipse_values(picture.truth.ellipse)
    means, scatter, differences = errors.mean(axis=0), errors.std(axis=0, ddof=1), np.diff(errors, axis=1)[:, 0]
    difference, error = differences.mean(axis=0), differences.std(axis=0, ddof=1) / np.sqrt(len(errors))
    columns = np.column_stack([exact, means[0], scatter[0], means[1], scatter[1], difference, error])
    units = ("px", "px", "px", "px", "deg", "1")
    names = [f"{name} ({unit})" for name, unit in zip(sweeps.PARAMETERS, units, strict=True)]
    apart = np.abs(difference) / error > _AGREE
    return Part.of(
        "figure_16",
        {"main": figure},
        {"main": [(name, *row) for name, row in zip(names, columns.tolist(), strict=True)]},
        levels=levels,
        lights=[sorted({int(column.min()), int(column.max())}) for column in lights.T],
        pictures=len(errors),
        largest=np.abs(difference[:4]).max(),
        apart=[name for name, is_apart in zip(sweeps.PARAMETERS, apart, strict=True) if is_apart],
        most=_AGREE,
    )


def _show_levels(axes: Sequence[Axes], picture: Picture, seen: Mapping[str, AtLevel]) -> None:
    """The ring of a picture, and what each level keeps of it, by title."""
    roi = draw.ring_roi(picture)
    show(axes[0], picture.image, "the picture", roi)
    for one_axes, (title, one) in zip(axes[1:], seen.items(), strict=False):
        show(one_axes, picture.histogram.levels >= one.level, title, roi, one.found)
