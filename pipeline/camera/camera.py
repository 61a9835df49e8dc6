"""The camera: intrinsics and lens distortion, pixels to rays and back."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from dockpose.camera.lens import bend, straighten, tangents_of
from dockpose.camera.port import FlatPort
from dockpose.camera.standard_errors import CameraSigma, check_sigma, transformed
from dockpose.camera.tone import TONES, check_tone
from dockpose.checks import as_points, check_is, check_number, check_turn, check_whole, make_plain
from numpy.typing import ArrayLike

DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)
FISHEYE_LENGTHS = (0, 4)
_SLOPE_STEP_PX = 0.01
# Coefficients that a quarter turn clockwise exchanges: the first becomes the second, and that the first, negated.
_EXCHANGED = ((3, 2), (8, 10), (9, 11), (12, 13))


class Camera(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    rename={name: f"{name}_px" for name in ("fx", "fy", "cx", "cy", "width", "height")},
):
    """Intrinsics of one camera, in pixels, with pixel centres at integers.

    Parameters
    ----------
    fx, fy : float, pixels
        Focal lengths, above 0.
    cx, cy : float, pixels
        Principal point.
    width, height : int, pixels
        Size of the pictures that these intrinsics are for.
    distortion : tuple of float
        None, 4 or 5 coefficients (plumb_bob: k1 k2 p1 p2 k3), 8 (rational: ... k4 k5 k6), 12 (thin prism: ... s1 s2 s3
        s4) or 14 (tilted sensor: ... tau_x tau_y), in OpenCV's order; none or 4 for a fisheye lens.
    port : FlatPort, optional
        The flat window in front of a camera that was calibrated in air. None for a camera calibrated in the water, or
        behind a dome whose centre is the camera's centre: there every ray meets the glass at right angles and is not
        bent, so intrinsics measured in air hold in the water.
    fisheye : bool
        Whether the lens follows OpenCV's fisheye model (equidistant) rather than a perspective one.
    sigma : CameraSigma or mapping, optional
        Standard errors of these numbers, as in ``{"fx_px": 1.5, "fy_px": 1.5}``; where they are unknown, 0.3 % of the
        focal lengths and 2 pixels of the principal point are taken.
    covariance : (P, P) sequence
        Covariance of the P numbers that ``sigma`` has, in its order; empty where their errors are independent.
    tone : str or float
        How grey levels grow with light: "linear", "srgb", or the gamma by whose inverse light is raised, as 2.2 of many
        webcams. Centres of lights are weighed by light.

    Raises
    ------
    ValueError
        If a value is not finite, a focal length or a size is not positive, or the number of distortion coefficients is
        none of these, ``sigma`` or ``covariance`` is not of these numbers, or ``tone`` is no such curve.

    Examples
    --------
    >>> camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
    >>> camera.project([[0.0, 0.0, 2.0], [0.1, 0.0, 2.0]])
    array([[319.5, 239.5],
           [354.5, 239.5]])
    >>> camera.for_size(320, 240).fx
    350.0
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
    sigma: CameraSigma | None = None
    covariance: tuple[tuple[float, ...], ...] = ()
    tone: str | float = "linear"

    if TYPE_CHECKING:  # what is taken is more than what is kept

        def __init__(
            self,
            fx: float,
            fy: float,
            cx: float,
            cy: float,
            width: int,
            height: int,
            distortion: Sequence[float] | np.ndarray = (),
            port: FlatPort | None = None,
            fisheye: bool = False,
            sigma: CameraSigma | Mapping[str, Any] | None = None,
            covariance: Sequence[Sequence[float]] | np.ndarray = (),
            tone: str | float = "linear",
        ) -> None: ...

    def __post_init__(self) -> None:
        make_plain(self)
        if self.port is not None:
            check_is("port", self.port, FlatPort)
        for name, above in (("fx", 0), ("fy", 0), ("cx", -math.inf), ("cy", -math.inf)):
            check_number(name, getattr(self, name), above=above)
        check_whole("width", self.width, least=1)
        check_whole("height", self.height, least=1)
        lengths = FISHEYE_LENGTHS if self.fisheye else DISTORTION_LENGTHS
        if len(self.distortion) not in lengths:
            must = f"{', '.join(map(str, lengths[:-1]))} or {lengths[-1]}"
            raise ValueError(f"distortion has {len(self.distortion)} coefficients; it must have {must}")
        for i, coefficient in enumerate(self.distortion):
            check_number(f"distortion[{i}]", coefficient)
        if isinstance(self.sigma, Mapping):
            msgspec.structs.force_setattr(self, "sigma", msgspec.convert(self.sigma, CameraSigma, strict=False))
        if self.sigma is not None or self.covariance:
            has_port = self.port is not None
            check_sigma(self.sigma or CameraSigma(), self.covariance, len(self.distortion), has_port=has_port)
        if self.tone != TONES[0]:
            check_tone(self.tone)

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

    def undistort(self, points_px: ArrayLike) -> np.ndarray:
        """Where an ideal pinhole would see picture points (N, 2), at most 89.9 degrees off; a port is ignored."""
        points = as_points("points_px", points_px, 2)
        if self._is_pinhole or len(points) == 0:
            return points.copy()
        return self._pixels(tangents_of(self._directions(points)))

    def distort(self, points_px: ArrayLike) -> np.ndarray:
        """Move points (N, 2) of the undistorted picture to where the lens puts them, in pixels."""
        points = as_points("points_px", points_px, 2)
        if self._is_pinhole:
            return points.copy()
        return self._pixels(bend(self.pinhole_rays(points), self.distortion, self.fisheye))

    def rays(self, points_px: ArrayLike) -> np.ndarray:
        """Unit vectors (N, 3), in the water, along which picture points (N, 2) look; see :meth:`ray_starts`."""
        directions = self._directions(as_points("points_px", points_px, 2))
        if self.port is not None:
            return self.port.into_water(directions)[1]
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def ray_starts(self, points_px: ArrayLike) -> np.ndarray:
        """Points (N, 3) in metres where the rays of picture points (N, 2) start: the origin unless there is a port."""
        points = as_points("points_px", points_px, 2)
        if self.port is None:
            return np.zeros((len(points), 3))
        return self.port.into_water(self._directions(points))[0]

    def project(self, points_m: ArrayLike) -> np.ndarray:
        """Images (N, 2) in pixels of points (N, 3) in metres in the camera frame; NaN where the lens sees none."""
        points = as_points("points_m", points_m, 3)
        in_air = points if self.port is None else self.port.into_air(points)
        return self._pixels(bend(in_air, self.distortion, self.fisheye))

    def virtual_pixels(self, points_px: ArrayLike, depths_m: float | np.ndarray) -> np.ndarray:
        """Where a pinhole, without lens or port, would see picture points (N, 2) of lights at z in metres."""
        points = as_points("points_px", points_px, 2)
        if self.port is None:
            return self.undistort(points)
        starts, rays = self.port.into_water(self._directions(points))
        nearer = 1 - starts[:, 2] / depths_m
        return self._pixels(rays[:, :2] / rays[:, 2:] * nearer[:, None])

    def picture_slopes(self, points_px: ArrayLike, depths_m: float | np.ndarray) -> np.ndarray:
        """Derivatives (N, 2, 2) of picture points by virtual pixels, which carry the centroids' noise over."""
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
        """Directions (N, 3), in the air in front of the lens, along which picture points (N, 2) look."""
        image = (points_px - [self.cx, self.cy]) / [self.fx, self.fy]
        return straighten(image, self.distortion, self.fisheye)

    def _pixels(self, image: np.ndarray) -> np.ndarray:
        return image * [self.fx, self.fy] + [self.cx, self.cy]

    def for_size(self, width: int, height: int) -> "Camera":
        """Intrinsics scaled to another size in pixels; ValueError where that is no pure rescale, as of a crop."""
        if (width, height) == (self.width, self.height):
            return self
        scale_x, scale_y = width / self.width, height / self.height
        rounding = max(1 / self.width, 1 / self.height, 1 / width, 1 / height)
        if abs(scale_x / scale_y - 1) > rounding:
            calibrated = f"the camera was calibrated at {self.width} x {self.height}"
            what = f"the image is {width} x {height} pixels, but {calibrated}"
            raise ValueError(f"{what}, which is not the same picture rescaled")
        scales = {"fx": ("fx", scale_x), "cx": ("cx", scale_x), "fy": ("fy", scale_y), "cy": ("cy", scale_y)}
        numbers: dict[str, Any] = {"fx": self.fx * scale_x, "fy": self.fy * scale_y, "width": width, "height": height}
        numbers |= {"cx": (self.cx + 0.5) * scale_x - 0.5, "cy": (self.cy + 0.5) * scale_y - 0.5}
        numbers |= transformed(self.sigma, self.covariance, len(self.distortion), scales)
        return msgspec.structs.replace(self, **numbers)

    def rotated(self, degrees: int) -> "Camera":
        """The camera of the picture turned clockwise by 0, 90, 180 or 270; by 90, (x, y, z) becomes (-y, x, z)."""
        camera = self
        if degrees in (90, 270) and all(self.distortion[12:]) and self.distortion[12:]:
            raise ValueError(f"degrees is {degrees}; a camera with a sensor tilted about both axes turns by 180 alone")
        for _ in range(check_turn("degrees", degrees) // 90):
            bent = list(camera.distortion)
            turned = {"fx": ("fy", 1.0), "fy": ("fx", 1.0), "cx": ("cy", 1.0), "cy": ("cx", -1.0)}
            for one, other in _EXCHANGED:
                if max(one, other) < len(bent) and not camera.fisheye:
                    bent[other], bent[one] = bent[one], -bent[other]
                    turned[f"distortion[{one}]"] = (f"distortion[{other}]", 1.0)
                    turned[f"distortion[{other}]"] = (f"distortion[{one}]", -1.0)
            numbers: dict[str, Any] = {"fx": camera.fy, "fy": camera.fx, "distortion": tuple(bent)}
            numbers |= {"cx": camera.height - 1 - camera.cy, "cy": camera.cx}
            numbers |= {"width": camera.height, "height": camera.width}
            numbers |= transformed(camera.sigma, camera.covariance, len(camera.distortion), turned)
            camera = msgspec.structs.replace(camera, **numbers)
        return camera

    def pinhole_rays(self, undistorted_px: np.ndarray) -> np.ndarray:
        """Directions (N, 3) with z = 1 along which points (N, 2) of the undistorted picture look."""
        tangents = (undistorted_px - [self.cx, self.cy]) / [self.fx, self.fy]
        return np.column_stack([tangents, np.ones(len(tangents))])
