"""What the node does with messages, without ROS: messages of cameras in, fields of messages about the dock out."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from dockpose import Camera, Dock, Settings
from dockpose.app.drawing.annotated import annotate
from dockpose.app.errors import UserError
from dockpose.app.export.recordings.messages import Message, Seen, header, messages_of
from dockpose.app.processing.analysis import headline_of
from dockpose.app.processing.following import Following
from dockpose.camera.image import ImageError
from dockpose.sources import Frame
from dockpose.sources.bags.messages import camera_in, picture_in

_ERROR = 2  # of diagnostic_msgs/DiagnosticStatus


@dataclass(frozen=True)
class Options:
    """What the node is configured with."""

    dock: Dock  # the dock to look for
    settings: Settings = field(default_factory=Settings)  # how to search for it
    camera: Camera | None = None  # the camera
    image_topic: str = "/camera/image_raw"  # topic of the pictures

    @property
    def is_compressed(self) -> bool:
        """Whether the pictures are compressed, by the name of their topic."""
        return self.image_topic.endswith("/compressed")

    @property
    def info_topic(self) -> str:
        """Topic of the camera_info that belongs to the pictures."""
        return f"{self.image_topic.removesuffix('/compressed').rsplit('/', 1)[0]}/camera_info"


class NodeLogic:
    """Finds and tracks the dock in pictures as they are published."""

    def __init__(self, options: Options, tell: Callable[[str], None]) -> None:
        self._options, self._tell = options, tell
        self._camera = options.camera
        self._told: set[str] = set()
        self._frames = 0
        self.restart()

    def restart(self) -> None:
        """Forget the track, as after a pause."""
        self._following: Following | None = None

    def take_camera_info(self, message: Any) -> None:
        """Take the camera from a ``sensor_msgs/CameraInfo``; one that was configured has precedence."""
        if self._options.camera is not None:
            return
        name = self._options.image_topic.removesuffix("/compressed").rsplit("/", 1)[-1]
        try:
            camera = camera_in(message, "rect" in name)
        except ValueError as error:
            self._tell_once(f"{self._options.info_topic} cannot be used: {error}")
            return
        if camera is None:
            self._tell_once(f"{self._options.info_topic} is of a camera that was not calibrated")
        elif camera != self._camera:
            self._camera = camera
            self.restart()

    def take_image(self, message: Any, now_s: float) -> list[Message]:
        """Search a picture."""
        stamp = message.header.stamp
        time_s = stamp.sec + 1e-9 * stamp.nanosec
        if time_s == 0:
            self._tell_once("pictures have no time stamps; the time at which they arrive is taken")
            time_s = now_s
        frame_id, number = message.header.frame_id or "camera_optical_frame", self._frames
        self._frames += 1
        try:
            return self._searched(message, time_s, frame_id, number)
        except (ImageError, UserError, ValueError) as error:
            self._tell_once(str(error))
            return [("/diagnostics", self._trouble(str(error), time_s, frame_id))]

    def _searched(self, message: Any, time_s: float, frame_id: str, number: int) -> list[Message]:
        options, camera = self._options, self._camera
        if camera is None:
            raise UserError(f"no camera is known yet: {options.info_topic} is silent, and no camera file is given")
        picture = picture_in(message, options.image_topic)
        if self._following is None:
            self._following = Following(camera, options.dock, options.settings, self._tell)
        followed = self._following.see(Frame(picture, number, time_s, options.image_topic))
        found, trust = followed.estimate, followed.trust
        drawn = annotate(picture, found, headline=headline_of(trust))
        seen = Seen(options.image_topic, number, found, trust, followed.tracked.track, drawn)
        return messages_of(seen, time_s, frame_id)

    def _trouble(self, sentence: str, time_s: float, frame_id: str) -> dict[str, Any]:
        status = {"level": _ERROR, "name": "dockpose: dock", "message": sentence}
        status |= {"hardware_id": self._options.image_topic, "values": []}
        return {"header": header(time_s, frame_id), "status": [status]}

    def _tell_once(self, sentence: str) -> None:
        if sentence not in self._told:
            self._told.add(sentence)
            self._tell(sentence)
