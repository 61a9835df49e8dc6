"""Approaches in closed loop: a vehicle with drag, current and delay, flown by guidance into a dock."""

import math
from collections import Counter, deque
from dataclasses import dataclass
from multiprocessing import Pool

import numpy as np
import pytest
from dockpose import Camera, Dock, Entrance, Guidance, Mount, Tracker, Vehicle, guide

from tests.bench.lamps import dock_px, draw_lamps

RUNS, LEAST = 100, 98
CAMERA = Camera(525, 525, 239.5, 179.5, 480, 360)
BEHIND_M = 1.5  # the ring stands so far behind the entrance, so that it is in the picture up to there
ENTRANCE = Entrance(position_m=(0.0, 0.0, -BEHIND_M), radius_m=0.15, cone_deg=12.0, standoff_m=1.5)
DOCK = Dock(0.9, 12, entrance=ENTRANCE)
VEHICLE = Vehicle(T_body_camera=Mount(position_m=(0.2, 0.0, 0.0)), frame="frd")
RATE_HZ, STEPS, MOST_S = 4.0, 5, 90.0  # of the camera; steps of the vehicle between two frames
RESPONSE_S, YAW_RESPONSE_S = 0.8, 0.4  # in which the vehicle takes up a speed through the water, and a rate of turn
SPEED, SLOW, TURN = 0.4, 0.12, math.radians(20)  # m/s: on the way, and in; rad/s
PULL, LEAD_S = 0.45, 0.3  # 1/s, by which it closes in on the axis; how far ahead it looks
SETTLE_S = 1.5  # in which the current is told from what the vehicle did
SURE = 0.9  # probability of a pose that is steered by, whatever the other one says
RIM_M = 0.7  # from the axis, within which the dock is hit by a vehicle that comes in beside the entrance


@dataclass
class Craft:
    """The vehicle: where its middle is from the entrance, in the dock's axes; its speed through the water; heading."""

    place_m: np.ndarray
    yaw: float
    through_m_s: np.ndarray
    turn: float = 0.0

    def move(self, wanted: tuple[np.ndarray, float], current: np.ndarray, time_s: float) -> None:
        """Go on for a short time."""
        self.through_m_s = self.through_m_s + (wanted[0] - self.through_m_s) * time_s / RESPONSE_S
        self.turn += (wanted[1] - self.turn) * time_s / YAW_RESPONSE_S
        self.place_m = self.place_m + (self.through_m_s + current) * time_s
        self.yaw += self.turn * time_s

    @property
    def heading(self) -> np.ndarray:
        """Rotation (3, 3) from the camera's axes to the dock's."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


class Pilot:
    """Flies by guidance alone: it knows what it asked for, and not the current, nor where the dock is."""

    def __init__(self, delay_s: float) -> None:
        self.delay_s, self.current = delay_s, np.zeros(3)  # right, down, in: along the corridor's axes
        self.asked, self.through = np.zeros(3), np.zeros(3)
        self.before: np.ndarray | None = None
        self.blind_s = 0.0

    def steer(self, seen: Guidance | None, bearing: float | None, time_s: float) -> tuple[np.ndarray, float]:
        """Speed through the water along the corridor's axes, and rate of turn."""
        self.through = self.through + (self.asked - self.through) * (1 - math.exp(-time_s / RESPONSE_S))
        if seen is None or bearing is None:
            self.before, self.blind_s = None, self.blind_s + time_s
            back = np.array([0.0, 0.0, -SLOW if self.blind_s > 2 else 0.0])
            self.asked = back - self.current
            return self.asked, 0.0
        self.blind_s = 0.0
        place = np.array([seen.across_m, -seen.above_m, -seen.along_m])
        if self.before is not None:
            drifted = (place - self.before) / time_s - self.through
            self.current = np.clip(self.current + (drifted - self.current) * time_s / SETTLE_S, -0.3, 0.3)
        self.before = place
        there = place + (self.through + self.current) * (self.delay_s + LEAD_S)
        goal = np.array([0.0, 0.0, 0.5 if seen.inside_cone else -ENTRANCE.standoff_m])
        wanted = PULL * (goal - there)
        most = np.clip(SLOW + 0.25 * max(seen.along_m, 0.0), SLOW, SPEED)
        if seen.inside_cone:
            # As far as it is off the axis it waits: at the cone's edge it only closes in.
            room = ENTRANCE.radius_m + seen.along_m * math.tan(math.radians(ENTRANCE.cone_deg))
            wanted[2] = most * max(0.0, 1 - (math.hypot(*there[:2]) / room) ** 2)
        speed = float(np.linalg.norm(wanted))
        self.asked = wanted * min(1.0, most / max(speed, 1e-9)) - self.current
        off = math.radians(seen.yaw_off_deg) if seen.inside_cone else -bearing
        return self.asked, float(np.clip(-0.8 * off, -TURN, TURN))


@dataclass(frozen=True)
class Flown:
    """How an approach ended."""

    end: str  # "entered", or why not
    speed_m_s: float  # along the corridor, at the entrance's plane
    off_m: float  # from its axis there
    time_s: float
    in_cone: bool  # by the truth, in the last frame before the entrance's plane
    unseen: float  # share of frames without a pose


def fly(seed: int) -> Flown:
    """Fly one approach."""
    rng = np.random.default_rng([seed, 77])
    range_m, bearing = rng.uniform(4.0, 6.0), math.radians(rng.uniform(-20, 20))
    start = range_m * np.array([math.sin(bearing), math.sin(math.radians(rng.uniform(-6, 6))), -math.cos(bearing)])
    craft = Craft(start, -bearing + math.radians(rng.uniform(-8, 8)), np.zeros(3))
    current = rng.uniform(0, 0.2) * unit(rng.normal(size=3) * [1.0, 0.4, 1.0])
    delay_s, roll = rng.uniform(0, 0.2), math.radians(rng.uniform(-10, 10))
    other = np.array([rng.choice([-1, 1]) * rng.uniform(2.0, 3.0), rng.uniform(-0.3, 0.3), rng.uniform(0.8, 2.0)])
    tracker, pilot = Tracker(CAMERA, DOCK), Pilot(delay_s)
    step_s = 1 / RATE_HZ / STEPS
    waiting = deque([(np.zeros(3), 0.0)] * round(delay_s / step_s), maxlen=None)
    doing: tuple[np.ndarray, float] = (np.zeros(3), 0.0)
    unseen = frames = 0
    in_cone = False
    for number in range(int(MOST_S * RATE_HZ)):
        tracked = tracker.see(picture(craft, roll, other, rng), number / RATE_HZ)
        pose = tracked.pose if tracked.selected is not None else None
        seen = None if pose is None else guide(pose, DOCK, CAMERA, VEHICLE)
        if seen is not None and (tracked.track.probability or 0.0) < SURE:
            # Of two poses that may be right it steers where both lead to the same place.
            both = [guide(one, DOCK, CAMERA, VEHICLE) for one in tracked.estimate.candidates]
            seen = seen if {one and one.target for one in both} == {seen.target} else None
        towards = None if pose is None else math.atan2(pose.position_m[0], pose.position_m[2])
        frames, unseen = frames + 1, unseen + (seen is None)
        asked, turn = pilot.steer(seen, towards, 1 / RATE_HZ)
        lateral = math.hypot(*craft.place_m[:2])
        in_cone = lateral <= ENTRANCE.radius_m - craft.place_m[2] * math.tan(math.radians(ENTRANCE.cone_deg))
        for _ in range(STEPS):
            # The pilot's axes are the corridor's as it sees them; the dock stands upright, so they are the dock's.
            waiting.append((asked, turn))
            doing = waiting.popleft()
            craft.move(doing, current, step_s)
            if craft.place_m[2] >= 0:
                off = math.hypot(*craft.place_m[:2])
                heading = abs(math.degrees(craft.yaw))
                end = (
                    "entered"
                    if off <= ENTRANCE.radius_m and heading < 15
                    else "hit the rim"
                    if off < RIM_M
                    else "passed by"
                )
                speed = float((craft.through_m_s + current)[2])
                return Flown(end, speed, off, number / RATE_HZ, in_cone, unseen / frames)
    return Flown("out of time", 0.0, 0.0, MOST_S, in_cone, unseen / max(frames, 1))


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def picture(craft: Craft, roll: float, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What the camera sees of both docks, the second one beside and behind the first."""
    heading = craft.heading
    eye = craft.place_m + heading @ [0.0, 0.0, 0.2]
    c, s = math.cos(roll), math.sin(roll)
    upright = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    lamps, depths = [], []
    for entrance in (np.zeros(3), other):
        ring_m = entrance + [0.0, 0.0, BEHIND_M]
        lamps_px, depths_m = dock_px(CAMERA, DOCK, heading.T @ (ring_m - eye), heading.T @ upright)
        ahead = depths_m > 0.05
        lamps.append(lamps_px[ahead])
        depths.append(depths_m[ahead])
    depths_m = np.concatenate(depths)
    radii_px = np.maximum(CAMERA.fx * 0.004 / depths_m, 0.8)
    brightness = np.minimum(3.0, 3.0 * (1.5 / depths_m) ** 2 + 0.4)
    size = CAMERA.width, CAMERA.height
    return draw_lamps(size, np.concatenate(lamps), radii_px, brightness, rng, ambient=0.02)


@pytest.mark.slow
def test_approaches_that_enter():
    with Pool(2) as pool:
        flown = pool.map(fly, range(RUNS), chunksize=1)
    ends = Counter(one.end for one in flown)
    inside = [one for one in flown if one.end == "entered"]
    speeds, offs = ([getattr(one, name) for one in inside] for name in ("speed_m_s", "off_m"))
    print(
        f"{ends['entered']} of {RUNS} entered ({dict(ends)}); at the entrance {np.median(speeds):.2f} m/s, at most "
        f"{max(speeds):.2f}, {100 * np.median(offs):.1f} cm off its middle, at most {100 * max(offs):.1f}; "
        f"after {np.median([one.time_s for one in inside]):.0f} s, at most {max(one.time_s for one in inside):.0f}; "
        f"frames without a pose {100 * np.mean([one.unseen for one in flown]):.1f} %"
    )
    assert ends["entered"] >= LEAST
    assert not [one for one in flown if one.end == "hit the rim" and not one.in_cone]
