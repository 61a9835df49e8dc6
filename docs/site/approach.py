"""The moving picture in the README: a simulated approach with both poses, ``python docs/site/approach.py``."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from dockpose import Camera, Dock, Estimate, Tracker
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.colours import POSE_COLOURS
from dockpose.app.drawing.numbers import pose_cells
from dockpose.app.processing.following import chosen_by_track
from dockpose.estimate.canvas import Canvas
from dockpose.estimate.drawing import PARTS
from dockpose.simulate import Approach, FilmPlan, Pose, Scene, Sensor, film
from dockpose.simulate.parts import Background, Lights, Snow
from PIL import Image

TARGET = Path(__file__).resolve().parents[2] / "static" / "screenshot-approach.webp"
CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(diameter=0.30, lights=10)
FRAMES, RATE_HZ = 60, 8.0
SHOWN_PX = (560, 420)
LAYERS = (*PARTS, "scale")
BAR_PX = 58


def plan() -> FilmPlan:
    """From 5.5 m to 0.8 m to a dock that is turned away, in drifting coastal water with snow."""
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=Pose(position_m=(0.03, -0.01, 1.0), theta_x_deg=12.0, theta_y_deg=-24.0, roll_deg=9.0),
        lights=Lights(level=900.0, radius_m=0.005),
        water="coastal",
        background=Background(level=30.0, gradient_y=-6.0, backscatter_level=4.0),
        snow=Snow(count=25),
        sensor=Sensor(blur_px=0.8),
        seed=7,
    )
    motion = Approach(start_m=5.5, end_m=0.8, frames=FRAMES, rate_hz=RATE_HZ, drift_m=0.015, drift_deg=1.5)
    return FilmPlan(scene=scene, motion=motion)


def words(found: Estimate, chance: float | None) -> list[tuple[str, str]]:
    """A line for each pose, in its colour."""
    lines = []
    for index, (name, pose) in enumerate(zip("AB", found.candidates, strict=False)):
        x, y, z, theta_x, theta_y = pose_cells(pose)
        mark = f"<- chosen, {100 * (chance or 0):.1f} %" if pose is found.selected else ""
        text = f"{name}  x {x}  y {y}  z {z} cm   pitch {theta_x}  yaw {theta_y} deg  {mark}"
        lines.append((text, POSE_COLOURS[index]))
    return lines or [("no dock seen", "#ffffff")]


def drawn(image: np.ndarray, found: Estimate, chance: float | None) -> Image.Image:
    """One frame: the picture with both poses, and below it their numbers."""
    picture = cv2.resize(annotate(image, found, layers=LAYERS), SHOWN_PX, interpolation=cv2.INTER_AREA)
    bar = Canvas(np.full((BAR_PX, SHOWN_PX[0], 3), 0, np.uint8))
    for row, (text, colour) in enumerate(words(found, chance)):
        bar.text(text, (10, 24 + 22 * row), colour, 0.5)
    return Image.fromarray(np.vstack([picture, bar.pixels])[:, :, ::-1])


def main() -> None:
    """Write the file."""
    tracker, frames = Tracker(CAMERA, DOCK), []
    for frame in film(plan()):
        tracked = tracker.see(frame.image, frame.time_s)
        found = chosen_by_track(tracked)
        frames.append(drawn(frame.image, found, tracked.track.probability))
    hold = round(1000 / RATE_HZ)
    times = [hold] * (len(frames) - 1) + [2500]
    frames[0].save(TARGET, save_all=True, append_images=frames[1:], duration=times, loop=0, quality=60, method=6)
    print(f"{TARGET.name}: {len(frames)} frames, {TARGET.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
