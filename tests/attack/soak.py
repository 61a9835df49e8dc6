"""Twenty browsers on a page that plays a 720p video with its sliders moving: ``python -m tests.attack.soak``.

Five never read; one is stopped for a while as by SIGSTOP and goes on. Memory is to stay within 5 % of what it is after
the first minute, and threads and open files are to be those of before, once the browsers have left.
"""

import argparse
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median

import av
import cv2
import numpy as np

from tests.attack.program import Program
from tests.attack.report import write_table
from tests.support.visitors import Visitor

READERS, DEAF, RATE_HZ = 14, 5, 10
SETTLED_S, WINDOW_S, MOST_GROWTH = 60.0, 20.0, 0.05
STOPPED_S = 15.0
LEAST_MINUTES_TO_TELL = 30.0  # of a soak whose table SECURITY.md shows
BEGIN = "<!-- make soak writes this table -->"
LEAST_RATE_HZ = 1.0  # frames shown; a page without a graphics card and twenty browsers share the cores
_FRAME = re.compile(r'"at":(\d+)')


def write_video(path: Path, seconds: float) -> None:
    """A ring of ten lights that sways, 1280 x 720, H.264."""
    frames = []
    for phase in np.linspace(0, 2 * np.pi, 40, endpoint=False):
        image = np.full((720, 1280), 20, np.uint8)
        for angle in np.arange(10) * 2 * np.pi / 10:
            x, y = 640 + 60 * np.sin(phase) + 150 * np.cos(angle), 360 + 140 * np.sin(angle)
            cv2.circle(image, (round(x), round(y)), 6, 255, -1, cv2.LINE_AA)
        frames.append(av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p"))
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", RATE_HZ, options={"preset": "ultrafast"})
        stream.width, stream.height, stream.pix_fmt = 1280, 720, "yuv420p"
        for number in range(round(seconds * RATE_HZ)):
            frame = frames[number % len(frames)]
            frame.pts = number
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))


class Drain(Visitor):
    """A browser that reads all and looks at nothing."""

    def _read(self):
        with contextlib.suppress(Exception):
            while True:
                self.bytes_read += len(self.socket.recv(decode=False))


def move_sliders(page: Visitor, is_over: threading.Event) -> None:
    number = 0
    while not is_over.wait(0.1) and page.is_open:
        number += 1
        page.set("Min. area (px)", 2 + number % 9)
        page.set("Level (0-255)", 100 + number % 50)


def soak(minutes: float) -> int:
    """Run it; returns the exit status."""
    is_over, faults = threading.Event(), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        video = folder / "sway.mp4"
        write_video(video, 60 * minutes + 60)
        dock = ("--dock-diameter", "0.30", "--lights", "10")
        camera = folder / "camera.yaml"
        camera.write_text(_CAMERA, encoding="utf-8")
        longest_s = 60 * minutes + 300
        with Program(folder, str(video), "--camera", str(camera), *dock, longest_s=longest_s) as program:
            with Visitor(program.address) as first:  # what is made with the first browser stays
                assert first.is_replayed.wait(30)
                time.sleep(3)
            time.sleep(3)
            threads, handles = program.threads, program.handles
            mover = Visitor(program.address)
            assert mover.is_replayed.wait(30)
            drains = [Drain(program.address) for _ in range(READERS - 1)]
            deaf = [Visitor(program.address, reads=False) for _ in range(DEAF)]
            command = [sys.executable, "-m", "tests.attack.soak", "--read", program.address]
            stopped = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
            shown: set[int] = set()
            mover.hears = lambda message: shown.update(frames_in(message))
            mover.set("Done on the page", json.dumps({"do": "play", "number": 1}))
            threading.Thread(target=move_sliders, args=(mover, is_over), daemon=True).start()
            memory = watched(program, stopped, deaf, minutes)
            if not all(one.is_open for one in (mover, *drains)):
                faults.append("a browser that reads was closed")
            heard = f"{mover.messages_read} messages, {mover.bytes_read / 1e6:.0f} MB"
            is_over.set()
            stopped.terminate()
            stopped.wait(10)
            for one in (mover, *drains, *deaf):
                one.close()
            threads_left, handles_left = came_back(program, threads, handles)
            lines = [line for line in program.lines() if " ERROR " in line]
    settled = [size for at_s, size in memory if SETTLED_S <= at_s < SETTLED_S + WINDOW_S]
    last = [size for at_s, size in memory if at_s >= memory[-1][0] - WINDOW_S]
    growth = median(last) / median(settled) - 1
    rows = (
        ("Minutes, browsers", f"{minutes:g}, {READERS + DEAF + 1}"),
        ("Sent to one of them", heard),
        ("Frames shown", f"{len(shown)}"),
        ("Memory after a minute, at the end", f"{_mb(settled)}, {_mb(last)} ({growth:+.1%})"),
        ("Threads before, after", f"{threads}, {threads_left}"),
        ("Open files before, after", f"{handles}, {handles_left}"),
    )
    table = "\n".join(("| What | Measured |", "|---|---|", *(f"| {what} | {told} |" for what, told in rows)))
    print(table)
    if minutes >= LEAST_MINUTES_TO_TELL:
        write_table(BEGIN, lambda _: table)
    faults += [f"memory grew by {growth:.1%}"] * (growth > MOST_GROWTH)
    faults += ["the video did not play"] * (len(shown) < 60 * minutes * LEAST_RATE_HZ)
    faults += ["threads stay"] * (threads_left > threads + 32)  # the library's pool has up to 32, whoever is there
    faults += ["open files stay"] * (handles_left > handles)
    faults += [f"{len(lines)} errors in the log, as {lines[0]}"] if lines else []
    for fault in faults:
        print(f"fault: {fault}", file=sys.stderr)
    return 1 if faults else 0


def _mb(sizes: list[int]) -> str:
    return f"{median(sizes) / 1e6:.0f} MB"


def watched(program, stopped, deaf, minutes) -> list[tuple[float, int]]:
    """The program's memory every second; meanwhile one browser is stopped, and those that were cut off come again."""
    began_s, memory = time.monotonic(), []
    while (at_s := time.monotonic() - began_s) < 60 * minutes:
        memory.append((at_s, program.memory_bytes))
        phase = at_s % (4 * STOPPED_S)
        os.kill(stopped.pid, signal.SIGSTOP if phase < STOPPED_S else signal.SIGCONT)
        for index, one in enumerate(deaf):
            if not one.is_open:
                deaf[index] = Visitor(program.address, reads=False)
        time.sleep(1)
    os.kill(stopped.pid, signal.SIGCONT)
    return memory


def frames_in(message: dict) -> list[int]:
    """Numbers of the frames of the video that a message to the page shows."""
    content = str(message.get("updates", {}).get("content", ""))
    return [int(number) for number in _FRAME.findall(content)]


def came_back(program, threads, handles):
    end_s = time.monotonic() + 45  # who never read is given up after 40 s
    while (program.handles > handles or program.threads > threads) and time.monotonic() < end_s:
        time.sleep(0.5)
    return program.threads, program.handles


_CAMERA = """\
image_width: 1280
image_height: 720
camera_matrix: {rows: 3, cols: 3, data: [900, 0, 639.5, 0, 900, 359.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0, help="at least 1.7 (default: 30)")
    parser.add_argument("--read", metavar="ADDRESS", help="be a browser that reads, and comes again when it is closed")
    arguments = parser.parse_args()
    if arguments.read:
        while True:
            page = Drain(arguments.read)
            while page.is_open:
                time.sleep(0.2)
    return soak(arguments.minutes)


if __name__ == "__main__":
    sys.exit(main())
