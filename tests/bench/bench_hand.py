"""Lights that are set by hand: at the marks of photographs, and in drawn scenes beside what the search finds there.

``python -m tests.bench.bench_hand [--data DATA]``.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from dockpose import Camera, Dock, Estimate, Tracker, estimate, open_frames
from dockpose.camera.image import read
from dockpose.lights.by_hand import EXACT_PX
from dockpose.lights.ellipse import MIN_POINTS, fit_ellipse
from dockpose.study.judge import nearest, signed_errors

from tests.bench.films import maker
from tests.bench.floors import at_least
from tests.bench.lamps import DIAMETER_M
from tests.bench.seen_scenes import Shown, circle, dock_drawn, drawn, even

_CLICKED_PX, _AT_MARKS_PX = 1.5, 2.0  # scatter of x and of y
_SAME = 0.02  # share of the marks' larger semi-axis
_SCENES, _SEED, _INTERVAL = 120, 6900, 1.96
_HALOS, _FILMS, _FRAMES = ((0.8, 2.0), (1.0, 5.0)), 20, 60
_MIDDLE = 0.6745  # of a normal distribution's absolute values, in its standard deviations
_LED_FIELD_OF_VIEW = 1.1547  # of a photograph's width to the assumed focal length: 60 degrees across


def scene(rng: np.random.Generator) -> tuple[Shown, np.ndarray]:
    """A dock of six to sixteen lights, and where (N, 2) they are in the picture."""
    lights = int(rng.integers(6, 17))
    dock = Dock(DIAMETER_M, lights)
    lamps = dock_drawn(rng, circle(even(lights)), dock, share=(0.14, 0.42), tilt_deg=(5, 45))
    return drawn(rng, lamps, background=rng.uniform(3, 40), noise=1.5), lamps.points_px


def compared(seed: int) -> tuple[float, float, np.ndarray]:
    """Errors of the snapped pose and of the search's, over the range; and of exact clicks which (5,) intervals hold."""
    rng = np.random.default_rng([_SEED, seed])
    shown, lamps_px = scene(rng)
    place, normal = shown.position_m, shown.normal
    assert place is not None
    assert normal is not None

    def off(found: Estimate) -> float:
        errors = signed_errors(nearest(found.candidates, normal), place, normal)
        return float(np.linalg.norm(errors[:3]) / place[2])

    by_search = estimate(shown.image, shown.camera, shown.dock)
    clicked = lamps_px + rng.normal(0, _CLICKED_PX, lamps_px.shape)
    snapped = estimate(shown.image, shown.camera, shown.dock, lights_px=clicked, snap=True)
    exact_px = lamps_px + rng.normal(0, EXACT_PX, lamps_px.shape)
    pose = nearest(estimate(shown.image, shown.camera, shown.dock, lights_px=exact_px).candidates, normal)
    sigmas = np.array([*(pose.sigma_position_m or ()), *np.degrees(pose.sigma_theta_rad or ())])
    held = np.abs(signed_errors(pose, place, normal)) <= _INTERVAL * sigmas
    return off(snapped), math.inf if by_search.status != "ok" else off(by_search), held


def same_ellipse(folder: Path, entry: dict[str, Any], rng: np.random.Generator) -> tuple[float, np.ndarray]:
    """By how much the ellipse through lights clicked at a photograph's marks, snapped, is off theirs, of its axis.

    And how far (N, 2) the spots are, in pixels, from marks that people have set.
    """
    image = read(folder / entry["picture"])
    height, width = image.shape[:2]
    focal = width / _LED_FIELD_OF_VIEW
    camera = Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)
    marks = np.array(entry["lights"])
    clicked = marks + rng.normal(0, _AT_MARKS_PX, marks.shape)
    found = estimate(image, camera, Dock(0.10, entry["N"]), lights_px=clicked, snap=True)
    if found.ellipse is None or found.markers is None:
        return math.inf, np.empty((0, 2))
    exact = estimate(image, camera, Dock(0.10, entry["N"]), lights_px=marks, snap=True).markers
    off_px = np.empty((0, 2)) if exact is None else exact.points_px - marks
    theirs, ours = fit_ellipse(marks), found.ellipse
    off = np.subtract((*theirs.centre_px, *theirs.semi_axes_px), (*ours.centre_px, *ours.semi_axes_px))
    return float(np.abs(off).max() / theirs.semi_axes_px[0]), off_px[(off_px != 0).any(axis=1)]


def test_in_drawn_scenes_lights_set_by_hand_are_as_good_as_the_search() -> None:
    with get_context("spawn").Pool() as pool:
        rows = pool.map(compared, range(_SCENES))
    snapped, searched, held = (np.array(each) for each in zip(*rows, strict=True))
    both = np.isfinite(searched)
    ratio = float(np.median(snapped[both]) / np.median(searched[both]))
    print(f"\n{both.sum()} of {_SCENES} found by the search; error snapped / searched {ratio:.3f}")
    print(
        "95 % intervals of exact clicks hold, x y z pitch yaw:",
        *(f"{100 * share:.0f} %" for share in held.mean(axis=0)),
    )
    assert ratio <= 1.1
    assert (held.sum(axis=0) >= at_least(0.92, _SCENES)).all()


def followed(data: Path, name: str) -> tuple[int, int]:
    """Frames of a film of a photograph that are followed and right, whose lights are set in the first alone."""
    films = maker(data)
    entry = json.loads((data / "leds" / "leds.json").read_text("utf-8"))[name]
    picture, lights, radius = films.still(entry)
    height, width = picture.shape[:2]
    focal = width / _LED_FIELD_OF_VIEW
    camera = Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)
    tracker, rng, counts = Tracker(camera, Dock(0.10, entry["N"])), np.random.default_rng(_SEED), np.zeros(2, int)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mkv"
        places = films.film(path, picture, lights, np.random.default_rng(1))
        for frame, there in zip(open_frames(str(path), grey=True), places, strict=True):
            clicked = there + rng.normal(0, _CLICKED_PX, there.shape) if frame.index == 0 else None
            found = tracker.see(frame.image, frame.time_s, lights_px=clicked, snap=True).estimate
            is_followed = found.status == "ok" and found.detection is None
            counts += [is_followed, is_followed and films.is_right(found.to_dict(), there, radius)]
    return int(counts[0]), int(counts[1])


def in_haze(seed: int) -> tuple[bool, int]:
    """Of a drawn film of 60 frames in haze: whether the search finds a frame, and how many are followed.

    Its lamps are half to three times as high as the noise, and set once; a frame counts where the pose is right, too.
    """
    rng = np.random.default_rng([_SEED + 1, seed])
    lights = int(rng.integers(6, 17))
    dock = Dock(DIAMETER_M, lights)
    lamps = dock_drawn(rng, circle(even(lights)), dock, diameters=rng.uniform(4, 12), focal=(0.8, 2))
    assert lamps.position_m is not None
    noise, veil, height = rng.uniform(3, 5), rng.uniform(80, 140), rng.uniform(0.5, 3)
    phases, tracker, found, counts = rng.uniform(0, 6, 2), Tracker(lamps.camera, dock), list[bool](), 0
    for frame in range(_FRAMES):
        shift_px = np.array([6, 4]) * (np.sin(frame / np.array([9, 7]) + phases) - np.sin(phases))
        place_m = lamps.position_m + np.array([*(shift_px * lamps.position_m[2] / lamps.camera.fx), 0])
        moved = replace(lamps, points_px=lamps.points_px + shift_px, position_m=place_m)
        shown = drawn(rng, moved, background=veil, above=noise * height, halos=_HALOS, noise=noise, jpeg=(90, 98))
        clicked = moved.points_px + rng.normal(0, _CLICKED_PX, moved.points_px.shape) if frame == 0 else None
        one = tracker.see(shown.image, frame / 20, lights_px=clicked, snap=True).estimate
        if frame % 10 == 0:
            found.append(estimate(shown.image, shown.camera, shown.dock).status == "ok")
        is_near = one.selected is not None and np.linalg.norm(one.selected.position_m - place_m) < 0.05 * place_m[2]
        counts += bool(is_near and one.found_by in ("hand", "following"))
    return any(found), counts


def main() -> None:
    """Print how far ellipses are off for each marked photograph, and how long a film is followed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True)
    data = parser.parse_args().data
    rng, offs, marks_px = np.random.default_rng(_SEED), dict[str, float](), list[np.ndarray]()
    for path in sorted(data.glob("leds*/leds.json")):
        for name, entry in json.loads(path.read_text("utf-8")).items():
            if "lights" in entry and len(entry["lights"]) >= MIN_POINTS:
                offs[name], off_px = same_ellipse(path.parent, entry, rng)
                marks_px.append(off_px - np.median(off_px, axis=0))  # less how a picture's marks are off as a whole
                print(f"{name:24} {entry['N']:3} lights, {100 * offs[name]:.2f} % off")
    print(f"{sum(off < _SAME for off in offs.values())} of {len(offs)} within {100 * _SAME:.0f} %")
    each = np.abs(np.concatenate(marks_px))
    middle, most = np.median(each, axis=0) / _MIDDLE, np.mean(each < 3 * EXACT_PX)
    print(f"marks are off by {middle[0]:.2f} and {middle[1]:.2f} px, {100 * most:.0f} % by less than {3 * EXACT_PX:g}")
    with get_context("spawn").Pool() as pool:
        films = pool.map(in_haze, range(_FILMS))
    for words, chosen in (("finds", True), ("never finds", False)):
        followed_of = sorted(count for ever, count in films if ever == chosen)
        print(f"in haze, frames of 60 followed in films that the search {words}: {followed_of}")
    print("five_air_b, a film of 60 frames: {} followed, {} right".format(*followed(data, "five_air_b")))


if __name__ == "__main__":
    main()
