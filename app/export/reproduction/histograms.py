"""Figure 8: the histogram and the level of HATS on scenes like the paper's photographs."""

from __future__ import annotations

from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.app.export.reproduction.pictures import (
    PHOTO_DPI,
    SMALL,
    draw_groups,
    draw_histogram,
    mark_lights,
    show,
)
from dockpose.paper.lights.levels import AtLevel, Picture, at_level, picture_of
from dockpose.paper.lights.outcomes import are_the_lights, group_centres
from dockpose.paper.lights.tank_scenes import tank_scenes
from dockpose.settings import Settings


def figure_8(seed: int) -> Part:
    """The histogram and the level on five scenes."""
    pictures = {name: picture_of(scene) for name, scene in tank_scenes(seed).items()}
    seen = {name: at_level(picture, picture.hats.level) for name, picture in pictures.items()}
    exact = [name for name in pictures if _is_exact(pictures[name])]
    right = [name for name, one in seen.items() if one.is_right]
    rest = [_rest_words(name, pictures[name], one) for name, one in seen.items() if name not in exact]
    return Part(
        key="figure_8",
        title="Figure 8: histogram and level on scenes like the paper's photographs",
        paper="The figure shows photographs of a tank under different light, each with its histogram and the level "
        "that HATS chooses.",
        ours=f"HATS leaves exactly the lights in {len(exact)} of {len(pictures)} scenes"
        f"{': ' + ', '.join(exact) if exact else ''}. {' '.join(rest)} At its level the right pose is found in "
        f"{len(right)} of {len(pictures)}.",
        differs="The photographs are the paper's own. These scenes are simulated after their kind, by fixed numbers "
        "and not to any photograph: plain, with uneven lights before a bright patch, with the glow of a harbour's "
        "water, with ambient light of about a hundred levels, and under a rippled surface that mirrors the ring. A "
        "reflection is as bright as its light, or nearly, so no level can leave it out: it must be told from the dock "
        "by where it lies. Where a patch of the background is brighter than the faintest lights, no single level "
        "serves; by default each light then gets a level of its own, which is not done here.",
        plots=[_draw(pictures, seen)],
        tables=[
            NumberTable(
                "figure_8",
                "Each scene at the level of HATS; lights are groups on the ring, errors are of the chosen pose.",
                (
                    *("scene", "level", "background ends at", "lights in view", "groups", "lights found"),
                    *("position error (mm)", "angle error (deg)"),
                ),
                [_row(name, pictures[name], one) for name, one in seen.items()],
            )
        ],
    )


def _is_exact(picture: Picture) -> bool:
    points_px = group_centres(picture.histogram, picture.hats.level, Settings().min_area_px)
    return are_the_lights(points_px, picture.truth.lights_px[picture.truth.visible])


def _rest_words(name: str, picture: Picture, one: AtLevel) -> str:
    pose = "right" if one.is_right else "wrong" if one.found.selected is not None else "not found"
    return (
        f"With {name} there are {one.groups} groups for {picture.lights} lights, of which "
        f"{one.found.lights_on_ring or 0} are taken for lights, and the pose is {pose}."
    )


def _row(name: str, picture: Picture, one: AtLevel) -> tuple[str | int | float | None, ...]:
    lights = one.found.lights_on_ring
    errors = 1000 * one.distance_m, one.angle_deg
    return name, one.level, picture.hats.floor, picture.lights, one.groups, lights, *errors


def _draw(pictures: dict[str, Picture], seen: dict[str, AtLevel]) -> Plot:
    figure = new_figure(8.6, 9.2, PHOTO_DPI)
    rows = figure.subplots(len(pictures), 3, width_ratios=(2, 3, 3))
    for axes, (name, picture) in zip(rows, pictures.items(), strict=True):
        one = seen[name]
        show(axes[0], picture.image, f"{name}\nlevel {one.level}, {one.groups} groups")
        mark_lights(axes[0], one.found)
        draw_histogram(axes[1], picture.histogram.counts, one.level)
        draw_groups(axes[2], picture.groups, one.level, picture.lights)
    rows[0, 1].set_title("histogram", fontsize=SMALL)
    rows[0, 2].set_title("groups at each level", fontsize=SMALL)
    for axes in rows[-1, 1:]:
        axes.set_xlabel("grey level", fontsize=SMALL)
    figure.set_layout_engine("constrained")
    caption = (
        "Left: the picture; circles are groups that are taken for lights at the level of HATS. Middle: pixels at each "
        "grey level. Right: groups that each level leaves; dashed is the number of lights; the scale ends at three "
        "times that. Dash-dotted: the level."
    )
    return Plot.of("figure_8", caption, figure, is_photograph=True)
