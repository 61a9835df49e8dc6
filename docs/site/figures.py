"""The figures of the documentation, made by the simulator: ``python docs/site/figures.py`` (``make figures``)."""

from __future__ import annotations

import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from dockpose import Camera, Dock, Settings, estimate
from dockpose.app.drawing.colours import POSE_COLOURS
from dockpose.camera.image import read
from dockpose.camera.port import FlatPort
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.thresholds import histogram_of
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
FIGURES = ROOT / "docs" / "figures"
CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(diameter=0.30, lights=10)
LEVEL_COLOUR = "#D55E00"
NOISE_PX, DRAWS = 0.3, 200
STYLE = {"svg.hashsalt": "dockpose", "svg.fonttype": "path", "font.size": 9, "axes.spines.top": False}


def main() -> None:
    """Write all figures into docs/figures/."""
    FIGURES.mkdir(exist_ok=True)
    with plt.rc_context(STYLE):
        for name, draw in {
            "hats.png": hats,
            "two_poses.svg": two_poses,
            "choice.svg": choice,
            "port.svg": port,
            "frames.svg": frames,
        }.items():
            figure = draw()
            about = {"Software": None} if name.endswith("png") else {"Date": None, "Creator": None}
            figure.savefig(FIGURES / name, dpi=110, metadata=about, bbox_inches="tight")
            plt.close(figure)
            print(f"{name}: {(FIGURES / name).stat().st_size / 1e3:.0f} kB")


def hats() -> Figure:
    """A turbid picture, its histogram with the chosen level, and the groups that each level leaves."""
    image = read(ROOT / "sample_images" / "turbid.png")
    camera, dock = _beside("turbid")
    found = estimate(image, camera, dock)
    assert found.threshold is not None
    level, counts = found.threshold.level, histogram_of(image).counts
    levels = np.arange(20, 250, 2)
    groups = [_groups(image, camera, dock, int(one)) for one in levels]
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(10, 2.8), layout="constrained")
    left.imshow(image, cmap="gray", vmin=0, vmax=255)
    left.set_axis_off()
    middle.semilogy(np.maximum(counts, 0.5), color="0.3", drawstyle="steps-mid", linewidth=0.8)
    middle.set(xlabel="grey level", ylabel="pixels", ylim=(0.7, None))
    right.plot(levels, groups, color="#0072B2")
    right.axhline(dock.lights, color="0.6", linestyle=":")
    right.set(xlabel="grey level", ylabel="groups", ylim=(0, 4 * (dock.lights or 10)))
    for axis in (middle, right):
        axis.axvline(level, color=LEVEL_COLOUR, linestyle="--")
    middle.text(
        level - 4,
        0.97,
        f"HATS: {level}",
        color=LEVEL_COLOUR,
        transform=middle.get_xaxis_transform(),
        ha="right",
        va="top",
    )
    return figure


def two_poses() -> Figure:
    """The two poses of one picture, seen from above."""
    truth = _lights_m(np.array([0.1, 0.0, 1.0]), 0.0, math.radians(-30))
    _, chosen = find_poses(CAMERA.project(truth), CAMERA, DOCK)
    figure, axis = plt.subplots(figsize=(4, 5))
    axis.plot(0, 0, "k^", markersize=9)
    axis.text(0.02, 0.0, "camera")
    for name, pose, colour in zip("AB", chosen.candidates, POSE_COLOURS, strict=False):
        x, _, z = pose.position_m
        across = pose.rotation[:, 0] * DOCK.radius
        axis.plot([x - across[0], x + across[0]], [z - across[2], z + across[2]], color=colour, linewidth=3)
        axis.annotate(
            "",
            (x + 0.15 * pose.normal[0], z + 0.15 * pose.normal[2]),
            (x, z),
            arrowprops={"arrowstyle": "->", "color": colour},
        )
        axis.text(x + 0.17 * pose.normal[0], z + 0.17 * pose.normal[2], name, color=colour, ha="center", va="top")
        axis.plot(x, z, "o", color=colour)
    for point in truth[np.argsort(truth[:, 0])[[0, -1]]]:
        axis.plot([0, 1.25 * point[0]], [0, 1.25 * point[2]], color="0.7", linewidth=0.8, zorder=0)
    axis.set(xlabel="x (m)", ylabel="z ahead (m)", xlim=(-0.3, 0.5), ylim=(-0.05, 1.2), aspect="equal")
    return figure


def choice() -> Figure:
    """Share of pictures in which the lights' spacing chooses the right pose, by range and tilt."""
    rng = np.random.default_rng(1)
    ranges_m = np.array([1, 1.5, 2, 3, 4, 6, 8, 12, 16])
    figure, axis = plt.subplots(figsize=(6, 3.2))
    for tilt, style in ((5, ":"), (10, "-."), (20, "--"), (40, "-")):
        right = [
            100 * np.mean([_is_right(rng, range_m, math.radians(tilt)) for _ in range(DRAWS)]) for range_m in ranges_m
        ]
        axis.plot(ranges_m, right, style, color="#0072B2", label=f"{tilt} degrees", marker=".")
    axis.axhline(50, color="0.7", linewidth=0.8)
    axis.set(xscale="log", xlabel="range (m) of a ring of 0.30 m", ylabel="right pose chosen (%)", ylim=(40, 102))
    axis.set_xticks(ranges_m, [f"{one:g}" for one in ranges_m])
    axis.minorticks_off()
    axis.legend(title="tilted by", frameon=False)
    return figure


def port() -> Figure:
    """How far a flat port moves a point in the picture, against the angle in the water off the axis."""
    window = FlatPort(air_gap_m=0.03, glass_m=0.01)
    through = Camera(700, 700, 319.5, 239.5, 640, 480, port=window)
    angles = np.linspace(0, 25, 60)
    figure, axis = plt.subplots(figsize=(6, 3))
    for range_m, style in ((0.5, "--"), (3.0, "-")):
        points = np.column_stack([range_m * np.tan(np.radians(angles)), 0 * angles, np.full(angles.shape, range_m)])
        moved = through.project(points)[:, 0] - CAMERA.project(points)[:, 0]
        axis.plot(angles, moved, style, color="#0072B2", label=f"{range_m:g} m ahead")
    axis.set(xlabel="angle off the axis, in water (degrees)", ylabel="moved outwards (px)")
    axis.legend(frameon=False)
    return figure


def frames() -> Figure:
    """The axes of camera, vehicle and dock, drawn in a world with x ahead, y left and z up."""
    figure = plt.figure(figsize=(10, 3.4), layout="constrained")
    ahead, left, up = np.eye(3)
    views: list[tuple[str, list[tuple[str, np.ndarray]]]] = [
        ("camera", [("x right", -left), ("y down", -up), ("z ahead", ahead)]),
        ("vehicle, frd", [("x ahead", ahead), ("y right", -left), ("z down", -up)]),
        ("vehicle, flu", [("x ahead", ahead), ("y left", left), ("z up", up)]),
        ("dock and entrance", [("x", -left), ("y", -up), ("z into the dock", ahead)]),
    ]
    turn = np.linspace(0, 2 * math.pi, 60)
    for number, (title, axes) in enumerate(views, 1):
        axis = figure.add_subplot(1, len(views), number, projection="3d")
        axis.set_title(title, fontsize=10)
        for (label, to), colour in zip(axes, (LEVEL_COLOUR, "#009E73", "#0072B2"), strict=True):
            axis.quiver(0, 0, 0, *to, color=colour, arrow_length_ratio=0.15, linewidth=2)
            axis.text(*(1.3 * to), label, color=colour, ha="center")
        if title == "camera":
            corners = np.array([[0.6, 0.4 * y, 0.3 * z] for y, z in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))])
            axis.plot(*corners.T, color="0.5", linewidth=0.8)
            for corner in corners[:4]:
                axis.plot(*np.array([[0, 0, 0], corner]).T, color="0.5", linewidth=0.8)
        elif title.startswith("vehicle"):
            hull = np.array([[1, 0.35, 0], [1, -0.35, 0], [-1, -0.35, 0], [-1, 0.35, 0], [1, 0.35, 0]]) * 0.7
            axis.plot(*hull.T, color="0.5", linewidth=0.8)
            axis.plot([0.7], [0], [0], ">", color="0.5")
        else:
            axis.plot(0 * turn, 0.8 * np.cos(turn), 0.8 * np.sin(turn), color="0.5", linewidth=0.8)
            axis.plot(*np.array([[0, 0.8 * math.cos(a), 0.8 * math.sin(a)] for a in turn[::6]]).T, "o", color="0.3")
            for width in (-1, 1):
                axis.plot([0.5, -1.2], [0.1 * width, 0.6 * width], [0, 0], "--", color="0.5", linewidth=0.8)
            axis.quiver(0.5, 0, 0, -1.4, 0, 0, color="0.3", arrow_length_ratio=0.1)
            axis.text(-1.2, 0, -0.3, "normal", color="0.3", ha="center")
        axis.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
        axis.set_box_aspect((1, 1, 1), zoom=1.15)
        axis.view_init(elev=25, azim=-140)
        axis.set_axis_off()
    return figure


def _beside(name: str) -> tuple[Camera, Dock]:
    from dockpose.sidecar import load_dock
    from dockpose.simulate import load_scene

    path = ROOT / "sample_images" / f"{name}.yaml"
    return load_scene(path).camera, load_dock(path)


def _groups(image: np.ndarray, camera: Camera, dock: Dock, level: int) -> int:
    markers = estimate(image, camera, dock, Settings(method="fixed", level=level)).markers
    return 0 if markers is None else len(markers)


def _lights_m(position_m: np.ndarray, theta_x_rad: float, theta_y_rad: float, roll_rad: float = 0.1) -> np.ndarray:
    return position_m + DOCK.light_points() @ rotation_from_angles(theta_x_rad, theta_y_rad, roll_rad).T


def _is_right(rng: np.random.Generator, range_m: float, tilt_rad: float) -> bool:
    """Whether the pose nearer to the truth is the one that is chosen, for a dock ahead that is tilted some way."""
    way, roll = rng.uniform(0, 2 * math.pi, 2)
    theta_x = math.asin(math.sin(tilt_rad) * math.sin(way))
    theta_y = math.atan2(math.sin(tilt_rad) * math.cos(way), math.cos(tilt_rad))
    points = _lights_m(np.array([0.0, 0.0, range_m]), theta_x, theta_y, roll)
    seen = CAMERA.project(points) + rng.normal(0, NOISE_PX, (len(points), 2))
    try:
        _, found = find_poses(seen, CAMERA, DOCK)
    except NoEllipseError:
        return False
    normal = -rotation_from_angles(theta_x, theta_y)[:, 2]
    nearer = max(range(2), key=lambda index: float(found.candidates[index].normal @ normal))
    return found.selected == nearer


if __name__ == "__main__":
    main()
