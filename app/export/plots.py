"""Figures, pictures and curves that several reports draw alike."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dockpose.app.drawing.annotated import kept_pixels
from dockpose.app.drawing.colours import BARS_COLOUR, GROUPS_COLOUR, LIGHT_COLOUR, THRESHOLD_COLOUR
from dockpose.app.drawing.figures import DPI, new_figure
from dockpose.app.drawing.numbers import MISSING
from dockpose.camera.image import to_grey, to_levels
from dockpose.estimate import Estimate
from dockpose.paper.levels import Picture
from dockpose.thresholds import LEVELS
from matplotlib.axes import Axes
from matplotlib.figure import Figure

SMALL = 8  # points, of texts within a figure
PHOTO_DPI = 110  # of figures with pictures in them, which keeps the report small
_WIDE_IN, _TITLE_IN, _TILE = 9.6, 0.25, 0.9  # of pictures beside each other, which have so much of their places
_AROUND = 1.5  # of the ring's radius: what is shown around it

Box = tuple[int, int, int, int]


def canvas(width_in: float, height_in: float, dpi: float = DPI) -> Figure:
    """An empty figure whose axes take the room that their texts leave."""
    return new_figure(width_in, height_in, dpi, "constrained")


def legend_above(figure: Figure, axes: Axes, ncols: int, **style: Any) -> None:
    """One legend for all axes of a figure, above them."""
    handles = axes.get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=ncols, frameon=False, **style)


def draw_intervals(
    axes: Axes,
    places: Sequence[float] | np.ndarray,
    shares: Sequence[Mapping[str, Any]],
    style: tuple[str, str],
    *,
    scale: float = 100.0,
    across: bool = False,
    **more: Any,
) -> None:
    """Draw values with their intervals in a colour with a mark, upright or across; those of no cases are left out."""
    # None becomes NaN.
    rows = np.array([[share[key] for key in ("value", "low", "high")] for share in shares], dtype=float).reshape(-1, 3)
    known = np.isfinite(rows[:, 0])
    if not known.any():
        return
    at, (values, lows, highs) = np.array(places)[known], scale * rows[known].T
    off = np.maximum(0, [values - lows, highs - values])
    colour, mark = style
    drawn = {"fmt": mark, "color": colour, "ms": 4, "lw": 0.9} | more
    if across:
        axes.errorbar(values, at, xerr=off, **drawn)
    else:
        axes.errorbar(at, values, yerr=off, **drawn)


def ring_roi(picture: Picture) -> Box:
    """Left, top, right and bottom of what shows the dock's ring with a margin."""
    ellipse = picture.truth.ellipse
    assert ellipse is not None
    (x, y), half = ellipse.centre_px, _AROUND * ellipse.semi_axes_px[0]
    height, width = picture.image.shape
    return max(0, int(x - half)), max(0, int(y - half)), min(width, int(x + half)), min(height, int(y + half))


def show(axes: Axes, image: np.ndarray, title: str, roi: Box | None = None, found: Estimate | None = None) -> None:
    """Show a grey or binarised picture, or a region of it, without ticks, and circle what was found in it."""
    height, width = image.shape
    left, top, right, bottom = roi or (0, 0, width, height)
    extent = (left - 0.5, right - 0.5, bottom - 0.5, top - 0.5)
    top_value = 1 if image.dtype == bool else 255
    shown = image[top:bottom, left:right]
    axes.imshow(shown, cmap="gray", vmin=0, vmax=top_value, extent=extent, interpolation="nearest")
    axes.set_title(title, fontsize=SMALL)
    axes.set(xticks=[], yticks=[])
    if found is not None and found.markers is not None and found.ring is not None:
        x, y = found.markers.points_px[found.ring.on_ring].T
        axes.plot(x, y, "o", mfc="none", mec=LIGHT_COLOUR, ms=7, mew=1.2)
    if found is not None and found.ellipse is not None:
        x, y = found.ellipse.points().T
        axes.plot(np.append(x, x[0]), np.append(y, y[0]), "-", color=LIGHT_COLOUR, lw=0.8)


def side_by_side(pictures: Sequence[tuple[str, np.ndarray]], columns: int) -> Figure:
    """Pictures with their titles beside each other, those of bools black and white, as in the paper's Figure 15."""
    rows, (height, width) = -(-len(pictures) // columns), pictures[0][1].shape
    figure = canvas(_WIDE_IN, rows * (_WIDE_IN * height / width / columns + _TITLE_IN), PHOTO_DPI)
    all_axes = figure.subplots(rows, columns, squeeze=False).flat
    for axes, (title, picture) in zip(all_axes, pictures, strict=False):
        show(axes, _coarse(picture, int(_TILE * _WIDE_IN * PHOTO_DPI / columns)), title)
    for axes in all_axes[len(pictures) :]:
        axes.set_axis_off()
    return figure


def _coarse(picture: np.ndarray, wide_px: int) -> np.ndarray:
    """The picture at most so wide, each pixel as bright as the brightest that it stands for: no light is lost."""
    step = -(-picture.shape[1] // wide_px)
    starts = [np.arange(0, length, step) for length in picture.shape]
    return np.maximum.reduceat(np.maximum.reduceat(picture, starts[0], axis=0), starts[1], axis=1)


def methods_beside(
    title: str, image: Any, found: Mapping[str, Estimate], names: Mapping[str, str]
) -> list[tuple[str, np.ndarray]]:
    """Return a picture, and what each method keeps of it, with titles, for :func:`side_by_side`."""
    levels = {name: MISSING if one.threshold is None else one.threshold.level for name, one in found.items()}
    kept = [(f"{names[name]}: {levels[name]}", kept_pixels(image, one)) for name, one in found.items()]
    return [(title, to_levels(to_grey(image))[0]), *kept]


def draw_histogram(axes: Axes, counts: np.ndarray, level: int = LEVELS) -> None:
    """Draw the pixels at each grey level on a logarithmic scale, and the level."""
    axes.fill_between(np.arange(LEVELS), counts + 1, 1, step="mid", color=BARS_COLOUR, label="pixels + 1")
    axes.set_yscale("log")
    _finish(axes, "pixels + 1", level)


def draw_groups(axes: Axes, groups: np.ndarray, level: int, lights: int) -> None:
    """Draw the groups that each level leaves, the number of visible lights, and the level."""
    axes.plot(np.arange(LEVELS), groups, color=GROUPS_COLOUR, drawstyle="steps-mid", lw=1)
    axes.axhline(lights, color=LIGHT_COLOUR, ls="--", lw=1)
    axes.set_ylim(0, 3 * lights)
    _finish(axes, "groups", level)


def _finish(axes: Axes, label: str, level: int) -> None:
    """Name the axes of what is drawn against the grey levels, and mark one; none where nothing is kept."""
    if level < LEVELS:
        axes.axvline(level, color=THRESHOLD_COLOUR, lw=1.2, ls="-.", label=f"level {level}")
    axes.set_xlim(0, LEVELS)
    axes.set_ylabel(label, fontsize=SMALL)
    axes.tick_params(labelsize=SMALL - 1)
