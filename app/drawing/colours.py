"""Every colour in the app, and the names of the two poses: those of a result are the library's."""

from dockpose.palette import BLUE, GREEN, GREY, PURPLE, SKY_BLUE, VERMILLION
from dockpose.palette import DROPPED_COLOUR as DROPPED_COLOUR
from dockpose.palette import ELLIPSE_COLOUR as ELLIPSE_COLOUR
from dockpose.palette import LIGHT_COLOUR as LIGHT_COLOUR
from dockpose.palette import ORANGE as ORANGE
from dockpose.palette import POSE_COLOURS as POSE_COLOURS
from dockpose.palette import POSE_NAMES as POSE_NAMES
from dockpose.palette import TEXT_COLOUR as TEXT_COLOUR
from dockpose.palette import bgr as bgr
from dockpose.palette import rgb as rgb

MASK_COLOUR = SKY_BLUE
SHADOW_COLOUR = "#000000"
NOISE_COLOUR = "#969696"  # groups below the minimum area
TRUTH_COLOUR, MEASURED_COLOUR, PATH_COLOUR = GREEN, PURPLE, SKY_BLUE

THRESHOLD_COLOUR, PEAKS_COLOUR, GROUPS_COLOUR, BARS_COLOUR = VERMILLION, PURPLE, BLUE, GREY
TRUST_COLOURS = {"green": "#0B7A4B", "amber": "#FFC233", "red": "#B3261E"}  # white, black and white words on them
STALE_COLOUR = "#5b6570"  # in place of these while a live source gives no new picture
