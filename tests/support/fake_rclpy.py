"""Modules that stand for rclpy and ROS's messages: what the node calls of them, and a record of what it did."""

import enum
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

from rosbags.typesys import Stores, get_typestore

from tests.support import foxglove

STORE = foxglove.register(get_typestore(Stores.ROS2_HUMBLE))
PACKAGES = (
    "sensor_msgs",
    "geometry_msgs",
    "tf2_msgs",
    "diagnostic_msgs",
    "std_msgs",
    "builtin_interfaces",
    "foxglove_msgs",
)


def message_type(kind: str) -> type:
    """A class like rclpy's: fields with defaults, and what type each has."""
    fields: Any = STORE.fielddefs[kind][1]

    class Message:
        __slots__ = tuple(name for name, _ in fields)  # a field that is none is an error, as in rclpy

        def __init__(self) -> None:
            for name, (sort, about) in fields:
                setattr(self, name, message_type(about)() if sort.name == "NAME" else None)

        @classmethod
        def get_fields_and_field_types(cls) -> dict[str, str]:
            return {name: _type_text(described) for name, described in fields}

    return Message


def _type_text(described: Any) -> str:
    sort, about = described
    if sort.name == "BASE":
        return {"byte": "octet", "float64": "double"}.get(about[0], str(about[0]))
    if sort.name == "NAME":
        return about.replace("/msg/", "/")
    inner = _type_text(about[0])
    return f"{inner}[{about[1]}]" if sort.name == "ARRAY" else f"sequence<{inner}>"


class Return(enum.Enum):
    SUCCESS, FAILURE = 0, 1


class Node:
    """A lifecycle node, whose publishers publish while it is active, as in rclpy."""

    nodes: "list[Node]"

    def __init__(self, name: str) -> None:
        self.name, self.parameters, self.said = name, {}, []
        self.publishers_, self.subscriptions_, self.services_ = {}, {}, {}
        self.state, self.published = "unconfigured", []
        Node.nodes.append(self)

    def declare_parameter(self, name: str, value: Any) -> None:
        self.parameters.setdefault(name, value)

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self.parameters[name])

    def get_logger(self) -> Any:
        return SimpleNamespace(warning=self.said.append, error=self.said.append)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=1_760_000_000 * 10**9))

    def get_name(self) -> str:
        return self.name

    def create_lifecycle_publisher(self, kind: type, topic: str, qos: Any) -> Any:
        def publish(message: Any) -> None:
            if self.state == "active":
                self.published.append((topic, message))

        publisher = self.publishers_[topic] = SimpleNamespace(publish=publish, qos=qos)
        return publisher

    def destroy_lifecycle_publisher(self, publisher: Any) -> None:
        self.publishers_ = {topic: one for topic, one in self.publishers_.items() if one is not publisher}

    def create_subscription(self, kind: type, topic: str, take: Any, qos: Any) -> Any:
        subscription = self.subscriptions_[topic] = SimpleNamespace(kind=kind, take=take, qos=qos)
        return subscription

    def create_service(self, kind: Any, name: str, answer: Any) -> None:
        self.services_[name] = kind, answer

    def call(self, name: str, **fields: Any) -> Any:
        """The answer of a service."""
        _, answer = self.services_[name]
        return answer(SimpleNamespace(**fields), SimpleNamespace(success=None, message=None))

    def destroy_subscription(self, subscription: Any) -> None:
        self.subscriptions_ = {topic: one for topic, one in self.subscriptions_.items() if one is not subscription}

    def on_activate(self, state: Any) -> Return:
        return Return.SUCCESS

    def on_deactivate(self, state: Any) -> Return:
        return Return.SUCCESS

    def _trigger(self, change: Any, after: str) -> Return:
        result = change(None)
        if result is Return.SUCCESS:
            self.state = after
        return result

    def trigger_configure(self) -> Return:
        return self._trigger(getattr(self, "on_configure"), "inactive")  # noqa: B009  # of the node made of this class

    def trigger_activate(self) -> Return:
        return self._trigger(self.on_activate, "active")

    def trigger_deactivate(self) -> Return:
        return self._trigger(self.on_deactivate, "inactive")

    def trigger_cleanup(self) -> Return:
        return self._trigger(getattr(self, "on_cleanup"), "unconfigured")  # noqa: B009

    def destroy_node(self) -> None:
        self.state = "gone"


def install(monkeypatch: Any, spin: Any = lambda node: None) -> list[Any]:
    """Put the modules where imports find them; returns the list of nodes that are made."""
    Node.nodes = []
    begun: list[Any] = []

    def module(name: str, **contents: Any) -> ModuleType:
        made = ModuleType(name)
        vars(made).update(contents)
        monkeypatch.setitem(sys.modules, name, made)
        return made

    module("rclpy", init=lambda args=None: begun.append(args), spin=spin, try_shutdown=lambda: begun.append("shutdown"))
    module("rclpy.lifecycle", Node=Node, TransitionCallbackReturn=Return)
    reliability = SimpleNamespace(RELIABLE="reliable", BEST_EFFORT="best effort")
    best_effort = SimpleNamespace(reliability="best effort", depth=5)
    module("rclpy.qos", QoSProfile=SimpleNamespace, ReliabilityPolicy=reliability, qos_profile_sensor_data=best_effort)
    module("std_srvs", srv=module("std_srvs.srv", Trigger="std_srvs/srv/Trigger", SetBool="std_srvs/srv/SetBool"))
    for package in PACKAGES:
        kinds = [kind for kind in STORE.fielddefs if kind.startswith(f"{package}/msg/")]
        made = module(f"{package}.msg", **{kind.rpartition("/")[2]: message_type(kind) for kind in kinds})
        module(package, msg=made)
    return Node.nodes
