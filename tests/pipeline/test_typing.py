"""What users write passes the type checker, and what cannot work does not: pyright reads this file, pytest runs it."""

# pyright: reportUnnecessaryTypeIgnoreComment=error

from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, Settings, Tracker, calibrate, estimate, open_frames
from dockpose.camera import Board
from dockpose.pose.solve import find_poses

CAMERA = Camera(50, 50, 31.5, 23.5, 64, 48, distortion=[0.1, 0, 0, 0])
DARK = np.zeros((48, 64), np.uint8)


def test_lists_arrays_and_paths_are_taken(tmp_path: Path) -> None:
    assert msgspec.structs.replace(CAMERA, distortion=np.zeros(5)).distortion == (0, 0, 0, 0, 0)
    assert Camera(50, 50, 31.5, 23.5, 64, 48, np.zeros(4)).distortion == (0, 0, 0, 0)
    dock = Dock(0.3, 3, angles_deg=np.array([0.0, 120.0, 240.0]))
    assert dock.angles_deg == (0, 120, 240)
    assert Dock(0.3, 3, offsets_m=[[0, 0, 0.01]] * 3) == Dock(0.3, 3, offsets_m=np.array([[0, 0, 0.01]] * 3))
    assert Settings(masks=[[0, 0, 5, 5]]).masks == Settings(masks=np.array([[0, 0, 5, 5]])).masks
    assert CAMERA.project([[0, 0, 1]]).tolist() == CAMERA.project(np.array([[0, 0, 1.0]])).tolist()
    angles = np.radians(np.arange(0, 360, 36))
    points = np.column_stack([31.5 + 10 * np.cos(angles), 23.5 + 9 * np.sin(angles)])
    assert find_poses(points.tolist(), CAMERA, dock)[0].centre_px == find_poses(points, CAMERA, dock)[0].centre_px
    path = tmp_path / "dark.png"
    cv2.imwrite(str(path), DARK)
    for image in (DARK, DARK / 255, path, str(path)):
        assert estimate(image, CAMERA, dock).status == "no_lights"
    assert Tracker(CAMERA, dock).see(path).estimate.status == "no_lights"
    with open_frames(path) as frames, open_frames(str(path)) as others:
        assert frames.count == others.count == 1


def test_what_cannot_be_a_picture_is_refused_by_name_and_value() -> None:
    dock = Dock(0.3)
    with pytest.raises(ValueError, match="image is 12; it must be an array of pixels, or the path of a picture file"):
        estimate(12, CAMERA, dock)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"image is \[\[0, 1\]\]; it must be an array"):
        estimate([[0, 1]], CAMERA, dock)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="image is None; it must be an array"):
        estimate(None, CAMERA, dock)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"camera is 'c\.yaml'; it must be a Camera"):
        estimate(DARK, "c.yaml", dock)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"dock is 0\.3; it must be a Dock"):
        estimate(DARK, CAMERA, 0.3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="settings is 'otsu'; it must be a Settings"):
        estimate(DARK, CAMERA, dock, "otsu")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match=r"source is 1\.5; it must be a path"):
        open_frames(1.5)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="board is '10x7'; it must be a Board"):
        calibrate([("a", DARK)], "10x7")  # pyright: ignore[reportArgumentType]


def test_calibrate_takes_any_picture_that_estimate_takes() -> None:
    bgr = np.zeros((48, 64, 3), np.uint8)
    for image in (bgr, DARK / 255, bgr.astype(">u2"), None):
        with pytest.raises(ValueError, match="was found in 0 of 1 pictures"):
            calibrate([("a", image)], Board(10, 7, 0.024))
    with pytest.raises(ValueError, match="pixels are int64"):
        calibrate([("a", DARK.astype(np.int64))], Board(10, 7, 0.024))
