"""Matplotlib figures, made without a window: among them the annotated picture as vectors over the picture itself."""

import io
import math
import threading
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.annotated import DRAWN, check_layers, draw_layers
from dockpose.app.drawing.numbers import chance, pose_cells, status_words
from dockpose.camera.mark import COMMENT
from dockpose.estimate import geometry
from dockpose.estimate.canvas import Canvas, Point, to_bgr8
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
_LINE_IN, _MARGIN_IN = 0.17, 0.12
_POINTS_PER_IN = 72.0
_FINEST_POINTS = 1.2  # of a line, so that it is seen in print, however large the picture was
_LETTER = 24.0  # height of a font in units of the canvas at size 1


def picture_figure(
    image: Any, estimate: Estimate, layers: Collection[str] = DRAWN, truth: KnownPose | None = None
) -> "Figure":
    """Draw what was found over the picture, with a legend below."""
    from matplotlib.patches import Rectangle

    check_layers(layers)
    scale = min(WIDTH_IN / estimate.width, HIGHEST_IN / estimate.height)
    width, height = scale * estimate.width, scale * estimate.height
    figure = new_figure(WIDTH_IN, height)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(to_bgr8(image)[..., ::-1], interpolation="none")
    axes.set_axis_off()
    axes.autoscale(False)
    for index, (x, y, wide, high) in enumerate(estimate.settings.masks):
        name = "masked" if index == 0 else None
        axes.add_patch(Rectangle((x, y), wide, high, fill=False, hatch="///", color=colours.MASK_COLOUR, label=name))
    draw_layers(_Vectors(axes, estimate, _POINTS_PER_IN * scale), estimate, layers, truth)
    _add_legend(axes, estimate, layers)
    entries = len(axes.get_legend_handles_labels()[0])
    legend_in = _MARGIN_IN + _LINE_IN * math.ceil(entries / 2) if entries else 0.0
    total_in = height + legend_in
    figure.set_size_inches(WIDTH_IN, total_in)
    axes.set_position(((1 - width / WIDTH_IN) / 2, legend_in / total_in, width / WIDTH_IN, height / total_in))
    if entries:
        figure.legend(loc="lower center", ncols=2, fontsize=7, frameon=False, borderaxespad=0.2)
    return figure


class _Vectors(Canvas):
    """A canvas that draws on axes, on which a unit of it has so many points."""

    def __init__(self, axes: "Axes", estimate: Estimate, points_per_px: float) -> None:
        super().__init__(np.broadcast_to(np.uint8(0), (estimate.height, estimate.width, 3)))
        self._axes, self._points = axes, points_per_px * self.unit

    def polyline(self, points: np.ndarray, colour: str, width: float = 1.0) -> None:
        self._axes.plot(*points.T, color=colour, linewidth=max(_FINEST_POINTS, width * self._points))

    def circle(self, centre: Point, radius: float, colour: str, *, filled: bool = False) -> None:
        inside = colour if filled else "none"
        style: dict[str, Any] = {"markersize": 2 * radius * self._points, "markeredgewidth": self._points}
        self._axes.plot(*centre, "o", color=colour, markerfacecolor=inside, **style)

    def cross(self, centre: Point, size: float, colour: str, *, tilted: bool = False) -> None:
        self._axes.plot(*centre, "x" if tilted else "+", color=colour, markersize=size * self._points)

    def text(self, text: str, at: Point, colour: str = colours.TEXT_COLOUR, size: float = 0.45) -> None:
        if np.isfinite(at).all():
            self._axes.text(at[0], at[1], text, color=colour, fontsize=_LETTER * size * self._points)


def _add_legend(axes: "Axes", estimate: Estimate, layers: Collection[str]) -> None:
    """Name what is drawn, by entries without points."""
    on_ring, names = geometry.on_ring(estimate), zip(colours.POSE_NAMES, estimate.candidates, strict=False)
    has_ellipse = "ellipse" in layers and estimate.ellipse is not None
    is_chosen_shown = any(pose is estimate.selected and name.lower() in layers for name, pose in names)
    poses = [(colours.POSE_COLOURS[at], "-", _pose_words(estimate, at)) for at in range(len(estimate.candidates))]
    nothing = [("none", " ", f"no pose ({status_words(estimate.status)})")]
    entries = [
        *((poses or nothing) if "text" in layers else []),
        *([(colours.ELLIPSE_COLOUR, "-", "ellipse"), (colours.ELLIPSE_COLOUR, "+", "ellipse centre")] * has_ellipse),
        *([(colours.LIGHT_COLOUR, "o", "light on the ring")] * ("lights" in layers and bool(on_ring.any()))),
        *([(colours.DROPPED_COLOUR, "x", "other group")] * ("lights" in layers and not on_ring.all())),
        *([("black", "o", "dock centre")] * is_chosen_shown),
    ]
    for colour, style, label in entries:
        axes.plot([], [], style, color=colour, markerfacecolor="none", label=label)


def _pose_words(estimate: Estimate, index: int) -> str:
    pose = estimate.candidates[index]
    x, y, z, theta_x, theta_y = pose_cells(pose)
    chosen = ", chosen" if pose is estimate.selected else ""
    likely = f" ({chance(pose)})" if chance(pose) else ""
    return f"{colours.POSE_NAMES[index]}{chosen}{likely}: x {x}, y {y}, z {z} cm; θx {theta_x}°, θy {theta_y}°"
