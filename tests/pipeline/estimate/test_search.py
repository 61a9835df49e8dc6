import numpy as np
import pytest
from dockpose.estimate.search import _Found
from dockpose.lights.ellipse import fit_ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring

ANGLES = np.radians([0, 62, 117, 183, 240, 297])


def look(off_px=0.0, sigma_px: float | None = 0.1, count=6, log_chance=-10.0):
    """Six lights of 100 pixels on a circle of 80, the second farther from its middle by so much, and known so well."""
    radii = np.full(6, 80.0)
    radii[1] += off_px
    points = (320 + radii * [np.cos(ANGLES), np.sin(ANGLES)]).T[:count]
    covariances = None
    if sigma_px is not None:
        covariances = np.tile(0.1**2 * np.eye(2), (count, 1, 1))
        covariances[1] = sigma_px**2 * np.eye(2)
    shown = np.full(count, 100)
    markers = Markers(points, shown, shown, covariances_px2=covariances)
    stages = {"markers": markers, "ring": Ring(np.ones(count, dtype=bool), ""), "ellipse": fit_ellipse(points)}
    return _Found("ok", "", stages, log_chance)


@pytest.mark.parametrize(
    ("other", "better"),
    [
        (look(4.0, 3.0), True),  # moved within the light, and worse known
        (look(4.0, None), True),  # and nothing known of it
        (look(4.0, 0.1), False),  # as well known
        (look(7.0, 3.0), False),  # another light: 100 pixels reach 5.6 px
        (look(0.0, 3.0, count=5), False),  # not all of them
        (_Found("not_a_ring", "", {}), False),
    ],
)
def test_centres_that_are_worse_known_are_no_better_for_being_nearer_to_even(other, better):
    assert look().knows_better(other) == better


def test_a_look_with_a_light_off_the_rim_does_not_hold_out_against_one_with_all_on_it():
    assert not look(4.0, 0.1).knows_better(look(0.0, 3.0))
