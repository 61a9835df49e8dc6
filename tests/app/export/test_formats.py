# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false, reportArgumentType=false
# pyright: reportGeneralTypeIssues=false, reportCallIssue=false, reportOptionalIterable=false

import base64
import io
import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
import pytest
from dockpose import estimate
from dockpose.app.drawing.annotated import LAYERS, annotate
from dockpose.app.drawing.colours import POSE_COLOURS, TRUTH_COLOUR, bgr
from dockpose.app.drawing.figures import picture_figure, to_png, to_svg
from dockpose.app.export.recordings.ros import FRAME_ID, covariance, header, pose_message
from dockpose.app.export.report import histogram_figure
from dockpose.estimate.geometry import pose_lines
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose
from dockpose.simulate import render
from PIL import Image
from scipy.spatial.transform import Rotation

from tests.support.scenes import CAMERA, DOCK, random_scene

PICTURE, _ = render(random_scene(2, position_m=(0.0, 0.05, 1.4), theta_x_deg=20.0, theta_y_deg=-15.0))
FOUND = estimate(PICTURE, CAMERA, DOCK)
TRUTH = KnownPose((0.0, 0.05, 1.4), 20.0, -15.0)
NOTHING = estimate(np.full((480, 640), 10, np.uint8), CAMERA, DOCK)
SVG = "{http://www.w3.org/2000/svg}"


def texts(svg):
    return [" ".join(element.itertext()).strip() for element in ElementTree.fromstring(svg).iter(f"{SVG}text")]


def test_svg_holds_the_very_picture_and_text_as_text():
    svg = to_svg(picture_figure(PICTURE, FOUND), "a")
    (image,) = ElementTree.fromstring(svg).iter(f"{SVG}image")
    data = base64.b64decode(image.get("{http://www.w3.org/1999/xlink}href").partition(",")[2])
    embedded = np.asarray(Image.open(io.BytesIO(data)).convert("L"))
    assert embedded.shape == PICTURE.shape
    assert (embedded == PICTURE).all() or (embedded[::-1] == PICTURE).all()
    words = " ".join(texts(svg))
    assert "chosen" in words
    assert "cm; θx" in words
    assert "at the dock" in words
    assert to_svg(picture_figure(PICTURE, FOUND), "a") == svg  # no date, nothing by chance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layer", "word"),
    [
        *[("lights", "light on the ring"), ("ellipse", "ellipse centre"), ("a", "dock centre"), ("b", "B")],
        *[("truth", "truth"), ("text", "chosen"), ("scale", "at the dock")],
    ],
)
def test_each_layer_can_be_left_out(layer, word):
    alone = texts(to_svg(picture_figure(PICTURE, FOUND, [layer], TRUTH)))
    without = texts(to_svg(picture_figure(PICTURE, FOUND, [name for name in LAYERS if name != layer], TRUTH)))
    assert any(text.startswith(word) or word in text.split(": ")[0] or word in text for text in alone)
    assert not any(text == word or (len(word) > 8 and word in text) for text in without)


@pytest.mark.parametrize("kind", ["pixels", "figure"])
@pytest.mark.parametrize(("layer", "colour"), [*zip("ab", POSE_COLOURS, strict=True), ("truth", TRUTH_COLOUR)])
def test_a_pose_is_drawn_where_it_lies_and_in_its_own_colour_alone(layer, colour, kind):
    poses = {"a": FOUND.candidates[0], "b": FOUND.candidates[1], "truth": TRUTH}
    if kind == "pixels":
        drawn, scale = annotate(PICTURE, FOUND, layers=[layer], truth=TRUTH), 1.0
    else:
        figure = picture_figure(PICTURE, FOUND, [layer], TRUTH)
        figure.legends.clear()
        drawn = cv2.imdecode(np.frombuffer(to_png(figure), np.uint8), cv2.IMREAD_COLOR)
        scale = drawn.shape[1] / FOUND.width
    is_coloured = {one: np.abs(drawn.astype(int) - bgr(one)).max(axis=2) < 40 for one in (*POSE_COLOURS, TRUTH_COLOUR)}
    # The tips of the normals are far apart; at the rims all poses meet.
    x, y = np.rint(scale * pose_lines(poses[layer], FOUND)[2][1]).astype(int)
    assert is_coloured[colour][y - 3 : y + 4, x - 3 : x + 4].any()
    counts = {one: int(pixels.sum()) for one, pixels in is_coloured.items()}
    assert counts.pop(colour) > 100
    assert set(counts.values()) == {0}


@pytest.mark.parametrize("layer", LAYERS)
def test_each_layer_of_the_png_changes_something_of_its_own(layer):
    plain = annotate(PICTURE, FOUND, layers=(), truth=TRUTH)
    np.testing.assert_array_equal(plain, cv2.cvtColor(PICTURE, cv2.COLOR_GRAY2BGR))
    assert (annotate(PICTURE, FOUND, layers=[layer], truth=TRUTH) != plain).any()
    with pytest.raises(ValueError, match="layers has 'lamps'"):
        annotate(PICTURE, FOUND, layers=["lamps"])


def test_without_a_dock_the_legend_says_so():
    assert any("no pose (no lights)" in text for text in texts(to_svg(picture_figure(PICTURE, NOTHING))))


@pytest.mark.slow
def test_histogram_opens_and_names_level_and_groups():
    figure = histogram_figure(FOUND.threshold)
    words = " ".join(texts(to_svg(figure)))
    assert f"level {FOUND.threshold.level}" in words
    assert "groups" in words
    assert np.asarray(Image.open(io.BytesIO(to_png(figure)))).std() > 10
    assert texts(to_svg(histogram_figure(NOTHING.threshold)))


def test_ros_message_is_the_pose():
    message = pose_message(FOUND.selected, header(1_500_000_000, FRAME_ID))
    assert message["header"] == {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "camera_optical_frame"}
    pose = message["pose"]["pose"]
    transform = FOUND.selected.T_camera_dock
    np.testing.assert_allclose([pose["position"][axis] for axis in "xyz"], transform[:3, 3])
    rotation = Rotation.from_quat([pose["orientation"][axis] for axis in "xyzw"])
    np.testing.assert_allclose(rotation.as_matrix(), transform[:3, :3], atol=1e-12)
    assert len(message["pose"]["covariance"]) == 36


def test_ros_covariance_of_a_pose_without_one_says_that_nothing_is_known():
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2))
    assert np.diag(covariance(pose)).tolist() == [1e6] * 3 + [np.pi**2 / 3] * 3
