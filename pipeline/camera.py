"""The camera: intrinsics and lens distortion, pixels to rays and back."""

from __future__ import annotations

import math
from typing import Any

import cv2
import msgspec
import numpy as np

from pipeline.checks import as_points, check_number, check_whole
from pipeline.port import FlatPort

DISTORTION_LENGTHS = (0, 4, 5, 8)
_UNDISTORT_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-14)


class Camera(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    rename={
        "fx": "fx_px",
        "fy": "fy_px",
        "cx": "cx_px",
        "cy": "cy_px",
        "width": "width_px",
        "height": "height_px",
    },
):
    """Intrinsics of one camera, in pixels, with pixel centres at integers.

    Parameters
    ----------
    fx, fy : focal lengths in pixels, above 0.
    cx, cy : principal point in pixels.
    width, height : size in pixels of the pictures these intrinsics are for.
    distortion : none, 4 or 5 (plumb_bob: k1 k2 p1 p2 k3) or 8 (rational: ... k4 k5 k6) coefficients,
        in OpenCV's order.
    port : the flat window in front of a camera whose intrinsics were measured in air; None for a camera that was
        calibrated in the water, or that looks through a dome with its centre at the dome's.

    Raises
    ------
    ValueError
        if a value is not finite, a focal length or a size is not positive, or the number of
        distortion coefficients is none of these.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    distortion: tuple[float, ...] = ()
    port: FlatPort | None = None

    def __post_init__(self) -> None:
        check_number("fx", self.fx, above=0)
        check_number("fy", self.fy, above=0)
        check_number("cx", self.cx)
        check_number("cy", self.cy)
        check_whole("width", self.width, least=1)
        check_whole("height", self.height, least=1)
        if len(self.distortion) not in DISTORTION_LENGTHS:
            raise ValueError(
                f"distortion has {len(self.distortion)} coefficients; it must have "
                f"{', '.join(map(str, DISTORTION_LENGTHS[:-1]))} or {DISTORTION_LENGTHS[-1]}"
            )
        for i, coefficient in enumerate(self.distortion):
            check_number(f"distortion[{i}]", coefficient)

    @property
    def matrix(self) -> np.ndarray:
        """The 3 x 3 intrinsic matrix K."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def field_of_view_rad(self) -> tuple[float, float]:
        """Horizontal and vertical field of view of the pinhole, in radians."""
        left, right = math.atan((self.cx + 0.5) / self.fx), math.atan((self.width - 0.5 - self.cx) / self.fx)
        top, bottom = math.atan((self.cy + 0.5) / self.fy), math.atan((self.height - 0.5 - self.cy) / self.fy)
        return left + right, top + bottom

    def undistort(self, points_px: Any) -> np.ndarray:
        """Move picture points (N, 2) to where the same camera without lens distortion would see them, in pixels."""
        points = as_points("points_px", points_px, 2)
        if not any(self.distortion) or len(points) == 0:
            return points.copy()
        coefficients = np.array(self.distortion)
        undistorted = cv2.undistortPoints(
            points[:, None], self.matrix, coefficients, P=self.matrix, criteria=_UNDISTORT_STOP
        )
        return undistorted[:, 0]

    def distort(self, points_px: Any) -> np.ndarray:
        """Move points (N, 2) of the undistorted picture to where the lens puts them, in pixels."""
        points = as_points("points_px", points_px, 2)
        if not any(self.distortion):
            return points.copy()
        return self._through_lens(self.pinhole_rays(points))

    def rays(self, points_px: Any) -> np.ndarray:
        """Unit vectors (N, 3), in the water, that picture points (N, 2) look along; see :meth:`ray_starts`."""
        directions = self.pinhole_rays(self.undistort(points_px))
        if self.port is not None:
            return self.port.into_water(directions)[1]
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def ray_starts(self, points_px: Any) -> np.ndarray:
        """Points (N, 3) in metres that the rays of picture points (N, 2) start from: 0 unless there is a port."""
        points = as_points("points_px", points_px, 2)
        if self.port is None:
            return np.zeros((len(points), 3))
        return self.port.into_water(self.pinhole_rays(self.undistort(points)))[0]

    def project(self, points_m: Any) -> np.ndarray:
        """Picture points (N, 2) in pixels of points (N, 3) in the camera frame, in metres.

        Points at or behind the camera (z <= 0), or inside its port, have no image and give NaN.
        """
        points = as_points("points_m", points_m, 3)
        return self._through_lens(points if self.port is None else self.port.into_air(points))

    def _through_lens(self, directions: np.ndarray) -> np.ndarray:
        """Picture points (N, 2) of directions (N, 3) in front of the lens; NaN for those behind it."""
        points = directions
        in_front = points[:, 2] > 0
        image = np.full((len(points), 2), np.nan)
        if in_front.any():
            coefficients = np.array(self.distortion, dtype=float)
            zero = np.zeros(3)
            projected, _ = cv2.projectPoints(points[in_front][:, None], zero, zero, self.matrix, coefficients)
            image[in_front] = projected[:, 0]
        return image

    def for_size(self, width: int, height: int) -> Camera:
        """Return the intrinsics for a picture of ``width`` x ``height`` pixels.

        A pure rescale of the calibration's picture scales them; anything else (a crop, another aspect ratio)
        raises a ValueError, since no one can tell which part of the field of view it shows.
        """
        if (width, height) == (self.width, self.height):
            return self
        scale_x, scale_y = width / self.width, height / self.height
        rounding = max(1 / self.width, 1 / self.height, 1 / width, 1 / height)
        if abs(scale_x / scale_y - 1) > rounding:
            raise ValueError(
                f"the image is {width} x {height} pixels, but the camera was calibrated at "
                f"{self.width} x {self.height}, which is not the same picture rescaled"
            )
        return Camera(
            fx=self.fx * scale_x,
            fy=self.fy * scale_y,
            cx=(self.cx + 0.5) * scale_x - 0.5,
            cy=(self.cy + 0.5) * scale_y - 0.5,
            width=width,
            height=height,
            distortion=self.distortion,
            port=self.port,
        )

    def pinhole_rays(self, undistorted_px: np.ndarray) -> np.ndarray:
        """Directions (N, 3) with z = 1 that points (N, 2) of the undistorted picture look along."""
        x = (undistorted_px[:, 0] - self.cx) / self.fx
        y = (undistorted_px[:, 1] - self.cy) / self.fy
        return np.column_stack([x, y, np.ones_like(x)])
