"""How fast the page follows sliders, plays and opens, and memory while sliders move."""

import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
from dockpose.camera.files import save_camera

from tests.bench.bench_speed import camera, scene
from tests.browser.conftest import Page

MOVES = 80
DRAG_PX, PAUSE_MS = 2, 160
RATE_HZ, PLAYED_FRAMES, TURN_DEG = 30, 240, 0.02  # of the camera, from frame to frame
LEAST_HZ = 25.0
SLIDER_MS, DOCKS_MS = 100.0, 150.0  # from a slider to what follows it, and to both docks in 3D
FIRST_PAGE_S, FIRST_RESULT_S = 1.8, 0.7  # from the command, from navigation
MEMORY_S = 600.0  # how long sliders move while memory is watched
WARM_UP = 0.4  # of that time, in which caches still fill
GROWTH_MB = 25.0  # at most, from the warm-up to the end, on either side

# When each frame was drawn, in the page's own clock, and its number as picture, status and words told it then.
_WATCH_FRAMES = """
() => {
  window.shown = [];
  const ours = document.querySelector("dockpose-picture");
  const told = (selector) => /[fF]rame (\\d+) of/.exec(document.querySelector(selector)?.textContent ?? "")?.[1];
  const numbers = () => [ours.dataset.frame, told("[role=status]"), told("#sequence")];
  const note = () => window.shown.push([performance.now(), ...numbers()]);
  new MutationObserver(() => requestAnimationFrame(note))
    .observe(ours, { attributes: true, attributeFilter: ["data-drawn"] });
}
"""


class Served:
    """``dockpose serve`` in a process of its own, as its users run it."""

    def __init__(self, settings_folder: Path, *arguments: str) -> None:
        # Python keeps what it compiled of the program, as it does for users, but beside the tests.
        kept = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(settings_folder.parent / "bytecode")}
        environment = os.environ | {"XDG_CONFIG_HOME": str(settings_folder)} | kept
        self.began_s = time.time()
        command = [sys.executable, "-m", "dockpose.app.cli", "serve", "--port", "0", *arguments]
        self.process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        self.address = next(word for line in self.process.stderr for word in line.split() if word.startswith("http://"))

    def stop(self) -> None:
        """End it."""
        self.process.terminate()
        self.process.wait(10)
        assert self.process.stderr is not None
        self.process.stderr.close()

    @property
    def memory_mb(self) -> float:
        """Resident memory of the process."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS"):
                return int(line.split()[1]) / 1024
        return 0.0


@pytest.fixture
def serve(tmp_path):
    running: list[Served] = []

    def start(*arguments: str) -> Served:
        running.append(Served(tmp_path / "settings", *arguments))
        return running[-1]

    yield start
    for one in running:
        one.stop()


def rendered(tmp_path, width: int, height: int) -> tuple[np.ndarray, list[str]]:
    """A picture of that size, and the arguments that name its camera and its dock."""
    save_camera(camera((width, height)), tmp_path / "camera.yaml")
    known = ["--camera", str(tmp_path / "camera.yaml"), "--dock-diameter", "0.30", "--lights", "10"]
    return scene((width, height)), known


def still(tmp_path, width: int, height: int) -> list[str]:
    """Arguments for a picture of that size."""
    picture, arguments = rendered(tmp_path, width, height)
    cv2.imwrite(str(tmp_path / "still.png"), picture)
    return [str(tmp_path / "still.png"), *arguments]


def video(tmp_path, width: int, height: int) -> list[str]:
    """Arguments for a video of 30 frames/s in which the camera turns, so that the ring drifts across the picture."""
    picture, arguments = rendered(tmp_path, width, height)
    K = camera((width, height)).matrix
    path = str(tmp_path / "drift.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), RATE_HZ, (width, height))
    for number in range(PLAYED_FRAMES):
        turned = K @ cv2.Rodrigues(np.array([0.0, math.radians(number * TURN_DEG), 0.0]))[0] @ np.linalg.inv(K)
        seen = cv2.warpPerspective(picture, turned, (width, height), borderMode=cv2.BORDER_REPLICATE)
        writer.write(cv2.cvtColor(seen, cv2.COLOR_GRAY2BGR))
    writer.release()
    return [path, *arguments]


@contextmanager
def opened(browser, served: Served) -> Iterator[Page]:
    """The page, settled; closed afterwards in any case, since a page left open slows the next one down."""
    page = Page(browser.new_page(viewport={"width": 1366, "height": 768}), served)
    try:
        page.open()
        page.page.wait_for_timeout(3000)
        yield page
    finally:
        page.page.close()


def drag(page: Page, label: str) -> None:
    """Drag a slider's thumb to and fro with the mouse."""
    thumb = page.slider(label).bounding_box()
    assert thumb is not None
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    for move in range(MOVES):
        x += DRAG_PX if move % 40 < 20 else -DRAG_PX
        page.page.mouse.move(x, y)
        page.page.wait_for_timeout(PAUSE_MS)
    page.page.mouse.up()
    page.page.wait_for_timeout(4000)


def played(page: Page) -> np.ndarray:
    """When each frame was shown (s), and the numbers that picture, status and words told then; from the first on."""
    page.page.evaluate(_WATCH_FRAMES)
    page.page.get_by_role("button", name="Play", exact=True).first.click()
    page.page.wait_for_timeout(1000 * PLAYED_FRAMES / RATE_HZ + 2500)
    frames = page.page.evaluate("() => window.shown")
    return np.array([[time_ms / 1000, *(float(told or 0) for told in numbers)] for time_ms, *numbers in frames])


def tell(what: str, delays: np.ndarray) -> float:
    """Print how long moves took to be followed, those that were; returns the median."""
    delays = delays[~np.isnan(delays)]
    median, slow = float(np.median(delays)), float(np.quantile(delays, 0.95))
    print(f"{what:42} | median {median:6.1f} ms | 95 % {slow:6.1f} ms | {len(delays)} drawn for {MOVES} moves")
    return median


def rate_hz(frames: np.ndarray) -> float:
    """Frames a second over the middle of what was played: the first and the last may be late."""
    times = frames[3:-3, 0]
    return (len(times) - 1) / (times[-1] - times[0])


# When a slider was moved, and when overlay, table and both docks were seen to have changed, in the page's own clock.
_WATCH_ALL = """
() => {
  window.seen = { moved: [], overlay: [], table: [], docks: [] };
  document.addEventListener("pointermove", () => seen.moved.push(performance.now()), true);
  const after = (kind) => requestAnimationFrame(() => seen[kind].push(performance.now()));
  const picture = document.querySelector("dockpose-picture");
  new MutationObserver(() => after("overlay")).observe(picture, { attributeFilter: ["data-drawn"] });
  const table = document.querySelector("dockpose-live[name=candidates]");
  new MutationObserver(() => after("table")).observe(table, { childList: true });
  const hasBoth = ({ target }) => target.querySelectorAll(".disc").length === 2;
  new MutationObserver((changes) => changes.some(hasBoth) && after("docks"))
    .observe(viserPage.sceneBox(), { subtree: true, attributeFilter: ["data-drawn"] });
}
"""


def first_after(moved: np.ndarray, times: np.ndarray) -> np.ndarray:
    """For each move (n,) the time (ms) to the first of ``times`` after it; NaN where none came before the next."""
    places = np.searchsorted(times, moved, side="right")
    delays = np.append(times, np.inf)[places] - moved
    return np.where(delays < np.append(np.diff(moved), PAUSE_MS), delays, np.nan)


def test_slider_to_overlay_and_table_at_640_x_480(browser, serve, tmp_path):
    """Dragging fx and the diameter; the docks in 3D by their light drawing."""
    with opened(browser, serve(*still(tmp_path, 640, 480))) as page:
        page.tab("Tank")
        page.page.evaluate(_WATCH_ALL)
        for label in ("fx (px)", "Diameter (cm)"):
            page.page.evaluate("for (const times of Object.values(seen)) times.length = 0")
            drag(page, label)
            seen = {kind: np.array(times) for kind, times in page.page.evaluate("seen").items()}
            moved = seen["moved"][-MOVES:]
            both = np.maximum(*(first_after(moved, seen[kind]) for kind in ("overlay", "table")))
            docks = first_after(moved, seen["docks"])
            assert tell(f"{label}: overlay and table", both) <= SLIDER_MS
            assert tell(f"{label}: both docks in 3D", docks) <= DOCKS_MS
            assert max(np.isnan(both).sum(), np.isnan(docks).sum()) <= 0.1 * MOVES


@pytest.mark.parametrize(("width", "height"), [(640, 480), (1280, 720)])
def test_playing_30_frames_a_second(browser, serve, tmp_path, width, height):
    """Of 30 at least 25 are shown, and all of the page tells the same frame."""
    with opened(browser, serve(*video(tmp_path, width, height))) as page:
        page.tab("Source")
        frames = played(page)
    differ = int((frames[:, 1:] != frames[:, 1:2]).any(axis=1).sum())
    shown = len(np.unique(frames[:, 1]))
    print(
        f"\n{width} x {height} played | {rate_hz(frames):4.1f} frames/s, {shown} of {PLAYED_FRAMES} shown; "
        f"{differ} updates in which picture, status and words differ"
    )
    assert differ == 0
    assert rate_hz(frames) >= LEAST_HZ


# When the page had a result first, and when all of it was the live page's, each once that was drawn, in its own clock.
_WATCH_FIRST = """
window.first = {};
new MutationObserver(() => {
  const note = (kind, isThere) => {
    if (!isThere || kind in first) return;
    first[kind] = NaN;
    requestAnimationFrame(() => setTimeout(() => { first[kind] = performance.now(); }));
  };
  note("result", document.querySelector("#candidates tbody tr td"));
  note("live", document.querySelector("dockpose-live[name=candidates] td") && !document.getElementById("shell"));
}).observe(document, { childList: true, subtree: true });
"""


def test_first_page_with_a_result(browser, serve):
    figures = []
    for _ in range(4):
        served = serve()
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.add_init_script(_WATCH_FIRST)
        page.goto(served.address)
        page.wait_for_function("() => first.live > 0")
        result, live, origin = page.evaluate("[first.result, first.live, performance.timeOrigin]")
        figures.append(((origin + result) / 1000 - served.began_s, result / 1000, live / 1000))
        page.close()
    best = np.min(figures[1:], axis=0)
    for what, times in zip(
        ("command to first result", "navigation to it", "navigation to the live page"),
        zip(*figures, strict=True),
        strict=True,
    ):
        print(f"\n{what:27} | {', '.join(f'{one:.2f}' for one in times)} s", end="")
    assert best[0] <= FIRST_PAGE_S
    assert best[1] <= FIRST_RESULT_S


def test_memory_while_sliders_move(browser, serve, tmp_path):
    served = serve(*still(tmp_path, 1280, 720))
    with opened(browser, served) as page:
        slider = page.slider("Level (0-255)")
        slider.focus()
        began, samples, moves = time.monotonic(), [], 0
        while (now_s := time.monotonic() - began) < MEMORY_S:
            for _ in range(20):
                page.page.keyboard.press("ArrowRight" if moves % 40 < 20 else "ArrowLeft")
                page.page.wait_for_timeout(70)
                moves += 1
            heap = page.page.evaluate("() => performance.memory.usedJSHeapSize / 2 ** 20")
            samples.append((now_s, served.memory_mb, heap))
    table = np.array(samples)
    warm = table[table[:, 0] >= WARM_UP * MEMORY_S]
    half = len(warm) // 2
    print(f"\n{moves} moves in {MEMORY_S:.0f} s:  second (s)   server (MB)   page's heap (MB)")
    for row in table[:: max(1, len(table) // 8)]:
        print(f"{row[0]:36.0f} {row[1]:13.1f} {row[2]:18.1f}")
    growth = np.median(warm[half:, 1:], axis=0) - np.median(warm[:half, 1:], axis=0)
    print(f"growth after the warm-up: server {growth[0]:+.1f} MB, page {growth[1]:+.1f} MB (at most {GROWTH_MB:.0f})")
    assert growth.max() <= GROWTH_MB
