"""The camera: intrinsics and lens distortion, pixels to rays and back."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
from dockpose.camera.lens import bend, straighten, tangents_of
from dockpose.camera.port import FlatPort
from dockpose.checks import as_points, check_number, check_whole

DISTORTION_LENGTHS = (0, 4, 5, 8)
FISHEYE_LENGTHS = (0, 4)
_SLOPE_STEP_PX = 0.01


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
        in OpenCV's order; for a fisheye lens none or 4.
    port : the flat window in front of a camera whose intrinsics were measured in air; None for a camera that was
        calibrated in the water, or that looks through a dome: where the camera's centre is the dome's, every ray meets
        the glass at right angles and is not bent, so that the intrinsics measured in air hold in the water.
    fisheye : whether the lens is OpenCV's fisheye model (equidistant) rather than a perspective one.

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
    fisheye: bool = False

    def __post_init__(self) -> None:
        check_number("fx", self.fx, above=0)
        check_number("fy", self.fy, above=0)
        check_number("cx", self.cx)
        check_number("cy", self.cy)
        check_whole("width", self.width, least=1)
        check_whole("height", self.height, least=1)
        lengths = FISHEYE_LENGTHS if self.fisheye else DISTORTION_LENGTHS
        if len(self.distortion) not in lengths:
            raise ValueError(
                f"distortion has {len(self.distortion)} coefficients; it must have "
                f"{', '.join(map(str, lengths[:-1]))} or {lengths[-1]}"
            )
        for i, coefficient in enumerate(self.distortion):
            check_number(f"distortion[{i}]", coefficient)

    @property
    def matrix(self) -> np.ndarray:
        """The 3 x 3 intrinsic matrix K."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def field_of_view_rad(self) -> tuple[float, float]:
        """Horizontal and vertical field of view in radians, in air, edge to edge through the principal point."""
        left, right, top, bottom = -0.5, self.width - 0.5, -0.5, self.height - 0.5
        edges = np.array([[left, self.cy], [right, self.cy], [self.cx, top], [self.cx, bottom]])
        directions = self._directions(edges)
        angles = np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2])
        return float(angles[0] + angles[1]), float(angles[2] + angles[3])

    def undistort(self, points_px: Any) -> np.ndarray:
        """Move picture points (N, 2) to where the same camera with a perfect pinhole lens would see them, in pixels.

        What a fisheye lens sees more than 89.9 degrees off the axis is put there; a port plays no part, see
        :meth:`virtual_pixels`.
        """
        points = as_points("points_px", points_px, 2)
        if self._is_pinhole or len(points) == 0:
            return points.copy()
        return self._pixels(tangents_of(self._directions(points)))

    def distort(self, points_px: Any) -> np.ndarray:
        """Move points (N, 2) of the undistorted picture to where the lens puts them, in pixels."""
        points = as_points("points_px", points_px, 2)
        if self._is_pinhole:
            return points.copy()
        return self._through_lens(self.pinhole_rays(points))

    def rays(self, points_px: Any) -> np.ndarray:
        """Unit vectors (N, 3), in the water, that picture points (N, 2) look along; see :meth:`ray_starts`."""
        directions = self._directions(as_points("points_px", points_px, 2))
        if self.port is not None:
            return self.port.into_water(directions)[1]
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def ray_starts(self, points_px: Any) -> np.ndarray:
        """Points (N, 3) in metres that the rays of picture points (N, 2) start from: 0 unless there is a port."""
        points = as_points("points_px", points_px, 2)
        if self.port is None:
            return np.zeros((len(points), 3))
        return self.port.into_water(self._directions(points))[0]

    def project(self, points_m: Any) -> np.ndarray:
        """Picture points (N, 2) in pixels of points (N, 3) in the camera frame, in metres.

        Points that the lens does not see (for all but a fisheye: z <= 0), or inside the port, have no image and give
        NaN.
        """
        points = as_points("points_m", points_m, 3)
        return self._through_lens(points if self.port is None else self.port.into_air(points))

    def virtual_pixels(self, points_px: Any, depths_m: Any) -> np.ndarray:
        """Where a pinhole at the camera's centre, without lens or port, would see what picture points (N, 2) show.

        Parameters
        ----------
        points_px : (N, 2) in the picture.
        depths_m : z of what they show, one for all or (N,), in metres. Behind a port rays do not meet in one point, so
            that the answer depends on it, beyond a metre hardly; without a port it plays no part.

        Returns
        -------
        (N, 2) in pixels of this camera's pinhole.
        """
        points = as_points("points_px", points_px, 2)
        if self.port is None:
            return self.undistort(points)
        starts, rays = self.port.into_water(self._directions(points))
        nearer = 1 - starts[:, 2] / depths_m
        return self._pixels(rays[:, :2] / rays[:, 2:] * nearer[:, None])

    def picture_slopes(self, points_px: Any, depths_m: Any) -> np.ndarray:
        """How far picture points move for a step of their virtual pixels: derivatives (N, 2, 2), pixel per pixel.

        They carry the noise of a light's centre, which arises in the picture, over to the pinhole that poses are
        computed in. By central differences of :meth:`virtual_pixels`.
        """
        points = as_points("points_px", points_px, 2)
        if self.port is None and self._is_pinhole:
            return np.tile(np.eye(2), (len(points), 1, 1))
        columns = []
        for step in _SLOPE_STEP_PX * np.eye(2):
            ahead, behind = self.virtual_pixels(points + step, depths_m), self.virtual_pixels(points - step, depths_m)
            columns.append((ahead - behind) / (2 * _SLOPE_STEP_PX))
        return np.linalg.pinv(np.stack(columns, axis=2))

    @property
    def _is_pinhole(self) -> bool:
        return not self.fisheye and not any(self.distortion)

    def _directions(self, points_px: np.ndarray) -> np.ndarray:
        """Directions (N, 3), in the air before the lens, that picture points (N, 2) look along."""
        image = (points_px - [self.cx, self.cy]) / [self.fx, self.fy]
        return straighten(image, self.distortion, self.fisheye)

    def _through_lens(self, directions: np.ndarray) -> np.ndarray:
        """Picture points (N, 2) of directions (N, 3) in front of the lens; NaN for those that it does not see."""
        return self._pixels(bend(directions, self.distortion, self.fisheye))

    def _pixels(self, image: np.ndarray) -> np.ndarray:
        return image * [self.fx, self.fy] + [self.cx, self.cy]

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
        return msgspec.structs.replace(
            self,
            fx=self.fx * scale_x,
            fy=self.fy * scale_y,
            cx=(self.cx + 0.5) * scale_x - 0.5,
            cy=(self.cy + 0.5) * scale_y - 0.5,
            width=width,
            height=height,
        )

    def pinhole_rays(self, undistorted_px: np.ndarray) -> np.ndarray:
        """Directions (N, 3) with z = 1 that points (N, 2) of the undistorted picture look along."""
        x = (undistorted_px[:, 0] - self.cx) / self.fx
        y = (undistorted_px[:, 1] - self.cy) / self.fy
        return np.column_stack([x, y, np.ones_like(x)])
