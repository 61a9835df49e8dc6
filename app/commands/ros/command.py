"""``dockpose ros``: a lifecycle node of ROS 2 that publishes where the dock is."""

from __future__ import annotations

import argparse

from dockpose.app.commands.arguments import Commands, add_camera_and_dock, add_method, dock_of
from dockpose.app.commands.console import EXIT_ALL_READ, say
from dockpose.app.commands.ros.node import make_node, options_of
from dockpose.app.errors import UserError


def add_parser(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add the command ``ros``."""
    parser = commands.add_parser("ros", help="publish the dock's pose as a node of ROS 2 (where rclpy is there)")
    parser.add_argument(
        "--topic",
        metavar="NAME",
        default="/camera/image_raw",
        help="image topic (default: %(default)s)",
    )
    add_camera_and_dock(parser)
    add_method(parser, "hats")
    parser.add_argument(
        "--managed", action="store_true", help="wait to be configured and activated, rather than do so at once"
    )
    parser.add_argument(
        "--ros-args", nargs=argparse.REMAINDER, default=[], metavar="...", help="for ROS, as -p lights:=10; comes last"
    )


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose ros`` until it is stopped; returns the exit status."""
    try:
        import rclpy  # pyright: ignore[reportMissingImports]  # comes with ROS
    except ImportError as error:
        raise UserError("ros: needs ROS 2 with rclpy, which is not there; source its setup.bash first") from error
    dock = dock_of(arguments)
    defaults = {
        "camera_file": arguments.camera or "",
        "dock_file": arguments.dock or "",
        "dock_diameter_m": 0.0 if dock is None else dock.diameter,
        "lights": 0 if dock is None or dock.lights is None else dock.lights,
        "method": arguments.method,
        "image_topic": arguments.topic,
    }
    if dock is not None:
        options_of(defaults)  # what is wrong is reported here rather than in a log
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
