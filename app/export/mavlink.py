"""MAVLink to an autopilot: where the vehicle is to the dock, frame by frame, and nothing where that is not sure."""

import math
import re
import threading
import time
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
        messages = self._messages(found, found.selected, tracked.track.probability, frame.time_unix_s)
        with self._held:
            for message in messages:
                self._mavlink.send(message)
        self.sent += bool(messages)
        x, y, z = relative.vehicle_in_dock(found.selected, self.vehicle).position_m
        self.words = f"{' and '.join(MESSAGES[kind] for kind in self.kinds)}: {-x:.2f} m before the dock, "
        self.words += f"{abs(y):.2f} m {'right' if y >= 0 else 'left'}, {abs(z):.2f} m {'below' if z >= 0 else 'above'}"

    def close(self) -> None:
        """End the thread and let go of the link."""
        self._stop.set()
        self._thread.join()
        self._link.close()
        self._tell(f"{self.address}: {self.sent} frames sent, {self.refused} not")

    def _note_track(self, tracked: Tracked) -> None:
        """Count a reset where another track, or the other of the two poses, takes over."""
        track = tracked.chain, tracked.track.age
        if track[1] and (track[0] != self._track[0] or track[1] <= self._track[1]):
            self._resets, self._before = (self._resets + 1) % 256, None
        self._track = track if track[1] else self._track

    def _messages(self, found: Estimate, pose: CirclePose, probability: float | None, time_s: float) -> list[Any]:
        """The messages about a frame; of the first after a gap there is no way from the one before."""
        names, messages = self._names, []
        time_us, here = round(1e6 * time_s), relative.vehicle_in_dock(pose, self.vehicle)
        if "estimate" in self.kinds:
            spread = relative.vehicle_covariance(pose, self.vehicle)[_UPPER].tolist()
            where = (*here.position_m.tolist(), *here.roll_pitch_yaw_rad)
            messages.append(names.MAVLink_vision_position_estimate_message(time_us, *where, spread, self._resets))
        if "delta" in self.kinds and self._before is not None:
            turned, way = (part.tolist() for part in relative.moved(self._before[1], here))
            since_us = time_us - self._before[0]
            sure = 100 * (found.detection or 0.0) * (probability or 0.0)
            messages.append(names.MAVLink_vision_position_delta_message(time_us, since_us, turned, way, sure))
        if "target" in self.kinds:
            messages.append(self._target(pose, found.dock.diameter, time_us))
        self._before = time_us, here
        return messages

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
            if self._link.select(_WAIT_S):
                self._answer(self._link.recv(2**12))

    def _answer(self, data: bytes) -> None:
        """Answer requests for the time by our clock, which stamps the messages."""
        try:
            messages = self._mavlink.parse_buffer(data) or []
        except self._names.MAVError:
            return
        for message in messages:
            if message.get_type() == "TIMESYNC" and message.tc1 == 0:
                with self._held:
                    self._mavlink.timesync_send(time.time_ns(), message.ts1)


def _kinds(send: str) -> Sequence[str]:
    kinds = tuple(send.split(","))
    if not set(kinds) <= set(MESSAGES):
        raise UserError(f"--mavlink-send {send}: may be {', '.join(MESSAGES)}, or several with commas between")
    return kinds
