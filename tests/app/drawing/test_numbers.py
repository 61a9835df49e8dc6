import math

import pytest
from dockpose.app.drawing.numbers import deviation_words, place_words
from dockpose.pose.known import KnownPose


@pytest.mark.parametrize(
    ("position_m", "angles_deg", "words"),
    [
        ((0.06, -0.04, 1.1), (6, -12), "1.10 m ahead, 6 cm right, 4 cm up; pitch 6°, yaw -12°"),
        ((-1.234, 0.5, 0.42), (0, 0.2), "42 cm ahead, 1.23 m left, 50 cm down; pitch 0°, yaw 0°"),
        ((0, 0, 20.94), (-0.4, 90), "20.9 m ahead, 0 cm right, 0 cm down; pitch 0°, yaw 90°"),
        ((0, 0, 0.996), (0, 0), "1.00 m ahead, 0 cm right, 0 cm down; pitch 0°, yaw 0°"),
    ],
)
def test_places_are_said_in_plain_words(position_m, angles_deg, words):
    assert place_words(KnownPose(position_m=position_m, theta_x_deg=angles_deg[0], theta_y_deg=angles_deg[1])) == words


@pytest.mark.parametrize(
    ("sigma_m", "words"),
    [
        (0.00012, "± 0.1 mm"),
        (1e-6, "± 0.1 mm"),
        (0.0034, "± 3 mm"),
        (0.0097, "± 1 cm"),
        (0.123, "± 10 cm"),
        (2.9, "± 3 m"),
        (math.inf, ""),
        (None, ""),
    ],
)
def test_deviations_have_the_unit_that_fits(sigma_m, words):
    assert deviation_words(sigma_m) == words
