"""From a slider to the picture in the browser, from the command to the first page, and memory while sliders move."""

from __future__ import annotations

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
from dockpose import Camera, Dock
from dockpose.camera.files import save_camera
from dockpose.simulate import Pose, Scene, render
from dockpose.simulate.optics.water import preset
from dockpose.simulate.parts import Background, Lights

from tests.browser.conftest import Page

MOVES = 80
DRAG_PX, PAUSE_MS = 2, 160
MEDIAN_MS, SLOW_MS = 50.0, 120.0  # median and 95th percentile at 1280 x 720; a simulated 640 x 480 may take twice that
FIRST_PAGE_S = 3.0
MEMORY_S = 600.0  # how long sliders move while memory is watched
WARM_UP = 0.4  # of that time, in which caches still fill
GROWTH_MB = 25.0  # at most, from the warm-up to the end, on either side

# Times, in the page's own clock, from a slider's movement to the next frame drawn after the annotated picture changed.
_WATCH = """
() => {
  const isWatched = window.delays !== undefined;
  window.delays = [];
  if (isWatched) return;
  let moved = null;
  const now = () => { moved = performance.now(); };
  document.addEventListener("keydown", now, true);
  document.addEventListener("pointermove", now, true);
  const shown = [...document.querySelectorAll("img[src^=blob]")].find((one) => one.offsetParent !== null);
  new MutationObserver(() => {
    const began = moved;
    moved = null;
    if (began === null) return;
    shown.decode().catch(() => {}).then(() => requestAnimationFrame(() => {
      window.delays.push(performance.now() - began);
    }));
  }).observe(shown, { attributes: true, attributeFilter: ["src"] });
}
"""


class Served:
    """``dockpose serve`` in a process of its own, as its users run it."""

    def __init__(self, settings_folder: Path, *arguments: str) -> None:
        environment = os.environ | {"XDG_CONFIG_HOME": str(settings_folder)}
        self.began = time.perf_counter()
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


@pytest.fixture
def large(tmp_path) -> list[str]:
    """Arguments for a picture of 1280 x 720."""
    camera = Camera(1400, 1400, 639.5, 359.5, 1280, 720)
    scene = Scene(
        camera=camera,
        dock=Dock(0.30, 10),
        pose=Pose(position_m=(0.1, -0.05, 1.5), theta_x_deg=15.0, theta_y_deg=20.0),
        lights=Lights(level=600.0),
        water=preset("tank"),
        background=Background(level=20.0, gradient_x=15.0),
        seed=1,
    )
    cv2.imwrite(str(tmp_path / "large.png"), render(scene)[0])
    save_camera(camera, tmp_path / "camera.yaml")
    picture, of_camera = str(tmp_path / "large.png"), str(tmp_path / "camera.yaml")
    return [picture, "--camera", of_camera, "--dock-diameter", "0.30", "--lights", "10"]


@contextmanager
def opened(browser, served: Served) -> Iterator[Page]:
    """The page, settled; closed afterwards in any case, since a page left open slows the next one down."""
    page = Page(browser.new_page(viewport={"width": 1366, "height": 768}), served)
    try:
        page.open()
        page.page.get_by_role("button", name="Start").click()  # puts the words of the first opening away
        page.page.wait_for_timeout(3000)
        yield page
    finally:
        page.page.close()


def drag_ms(page: Page, label: str, moves: int, first_px: float) -> np.ndarray:
    """Time from each of so many moves of a slider's thumb, dragged to and fro with the mouse, to its picture."""
    thumb = page.slider(label).bounding_box()
    assert thumb is not None
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.page.evaluate(_WATCH)
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    for move in range(moves):
        x += first_px if move % 40 < 20 else -first_px
        page.page.mouse.move(x, y)
        page.page.wait_for_timeout(PAUSE_MS)
    page.page.mouse.up()
    page.page.wait_for_timeout(1000)
    return np.array(page.page.evaluate("() => window.delays"))


def keys_ms(page: Page, label: str, moves: int) -> np.ndarray:
    """Time from each of so many arrow keys on a slider to its picture."""
    slider = page.slider(label)
    page.page.evaluate(_WATCH)
    slider.focus()
    for move in range(moves):
        page.page.keyboard.press("ArrowRight" if move % 40 < 20 else "ArrowLeft")
        page.page.wait_for_timeout(PAUSE_MS)
    page.page.wait_for_timeout(1000)
    return np.array(page.page.evaluate("() => window.delays"))


def tell(what: str, delays: np.ndarray, moves: int, factor: float) -> tuple[float, float]:
    median, slow = float(np.median(delays)), float(np.quantile(delays, 0.95))
    print(
        f"\n{what:31} | median {median:5.1f} ms (asked {factor * MEDIAN_MS:.0f}) | 95 % {slow:5.1f} ms "
        f"(asked {factor * SLOW_MS:.0f}) | {len(delays)} pictures for {moves} moves"
    )
    return median, slow


def report(what: str, delays: np.ndarray, moves: int, factor: float) -> None:
    median, slow = tell(what, delays, moves, factor)
    assert len(delays) >= 0.9 * moves
    assert median <= factor * MEDIAN_MS
    assert slow <= factor * SLOW_MS


def test_slider_to_picture_at_1280_x_720(browser, serve, large):
    with opened(browser, serve(*large)) as page:
        keys = keys_ms(page, "Level (0-255)", MOVES)
        drags = drag_ms(page, "Level (0-255)", MOVES, -DRAG_PX)
    # After a key Chromium holds messages back until its own frame for that key is shown, so keys take longer.
    tell("level by keys, 1280 x 720", keys, MOVES, 1)
    report("level dragged, 1280 x 720", drags, MOVES, 1)


def test_slider_to_simulated_picture_at_640_x_480(browser, serve):
    with opened(browser, serve()) as page:
        page.page.get_by_text("Pose of the dock", exact=True).click()
        page.box("Dock z (cm)").fill("140")
        page.page.wait_for_timeout(3000)
        keys = keys_ms(page, "Dock z (cm)", MOVES)
        drags = drag_ms(page, "Dock z (cm)", MOVES, DRAG_PX)
    tell("simulated z by keys, 640 x 480", keys, MOVES, 2)
    report("simulated z dragged, 640 x 480", drags, MOVES, 2)


def test_first_page_with_a_result(browser, serve):
    times = []
    for _ in range(3):
        served = serve()
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto(served.address)
        page.locator("#candidates tbody tr td").first.wait_for()
        times.append(time.perf_counter() - served.began)
        page.close()
    print(f"\ncommand to first result       | {', '.join(f'{one:.2f}' for one in times)} s (asked {FIRST_PAGE_S:.0f})")
    assert min(times[1:]) <= FIRST_PAGE_S


def test_memory_while_sliders_move(browser, serve, large):
    served = serve(*large)
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
