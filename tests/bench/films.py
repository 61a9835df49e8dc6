"""Films made of photographs of rings that move, by the data's own ``leds/films.py``: frames right, and their time."""

from __future__ import annotations

import importlib.util
import json
import math
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from types import ModuleType

import av
import cv2
import numpy as np
from dockpose import Camera, Dock, Settings, open_frames
from dockpose.app.processing.following import Following
from dockpose.camera.files import save_camera

SEEDS = (1, 2, 3)
MAKER = Path("leds") / "films.py"
_WIDE = 1.1547  # the picture's width over the focal length that is taken


def report(data: Path, pool: Executor) -> dict[str, float]:
    """Print a line for each film; returns how many frames are right of the worst seed, by names with floors."""
    if not (data / MAKER).is_file():
        print(f"\n{data / MAKER} is not there: no films were scored.")
        return {}
    names = maker(data).NAMES
    scores = list(pool.map(scored, *zip(*[(data, name, seed) for name in names for seed in SEEDS], strict=True)))
    print("\nFilms of photographed rings: frames right by seed, time beside decoding and ArUco, followed")
    figures: dict[str, float] = {}
    for name, of_film in zip(names, _chunks(scores, len(SEEDS)), strict=True):
        rights, ratios, followed = zip(*of_film, strict=True)
        print(
            f"  {name:12} {', '.join(map(str, rights))} of 60; {np.median(ratios):.2f} times; {sum(followed)} followed"
        )
        figures[f"films, {name} right"] = min(rights)
    return figures


def scored(data: Path, name: str, seed: int) -> tuple[int, float, int]:
    """Frames right, time of a frame over that of decoding and ArUco, and frames followed, of one film."""
    cv2.setNumThreads(1)
    films = maker(data)
    entry = json.loads((data / "leds" / "leds.json").read_text("utf-8"))[name]
    picture, lights, radius = films.still(entry)
    following = Following(_camera(picture), Dock(diameter=0.10, lights=entry["N"]), Settings(), lambda text: None)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    right, followed, ours_s, tags_s = 0, 0, [], []
    with tempfile.TemporaryDirectory() as folder:
        truth = films.film(Path(folder) / "film.mkv", picture, lights, np.random.default_rng(seed))
        start = time.perf_counter()
        frames = list(open_frames(str(Path(folder) / "film.mkv"), grey=True))
        decode_s = (time.perf_counter() - start) / len(frames)
    for frame, there in zip(frames, truth, strict=True):
        start = time.perf_counter()
        found = following.see(frame).estimate
        middle = time.perf_counter()
        detector.detectMarkers(frame.image)
        tags_s.append(time.perf_counter() - middle)
        ours_s.append(middle - start)
        right += bool(films.is_right(found.to_dict(), there, radius))
        followed += found.found_by == "following"
    ratio = (decode_s + float(np.median(ours_s))) / (decode_s + float(np.median(tags_s)))
    return right, ratio, followed


def written(data: Path, name: str, folder: Path, frames: int) -> list[str]:
    """Write a film of so many frames and its camera file; returns the arguments that name both, and the dock."""
    films = maker(data)
    entry = json.loads((data / "leds" / "leds.json").read_text("utf-8"))[name]
    picture, lights, _ = films.still(entry)
    films.film(folder / f"{name}.mkv", picture, lights, np.random.default_rng(SEEDS[0]), frames)
    save_camera(_camera(picture), folder / f"{name}.camera.yaml")
    known = ["--camera", str(folder / f"{name}.camera.yaml"), "--dock-diameter", "0.10", "--lights", str(entry["N"])]
    return [str(folder / f"{name}.mkv"), *known]


def as_h264(path: str) -> str:
    """Write a film again as cameras do, beside it; returns where. Lossless, a frame takes 27 ms to decode, not 3."""
    written = path.replace(".mkv", ".mp4")
    with av.open(path) as film, av.open(written, "w") as out:
        there = film.streams.video[0]
        stream = out.add_stream("libx264", rate=there.average_rate, options={"crf": "20", "preset": "veryfast"})
        stream.width, stream.height, stream.pix_fmt = there.width, there.height, "yuv420p"
        for frame in film.decode(there):
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
    return written


def _camera(picture: np.ndarray) -> Camera:
    """A camera that sees 60 degrees across."""
    height, width = picture.shape[:2]
    f = width / _WIDE
    return Camera(fx=f, fy=f, cx=(width - 1) / 2, cy=(height - 1) / 2, width=width, height=height)


def maker(data: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("dockpose_films", data / MAKER)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _chunks(values: Sequence[tuple[int, float, int]], size: int) -> Iterator[Sequence[tuple[int, float, int]]]:
    for number in range(math.ceil(len(values) / size)):
        yield values[number * size : (number + 1) * size]
