"""What was found in one picture, and how it is reported: as a JSON object, a table, a sentence and a picture."""

import math
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from dockpose.estimate import drawing
from dockpose.estimate.reached import Stages
from dockpose.guidance import guided
from dockpose.lights.ellipse import NoEllipseError
from dockpose.palette import POSE_NAMES
from dockpose.pose.circle import CirclePose
from dockpose.pose.solve import find_poses
from dockpose.text import InputError
from dockpose.vehicle import Vehicle

SCHEMA = 1


@dataclass(frozen=True)
class Estimate(Stages):
    """Everything that was found in one picture, and how far the search came.

    Attributes
    ----------
    status : str
        "ok", "no_lights", "too_few_markers", "not_a_ring" or "no_ellipse"; "method_failed" where a threshold method
        that somebody registered raised an error.
    message : str
        One plain sentence.
    width, height, bits : int
        Of the picture.
    camera, dock, settings : Camera, Dock, Settings
        What it was searched with; the camera is already scaled to the picture.
    threshold, markers, ring, ellipse, choice : Threshold, Markers, Ring, Ellipse, Choice or None
        The stages; None where a stage was not reached.
        The ellipse is in pixels of the undistorted picture.
    detection : float or None
        Probability that the ring is a dock at all; those of the candidates are given that it is. None of lights that
        were set by hand.
    elapsed_ms : float
        How long it took.
    found_by : {"search", "following", "hand"}
        Whether the picture was searched, or measured where the lights must be by the frame before, or somebody set
        them.
    min_channel : bool
        Whether the lights show in the darkest of the colour channels rather than in grey.
    by_hand : ByHand or None
        The lights that somebody has set in this picture.
    picture : callable or None
        Gives the picture again, where it is still there, for the drawing in a notebook. It does not keep the picture
        alive, and is left behind where the estimate is pickled.
    """

    def __repr__(self) -> str:
        pose = self.selected
        level = "" if self.threshold is None else f" level {self.threshold.level}"
        where = "" if pose is None else f", {self.lights_on_ring} lights, {_place(pose)}"
        return f"<Estimate {self.status}: {self.width} x {self.height}, {self._method}{level}{where}>"

    def __str__(self) -> str:
        lines = [self.message]
        for name, pose in zip(POSE_NAMES, self.candidates, strict=False):
            chosen = ", chosen" if pose is self.selected else ""
            chance = "" if pose.probability is None else f" ({100 * pose.probability:.0f} %{chosen})"
            lines.append(f"{name}{chance or (chosen and ' (chosen)')}: {_place(pose)}")
        return "\n".join(lines)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"picture": None}

    def _repr_png_(self) -> bytes:
        return drawing.png(self)

    def draw(self) -> np.ndarray:
        """Draw lights, ellipse and poses, (H, W, 3) BGR of at most 1200 px a side; on black if the picture is gone."""
        return drawing.draw(self)

    def to_frame(self) -> Any:
        """The candidates as a pandas DataFrame, a row each, units in the columns' names; ValueError without pandas."""
        try:
            import pandas  # pyright: ignore[reportMissingImports]  # needed for tables alone
        except ImportError as error:
            raise InputError("to_frame() needs pandas: pip install pandas") from error
        names = POSE_NAMES[: len(self.candidates)] or ("",)
        poses = self.candidates or (None,)
        return pandas.DataFrame([self._row(name, pose) for name, pose in zip(names, poses, strict=True)])

    def to_dict(
        self,
        source: str | None = None,
        frame: int | None = None,
        time_s: float | None = None,
        sha256: str | None = None,
        time_unix_s: float | None = None,
        vehicle: Vehicle | None = None,
    ) -> dict[str, Any]:
        """The estimate as one JSON object of schema 1; unknown values are None, never left out."""
        return {
            "schema": SCHEMA,
            "source": source,
            "frame": frame,
            "time_s": time_s,
            "time_unix_s": time_unix_s,
            "sha256": sha256,
            "status": self.status,
            "message": self.message,
            "image": {"width": self.width, "height": self.height, "bits": self.bits},
            "camera": msgspec.json.decode(msgspec.json.encode(self.camera)),
            "dock": msgspec.json.decode(msgspec.json.encode(self.dock)),
            "settings": msgspec.to_builtins(self.settings) | {"masks": [list(mask) for mask in self.settings.masks]},
            "threshold": self._threshold_dict(),
            "markers": self._marker_dicts(),
            "ellipse": None if self.ellipse is None else self.ellipse.to_dict(),
            "candidates": [pose.to_dict() for pose in self.candidates],
            "selected": None if self.choice is None else self.choice.selected,
            "selected_by": None if self.choice is None else self.choice.selected_by,
            "chosen": None if self.selected is None else self.selected.summary(),
            **guided(self.selected, self.dock, self.camera, vehicle),
            "extra_lights": self._extra_dicts(),
            "detection": self.detection,
            "found_by": self.found_by,
            "by_hand": msgspec.json.decode(msgspec.json.encode(self.by_hand)),
            "rivals": [] if self.ring is None else [self._rival_dict(rival) for rival in self.ring.rivals],
            "elapsed_ms": round(self.elapsed_ms, 3),
        }

    @property
    def _method(self) -> str:
        """The method that the threshold is of: hats may have given each light a level of its own."""
        return self.settings.method if self.threshold is None else self.threshold.method

    def _row(self, name: str, pose: CirclePose | None) -> dict[str, Any]:
        line = {} if pose is None else pose.to_dict()
        place = line.get("position_m") or [None] * 3
        values = {f"{axis}_m": value for axis, value in zip("xyz", place, strict=True)}
        values |= {key: line.get(key) for key in ("theta_x_deg", "theta_y_deg", "roll_deg", "probability", "rms_px")}
        for kind in ("sigma", "sigma_total"):
            sigma, sigma_theta = (
                line.get(f"{kind}_position_m") or [None] * 3,
                line.get(f"{kind}_theta_deg") or [None] * 2,
            )
            values |= {f"{kind}_{axis}_m": value for axis, value in zip("xyz", sigma, strict=True)}
            values |= {f"{kind}_theta_{axis}_deg": value for axis, value in zip("xy", sigma_theta, strict=True)}
        return {
            "status": self.status,
            "pose": name,
            "selected": pose is not None and pose is self.selected,
            **{key: math.nan if value is None else value for key, value in values.items()},
            "detection": math.nan if self.detection is None else self.detection,
            "method": self._method,
            "level": math.nan if self.threshold is None else float(self.threshold.level),
            "lights_on_ring": 0 if self.lights_on_ring is None else self.lights_on_ring,
            "elapsed_ms": self.elapsed_ms,
            "message": self.message,
        }

    def _threshold_dict(self) -> dict[str, Any] | None:
        if self.threshold is None:
            return None
        return {
            "method": self.threshold.method,
            "level": self.threshold.level,
            "native_level": self.threshold.native_level,
            "groups": None if self.markers is None else len(self.markers),
        }

    def _rival_dict(self, on_ring: np.ndarray) -> dict[str, Any]:
        """Another ring in view: how many lights it has, their middle, and how far it is."""
        assert self.markers is not None
        points_px = self.markers.points_px[on_ring]
        seen = {"lights": len(points_px), "centre_px": points_px.mean(axis=0).tolist()}
        try:
            pose = find_poses(points_px, self.camera, self.dock)[1].candidates[0]
        except NoEllipseError:
            return {**seen, "range_m": None, "sigma_range_m": None}
        assert pose.sigma_position_m is not None  # what is shared moves all rings alike
        return {
            **seen,
            "range_m": float(np.linalg.norm(pose.position_m)),
            "sigma_range_m": float(np.linalg.norm(pose.sigma_position_m)),
        }

    def _extra_dicts(self) -> list[dict[str, Any] | None]:
        """Where the dock's extra lights are seen; None of those that are not."""
        places = [] if self.choice is None or self.choice.extra_px is None else self.choice.extra_px.tolist()
        return [{"x_px": x, "y_px": y} if math.isfinite(x) else None for x, y in places]

    def _marker_dicts(self) -> list[dict[str, Any]]:
        if self.markers is None:
            return []
        on_ring = [None] * len(self.markers) if self.ring is None else self.ring.on_ring.tolist()
        points_px, areas_px = self.markers.points_px.tolist(), self.markers.areas_px.tolist()
        return [
            {"x_px": x, "y_px": y, "area_px": area, "on_ring": on, "light": light}
            for (x, y), area, on, light in zip(points_px, areas_px, on_ring, self.light_numbers(), strict=True)
        ]


def _place(pose: CirclePose) -> str:
    """Position and attitude, with their standard errors where these are known."""
    x, y, z = (100 * float(value) for value in pose.position_m)
    theta_x, theta_y = math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad)
    sigma_z = "" if pose.sigma_total_position_m is None else f" ± {100 * pose.sigma_total_position_m[2]:.1g}"
    return f"x {x:.1f} y {y:.1f} z {z:.1f}{sigma_z} cm, theta x {theta_x:.1f} y {theta_y:.1f} deg"
