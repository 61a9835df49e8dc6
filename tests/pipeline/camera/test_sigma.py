"""Standard errors of a camera: read, written, scaled and turned with it; what is refused; what calibrations write."""

import msgspec
import numpy as np
import pytest
from dockpose.camera.camera import Camera
from dockpose.camera.files import load_camera, save_camera
from dockpose.camera.port import FlatPort
from dockpose.camera.sigma import CENTRE_PX, FOCAL_SHARE, errors_of, moved, with_port_errors
from dockpose.camera.standard_errors import CameraSigma

INTRINSICS = (700.0, 710.0, 300.0, 250.0, 640, 480)
BENT = (-0.2, 0.05, 0.001, 0.002)
SIGMA = {"fx_px": 1.0, "fy_px": 2.0, "cx_px": 3.0, "cy_px": 4.0, "distortion": [0.1, 0.2, 0.3, 0.4]}


def covariance(seed: int = 0) -> np.ndarray:
    """A covariance (8, 8) with the standard errors of ``SIGMA``."""
    A = np.random.default_rng(seed).normal(size=(8, 8))
    C = A @ A.T
    sigmas = np.array([1.0, 2.0, 3.0, 4.0, 0.1, 0.2, 0.3, 0.4])
    return C * np.outer(sigmas, sigmas) / np.sqrt(np.outer(np.diag(C), np.diag(C)))


def camera(**more) -> Camera:
    return Camera(*INTRINSICS, BENT, **more)


def test_files_keep_them(tmp_path):
    known = camera(sigma=SIGMA, covariance=covariance())
    save_camera(known, tmp_path / "camera.yaml")
    assert load_camera(tmp_path / "camera.yaml") == known
    save_camera(camera(), tmp_path / "without.yaml")
    assert load_camera(tmp_path / "without.yaml") == camera()


def test_a_file_written_by_hand(tmp_path):
    (tmp_path / "camera.yaml").write_text(
        "camera: {fx_px: 700, fy_px: 700, cx_px: 319.5, cy_px: 239.5, width_px: 640, height_px: 480,\n"
        "  port: {air_gap_m: 0.03, glass_m: 0.01}, sigma: {fx_px: 2, fy_px: 2, air_gap_m: 0.002}}\n"
    )
    found = load_camera(tmp_path / "camera.yaml")
    assert found.sigma == CameraSigma(fx=2.0, fy=2.0, air_gap_m=0.002)
    names, errors = errors_of(found)
    # What the file leaves out is as usual.
    assert names == ["fx", "fy", "air_gap_m", "cx", "cy"]
    assert np.sqrt(np.diag(errors)) == pytest.approx([2, 2, 0.002, CENTRE_PX, CENTRE_PX])


def test_without_a_word_focal_lengths_go_together():
    names, errors = errors_of(camera())
    assert names == ["fx", "fy", "cx", "cy"]
    assert np.sqrt(np.diag(errors)) == pytest.approx([FOCAL_SHARE * 700, FOCAL_SHARE * 710, CENTRE_PX, CENTRE_PX])
    assert errors[0, 1] ** 2 == pytest.approx(errors[0, 0] * errors[1, 1])  # the pixels stay square
    assert not errors[2:, :2].any()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"sigma": {"fx_px": -1.0}}, "sigma fx is -1.0; it must be at least 0"),
        ({"sigma": {"distortion": [0.1]}}, "sigma.distortion has 1 values; the camera has 4 coefficients"),
        ({"sigma": {"air_gap_m": 0.001}}, "sigma has a port's lengths; the camera has no port"),
        ({"sigma": {"fx_px": 1.0}, "covariance": np.eye(2)}, "covariance has 2 rows; it must be 1 x 1"),
        ({"covariance": np.eye(2)}, "covariance has 2 rows; it must be 0 x 0"),
        ({"sigma": {"fx_px": 1, "fy_px": 1}, "covariance": [[1, 2], [2, 1]]}, "have no negative eigenvalue"),
        ({"sigma": {"fx_px": 1, "fy_px": 1}, "covariance": [[1, 0.5], [0, 1]]}, "must be symmetric"),
        ({"sigma": {"fx_px": 1}, "covariance": [[float("nan")]]}, r"covariance\[0\] is nan"),
        ({"sigma": {"f_px": 1}}, "unknown field `f_px`"),
    ],
)
def test_what_is_no_standard_error_of_the_camera_is_refused(more, words):
    with pytest.raises(ValueError, match=words):
        camera(**more)


@pytest.mark.parametrize(
    "change", [lambda one: one.for_size(320, 240), *(lambda one, by=by: one.rotated(by) for by in (90, 180, 270))]
)
def test_a_camera_that_is_scaled_or_turned_keeps_its_errors(change):
    """Changing a number and then the picture is the same as the other way round, so errors go along."""
    known = camera(sigma=SIGMA, covariance=covariance())
    changed = change(known)
    numbers = [("fx", 1.0), ("fy", 1.0), ("cx", 1.0), ("cy", 1.0), *((f"distortion[{i}]", 1.0) for i in range(4))]

    def values(one: Camera) -> np.ndarray:
        return np.array([one.fx, one.fy, one.cx, one.cy, *one.distortion])

    J = np.column_stack([values(change(moved(known, name, by))) - values(changed) for name, by in numbers])
    names, errors = errors_of(changed)
    assert names == [name for name, _ in numbers]
    assert errors == pytest.approx(J @ covariance() @ J.T, rel=1e-6, abs=1e-12)
    assert list(changed.sigma.by_name().values()) == pytest.approx(np.sqrt(np.diag(errors)))
    alone = change(camera(sigma=SIGMA))
    assert alone.sigma == msgspec.convert(msgspec.to_builtins(alone.sigma), CameraSigma)
    assert alone.covariance == ()


def test_a_port_that_is_fitted_joins_what_is_known():
    known = msgspec.structs.replace(camera(sigma=SIGMA, covariance=covariance()), port=FlatPort(0.03, 0.01))
    both = with_port_errors(known, ["air_gap_m", "glass_m"], np.array([[1e-6, 5e-7], [5e-7, 4e-6]]))
    names, errors = errors_of(both)
    assert names[-2:] == ["air_gap_m", "glass_m"]
    assert errors[:8, :8] == pytest.approx(covariance())
    assert np.sqrt(np.diag(errors))[-2:] == pytest.approx([0.001, 0.002])
    gap_alone = with_port_errors(both, ["air_gap_m"], np.array([[1e-6]]))
    assert errors_of(gap_alone)[0] == names[:-1]
    alone = with_port_errors(Camera(*INTRINSICS, port=FlatPort(0.03, 0.01)), ["air_gap_m"], np.array([[1e-6]]))
    assert errors_of(alone)[0] == ["air_gap_m", "fx", "fy", "cx", "cy"]
    assert moved(alone, "air_gap_m", -1.0).port == FlatPort(0.0, 0.01)
