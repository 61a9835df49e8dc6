"""A recording for the viewer Rerun: pictures, lights, both poses in 3D, their chances, how each frame was judged."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

import cv2
import numpy as np
from dockpose.app.drawing import overlay
from dockpose.app.drawing.canvas import to_bgr8
from dockpose.app.drawing.colours import ELLIPSE_COLOUR, LIGHT_COLOUR, POSE_COLOURS, bgr
from dockpose.app.errors import UserError, writing
from dockpose.app.export.recordings.messages import Seen

ENDING = ".rrd"
_POSES = ("pose_a", "pose_b")
_LEVELS = {"green": "INFO", "amber": "WARN", "red": "ERROR"}
_RING_POINTS = 49
_JPEG_QUALITY = 90


class RerunFile:
    """A recording, written frame by frame; as a context manager it finishes itself.

    Its timelines are "frame", "time" where frames have times, and "time_of_day" where the source knows it. Positions
    are in metres, in the camera's frame.

    Parameters
    ----------
    path : Path
        NAME.rrd.
    source : str
        Name of the source.
    tell : callable
        Not called; as for other files of results.

    Raises
    ------
    UserError
        If it cannot be written, or Rerun is not installed.
    """

    def __init__(self, path: Path, source: str, tell: Callable[[str], None]) -> None:
        try:
            import rerun
        except ImportError as error:
            raise UserError(f"--rerun {path}: needs Rerun: pip install 'dockpose[rerun]'") from error
        with writing(path), path.open("wb"):
            pass  # Rerun itself only logs that it cannot
        self._rerun = rerun
        self._stream = rerun.RecordingStream("dockpose")
        self._stream.save(path)
        self._stream.log("camera", rerun.ViewCoordinates.RDF, static=True)
        self._camera: object = None

    def __enter__(self) -> RerunFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def write(self, seen: Seen, time_s: float | None, time_unix_s: float | None) -> None:
        """Add a frame; its times are in seconds since the source began, and since 1970."""
        rerun, log, found = self._rerun, self._stream.log, seen.found
        self._stream.set_time("frame", sequence=seen.frame)
        if time_s is not None:
            self._stream.set_time("time", duration=time_s)
        if time_unix_s is not None:
            self._stream.set_time("time_of_day", timestamp=time_unix_s)
        if found.camera != self._camera:
            self._camera, camera = found.camera, found.camera
            size = (camera.width, camera.height)
            log("camera/image", rerun.Pinhole(image_from_camera=camera.matrix, resolution=size))
        if seen.original is not None:
            quality = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
            data = cv2.imencode(".jpg", to_bgr8(seen.original), quality)[1].tobytes()
            log("camera/image", rerun.EncodedImage(contents=data, media_type="image/jpeg"))
        lights = np.zeros((0, 2)) if found.markers is None else found.markers.points_px[overlay.on_ring(found)]
        outline = overlay.outline(found)
        # Rerun counts pixels from the corner of the first one, we from its middle.
        log("camera/image/lights", rerun.Points2D(lights + 0.5, radii=4.0, colors=[_rgb(LIGHT_COLOUR)]))
        strips = [] if outline is None else [np.vstack([outline, outline[:1]]) + 0.5]
        log("camera/image/ellipse", rerun.LineStrips2D(strips, colors=[_rgb(ELLIPSE_COLOUR)]))
        self._log_poses(seen)
        log("status", rerun.TextLog(f"{found.message} {seen.trust.sentence}", level=_LEVELS[seen.trust.colour]))

    def close(self) -> None:
        """Finish the file."""
        self._stream.disconnect()

    def _log_poses(self, seen: Seen) -> None:
        rerun, log, found = self._rerun, self._stream.log, seen.found
        poses = found.candidates if found.status == "ok" else ()
        for name, colour, pose in zip(_POSES, POSE_COLOURS, (*poses, None, None), strict=False):
            if pose is None:
                log(f"camera/{name}", rerun.Clear(recursive=True))
                continue
            x, y, z, w = pose.quaternion_xyzw
            log(f"camera/{name}", rerun.Transform3D(translation=pose.position_m, quaternion=[x, y, z, w]))
            ring, axis = _ring(found.dock.radius)
            width = 3.0 if pose is found.selected else 1.0
            strips = rerun.LineStrips3D([ring, axis], colors=[_rgb(colour)], radii=rerun.Radius.ui_points(width))
            log(f"camera/{name}/ring", strips)
            if pose.probability is not None:
                log(f"chance/{name}", rerun.Scalars(pose.probability))
        if seen.track is not None and seen.track.probability is not None:
            log("chance/track", rerun.Scalars(seen.track.probability))


def _ring(radius_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The dock's ring (N, 3), and from its middle the normal (2, 3), in the dock's own frame, in metres."""
    angles = np.linspace(0, 2 * math.pi, _RING_POINTS)
    ring = radius_m * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    return ring, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -radius_m]])


def _rgb(colour: str) -> tuple[int, int, int]:
    blue, green, red = bgr(colour)
    return red, green, blue
