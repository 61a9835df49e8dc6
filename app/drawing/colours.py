"""Every colour in the app, and the names of the two poses.

The palette is Okabe and Ito's, which colour-blind people can tell apart (Color Universal Design, 2008). Colours are
written as in HTML; :func:`rgb` and :func:`bgr` convert them for viser and OpenCV.
"""

from __future__ import annotations

from dockpose.estimate.words import POSE_NAMES as POSE_NAMES

BLUE, ORANGE, GREEN, VERMILLION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY_BLUE, GREY, WHITE = "#CC79A7", "#56B4E9", "#7f8fa6", "#ffffff"

POSE_COLOURS = (BLUE, ORANGE)
LIGHT_COLOUR = GREEN
ELLIPSE_COLOUR = PURPLE
DROPPED_COLOUR = VERMILLION
MASK_COLOUR = SKY_BLUE
TEXT_COLOUR, SHADOW_COLOUR = WHITE, "#000000"
NOISE_COLOUR = "#969696"  # groups below the minimum area
TRUTH_COLOUR, MEASURED_COLOUR, PATH_COLOUR = GREEN, PURPLE, SKY_BLUE

THRESHOLD_COLOUR, PEAKS_COLOUR, GROUPS_COLOUR, BARS_COLOUR = VERMILLION, PURPLE, BLUE, GREY
GOOD_COLOUR, BAD_COLOUR = GREEN, VERMILLION
TRUST_COLOURS = {"green": GREEN, "amber": ORANGE, "red": VERMILLION}


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255 each."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def bgr(colour: str) -> tuple[int, int, int]:
    """Return blue, green and red, 0 to 255 each, as OpenCV orders them."""
    red, green, blue = rgb(colour)
    return blue, green, red
