# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false, reportArgumentType=false
# pyright: reportGeneralTypeIssues=false, reportCallIssue=false, reportOptionalIterable=false

import base64
import io
import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
import pypdfium2
import pytest
import yaml
from dockpose import estimate
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.figures import to_pdf, to_png, to_svg
from dockpose.app.drawing.overlay import LAYERS, scale_bar
from dockpose.app.drawing.vector import picture_figure
from dockpose.app.export.plots import histogram_figure
from dockpose.app.export.ros import covariance, pose_yaml
from dockpose.pose.circle import rotation_from_angles
from dockpose.simulate import render
from PIL import Image
from scipy.spatial.transform import Rotation

from tests.support.scenes import CAMERA, DOCK, random_scene

PICTURE, _ = render(random_scene(2, position_m=(0.0, 0.05, 1.4), theta_x_deg=20.0, theta_y_deg=-15.0))
FOUND = estimate(PICTURE, CAMERA, DOCK)
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


@pytest.mark.parametrize(
    ("layer", "word"),
    [
        ("lights", "light on the ring"),
        ("ellipse", "ellipse"),
        ("centres", "dock centre"),
        ("normals", "A"),
        ("text", "chosen"),
        ("scale", "at the dock"),
    ],
)
def test_each_layer_can_be_left_out(layer, word):
    alone = texts(to_svg(picture_figure(PICTURE, FOUND, [layer])))
    without = texts(to_svg(picture_figure(PICTURE, FOUND, [name for name in LAYERS if name != layer])))
    assert any(text.startswith(word) or word in text.split(": ")[0] or word in text for text in alone)
    assert not any(text == word or (len(word) > 8 and word in text) for text in without)


@pytest.mark.parametrize("layer", LAYERS)
def test_each_layer_of_the_png_changes_something_of_its_own(layer):
    plain = annotate(PICTURE, FOUND, layers=())
    np.testing.assert_array_equal(plain, cv2.cvtColor(PICTURE, cv2.COLOR_GRAY2BGR))
    assert (annotate(PICTURE, FOUND, layers=[layer]) != plain).any()
    with pytest.raises(ValueError, match="layers has 'lamps'"):
        annotate(PICTURE, FOUND, layers=["lamps"])


def test_the_scale_is_a_round_length_at_the_docks_distance():
    length_m, length_px = scale_bar(FOUND)
    assert length_m in (0.2, 0.1, 0.5)
    # A pinhole of f pixels sees a length L at z as f L / z pixels.
    assert length_px == pytest.approx(700 * length_m / FOUND.selected.position_m[2], rel=1e-6)
    assert length_px <= 640 / 4
    assert scale_bar(NOTHING) is None


@pytest.mark.parametrize("found", [FOUND, NOTHING], ids=["dock", "nothing"])
def test_a_pdf_reader_shows_one_page_with_the_picture(found):
    document = pypdfium2.PdfDocument(to_pdf(picture_figure(PICTURE, found)))
    assert len(document) == 1
    page = document[0].render(scale=1).to_numpy()
    assert page.shape[1] == pytest.approx(6.5 * 72, abs=1)
    assert page.std() > 5
    words = document[0].get_textpage().get_text_range()
    assert ("chosen" if found is FOUND else "no pose (no lights)") in words
    document.close()


def test_histogram_opens_and_names_level_and_groups():
    figure = histogram_figure(FOUND.threshold)
    words = " ".join(texts(to_svg(figure)))
    assert f"level {FOUND.threshold.level}" in words
    assert "groups" in words
    assert np.asarray(Image.open(io.BytesIO(to_png(figure)))).std() > 10
    assert texts(to_svg(histogram_figure(NOTHING.threshold)))


def test_ros_message_is_the_pose():
    message = yaml.safe_load(pose_yaml(FOUND, 12.25, "tank_cam_optical"))
    assert message["header"] == {"stamp": {"sec": 12, "nanosec": 250_000_000}, "frame_id": "tank_cam_optical"}
    pose = message["pose"]["pose"]
    transform = FOUND.selected.T_camera_dock
    np.testing.assert_allclose([pose["position"][axis] for axis in "xyz"], transform[:3, 3])
    rotation = Rotation.from_quat([pose["orientation"][axis] for axis in "xyzw"])
    np.testing.assert_allclose(rotation.as_matrix(), transform[:3, :3], atol=1e-12)
    assert len(message["pose"]["covariance"]) == 36
    assert pose_yaml(NOTHING) is None


def test_ros_covariance_is_that_of_poses_drawn_at_random():
    """Turn the dock by angles drawn with the sigmas; the turns' rotation vectors in the camera's frame scatter so."""
    rng = np.random.default_rng(3)
    pose, small = FOUND.selected, 1e-3
    sigma_x, sigma_y = pose.sigma_theta_rad
    base = rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad)
    drawn = rng.normal(0, [small * sigma_x, small * sigma_y], (20_000, 2))
    turned = np.array([rotation_from_angles(pose.theta_x_rad + dx, pose.theta_y_rad + dy) for dx, dy in drawn])
    vectors = Rotation.from_matrix(turned @ base.T).as_rotvec() / small
    roll = np.outer(base[:, 2], base[:, 2]) * np.pi**2 / 3
    np.testing.assert_allclose(
        covariance(pose)[3:, 3:] - roll, np.cov(vectors.T), atol=0.05 * max(sigma_x, sigma_y) ** 2
    )
    np.testing.assert_allclose(np.diag(covariance(pose))[:3], np.square(pose.sigma_position_m))
    assert np.linalg.eigvalsh(covariance(pose)).min() > -1e-12
