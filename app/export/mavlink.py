"""MAVLink to an autopilot: where the vehicle is to the dock, frame by frame, and nothing where that is not sure."""

import math
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dockpose import Estimate, Vehicle
from dockpose.app.errors import UserError
from dockpose.app.export import vehicle as relative
from dockpose.app.export.vehicle import AHEAD, Placed
from dockpose.app.state.trust import Trust
from dockpose.pose.circle import CirclePose
from dockpose.sources import Frame
from dockpose.tracking.tracker import Tracked

_ADDRESS = re.compile(r"(udpout|udpin|tcp):[^:\s]+:(\d{1,5})")
_IDS = re.compile(r"(\d{1,3}):(\d{1,3})")
MESSAGES = {"estimate": "VISION_POSITION_ESTIMATE", "delta": "VISION_POSITION_DELTA", "target": "LANDING_TARGET"}
_MAKERS = {3: "ardupilot", 12: "px4"}  # MAV_AUTOPILOT of heartbeats
_NAMES = {"ardupilot": "ArduPilot", "px4": "PX4"}
_ATTITUDE_S = 0.5  # most between a picture and the ATTITUDE that goes with it
_ATTITUDE_EACH_US = 50_000  # what is asked of an autopilot that sends none
_TELL_AT = 100  # frames sent until their least delay is told
_HEARTBEAT_S = 1.0
_WAIT_S = 0.1
_UPPER = np.triu_indices(6)


def why_not(found: Estimate, tracked: Tracked, trust: Trust, age_s: float, most_age_s: float) -> str | None:
    """Why a frame is not to be sent, in a few words; None where it may be."""
    if not age_s <= most_age_s:
        return f"the picture is {age_s:.1f} s old"
    if tracked.track.lost or tracked.track.predicted or found.selected is None:
        return "no dock is seen"
    return "do not rely on it" if trust.colour == "red" else None


class Autopilot:
    """A link to an autopilot, with its own thread for heartbeats and for those who ask for the time (TIMESYNC)."""

    def __init__(
        self,
        address: str,
        send: str = "estimate",
        ids: str = "1:197",
        most_age_s: float = 0.5,
        vehicle: Vehicle | None = None,
        tell: Callable[[str], None] = lambda text: None,
        is_on: bool = True,
        made_for: str = "auto",
    ) -> None:
        self.address, self.vehicle, self._most_age_s, self._tell = address, vehicle or AHEAD, most_age_s, tell
        self.kinds = _kinds(send)
        if not most_age_s > 0:
            raise UserError(f"--mavlink-age is {most_age_s:g}; it must be above 0 seconds")
        match, system = _ADDRESS.fullmatch(address), _IDS.fullmatch(ids)
        if match is None or not 0 < int(match[2]) < 2**16:
            raise UserError(f"--mavlink {address}: write it as udpout:127.0.0.1:14550, or with udpin: or tcp:")
        if system is None or not all(0 < int(number) < 256 for number in system.groups()):
            raise UserError(f"--mavlink-ids {ids}: must be system and component, as 1:197, each from 1 to 255")
        try:
            from pymavlink import mavutil  # pyright: ignore[reportMissingImports]
            from pymavlink.dialects.v20 import ardupilotmega as dialect  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise UserError(f"--mavlink {address}: needs pymavlink: pip install 'dockpose[mavlink]'") from error
        try:
            self._link: Any = mavutil.mavlink_connection(address)
        except OSError as error:
            raise UserError(f"--mavlink {address}: cannot be opened ({error.strerror or error})") from error
        self._names: Any = dialect
        self._mavlink: Any = dialect.MAVLink(self._link, int(system[1]), int(system[2]))
        self._held, self._stop = threading.Lock(), threading.Event()
        self.is_on = is_on
        self.sent, self.refused, self._resets = 0, 0, 0  # frames, and what is new about the poses
        self.made_for, self._least_s = made_for, math.inf  # the latter: least delay of a frame
        self._attitudes: deque[tuple[float, float, float]] = deque(maxlen=64)  # when, roll and pitch of the vehicle
        self._way: tuple[str, bool] | None = None  # for whom, and whether level, the last message was made
        self.words = "nothing yet"  # what came of the last frame
        self._before: tuple[int, Placed] | None = None  # time and pose that were sent last
        self._last: tuple[int, float] | None = None  # number and time of the frame before
        self._track: tuple[int | None, int] = None, 0  # its pose and its age
        self._thread = threading.Thread(target=self._run, name="dockpose mavlink", daemon=True)
        self._thread.start()

    def see(self, frame: Frame, found: Estimate, tracked: Tracked, trust: Trust, refusal: str | None = None) -> None:
        """Send a frame's pose unless something speaks against it, of which ``refusal`` names what only others know."""
        if frame.time_unix_s is None or frame.monotonic_s is None or self._last == (frame.index, frame.monotonic_s):
            return
        self._last = frame.index, frame.monotonic_s
        self._note_track(tracked)
        age_s = time.monotonic() - frame.monotonic_s
        reason = refusal or why_not(found, tracked, trust, age_s, self._most_age_s)
        if reason is not None or not self.is_on:
            self._before, self.words = None, f"nothing: {reason}" if reason else "nothing: it is switched off"
            self.refused += 1
            return
        assert found.selected is not None
        level = self._level(found.selected, frame.monotonic_s)
        messages = self._messages(found, tracked.track.probability, frame.time_unix_s, level)
        with self._held:
            for message in messages:
                self._mavlink.send(message)
        self.sent += bool(messages)
        self._least_s = min(self._least_s, time.monotonic() - frame.monotonic_s)
        self._tell_delay(self.sent == _TELL_AT)
        x, y, z = (relative.vehicle_in_dock(found.selected, self.vehicle) if level is None else level[0]).position_m
        kinds = MESSAGES | ({"estimate": "ODOMETRY"} if self.made_for == "px4" else {})
        lacks = " without angles, for no ATTITUDE comes" if self.made_for in _NAMES and level is None else ""
        self.words = f"{' and '.join(kinds[kind] for kind in self.kinds)}{lacks}: {-x:.2f} m before the dock, "
        self.words += f"{abs(y):.2f} m {'right' if y >= 0 else 'left'}, {abs(z):.2f} m {'below' if z >= 0 else 'above'}"

    def close(self) -> None:
        """End the thread and let go of the link."""
        self._stop.set()
        self._thread.join()
        self._link.close()
        self._tell(f"{self.address}: {self.sent} frames sent, {self.refused} not")
        self._tell_delay(0 < self.sent < _TELL_AT)

    def _tell_delay(self, is_due: bool) -> None:
        """Say our least delay to ArduPilot's operator; what is more than the least, ArduPilot takes off by itself."""
        if is_due and self.made_for == "ardupilot":
            least = f"{1000 * self._least_s:.0f} ms or more after its picture came"
            self._tell(f"{self.address}: a message leaves {least}; VISO_DELAY_MS is that and the camera's own delay")

    def _note_track(self, tracked: Tracked) -> None:
        """Count a reset where another track, or the other of the two poses, takes over."""
        track = tracked.chain, tracked.track.age
        if track[1] and (track[0] != self._track[0] or track[1] <= self._track[1]):
            self._resets, self._before = (self._resets + 1) % 256, None
        self._track = track if track[1] else self._track

    def _level(self, pose: CirclePose, seen_s: float) -> tuple[Placed, np.ndarray] | None:
        """The pose and its covariance by the vehicle's own roll and pitch at that time; None without them."""
        with self._held:
            near = min(self._attitudes, key=lambda one: abs(one[0] - seen_s), default=(-math.inf, 0.0, 0.0))
        is_known = self.made_for in _NAMES and abs(near[0] - seen_s) <= _ATTITUDE_S
        return relative.level_in_dock(pose, self.vehicle, *near[1:]) if is_known else None

    def _messages(
        self, found: Estimate, probability: float | None, time_s: float, level: tuple[Placed, np.ndarray] | None
    ) -> list[Any]:
        """The messages about a frame; of the first after a gap there is no way from the one before."""
        names, messages, pose, way = self._names, [], found.selected, (self.made_for, level is not None)
        assert pose is not None
        if self._way not in (None, way):  # other axes
            self._resets, self._before = (self._resets + 1) % 256, None
        self._way, time_us, sure = way, round(1e6 * time_s), 100 * (found.detection or 0.0) * (probability or 0.0)
        seen = pose, self.vehicle
        here, spread = level or (relative.vehicle_in_dock(*seen), relative.vehicle_covariance(*seen))
        if "estimate" in self.kinds:
            is_turned = level is not None or self.made_for not in _NAMES
            messages.append(self._estimate(here, spread[_UPPER].tolist(), time_us, sure, is_turned))
        if "delta" in self.kinds and self._before is not None:
            turned, moved = (part.tolist() for part in relative.moved(self._before[1], here))
            since_us = time_us - self._before[0]
            messages.append(names.MAVLink_vision_position_delta_message(time_us, since_us, turned, moved, sure))
        if "target" in self.kinds:
            messages.append(self._target(pose, found.dock.diameter, time_us))
        self._before = time_us, here
        return messages

    def _estimate(self, here: Placed, spread: list[float], time_us: int, sure: float, is_turned: bool) -> Any:
        """The message with the pose; its angles are NaN where they are not known."""
        names, where, unknown = self._names, here.position_m.tolist(), math.nan
        if self.made_for != "px4":
            angles = here.roll_pitch_yaw_rad if is_turned else 3 * [unknown]
            return names.MAVLink_vision_position_estimate_message(time_us, *where, *angles, spread, self._resets)
        turned = relative.quaternion_wxyz(here.rotation) if is_turned else 4 * [unknown]
        frames, speeds = (names.MAV_FRAME_LOCAL_FRD, names.MAV_FRAME_BODY_FRD), 6 * [unknown]
        about = self._resets, names.MAV_ESTIMATOR_TYPE_VISION, round(sure)
        return names.MAVLink_odometry_message(time_us, *frames, *where, turned, *speeds, spread, 21 * [unknown], *about)

    def _target(self, pose: CirclePose, diameter_m: float, time_us: int) -> Any:
        names, dock, (x, y, z) = self._names, relative.dock_in_body(pose, self.vehicle), pose.position_m.tolist()
        size = 2 * math.atan2(diameter_m / 2, math.hypot(x, y, z))
        where = (
            *dock.position_m.tolist(),
            relative.quaternion_wxyz(dock.rotation),
            names.LANDING_TARGET_TYPE_LIGHT_BEACON,
        )
        range_m = math.hypot(*dock.position_m.tolist())
        seen = names.MAV_FRAME_BODY_FRD, math.atan2(x, z), math.atan2(y, z)
        return names.MAVLink_landing_target_message(time_us, 0, *seen, range_m, size, size, *where, 1)

    def _run(self) -> None:
        names, due_s = self._names, time.monotonic()
        while not self._stop.is_set():
            if time.monotonic() >= due_s:
                due_s += _HEARTBEAT_S
                kind, none = names.MAV_TYPE_ONBOARD_CONTROLLER, names.MAV_AUTOPILOT_INVALID
                with self._held:
                    self._mavlink.heartbeat_send(kind, none, 0, 0, names.MAV_STATE_ACTIVE)
                    latest_s = self._attitudes[-1][0] if self._attitudes else -math.inf
                    if self.is_on and self.made_for in _NAMES and time.monotonic() - latest_s > _HEARTBEAT_S:
                        asked = 0, names.MAVLINK_MSG_ID_ATTITUDE, _ATTITUDE_EACH_US, 0, 0, 0, 0, 0
                        to = self._mavlink.srcSystem, names.MAV_COMP_ID_AUTOPILOT1
                        self._mavlink.command_long_send(*to, names.MAV_CMD_SET_MESSAGE_INTERVAL, *asked)
            if self._link.select(_WAIT_S):
                self._answer(self._link.recv(2**12))

    def _answer(self, data: bytes) -> None:
        """Answer requests for the time by our clock, which stamps the messages; hear the vehicle's own autopilot."""
        try:
            messages = self._mavlink.parse_buffer(data) or []
        except self._names.MAVError:
            return
        for message in messages:
            kind, sender = message.get_type(), (message.get_srcSystem(), message.get_srcComponent())
            if kind == "TIMESYNC" and message.tc1 == 0:
                with self._held:
                    self._mavlink.timesync_send(time.time_ns(), message.ts1)
            elif sender != (self._mavlink.srcSystem, self._names.MAV_COMP_ID_AUTOPILOT1):
                continue
            elif kind == "HEARTBEAT" and self.made_for == "auto" and message.autopilot in _MAKERS:
                self.made_for = _MAKERS[message.autopilot]
                self._tell(f"{self.address}: a heartbeat says {_NAMES[self.made_for]}, so messages are made for it")
            elif kind == "ATTITUDE" and math.isfinite(message.roll + message.pitch):
                with self._held:
                    self._attitudes.append((time.monotonic(), message.roll, message.pitch))


def _kinds(send: str) -> Sequence[str]:
    kinds = tuple(send.split(","))
    if not set(kinds) <= set(MESSAGES):
        raise UserError(f"--mavlink-send {send}: may be {', '.join(MESSAGES)}, or several with commas between")
    return kinds
