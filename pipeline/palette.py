"""The names of the two poses, and a result's colours: Okabe and Ito's, which colour-blind people can tell apart."""

BLUE, ORANGE, GREEN, VERMILLION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY_BLUE, GREY, WHITE = "#CC79A7", "#56B4E9", "#7f8fa6", "#ffffff"

POSE_NAMES = ("A", "B")
POSE_COLOURS = (BLUE, ORANGE)
LIGHT_COLOUR = GREEN
ELLIPSE_COLOUR = PURPLE
DROPPED_COLOUR = VERMILLION  # a group that is no light of the ring
TEXT_COLOUR = WHITE


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255 each."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def bgr(colour: str) -> tuple[int, int, int]:
    """Return blue, green and red, 0 to 255 each, as OpenCV orders them."""
    red, green, blue = rgb(colour)
    return blue, green, red
