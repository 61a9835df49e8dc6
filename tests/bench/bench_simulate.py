"""What a simulated picture costs: one scene at most 60 ms, growing with its pixels and not with pixels times lights."""
# All times are the best of several in this run, beside OpenCV's Gaussian blur of the same picture.

import time
from collections.abc import Callable

import cv2
import msgspec
import pytest
from dockpose import Camera, Dock
from dockpose.simulate import Lights, Pose, Scene, render
from dockpose.simulate.optics.psf import Psf

MOST_MS = 60.0
SIZES = ((320, 240), (640, 480), (1280, 720), (1920, 1080))
COUNTS = (1, 10, 100)
REPEATS = 7


def scene(width: int, height: int, lights: int) -> Scene:
    """A tilted ring of so many lights that fills half the picture's height; one of them alone for ``lights`` 1."""
    camera = Camera(1.5 * height, 1.5 * height, (width - 1) / 2, (height - 1) / 2, width, height)
    return Scene(
        camera=camera,
        dock=Dock(0.3, max(lights, 3)),
        pose=Pose(position_m=(0.02, 0.01, 0.9), theta_x_deg=10.0, theta_y_deg=-20.0),
        lights=Lights(level=900.0, missing=(1, 2) if lights == 1 else ()),
        psf=Psf(model="voss"),
    )


def best_ms(call: Callable[[], object]) -> float:
    """Shortest of several times; the first call, which fills caches, does not count."""
    call()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1000 * min(times)


def render_ms(width: int, height: int, lights: int) -> float:
    drawn = scene(width, height, lights)
    return best_ms(lambda: render(drawn))


def blur_ms(width: int, height: int) -> float:
    image, _ = render(scene(width, height, 10))
    return best_ms(lambda: cv2.GaussianBlur(image, (0, 0), 10))


def test_one_scene_feels_live() -> None:
    took, blur = render_ms(640, 480, 10), blur_ms(640, 480)
    print(f"\n640 x 480, ten lights, Voss: {took:.1f} ms (at most {MOST_MS:.0f}), {took / blur:.1f} Gaussian blurs")
    assert took <= MOST_MS


def test_cost_grows_with_pixels_and_not_with_pixels_times_lights() -> None:
    print("\nmilliseconds a picture, Voss                       us a pixel  the 2nd to 100th light's us")
    print("size         " + "".join(f"{count:>4} lights" for count in COUNTS) + "    blur   (10 lights)  (each)")
    each_us = {}
    per_pixel_us = {}
    for width, height in SIZES:
        times = [render_ms(width, height, count) for count in COUNTS]
        each_us[width] = 1000 * (times[2] - times[0]) / 99
        per_pixel_us[width] = 1000 * times[1] / (width * height)
        shown = "".join(f"{took:11.1f}" for took in times)
        name = f"{width} x {height}"
        print(f"{name:13}{shown}{blur_ms(width, height):8.1f}{per_pixel_us[width]:14.3f}{each_us[width]:8.0f}")
    # 27 times the pixels: were the cost their product with the lights, each further light would cost 27 times as much.
    assert each_us[1920] < 8 * max(each_us[320], 50.0)
    assert per_pixel_us[1920] < 2 * per_pixel_us[640]


@pytest.mark.parametrize("model", ["voss", "hou", "hou_poisson", "gaussian"])
def test_no_model_is_slower(model: str) -> None:
    drawn = msgspec.structs.replace(scene(640, 480, 10), psf=Psf(model=model))
    took = best_ms(lambda: render(drawn))
    print(f"\n640 x 480, ten lights, {model}: {took:.1f} ms")
    assert took <= MOST_MS
