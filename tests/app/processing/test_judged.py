# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false

import math
from typing import Any

import numpy as np
import pytest
from dockpose import estimate
from dockpose.app.processing.judged import HEAD, Judged, known_by_hand, summary
from dockpose.app.processing.losses import Losses
from dockpose.pose.known import PoseError
from dockpose.sidecar import sample_path


def row(method, lost, status="ok", error: Any = None, picture="a.png"):
    return Judged(picture, method, 100, Losses(*lost), status, error)


def test_a_method_has_the_sums_over_its_pictures_and_the_middle_of_its_errors():
    """Of 20 lights 3 missed are 17 found; errors of 1, 2 and 30 mm have their middle at 2."""
    off = [PoseError(mm / 1000, math.radians(degrees), mm < 30) for mm, degrees in ((1, 1), (30, 8), (2, 2))]
    rows = [
        row("hats", (10, 0, 0, 0), error=off[0]),
        row("otsu", (10, 10, 0, 4), status="not_a_ring"),
        row("hats", (6, 3, 2, 1), error=off[1], picture="b.png"),
        row("hats", (4, 0, 0, 0), error=off[2], picture="c.png"),
    ]
    assert [dict(zip(HEAD, cells, strict=True)) for cells in summary(rows)] == [
        {
            "method": "HATS",
            "pictures": "3",
            "lights found": "17 of 20",
            "run together": "2",
            "strays": "1",
            "exactly the lights": "2",
            "docks found": "3",
            "poses right": "2",
            "off (mm)": "2.0",
            "off (deg)": "2.0",
        },
        dict(zip(HEAD, ("Otsu", "1", "0 of 10", "0", "4", "0", "0", "0", "-", "-"), strict=True)),
    ]


def test_what_is_known_of_lights_that_were_set_is_where_they_are_and_their_pose():
    found = estimate(sample_path("plain"))
    assert known_by_hand(found) is None
    lights = found.markers.points_px[found.ring.on_ring]
    known = known_by_hand(estimate(sample_path("plain"), lights_px=lights + [1.0, -1.0], snap=True))
    np.testing.assert_allclose(known.lights_px, lights, atol=0.05)
    assert known.pose.position_m == pytest.approx(found.selected.position_m, abs=1e-4)
    too_few = known_by_hand(estimate(sample_path("plain"), lights_px=lights[:2]))
    assert (len(too_few.lights_px), too_few.pose) == (2, None)
