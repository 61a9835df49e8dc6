"""A recording for the viewer Rerun: pictures, lights, both poses in 3D, their chances, how each frame was judged."""

import math
import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
from dockpose.app.drawing.colours import ELLIPSE_COLOUR, LIGHT_COLOUR, POSE_COLOURS, rgb
from dockpose.app.errors import UserError, unwritable, writing
from dockpose.app.export.recordings.ros import Seen, jpeg
from dockpose.estimate import geometry
from dockpose.estimate.canvas import to_bgr8
from dockpose.files import GrowingFile

ENDING = ".rrd"
_POSES = ("pose_a", "pose_b")
_LEVELS = {"green": "INFO", "amber": "WARN", "red": "ERROR"}
_RING_RAD = np.linspace(0, 2 * math.pi, 49)


class RerunFile:
    """A recording, written frame by frame; positions are in metres, in the camera's frame."""

    def __init__(self, path: Path, source: str, tell: Callable[[str], None]) -> None:
        try:
            import rerun  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise UserError(f"--rerun {path}: needs Rerun: pip install 'dockpose[rerun]'") from error
        with writing(path):
            self._relay = _Relay(path)
        self._rerun = rerun
        self._stream = rerun.RecordingStream("dockpose")
        self._relay.begin(self._stream.save)
        self._is_open = True
        self._stream.log("camera", rerun.ViewCoordinates.RDF, static=True)
        self._camera: object = None

    def write(self, seen: Seen, time_s: float | None, time_unix_s: float | None) -> None:
        """Add a frame; its times are in seconds since the source began, and since 1970."""
        self._relay.check()
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
            log("camera/image", rerun.EncodedImage(contents=jpeg(to_bgr8(seen.original)), media_type="image/jpeg"))
        lights = np.zeros((0, 2)) if found.markers is None else found.markers.points_px[geometry.on_ring(found)]
        outline = geometry.outline(found)
        # Rerun counts pixels from the corner of the first one, we from its middle.
        log("camera/image/lights", rerun.Points2D(lights + 0.5, radii=4.0, colors=[rgb(LIGHT_COLOUR)]))
        strips = [] if outline is None else [np.vstack([outline, outline[:1]]) + 0.5]
        log("camera/image/ellipse", rerun.LineStrips2D(strips, colors=[rgb(ELLIPSE_COLOUR)]))
        self._log_poses(seen)
        log("status", rerun.TextLog(f"{found.message} {seen.trust.sentence}", level=_LEVELS[seen.trust.colour]))

    def close(self) -> None:
        """Finish the file. Raises UserError where it could not be written; what came before stays."""
        if self._is_open:
            self._is_open = False
            self._stream.disconnect()
            self._relay.end()

    def _log_poses(self, seen: Seen) -> None:
        rerun, log, found = self._rerun, self._stream.log, seen.found
        poses = found.candidates if found.status == "ok" else ()
        for name, colour, pose in zip(_POSES, POSE_COLOURS, (*poses, None, None), strict=False):
            if pose is None:
                log(f"camera/{name}", rerun.Clear(recursive=True))
                continue
            x, y, z, w = pose.quaternion_xyzw
            log(f"camera/{name}", rerun.Transform3D(translation=pose.position_m, quaternion=[x, y, z, w]))
            # In the dock's own frame, in metres: the ring (N, 3), and from its middle the normal (2, 3).
            ring = found.dock.radius * np.column_stack([np.cos(_RING_RAD), np.sin(_RING_RAD), 0 * _RING_RAD])
            axis = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -found.dock.radius]])
            width = 3.0 if pose is found.selected else 1.0
            strips = rerun.LineStrips3D([ring, axis], colors=[rgb(colour)], radii=rerun.Radius.ui_points(width))
            log(f"camera/{name}/ring", strips)
            if pose.probability is not None:
                log(f"chance/{name}", rerun.Scalars(pose.probability))
        if seen.track is not None and seen.track.probability is not None:
            log("chance/track", rerun.Scalars(seen.track.probability))


class _Relay:
    """Writes a file in Rerun's place, by a pipe where there is one: Rerun only logs a fault, and may wait."""

    def __init__(self, path: Path) -> None:
        self._path, self._file = path, GrowingFile(path)
        self._thread = threading.Thread(target=self._pass_on, name="dockpose rerun", daemon=True)
        self._error: OSError | None = None

    def begin(self, save: Callable[[str], object]) -> None:
        """Have ``save`` write to the file of a path."""
        if not os.path.isdir("/dev/fd"):
            self._file.close()
            save(str(self._path))
            return
        self._reads, writes = os.pipe()
        save(f"/dev/fd/{writes}")
        os.close(writes)
        self._thread.start()

    def check(self) -> None:
        """Raise UserError if something could not be written."""
        if self._error is not None:
            error, self._error = self._error, None
            raise unwritable(self._path, error, kept=self._file.cut()) from error

    def end(self) -> None:
        """Wait until all is written. Raises UserError if something could not be."""
        if self._thread.is_alive():
            self._thread.join()
        self.check()
        self._file.close()

    def _pass_on(self) -> None:
        has_failed = False
        with open(self._reads, "rb", buffering=0) as pipe:
            while data := pipe.read(2**16):
                if has_failed:
                    continue  # Rerun must not wait
                try:
                    self._file.write(data)
                    self._file.mark()
                except OSError as error:
                    self._error, has_failed = error, True
