"""``dockpose ros``: a lifecycle node of ROS 2 that publishes where the dock is; its logic knows no ROS."""

import argparse
import importlib
from array import array
from collections.abc import Callable
from typing import Any

from dockpose import Camera, Dock, Settings, Vehicle, load_vehicle
from dockpose.app.commands.arguments import camera_of, dock_of
from dockpose.app.commands.console import EXIT_ALL_READ, say
from dockpose.app.errors import UserError
from dockpose.app.export.recordings.ros import TOPICS_OF_NODE, Message, Seen, header, messages_of, status_of
from dockpose.app.processing.following import Following
from dockpose.camera.image import ImageError
from dockpose.sidecar import load_dock
from dockpose.sources import Frame
from dockpose.sources.bags.messages import camera_in, is_rectified, picture_in
from dockpose.thresholds import METHODS

_ERROR = 2  # of diagnostic_msgs/DiagnosticStatus
NAME = "dockpose"
_UNREAD = ("ffmpeg", "foxglove", "theora", "zstd", "compressedDepth")  # last parts of topics, by their transports
KNOWN = {"method": {"choices": METHODS, "default": "hats"}}


class NodeLogic:
    """Finds and tracks the dock in pictures as they are published."""

    def __init__(
        self,
        tell: Callable[[str], None],
        dock: Dock,
        settings: Settings,
        camera: Camera | None,
        image_topic: str,
        vehicle: Vehicle | None = None,
    ) -> None:
        self._tell, self._dock, self._settings, self._vehicle = tell, dock, settings, vehicle
        self._camera, self._is_configured = camera, camera is not None
        self.image_topic, transport = image_topic, image_topic.rpartition("/")[2]
        self.is_compressed = transport == "compressed"
        if transport in _UNREAD:
            raise UserError(f"{image_topic}: {transport} is not read by the node; republish it as raw or compressed")
        plain = image_topic.removesuffix("/compressed")
        self.info_topic, self._info = f"{plain.rpartition('/')[0]}/camera_info", None
        self._told: set[str] = set()
        self._frames = 0
        self.restart()

    def restart(self) -> None:
        """Forget the track, as after a pause."""
        self._following: Following | None = None

    def take_camera_info(self, message: Any) -> None:
        """Keep a ``sensor_msgs/CameraInfo`` for the next picture; a camera that was configured has precedence."""
        self._info = message

    def _camera_of(self, height: int, width: int) -> Camera:
        """The camera of pictures of that size."""
        if self._camera is not None and self._is_configured:
            return self._camera
        if self._info is None:
            raise UserError(f"no camera is known yet: {self.info_topic} is silent, and no camera file is given")
        try:
            camera = camera_in(self._info, (width, height), self._tell_once, is_rectified(self.image_topic))
        except ValueError as error:
            raise UserError(f"{self.info_topic} cannot be used: {error}") from error
        if camera is None:
            raise UserError(f"{self.info_topic} is of a camera that was not calibrated")
        if camera != self._camera:
            self._camera = camera
            self.restart()
        return camera

    def take_image(self, message: Any, now_s: float) -> list[Message]:
        """Search a picture."""
        stamp = message.header.stamp
        time_ns = stamp.sec * 10**9 + stamp.nanosec
        if time_ns == 0:
            self._tell_once("pictures have no time stamps; the time at which they arrive is taken")
            time_ns = round(1e9 * now_s)
        frame_id, number = message.header.frame_id or "camera_optical_frame", self._frames
        self._frames += 1
        try:
            return self._searched(message, time_ns, frame_id, number)
        except (ImageError, UserError, ValueError) as error:
            self._tell_once(str(error))
            trouble = status_of(_ERROR, str(error), self.image_topic)
            return [("/diagnostics", {"header": header(time_ns, frame_id)} | trouble)]

    def _searched(self, message: Any, time_ns: int, frame_id: str, number: int) -> list[Message]:
        picture = picture_in(message, self.image_topic)
        camera = self._camera_of(*picture.shape[:2])
        if self._following is None:
            self._following = Following(camera, self._dock, self._settings, self._tell, is_live=True)
        followed = self._following.see(Frame(picture, number, time_ns / 1e9, self.image_topic))
        found, trust = followed.estimate, followed.trust
        seen = Seen(self.image_topic, number, found, trust, followed.tracked.track, vehicle=self._vehicle)
        return messages_of(seen, time_ns, frame_id)

    def _tell_once(self, sentence: str) -> None:
        if sentence not in self._told:
            self._told.add(sentence)
            self._tell(sentence)


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose ros`` until it is stopped; returns the exit status."""
    try:
        import rclpy  # pyright: ignore[reportMissingImports]  # comes with ROS
    except ImportError as error:
        raise UserError("ros: needs ROS 2 with rclpy, which is not there; source its setup.bash first") from error
    dock = dock_of(arguments)
    defaults = {
        "camera_file": arguments.camera or "",
        "camera_size": arguments.camera_size or "",
        "dock_file": arguments.dock or "",
        "vehicle_file": arguments.vehicle or "",
        "dock_diameter_m": 0.0 if dock is None else dock.diameter,
        "lights": 0 if dock is None or dock.lights is None else dock.lights,
        "method": arguments.method,
        "image_topic": arguments.topic,
        "on_demand": arguments.on_demand,
    }
    if dock is not None:
        logic_of(defaults, say)  # what is wrong is reported here rather than in a log
    elif not arguments.managed and not any("dock_" in word for word in arguments.ros_args):
        raise UserError("ros: how large is the dock? Give --dock-diameter in metres")
    rclpy.init(args=["--ros-args", *arguments.ros_args] if arguments.ros_args else [])
    node = make_node(defaults)
    try:
        if not arguments.managed:
            node.trigger_configure()
            node.trigger_activate()
        say(f"node {node.get_name()} listens on {arguments.topic} (Ctrl+C stops it)")
        rclpy.spin(node)
    except KeyboardInterrupt:
        say("stopped")
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return EXIT_ALL_READ


def make_node(defaults: dict[str, Any]) -> Any:
    """Return the node, not yet configured."""
    lifecycle, qos = importlib.import_module("rclpy.lifecycle"), importlib.import_module("rclpy.qos")
    done = lifecycle.TransitionCallbackReturn

    class DockNode(lifecycle.Node):
        """Subscribes to pictures while it is active, and publishes what they show."""

        def __init__(self) -> None:
            super().__init__(NAME)
            for name, value in defaults.items():
                self.declare_parameter(name, value)
            self._logic: NodeLogic | None = None
            self._outputs: dict[str, Any] = {}
            self._inputs: list[Any] = []
            self._is_active, self._is_on = False, not self.get_parameter("on_demand").value
            try:
                services = importlib.import_module("std_srvs.srv")
                self.create_service(services.Trigger, "~/detect", lambda _, to: self._switch(True, to))
                self.create_service(services.SetBool, "~/enable", lambda asked, to: self._switch(asked.data, to))
            except ImportError:
                self.get_logger().warning("~/detect and ~/enable are not offered, for lack of the package std_srvs")

        def on_configure(self, state: Any) -> Any:
            """Read the parameters, and offer the topics; a wrong parameter leaves the node as it was."""
            values = {name: self.get_parameter(name).value for name in defaults}
            try:
                self._logic = logic_of(values, self.get_logger().warning)
            except ValueError as error:
                self.get_logger().error(str(error))
                return done.FAILURE
            reliable = qos.QoSProfile(depth=10, reliability=qos.ReliabilityPolicy.RELIABLE)
            for topic, kind in TOPICS_OF_NODE.items():
                try:
                    self._outputs[topic] = self.create_lifecycle_publisher(message_class(kind), topic, reliable)
                except ImportError:
                    package = kind.partition("/")[0]
                    self.get_logger().warning(f"{topic} is not published, for lack of the package {package}")
            return done.SUCCESS

        def on_activate(self, state: Any) -> Any:
            """Listen to the camera, unless that is switched off."""
            self._is_active = True
            self._listen(self._is_on)
            return super().on_activate(state)

        def on_deactivate(self, state: Any) -> Any:
            """Stop listening, and forget the track."""
            self._is_active = False
            self._listen(False)
            return super().on_deactivate(state)

        def _switch(self, is_on: bool, answer: Any) -> Any:
            """Answer one who wants pictures to be searched, or none."""
            self._is_on, answer.success = is_on, self._is_active
            self._listen(is_on and self._is_active)
            waits = "" if self._is_active else "the node is not active; once it is, it "
            answer.message = f"{waits}searches {'pictures' if is_on else 'none'}"
            return answer

        def _listen(self, is_on: bool) -> None:
            """Subscribe to the camera, or to nothing, so that what is published elsewhere is not even received."""
            if self._logic is None or is_on == bool(self._inputs):
                return
            self._logic.restart()
            for subscription in self._inputs:
                self.destroy_subscription(subscription)
            self._inputs.clear()
            if not is_on:
                return
            kind = "CompressedImage" if self._logic.is_compressed else "Image"
            best_effort = qos.qos_profile_sensor_data
            for name, topic, take in (
                ("CameraInfo", self._logic.info_topic, self._take_info),
                (kind, self._logic.image_topic, self._take_image),
            ):
                of_kind = message_class(f"sensor_msgs/msg/{name}")
                self._inputs.append(self.create_subscription(of_kind, topic, take, best_effort))

        def on_cleanup(self, state: Any) -> Any:
            """Take the topics back."""
            for publisher in self._outputs.values():
                self.destroy_lifecycle_publisher(publisher)
            self._outputs.clear()
            self._logic = None
            return done.SUCCESS

        def on_shutdown(self, state: Any) -> Any:
            """End, from whichever state."""
            self.on_deactivate(state)
            return self.on_cleanup(state)

        def _take_info(self, message: Any) -> None:
            if self._logic is not None:
                self._logic.take_camera_info(message)

        def _take_image(self, message: Any) -> None:
            if self._logic is None:
                return
            now_s = 1e-9 * self.get_clock().now().nanoseconds
            for topic, fields in self._logic.take_image(message, now_s):
                if topic in self._outputs:
                    kind = TOPICS_OF_NODE[topic]
                    self._outputs[topic].publish(filled(message_class(kind)(), fields))

    return DockNode()


def logic_of(values: dict[str, Any], tell: Callable[[str], None]) -> NodeLogic:
    """Return the logic by the values of the node's parameters. Raises ValueError that names a wrong one."""
    if values["dock_file"]:
        dock = load_dock(values["dock_file"])
    elif values["dock_diameter_m"] > 0:
        dock = Dock(float(values["dock_diameter_m"]), values["lights"] or None)
    else:
        raise UserError(f"dock_diameter_m is {values['dock_diameter_m']}; it must be the dock's diameter in metres")
    named = argparse.Namespace(camera=values["camera_file"] or None, camera_size=values.get("camera_size") or None)
    camera = camera_of(named, tell)
    vehicle = load_vehicle(values["vehicle_file"]) if values["vehicle_file"] else None
    return NodeLogic(tell, dock, Settings(method=values["method"]), camera, values["image_topic"], vehicle)


def message_class(kind: str) -> Any:
    """Return the class of messages of a type, as "sensor_msgs/msg/Image"."""
    package, _, name = kind.replace("/msg/", "/").partition("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def filled(message: Any, fields: dict[str, Any]) -> Any:
    """Fill in a message's fields from plain values, and return it."""
    kinds = message.get_fields_and_field_types()
    for name, value in fields.items():
        kind = kinds[name]
        if isinstance(value, dict):
            filled(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            inner = message_class(kind.removeprefix("sequence<").removesuffix(">"))
            setattr(message, name, [filled(inner(), one) for one in value])
        else:
            setattr(message, name, _plain(kind, value))
    return message


def _plain(kind: str, value: Any) -> Any:
    """A value as rclpy takes it: bytes as an array, a byte as bytes."""
    if isinstance(value, bytes):
        return array("B", value)
    return bytes([value]) if kind == "octet" else value
