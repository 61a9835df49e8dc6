"""Memory over a video of 10,000 frames, and the latency of a live stream."""

import contextlib
import os
import threading
import time
from pathlib import Path
from typing import cast

import av
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.cli import main
from dockpose.app.export.recording import record
from dockpose.app.inputs.pictures import save_dock
from dockpose.simulate import Approach, FilmPlan, Scene, film
from dockpose.simulate.optics.water import preset
from dockpose.simulate.parts import Background, Lights, Pose
from dockpose.sources import Live, open_frames
from dockpose.tracking.tracker import Tracker

from tests.support.streams import MjpegServer

WIDTH, HEIGHT, RATE_HZ = 1280, 720, 30.0
CAMERA = Camera(fx=900.0, fy=900.0, cx=639.5, cy=359.5, width=WIDTH, height=HEIGHT)
DOCK = Dock(0.30, 10)
FRAMES = 300
AT_MOST_LATENCY_MS = 1000 / RATE_HZ
LONG = 10_000  # frames
AT_MOST_GROWTH_MB = 20.0  # between a tenth of the way and its end


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    """An approach from 3 m to 1 m, in which all frames are different."""
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=Pose(position_m=(0.1, -0.05, 1.5), theta_x_deg=10.0, theta_y_deg=15.0),
        lights=Lights(level=600.0),
        water=preset("tank"),
        background=Background(level=20.0, gradient_x=15.0),
        seed=1,
    )
    motion = Approach(frames=FRAMES, start_m=3.0, end_m=1.0, rate_hz=RATE_HZ, drift_m=0.02, drift_deg=1.0)
    return [frame.image for frame in film(FilmPlan(scene=scene, motion=motion))]


def write_video(path: Path, pictures: list[np.ndarray], repeat: int = 1) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=int(RATE_HZ), options={"preset": "veryfast"})
        stream = cast("av.VideoStream", stream)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for picture in pictures * repeat:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray")))
        container.mux(stream.encode(None))
    return path


def run(path: Path, out: Path) -> int:
    save_dock(DOCK, path.with_suffix(".yaml"), CAMERA)
    assert main(["estimate", str(path), "--json", str(out)]) == 0
    return len(out.read_text().splitlines())


def resident_mb() -> float:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux's own account of memory")
def test_memory_does_not_grow_with_length(tmp_path, pictures):
    path = write_video(tmp_path / "long.mp4", pictures[:100], repeat=LONG // 100)
    run(write_video(tmp_path / "short.mp4", pictures[:100]), tmp_path / "o.jsonl")
    seen: list[float] = []
    stop = threading.Event()

    def watch() -> None:
        while not stop.wait(0.1):
            seen.append(resident_mb())

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        assert run(path, tmp_path / "o.jsonl") == LONG
    finally:
        stop.set()
        watcher.join()
    tenths = [float(np.median(part)) for part in np.array_split(seen, 10)]
    growth = tenths[-1] - tenths[1]
    print(f"\n{LONG} frames, resident MB in each tenth: {', '.join(f'{mb:.0f}' for mb in tenths)}")
    print(f"growth from the second tenth to the last {growth:.1f} MB (asked {AT_MOST_GROWTH_MB:g})")
    assert growth <= AT_MOST_GROWTH_MB


@pytest.mark.parametrize("records", [False, True], ids=["without recording", "recording"])
def test_latency_of_a_live_stream(tmp_path, pictures, records):
    """From sending each frame to its result, without the first ten."""
    marked = [mark(picture, number) for number, picture in enumerate(pictures)]
    tracker, took_ms = Tracker(CAMERA, DOCK), []
    with MjpegServer(marked, RATE_HZ) as server, contextlib.closing(open_frames(server.address, grey=True)) as frames:
        assert isinstance(frames, Live)
        kept = record(frames, tmp_path / "kept.mkv", print) if records else None
        for frame in frames:
            number = number_of(frame.image)
            assert tracker.see(frame.image, frame.time_s).estimate.status == "ok"
            took_ms.append(1000 * (time.monotonic() - server.sent_s[number]))
            if len(took_ms) >= 200 or number >= FRAMES - 5:
                break
        if kept is not None:
            kept.close()
            assert kept.missing == 0
    median, slow = np.percentile(took_ms[10:], [50, 95])
    print(f"\nlatency: median {median:.1f} ms, 95 % {slow:.1f} ms (asked {AT_MOST_LATENCY_MS:.0f} ms)")
    assert slow <= AT_MOST_LATENCY_MS


def mark(picture: np.ndarray, number: int) -> np.ndarray:
    """The picture with its number as nine dim fields in a corner, to tell which one came."""
    marked = picture.copy()
    for place in range(9):
        marked[:16, 16 * place : 16 * place + 16] = 35 if number >> place & 1 else 5
    return marked


def number_of(image: np.ndarray) -> int:
    fields = [float(image[4:12, 16 * place + 4 : 16 * place + 12].mean()) > 20 for place in range(9)]
    return sum(1 << place for place, is_set in enumerate(fields) if is_set)
