"""Figures 3, 8, 14 and 16: the level of HATS, and what depends on the level."""

from collections.abc import Mapping, Sequence

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, THRESHOLD_COLOUR
from dockpose.app.drawing.numbers import count
from dockpose.app.export.parts import Cell, Part
from dockpose.app.export.reproduction import pictures as draw
from dockpose.app.export.reproduction.pictures import PHOTO_DPI, SMALL, canvas, show
from dockpose.paper.lights import levels as sweeps
from dockpose.paper.lights.scenes import near_ring, tank_scenes
from dockpose.thresholds import LEVELS
from matplotlib.axes import Axes
from matplotlib.figure import Figure

_DEAD = (2, 3, 4)  # three neighbours
_CENTRES = {"mass moment": (BLUE, "-"), "centre of the ellipse": (ORANGE, "--"), "centre by the pose": (GREEN, ":")}
_PICTURES = 40
_AGREE = 2.0  # standard errors


def figure_3(seed: int) -> Part:
    """Too low, right and too high a level on one picture."""
    picture = sweeps.picture_of(near_ring(seed))
    levels = {
        "lights run together": sweeps.merged_level(picture),
        "background shows": sweeps.flooded_level(picture),
        "HATS": picture.hats.level,
        "lights are lost": sweeps.losing_level(picture),
    }
    seen = {name: sweeps.at_level(picture, level) for name, level in levels.items()}
    return Part.of(
        "figure_3",
        {"main": _draw_levels(picture, seen)},
        {"main": [_row(name, one) for name, one in seen.items()]},
        picture=picture,
        seen=seen,
    )


def _row(name: str, one: sweeps.AtLevel) -> tuple[Cell, ...]:
    ellipse, lights = one.found.ellipse, one.found.lights_on_ring
    shape = (None,) * 4 if ellipse is None else (*ellipse.centre_px, *ellipse.semi_axes_px)
    return name, one.level, one.kept, one.groups, lights, *shape, 1000 * one.distance_m, one.angle_deg


def _draw_levels(picture: sweeps.Picture, seen: dict[str, sweeps.AtLevel]) -> Figure:
    figure = canvas(8.6, 5.9, PHOTO_DPI)
    axes = figure.subplots(2, 3).ravel()
    _show_levels(
        axes, picture, {f"{name}: level {one.level}, {count(one.groups, 'group')}": one for name, one in seen.items()}
    )
    draw.draw_groups(axes[5], picture.groups, picture.hats.level, picture.lights)
    axes[5].set_xlabel("level", fontsize=SMALL)
    axes[5].set_title("groups at each level", fontsize=SMALL)
    return figure


def figure_8(seed: int) -> Part:
    """The histogram and the level on five scenes."""
    pictures = {name: sweeps.picture_of(scene) for name, scene in tank_scenes(seed).items()}
    seen = {name: sweeps.at_level(picture, picture.hats.level) for name, picture in pictures.items()}
    rows: list[tuple[Cell, ...]] = []
    exact = []
    for name, picture in pictures.items():
        one, lights_px = seen[name], picture.truth.lights_px[picture.truth.visible]
        counts = picture.lights, one.groups, one.found.lights_on_ring
        rows.append((name, one.level, picture.hats.floor, *counts, 1000 * one.distance_m, one.angle_deg))
        if sweeps.are_the_lights(sweeps.group_centres(picture.histogram, one.level, sweeps.MIN_AREA_PX), lights_px):
            exact.append(name)
    plots = {"main": _draw_scenes(pictures, seen)}
    return Part.of("figure_8", plots, {"main": rows}, exact=exact, pictures=pictures, seen=seen)


def _draw_scenes(pictures: dict[str, sweeps.Picture], seen: dict[str, sweeps.AtLevel]) -> Figure:
    figure = canvas(8.6, 9.2, PHOTO_DPI)
    rows = figure.subplots(len(pictures), 3, width_ratios=(2, 3, 3))
    for axes, (name, picture) in zip(rows, pictures.items(), strict=True):
        one = seen[name]
        show(axes[0], picture.image, f"{name}\nlevel {one.level}, {one.groups} groups", found=one.found)
        draw.draw_histogram(axes[1], picture.histogram.counts, one.level)
        draw.draw_groups(axes[2], picture.groups, one.level, picture.lights)
    rows[0, 1].set_title("histogram", fontsize=SMALL)
    rows[0, 2].set_title("groups at each level", fontsize=SMALL)
    for axes in rows[-1, 1:]:
        axes.set_xlabel("grey level", fontsize=SMALL)
    return figure


def figure_14(seed: int) -> Part:
    """The dock's centre by three ways, against the level."""
    pictures = [sweeps.picture_of(near_ring(seed, missing)) for missing in ((), _DEAD)]
    levels = np.arange(1, LEVELS)
    errors = [sweeps.centre_sweep(picture, levels.tolist()) for picture in pictures]
    at_hats = [one[picture.hats.level - 1] for picture, one in zip(pictures, errors, strict=True)]
    cases = ("all lights", "three missing")
    rows = [
        (name, case, float(at[column]), *_span(one[:, column]))
        for case, one, at in zip(cases, errors, at_hats, strict=True)
        for column, name in enumerate(_CENTRES)
    ]
    found = levels[np.isfinite(errors[0][:, 2])]
    head = ("level", *(f"{name}, {case} (px)" for case in ("all", "three missing") for name in _CENTRES))
    return Part.of(
        "figure_14",
        {"main": _draw_sweeps(pictures, levels, errors)},
        {"main": rows, "curves": [head, *np.column_stack([levels, *errors]).tolist()]},
        pictures=pictures,
        at_hats=at_hats,
        moved=at_hats[1] - at_hats[0],
        found=len(found),
        range=f"within {found[0]} to {found[-1]}" if len(found) else "none",
        spans=[_span(one) for one in errors[0].T],
    )


def _span(values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)


def _draw_sweeps(pictures: list[sweeps.Picture], levels: np.ndarray, errors: list[np.ndarray]) -> Figure:
    figure = canvas(8.6, 4.6)
    axes = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2, 1))
    for column, (picture, curves) in enumerate(zip(pictures, errors, strict=True)):
        above, below = axes[:, column]
        for number, (name, (colour, line)) in enumerate(_CENTRES.items()):
            above.plot(levels, np.maximum(curves[:, number], 1e-3), line, color=colour, label=name, lw=1.6)
        above.axvline(picture.hats.level, color=THRESHOLD_COLOUR, ls="-.", lw=1.2, label="level of HATS")
        above.set_yscale("log")
        above.set_title(("all twelve lights", "three neighbours missing")[column], fontsize=SMALL + 1)
        draw.draw_groups(below, picture.groups, picture.hats.level, pictures[0].lights)
        below.set_xlabel("level")
    axes[0, 0].set_ylabel("error of the centre (px)")
    axes[1, 1].set_ylabel("")
    draw.legend_above(figure, axes[0, 0], ncols=4)
    return figure


def figure_16(seed: int) -> Part:
    """The ellipse at two levels."""
    scene = near_ring(seed)
    picture, found = sweeps.picture_of(scene), sweeps.two_levels(scene, _PICTURES)
    seen = [sweeps.at_level(picture, level) for level in found.levels]
    figure = canvas(8.6, 3.3, PHOTO_DPI)
    _show_levels(
        figure.subplots(1, 3), picture, {f"level {one.level}: {count(one.groups, 'group')}": one for one in seen}
    )
    difference, error = found.mean_difference, found.standard_error
    apart = [name for name, one in zip(sweeps.PARAMETERS, np.abs(difference) / error, strict=True) if one > _AGREE]
    largest = float(np.abs(difference[:4]).max())
    means, scatter = found.errors.mean(axis=0), found.errors.std(axis=0, ddof=1)
    columns = (found.true_values, means[0], scatter[0], means[1], scatter[1], difference, error)
    units = ("px", "px", "px", "px", "deg", "1")
    names = [f"{name} ({unit})" for name, unit in zip(sweeps.PARAMETERS, units, strict=True)]
    return Part.of(
        "figure_16",
        {"main": figure},
        {"main": [(name, *row) for name, row in zip(names, np.column_stack(columns).tolist(), strict=True)]},
        found=found,
        lights=[sorted({int(column.min()), int(column.max())}) for column in found.lights.T],
        pictures=len(found.errors),
        largest=largest,
        share=100 * largest / found.true_values[2],
        apart=apart,
        most=_AGREE,
        scatter=scatter,
    )


def _show_levels(axes: Sequence[Axes], picture: sweeps.Picture, seen: Mapping[str, sweeps.AtLevel]) -> None:
    """The ring of a picture, and what each level keeps of it, by title."""
    part = draw.ring_part(picture)
    show(axes[0], picture.image, "the picture", part)
    for one_axes, (title, one) in zip(axes[1:], seen.items(), strict=False):
        show(one_axes, picture.histogram.levels >= one.level, title, part, one.found)
