"""Pixels and cameras of messages, each against pictures known by hand or what OpenCV makes of them."""

import av
import numpy as np
import pytest
from dockpose.camera.camera import Camera
from dockpose.camera.image import ImageError
from dockpose.sources.bags.messages import camera_in, is_rectified, picture_in

from tests.support import bags
from tests.support.bags import ROS1, ROS2

K = (700.0, 0.0, 319.5, 0.0, 710.0, 239.5, 0.0, 0.0, 1.0)
# One pixel, in the order of blue, green and red, as each encoding has it.
BGR = (10, 20, 30)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(
    ("name", "stored"),
    [("bgr", (10, 20, 30)), ("rgb", (30, 20, 10)), ("bgra", (10, 20, 30, 0)), ("rgba", (30, 20, 10, 7))],
)
def test_colours_are_put_in_order_whatever_their_opacity(name, stored, bits):
    kind = np.uint8 if bits == 8 else np.uint16
    picture = np.full((2, 3, len(stored)), stored, kind)
    found = picture_in(bags.image(picture, f"{name}{bits}"))
    assert found.dtype == kind
    assert np.array_equal(found, np.full((2, 3, 3), BGR))


@pytest.mark.parametrize("encoding", ["mono8", "8UC1", "mono16", "16UC1"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_grey_of_8_and_16_bits_in_either_order(encoding, order):
    levels, size = ([[1, 256], [4095, 65535]], 2) if "16" in encoding else ([[0, 1], [2, 255]], 1)
    found = picture_in(bags.image(np.array(levels, f"{order}u{size}"), encoding, is_bigendian=int(order == ">")))
    assert found.dtype == np.dtype(f"u{size}")
    assert found.tolist() == levels


@pytest.mark.parametrize("fills_last_row", [True, False])
def test_rows_may_be_filled_up(fills_last_row):
    rows = np.array([[1, 2, 3, 99], [4, 5, 6, 99]], np.uint8).ravel()
    data = rows if fills_last_row else rows[:-1]
    message = bags.image(np.zeros((2, 3), np.uint8), "mono8", step=4, data=data)
    assert picture_in(message).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
@pytest.mark.parametrize("bits", [8, 16])
def test_a_bayer_pattern_of_one_colour_gives_that_colour(pattern, bits):
    level = {"r": 200, "g": 100, "b": 50}
    top, bottom = ([level[letter] for letter in pair] for pair in (pattern[:2], pattern[2:]))
    tile = np.array([top, bottom], np.uint8 if bits == 8 else np.uint16)
    found = picture_in(bags.image(np.tile(tile, (4, 4)), f"bayer_{pattern}{bits}"))
    assert np.array_equal(found, np.full((8, 8, 3), (50, 100, 200)))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"encoding": "32FC3"}, "has the encoding '32FC3'; those read are mono8"),
        ({"step": 2}, "in rows of 2"),
        ({"height": 5}, "says 3 x 5 pixels"),
        ({"width": 0}, "says 0 x 2 pixels"),
        ({"data": np.zeros(0, np.uint8)}, "but has 0"),
    ],
)
def test_what_does_not_fit_is_refused(changed, message):
    encoding = changed.pop("encoding", "mono8")
    with pytest.raises(ImageError, match=message):
        picture_in(bags.image(np.zeros((2, 3), np.uint8), encoding, **changed))


def test_depth_and_damaged_pictures_are_refused():
    message = bags.compressed(np.zeros((2, 3), np.uint16), "png")
    message.format = "16UC1; compressedDepth png"
    with pytest.raises(ImageError, match="is a depth picture"):
        picture_in(message)
    cut = bags.compressed(np.random.default_rng(0).integers(0, 256, (20, 30), np.uint8), "png")
    cut.data = cut.data[: len(cut.data) // 2]
    with pytest.raises(ImageError, match=r"damaged or cut short"):
        picture_in(cut)


def camera_of(message, size=(640, 480), **how):
    """The camera of a message for pictures of that size, and what was told of it."""
    told = []
    return camera_in(message, size, told.append, **how), told


@pytest.mark.parametrize("store", [ROS1, ROS2], ids=["ROS 1", "ROS 2"])
@pytest.mark.parametrize(
    ("model", "D"), [("plumb_bob", (0.1, 0.2, 0.01, 0.02, 0.3)), ("equidistant", (0.1, 0.2, 0.01, 0.02))]
)
def test_the_camera_of_a_message(store, model, D):
    message = bags.camera_info(K, (640, 480), store=store, model=model, D=D)
    assert camera_of(message) == (Camera(700, 710, 319.5, 239.5, 640, 480, D, fisheye=model == "equidistant"), [])


ROI, NONE = (100, 50, 320, 240), (0, 0, 0, 0)
WHOLE = Camera(700, 710, 319.5, 239.5, 640, 480)


@pytest.mark.parametrize(
    ("roi", "binning", "size", "corner", "by", "words"),
    [
        (ROI, 0, (320, 240), (100, 50), 1, None),
        (ROI, 2, (160, 120), (100, 50), 2, None),
        ((100, 50, 321, 241), 2, (160, 120), (100, 50), 2, None),  # half a row less, as drivers round
        (NONE, 2, (320, 240), (0, 0), 2, None),
        ((0, 0, 640, 480), 1, (640, 480), (0, 0), 1, None),
        (ROI, 0, (640, 480), (0, 0), 1, "of 320 x 240, and its pictures have 640 x 480, so no region of interest"),
        (NONE, 2, (640, 480), (0, 0), 1, "binned by 2 x 2, and its pictures have 640 x 480, so they are taken as not"),
        ((100, 50, 200, 160), 2, (200, 160), (100, 50), 1, "so they are taken as not binned"),
        ((100, 50, 200, 160), 2, (320, 240), (0, 0), 2, "so no region of interest is taken off"),
    ],
)
def test_what_pictures_show_is_told_by_their_size(roi, binning, size, corner, by, words):
    """A pixel of a binned picture covers two by two: the middle of its first one lies at 0.5."""
    camera, told = camera_of(bags.camera_info(K, (640, 480), roi=roi, binning=binning), size)
    assert (camera.width, camera.height) == size
    point = [[0.1, -0.05, 1.5]]
    expected = (WHOLE.project(point) - corner + 0.5) / by - 0.5
    assert camera.project(point) == pytest.approx(expected, abs=0.5 if roi[2] % 2 else 1e-9)
    assert told == [] if words is None else words in told[0]


@pytest.mark.parametrize(
    ("about", "size", "words"),
    [
        ({"K": K}, (320, 240), "it is for pictures of 640 x 480 pixels, but they have 320 x 240"),
        ({"K": K}, (480, 640), "of 640 x 480 pixels, but they have 480 x 640"),
        ({"K": K, "roi": ROI}, (300, 240), "480 pixels with a region of interest of 320 x 240, but they have 300"),
        ({"K": K, "roi": ROI, "binning": 2}, (320, 240), "binned by 2 x 2, but they have 320 x 240"),  # either of two
        ({"K": K, "size": (0, 0)}, (640, 480), "does not say for which pictures it is"),
        ({"K": (350.0, 0, 159.5, 0, 355.0, 119.5, 0, 0, 1), "binning": 2}, (320, 240), "of about 320 x 240 pixels"),
        ({"K": (350.0, 0, 159.5, 0, 355.0, 119.5, 0, 0, 1)}, (640, 480), r"point \(159.5, 119.5\) is that of pictures"),
        ({"K": (1400.0, 0, 639.5, 0, 1420.0, 479.5, 0, 0, 1)}, (640, 480), "of about 1280 x 960 pixels"),
        ({"K": K, "P": (1400, 0, 639.5, 0, 0, 1420, 479.5, 0, 0, 0, 1, 0)}, (640, 480), "2 times as large as its K"),
        ({"K": (700.0, 0, 319.5, 0, 710.0, 119.5, 0, 0, 1), "roi": (0, 120, 640, 240)}, (640, 240), "about 640 x 240"),
    ],
)
def test_a_camera_that_cannot_be_of_these_pictures_is_refused(about, size, words):
    with pytest.raises(ValueError, match=words):
        camera_of(bags.camera_info(**{"size": (640, 480)} | about), size)


def test_a_principal_point_off_the_middle_is_a_lens_and_no_other_size():
    for x, y in ((290.0, 260.0), (352.0, 225.0), (330.0, 150.0), (420.0, 230.0)):
        assert camera_of(bags.camera_info((700, 0, x, 0, 700, y, 0, 0, 1), (640, 480)))[1] == []


def test_of_rectified_pictures_the_projection_matrix_holds():
    P = (650.0, 0.0, 310.0, 0.0, 0.0, 655.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    message = bags.camera_info(K, (640, 480), D=(0.1, 0.2, 0.01, 0.02, 0.3), P=P)
    camera, told = camera_of(message, is_rectified=True)
    assert camera == Camera(650, 655, 310, 230, 640, 480)
    assert "taken as rectified" in told[0]
    assert camera_of(bags.camera_info(K, (640, 480), D=(0.1, 0.2, 0.01, 0.02, 0.3)), is_rectified=True)[0] is None


RECTIFIED = """
    /camera/image_rect /camera/image_rect_color /camera/image_rect/compressed /camera/image_rect/ffmpeg image_rect
    /c/image_rect_raw /zed/rgb/color/rect/image /c/rectified/image/h264 /c/imageRect /c/ImageRectified /c/left_rect
    /c/image_undistorted/theora /c/rect-color/image
"""
OTHERS = """
    /camera/image_raw /camera/image_color_corrected /camera/direct /c/rectangle /c/correct/image /c/directed/compressed
    /c/image_unrectified /zed/rgb/color/raw/image /rect/camera/image_raw/ffmpeg /c/image_not_rectified /c/non_rect
    /c/no_rect/image /c/image_pre_rect /c/recto /c/rectal_probe/image /c/erect /c/redirect/image /c/distorted
"""


@pytest.mark.parametrize("topic", [*RECTIFIED.split(), *OTHERS.split()])
def test_rectified_is_a_word_of_its_own(topic):
    assert is_rectified(topic) == (topic in RECTIFIED.split())


def smooth_colours(height=48, width=64):
    y, x = np.mgrid[:height, :width]
    return np.dstack([60 + x, 90 + y, 200 - x]).astype(np.uint8)


@pytest.mark.parametrize(
    ("encoding", "pix_fmt"),
    [
        *(("yuv422", "uyvy422"), ("uyvy", "uyvy422"), ("yuv422_yuy2", "yuyv422"), ("yuyv", "yuyv422")),
        *(("nv12", "nv12"), ("nv21", "nv21"), ("i420", "yuv420p")),
    ],
)
@pytest.mark.parametrize("fill", [0, 16])
def test_brightness_and_colours_apart_are_as_ffmpeg_makes_them(encoding, pix_fmt, fill):
    picture = smooth_colours()
    frame = av.VideoFrame.from_ndarray(picture, format="bgr24").reformat(format=pix_fmt)
    planes = [np.frombuffer(bytes(plane), np.uint8).reshape(plane.height, -1) for plane in frame.planes]
    if len(planes) == 3:  # whose rows have two lengths, so nothing fills them up
        fill, planes = 0, [planes[0][:, :64], *(plane[:, :32].reshape(-1, 64) for plane in planes[1:])]
    width = 128 if "422" in pix_fmt else 64
    data = np.pad(np.vstack([plane[:, :width] for plane in planes]), ((0, 0), (0, fill)))
    message = bags.image(picture, encoding, step=width + fill, data=data.ravel())
    np.testing.assert_allclose(picture_in(message).astype(int), picture, atol=4)


def test_floats_from_0_to_1_become_16_bits():
    picture = np.array([[0, 0.5], [1, 1 / 65535]], np.float32)
    assert picture_in(bags.image(picture, "32FC1")).tolist() == [[0, 32768], [65535, 1]]


@pytest.mark.parametrize("value", [1.5, -0.1, np.nan, np.inf])
def test_other_floats_are_depths(value):
    with pytest.raises(ImageError, match="floats beyond 0 to 1"):
        picture_in(bags.image(np.full((2, 2), value, np.float32), "32FC1"))


@pytest.mark.parametrize(("encoding", "shape"), [("nv12", (3, 4)), ("yuyv", (4, 3)), ("i420", (4, 3))])
def test_odd_sizes_that_an_encoding_cannot_have_are_refused(encoding, shape):
    with pytest.raises(ImageError, match=f"which {encoding} cannot have"):
        picture_in(bags.image(np.zeros(shape, np.uint8), encoding))
