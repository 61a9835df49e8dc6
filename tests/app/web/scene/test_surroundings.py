import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.view import MeasuredPose, open_source, with_sample
from dockpose.app.web.scene.drawing import drawing_of
from dockpose.app.web.scene.viewpoints import FOV_RAD, viewpoint
from dockpose.camera.port import FlatPort
from dockpose.simulate import Pose, Scene, render
from dockpose.simulate.optics.water import preset
from msgspec.structs import replace as changed

LETTER_PX, LINE_PX = 7.5, 17.0  # of viser's labels: letters of 12 px, and a margin of a fifth of them around


def on_screen(place, points, width_px, height_px):
    """Pixels of points seen by an eye whose up is -y; not a number where they lie behind it."""
    ahead = place.look_at - place.position
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, [0, -1, 0])
    right = right / np.linalg.norm(right)
    offset = points - place.position
    depth = np.where(offset @ ahead > 1e-6, offset @ ahead, np.nan)
    scale = height_px / 2 / math.tan(FOV_RAD / 2)
    return np.column_stack(
        [
            width_px / 2 + scale * (offset @ right) / depth,
            height_px / 2 - scale * (offset @ np.cross(right, ahead)) / depth,
        ]
    )


def box(label, at):
    """Left, top, right and bottom of a label in pixels."""
    down, across = label.anchor.split("-")
    wide = LETTER_PX * len(label.text)
    left = at[0] - {"left": 0, "center": wide / 2, "right": wide}[across]
    top = at[1] - {"top": 0, "center": LINE_PX / 2, "bottom": LINE_PX}[down]
    return left, top, left + wide, top + LINE_PX


def touch(one, other):
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


@pytest.fixture(scope="module", params=["plain", "tilted", "port"])
def analysis(request):
    """A sample, or one seen through a port, and a pose measured beside where the dock is."""
    view = open_source(None, None, None)
    if request.param == "tilted":
        view = with_sample(view, "tilted")
    view = replace(view, measured=MeasuredPose(5.0, -3.0, 108.0, 5.0, -10.0))
    if request.param == "port":
        camera = changed(view.camera, port=FlatPort(0.02, 0.01))
        pose = Pose(position_m=(0.05, -0.04, 1.1), theta_x_deg=6, theta_y_deg=-12, roll_deg=0)
        scene = Scene(camera=camera, dock=view.dock, pose=pose, water=preset("clear"))
        view = replace(view, camera=camera, image=render(scene)[0])
    return analyse(view)


@pytest.mark.parametrize("size", [(597, 353), (840, 497), (390, 228), (820, 362), (1024, 197)])
def test_labels_are_apart_and_in_view(analysis, size):
    drawn = drawing_of(analysis)
    assert {"A", "B", "truth", "measured", "camera", "x", "y", "z"} <= set(drawn.labels)
    place = viewpoint(drawn.everything, size[0] / size[1])
    points = on_screen(place, np.array([label.position for label in drawn.labels.values()]), *size)
    boxes = {
        key: box(label, at)
        for (key, label), at in zip(drawn.labels.items(), points, strict=True)
        if np.isfinite(at).all()
    }
    docks = {"A", "B", "truth", "measured"}
    for one, other in itertools.combinations(boxes, 2):
        assert not touch(boxes[one], boxes[other]), (one, other)
    for key in docks | {"camera"}:
        left, top, right, bottom = boxes[key]
        assert 0 <= left <= right <= size[0], key
        assert 0 <= top <= bottom <= size[1], key
