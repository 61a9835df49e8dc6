"""Pictures and curves that several parts draw alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from dockpose.app.drawing.colours import BARS_COLOUR, GROUPS_COLOUR, LIGHT_COLOUR, THRESHOLD_COLOUR
from dockpose.estimate import Estimate
from dockpose.paper.lights.levels import Picture
from dockpose.thresholds import LEVELS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALL = 8  # points, of texts within a figure
PHOTO_DPI = 110  # of figures with pictures in them, which keeps the report small
_AROUND = 1.5  # of the ring's radius: what is shown around it

Part = tuple[int, int, int, int]


def ring_part(picture: Picture) -> Part:
    """Left, top, right and bottom of what shows the dock's ring with a margin."""
    ellipse = picture.truth.ellipse
    assert ellipse is not None
    (x, y), half = ellipse.centre_px, _AROUND * ellipse.semi_axes_px[0]
    height, width = picture.image.shape
    return max(0, int(x - half)), max(0, int(y - half)), min(width, int(x + half)), min(height, int(y + half))


def show(axes: Axes, image: np.ndarray, title: str, part: Part | None = None) -> None:
    """Show a grey or binarised picture, or a part of it, without ticks."""
    height, width = image.shape
    left, top, right, bottom = part or (0, 0, width, height)
    extent = (left - 0.5, right - 0.5, bottom - 0.5, top - 0.5)
    top_value = 1 if image.dtype == bool else 255
    shown = image[top:bottom, left:right]
    axes.imshow(shown, cmap="gray", vmin=0, vmax=top_value, extent=extent, interpolation="nearest")
    axes.set_title(title, fontsize=SMALL)
    axes.set_xticks([])
    axes.set_yticks([])


def mark_lights(axes: Axes, found: Estimate) -> None:
    """Circle the lights on the ring, and draw the ellipse through them."""
    if found.markers is not None and found.ring is not None:
        x, y = found.markers.points_px[found.ring.on_ring].T
        axes.plot(x, y, "o", mfc="none", mec=LIGHT_COLOUR, ms=7, mew=1.2)
    if found.ellipse is not None:
        x, y = found.ellipse.points().T
        axes.plot(np.append(x, x[0]), np.append(y, y[0]), "-", color=LIGHT_COLOUR, lw=0.8)


def draw_histogram(axes: Axes, counts: np.ndarray, level: int) -> None:
    """Draw the pixels at each grey level on a logarithmic scale, and the level."""
    axes.fill_between(np.arange(LEVELS), counts + 1, 1, step="mid", color=BARS_COLOUR)
    axes.set_yscale("log")
    draw_level(axes, level)
    axes.set_xlim(0, LEVELS)
    axes.set_ylabel("pixels + 1", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL - 1)


def draw_groups(axes: Axes, groups: np.ndarray, level: int, lights: int) -> None:
    """Draw the groups that each level leaves, the number of visible lights, and the level."""
    axes.plot(np.arange(LEVELS), groups, color=GROUPS_COLOUR, drawstyle="steps-mid", lw=1)
    axes.axhline(lights, color=LIGHT_COLOUR, ls="--", lw=1)
    draw_level(axes, level)
    axes.set_xlim(0, LEVELS)
    axes.set_ylim(0, 3 * lights)
    axes.set_ylabel("groups", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL - 1)


def draw_level(axes: Axes, level: int) -> None:
    """Mark a level; none where nothing is kept."""
    if level < LEVELS:
        axes.axvline(level, color=THRESHOLD_COLOUR, lw=1.2, ls="-.")
