"""Figures 3, 14 and 16: what depends on the level of the threshold."""

from __future__ import annotations

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, THRESHOLD_COLOUR
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.app.export.reproduction.pictures import PHOTO_DPI, SMALL, draw_groups, mark_lights, ring_part, show
from dockpose.paper.lights.levels import (
    PARAMETERS,
    AtLevel,
    Picture,
    TwoLevels,
    at_level,
    centre_sweep,
    flooded_level,
    losing_level,
    merged_level,
    picture_of,
    two_levels,
)
from dockpose.paper.lights.tank_scenes import near_ring
from dockpose.thresholds import LEVELS

_DEAD = (2, 3, 4)  # three neighbours
_CENTRES = (
    ("mass moment", BLUE, "-"),
    ("centre of the ellipse", ORANGE, "--"),
    ("centre by the pose", GREEN, ":"),
)
_PICTURES = 40
_AGREE = 2.0  # standard errors


def figure_3(seed: int) -> Part:
    """Too low, right and too high a level on one picture."""
    picture = picture_of(near_ring(seed))
    levels = {
        "lights run together": merged_level(picture),
        "background shows": flooded_level(picture),
        "HATS": picture.hats.level,
        "lights are lost": losing_level(picture),
    }
    seen = {name: at_level(picture, level) for name, level in levels.items()}
    return Part(
        key="figure_3",
        title="Figure 3: too low and too high a threshold",
        paper="The figure shows what a wrong level does to the lights: with too low a level they run together with "
        "each other or with the background, with too high a level some are lost.",
        ours=f"{picture.lights} lights are in view. " + " ".join(_words(name, one) for name, one in seen.items()),
        differs="The picture is simulated: twelve lights from a quarter of full brightness to full, in a harbour's "
        "water. The levels follow from rules. The lights run together at the highest level below that of HATS with at "
        "most half as many groups as lights. The background shows at the level above the one that most of it has. "
        "Lights are lost at the lowest level above that of HATS with at most half of them. Where every group "
        "is taken for a light, a wrong number of them means a wrong pose. Here groups that are no lights are told "
        "apart after the threshold, and some of "
        "the lights suffice, so a wrong level does not always lead to a wrong pose.",
        plots=[_draw_levels(picture, seen)],
        tables=[
            NumberTable(
                "figure_3",
                "The picture at each level: share of all pixels, groups on the ring, and errors of the chosen pose.",
                (
                    *("", "level", "share kept", "groups", "lights", "ellipse x (px)", "y (px)"),
                    *("semi-axes (px)", "", "position error (mm)", "angle error (deg)"),
                ),
                [_row(name, one) for name, one in seen.items()],
                digits=4,
            )
        ],
    )


def _words(name: str, one: AtLevel) -> str:
    share = f"{100 * one.kept:.2g} % of the picture is kept, in {_groups(one.groups)}"
    return f"At level {one.level} ({name}) {share}; {_pose_words(one)}."


def _groups(count: int) -> str:
    return f"{count} group{'' if count == 1 else 's'}"


def _pose_words(one: AtLevel) -> str:
    if one.found.selected is None:
        return "no pose was found"
    lights = one.found.lights_on_ring
    right = "right" if one.is_right else "wrong"
    errors = f"off by {1000 * one.distance_m:.2g} mm and {one.angle_deg:.2g} degrees"
    return f"{lights} of them are taken for lights, and the pose is {right}, {errors}"


def _row(name: str, one: AtLevel) -> tuple[str | int | float | None, ...]:
    ellipse, lights = one.found.ellipse, one.found.lights_on_ring
    shape = (None,) * 4 if ellipse is None else (*ellipse.centre_px, *ellipse.semi_axes_px)
    return name, one.level, one.kept, one.groups, lights, *shape, 1000 * one.distance_m, one.angle_deg


def _draw_levels(picture: Picture, seen: dict[str, AtLevel]) -> Plot:
    figure = new_figure(8.6, 5.9, PHOTO_DPI)
    part = ring_part(picture)
    axes = figure.subplots(2, 3).ravel()
    show(axes[0], picture.image, "the picture", part)
    for one_axes, (name, one) in zip(axes[1:], seen.items(), strict=False):
        title = f"{name}: level {one.level}, {_groups(one.groups)}"
        show(one_axes, picture.histogram.levels >= one.level, title, part)
        mark_lights(one_axes, one.found)
    draw_groups(axes[5], picture.groups, picture.hats.level, picture.lights)
    axes[5].set_xlabel("level", fontsize=SMALL)
    axes[5].set_title("groups at each level", fontsize=SMALL)
    figure.set_layout_engine("constrained")
    caption = (
        "White is kept. Circles are groups that are taken for lights, with the ellipse through them, where a ring is "
        "found. In the last panel the dash-dotted line is the level of HATS, the dashed line the number of lights."
    )
    return Plot.of("figure_3", caption, figure, is_photograph=True)


def figure_14(seed: int) -> Part:
    """The dock's centre by three ways, against the level."""
    pictures = [picture_of(near_ring(seed, missing)) for missing in ((), _DEAD)]
    levels = np.arange(1, LEVELS)
    errors = [centre_sweep(picture, levels.tolist()) for picture in pictures]
    at_hats = [one[picture.hats.level - 1] for picture, one in zip(pictures, errors, strict=True)]
    rows = [
        (name, case, float(at[column]), *_span(one[:, column]))
        for case, one, at in zip(("all lights", "three missing"), errors, at_hats, strict=True)
        for column, (name, _, _) in enumerate(_CENTRES)
    ]
    found = [levels[np.isfinite(one[:, 2])] for one in errors]
    moved = at_hats[1][0] - at_hats[0][0]
    return Part(
        key="figure_14",
        title="Figure 14: error of the dock's centre against the level",
        paper="The figure shows how far the dock's centre is off in pixels at each level, by the mass moment, by the "
        "centre of the ellipse and by the true centre, and marks the level of HATS.",
        ours=f"At the level of HATS ({pictures[0].hats.level}) the mass moment is off by {at_hats[0][0]:.2f} px, the "
        f"ellipse's centre by {at_hats[0][1]:.2f} px and the centre by the pose by {at_hats[0][2]:.3f} px. Over the "
        f"{len(found[0])} levels at which a pose is found ({_range(found[0])}) the mass moment's error lies between "
        f"{_span_words(errors[0][:, 0])}, the ellipse centre's between {_span_words(errors[0][:, 1])}, that by the "
        f"pose between {_span_words(errors[0][:, 2])}. With three neighbouring lights dead the mass moment is off by "
        f"{at_hats[1][0]:.2f} px at the level of HATS ({pictures[1].hats.level}), which is {moved:+.2f} px; the "
        f"ellipse's centre changes by {at_hats[1][1] - at_hats[0][1]:+.3f} px, the centre by the pose by "
        f"{at_hats[1][2] - at_hats[0][2]:+.3f} px.",
        differs="The reference here is the centre of the simulated dock, which is exactly known. The ellipse's centre "
        "is off by the same amount at every level, because the centre of a circle's image is not the image of its "
        "centre; no choice of the level mends that. The mass moment here is the mean of the lights' centres, which "
        "jumps whenever a higher level loses a light. With every light present it can be nearer than the ellipse's "
        "centre. Levels at which no pose is found have no error here, so the curves end where a wrong level would "
        "otherwise show as a large error.",
        plots=[_draw_sweeps(pictures, levels, errors)],
        tables=[
            NumberTable(
                "figure_14",
                "Error of the dock's centre in pixels at the level of HATS, and over all levels with a pose.",
                ("centre", "lights", "at HATS (px)", "least (px)", "largest (px)"),
                rows,
            ),
            NumberTable(
                "figure_14_curves",
                "Error in pixels at each level.",
                ("level", *(f"{name}, {case} (px)" for case in ("all", "three missing") for name, _, _ in _CENTRES)),
                np.column_stack([levels, *errors]).tolist(),
                is_shown=False,
            ),
        ],
    )


def _span(values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else (np.nan, np.nan)


def _span_words(values: np.ndarray) -> str:
    low, high = _span(values)
    return f"{low:.3g} and {high:.3g} px"


def _range(levels: np.ndarray) -> str:
    return f"within {levels[0]} to {levels[-1]}" if len(levels) else "none"


def _draw_sweeps(pictures: list[Picture], levels: np.ndarray, errors: list[np.ndarray]) -> Plot:
    figure = new_figure(8.6, 4.6)
    axes = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2, 1))
    for column, (picture, curves) in enumerate(zip(pictures, errors, strict=True)):
        above, below = axes[:, column]
        for number, (name, colour, line) in enumerate(_CENTRES):
            above.plot(levels, np.maximum(curves[:, number], 1e-3), line, color=colour, label=name, lw=1.6)
        above.axvline(picture.hats.level, color=THRESHOLD_COLOUR, ls="-.", lw=1.2, label="level of HATS")
        above.set_yscale("log")
        above.set_title(("all twelve lights", "three neighbours missing")[column], fontsize=SMALL + 1)
        draw_groups(below, picture.groups, picture.hats.level, pictures[0].lights)
        below.set_xlabel("level")
    axes[0, 0].set_ylabel("error of the centre (px)")
    axes[1, 1].set_ylabel("")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False)
    figure.set_layout_engine("constrained")
    caption = (
        "Above: distance from the true centre at each level with a pose, on a logarithmic scale. Below: groups at each "
        "level; the dashed line is the number of the dock's lights."
    )
    return Plot.of("figure_14", caption, figure)


def figure_16(seed: int) -> Part:
    """The ellipse at two levels."""
    scene = near_ring(seed)
    found = two_levels(scene, _PICTURES)
    difference, error = found.mean_difference, found.standard_error
    apart = [name for name, one in zip(PARAMETERS, np.abs(difference) / error, strict=True) if one > _AGREE]
    largest = float(np.abs(difference[:4]).max())
    means, scatter = found.errors.mean(axis=0), found.errors.std(axis=0, ddof=1)
    picture = picture_of(scene)
    return Part(
        key="figure_16",
        title="Figure 16: the ellipse at two levels",
        paper="The figure shows that the ellipses found at two levels, with fewer lights at the higher one, have the "
        "same parameters.",
        ours=f"At level {found.levels[0]} (HATS) {_lights(found, 0)} lights are left, at level {found.levels[1]} "
        f"{_lights(found, 1)}. Over {len(found.errors)} pictures, centre and semi-axes differ by at most "
        f"{largest:.3f} px on average, {100 * largest / found.true_values[2]:.2g} % of the semi-major axis. "
        f"{_agreement(apart)} In one picture the standard error of the semi-major axis is {scatter[0, 2]:.3f} px at "
        f"the lower level and {scatter[1, 2]:.3f} px at the higher one.",
        differs="The paper compares one picture. Here the scene is taken again and again with new noise, and with the "
        "ring moved by up to half a pixel, so that a difference can be told from chance; the ellipses are compared "
        "with the exact image of the circle. The groups are centred by their mass moment, as in the paper, and nothing "
        "tells lights from other groups."
        + ("" if apart else " Fewer lights make the ellipse less certain, and not another one."),
        plots=[_draw_two(picture, [at_level(picture, level) for level in found.levels])],
        tables=[
            NumberTable(
                "figure_16",
                "Parameters of the ellipse: those of the circle's exact image, mean error at both levels with the "
                "standard error of one picture, and the mean difference with its own standard error.",
                (
                    *("parameter", "exact", f"error at {found.levels[0]}", "standard error"),
                    *(f"error at {found.levels[1]}", "standard error", "difference", "its standard error"),
                ),
                [
                    (f"{name} ({unit})", *numbers)
                    for name, unit, *numbers in zip(
                        PARAMETERS,
                        ("px", "px", "px", "px", "deg", "1"),
                        found.true_values.tolist(),
                        *(values.tolist() for level in (0, 1) for values in (means[level], scatter[level])),
                        difference.tolist(),
                        error.tolist(),
                        strict=True,
                    )
                ],
            )
        ],
    )


def _lights(found: TwoLevels, column: int) -> str:
    low, high = int(found.lights[:, column].min()), int(found.lights[:, column].max())
    return str(low) if low == high else f"{low} to {high}"


def _agreement(apart: list[str]) -> str:
    if not apart:
        return f"No parameter's mean difference is more than {_AGREE:.0f} of its standard errors."
    return f"More than {_AGREE:.0f} of its standard errors is the mean difference of: {', '.join(apart)}."


def _draw_two(picture: Picture, seen: list[AtLevel]) -> Plot:
    figure = new_figure(8.6, 3.3, PHOTO_DPI)
    part = ring_part(picture)
    axes = figure.subplots(1, 3)
    show(axes[0], picture.image, "the picture", part)
    for one_axes, one in zip(axes[1:], seen, strict=True):
        show(one_axes, picture.histogram.levels >= one.level, f"level {one.level}: {_groups(one.groups)}", part)
        mark_lights(one_axes, one.found)
    figure.set_layout_engine("constrained")
    return Plot.of(
        "figure_16", "White is kept; circles are the lights, with the ellipse through them.", figure, is_photograph=True
    )
