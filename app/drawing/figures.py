"""Matplotlib figures, made without a window: among them the annotated picture as vectors over the picture itself."""

import io
import math
import threading
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.annotated import DRAWN, check_layers
from dockpose.app.drawing.numbers import chance, length_words, pose_cells, status_words
from dockpose.camera.mark import COMMENT
from dockpose.estimate import geometry
from dockpose.estimate.canvas import to_bgr8
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose

if TYPE_CHECKING:  # imported where it is used, since that takes half a second
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 150
_SETTINGS = {"svg.fonttype": "none", "font.family": "DejaVu Sans", "font.size": 9.0}
_busy = threading.Lock()  # all threads share Matplotlib's settings


def new_figure(width_in: float, height_in: float, dpi: float = DPI, layout: Any = None) -> "Figure":
    """Return an empty white figure of that size in inches; ``layout`` is Matplotlib's."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=dpi, facecolor="white", layout=layout)


def to_png(figure: "Figure") -> bytes:
    """Return the figure as PNG at its own resolution."""
    return _saved(figure, "png", {"Software": None, "Comment": COMMENT})


def to_svg(figure: "Figure", name: str = "figure") -> bytes:
    """Return the figure as SVG without a date; ``name`` keeps the identifiers of several figures on a page apart."""
    return _saved(figure, "svg", {"Date": None, "Creator": "dockpose"}, {"svg.hashsalt": name})


def _saved(figure: "Figure", kind: str, metadata: dict[str, Any], more: dict[str, Any] | None = None) -> bytes:
    from matplotlib import rc_context

    memory = io.BytesIO()
    settings: Any = {**_SETTINGS, **(more or {})}
    with _busy, rc_context(settings):
        figure.savefig(memory, format=kind, metadata=metadata, dpi=figure.dpi)
    return memory.getvalue()


WIDTH_IN, HIGHEST_IN = 6.5, 8.0
_LEAST_SHARE = 0.01  # of the picture's width: the least radius of a light's circle
_LINE_IN, _MARGIN_IN = 0.17, 0.12


def picture_figure(
    image: Any, estimate: Estimate, layers: Collection[str] = DRAWN, truth: KnownPose | None = None
) -> "Figure":
    """Draw what was found over the picture, with a legend below."""
    check_layers(layers)
    scale = min(WIDTH_IN / estimate.width, HIGHEST_IN / estimate.height)
    width, height = scale * estimate.width, scale * estimate.height
    figure = new_figure(WIDTH_IN, height)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(to_bgr8(image)[..., ::-1], interpolation="none")
    axes.set_axis_off()
    axes.autoscale(False)
    _draw(axes, estimate, layers, truth)
    entries = len(axes.get_legend_handles_labels()[0])
    legend_in = _MARGIN_IN + _LINE_IN * math.ceil(entries / 2) if entries else 0.0
    total_in = height + legend_in
    figure.set_size_inches(WIDTH_IN, total_in)
    axes.set_position(((1 - width / WIDTH_IN) / 2, legend_in / total_in, width / WIDTH_IN, height / total_in))
    if entries:
        figure.legend(loc="lower center", ncols=2, fontsize=7, frameon=False, borderaxespad=0.2)
    return figure


def _draw(axes: "Axes", estimate: Estimate, layers: Collection[str], truth: KnownPose | None) -> None:
    from matplotlib.patches import Rectangle

    for index, (x, y, width, height) in enumerate(estimate.settings.masks):
        name = "masked" if index == 0 else None
        axes.add_patch(Rectangle((x, y), width, height, fill=False, hatch="///", color=colours.MASK_COLOUR, label=name))
    if truth is not None and "truth" in layers:
        _draw_pose(axes, estimate, truth, "truth", color=colours.TRUTH_COLOUR, linewidth=4.0)
    shown: list[CirclePose] = []
    for index, (name, pose) in enumerate(zip(colours.POSE_NAMES, estimate.candidates, strict=False)):
        width = 1.4 if pose is estimate.selected else 0.7
        style: dict[str, Any] = {"color": colours.POSE_COLOURS[index], "linewidth": width}
        if name.lower() in layers:
            shown.append(pose)
            _draw_pose(axes, estimate, pose, name, **style)
        if "text" in layers:
            axes.plot([], [], **style, label=_pose_words(estimate, index))
    outline, (ellipse, dock) = geometry.outline(estimate), geometry.centres(estimate)
    if "ellipse" in layers and outline is not None:
        # Wider than the rim of a pose, which it would be lost in.
        style = {"color": colours.ELLIPSE_COLOUR, "linewidth": 1.2, "linestyle": "--"}
        _draw_line(axes, estimate, np.vstack([outline, outline[:1]]), **style)
        axes.plot([], [], **style, label="ellipse")
    if "lights" in layers:
        _draw_lights(axes, estimate)
    if "text" in layers and not estimate.candidates:
        axes.plot([], [], " ", label=f"no pose ({status_words(estimate.status)})")
    if "ellipse" in layers and ellipse is not None:
        axes.plot(*ellipse, "+", color=colours.ELLIPSE_COLOUR, markersize=8, label="ellipse centre")
    if dock is not None and any(pose is estimate.selected for pose in shown):
        axes.plot(*dock, "o", color="black", markerfacecolor="white", markersize=4, label="dock centre")
    if "scale" in layers:
        _draw_scale(axes, estimate)


def _draw_pose(axes: "Axes", estimate: Estimate, pose: CirclePose | KnownPose, name: str, **style: Any) -> None:
    """Draw the dock's rim, axes and normal as they are by a pose, with its name at the normal's tip."""
    rim, diameters, normal = geometry.pose_lines(pose, estimate)
    for points in (np.vstack([rim, rim[:1]]), *diameters):
        _draw_line(axes, estimate, points, **(style | {"linewidth": style["linewidth"] / 2}))
    _draw_line(axes, estimate, normal, **style)
    axes.plot(*normal[1], "o", color=style["color"], markersize=3 + style["linewidth"] / 2)
    off, side = ((4, -3), "left") if name in colours.POSE_NAMES else ((-6, -3), "right")
    axes.annotate(name, normal[1], off, textcoords="offset points", ha=side, color=style["color"])


def _draw_line(axes: "Axes", estimate: Estimate, points: np.ndarray, **style: Any) -> None:
    """Draw a line that stops short of the lights, so that they are seen."""
    for piece in geometry.beside_lights(points, estimate, _LEAST_SHARE * estimate.width):
        axes.plot(*piece.T, **style)


def _draw_lights(axes: "Axes", estimate: Estimate) -> None:
    from matplotlib.patches import Circle

    if estimate.markers is None:
        return
    points, on_ring = estimate.markers.points_px, geometry.on_ring(estimate)
    radii, others = geometry.light_radii(estimate, _LEAST_SHARE * estimate.width), points[~on_ring]
    for point, radius in zip(points[on_ring], radii[on_ring], strict=True):
        axes.add_patch(Circle(tuple(point), radius, fill=False, color=colours.LIGHT_COLOUR))
    if on_ring.any():
        ring: dict[str, Any] = {"color": colours.LIGHT_COLOUR, "markerfacecolor": "none", "markersize": 8}
        axes.plot([], [], "o", **ring, label="light on the ring")
    if len(others):
        axes.plot(*others.T, "x", color=colours.DROPPED_COLOUR, markersize=6, label="other group")
    place: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center"}
    for index, label, (x, y) in geometry.light_labels(estimate):
        axes.annotate(label, points[index], (10 * x, -10 * y), color="white", fontsize=7, **place)


def _draw_scale(axes: "Axes", estimate: Estimate) -> None:
    bar = geometry.scale_bar(estimate)
    if bar is None:
        return
    length_m, length_px = bar
    right, y = 0.98 * estimate.width, 0.97 * estimate.height
    axes.plot([right - length_px, right], [y, y], color="white", lw=2, solid_capstyle="butt")
    words = f"{length_words(length_m)} at the dock"
    axes.annotate(words, (right, y), (0, 4), textcoords="offset points", ha="right", color="white", fontsize=7)


def _pose_words(estimate: Estimate, index: int) -> str:
    pose = estimate.candidates[index]
    x, y, z, theta_x, theta_y = pose_cells(pose)
    chosen = ", chosen" if pose is estimate.selected else ""
    likely = f" ({chance(pose)})" if chance(pose) else ""
    return f"{colours.POSE_NAMES[index]}{chosen}{likely}: x {x}, y {y}, z {z} cm; θx {theta_x}°, θy {theta_y}°"
