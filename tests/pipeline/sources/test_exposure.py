"""That the exposure is judged as the simulator's light before it was cut off and made noisy says."""

import math
import re

import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.simulate import Lights, Pose, Scene, Sensor, render, truth_of
from dockpose.simulate.optics.glow import light_of
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Background
from dockpose.simulate.render import background_picture
from dockpose.sources import ExposureWatch, Frame
from dockpose.sources.exposure import exposure_hint

CAMERA = Camera(fx=700.0, fy=700.0, cx=319.5, cy=239.5, width=640, height=480)
# Where half of the lights are at the limit, a few pixels or a deviation of the noise decide: there either is right.
LONGER = "if the dock is in view, double the exposure"
CUT_EITHER, CONTRAST_EITHER = (0.35, 0.65), (6.0, 10.5)


def scene_of(seed: int) -> Scene:
    """Four to 24 lamps of any size, from far too dim to far too bright, in front of dark or lit water."""
    rng = np.random.default_rng(seed)
    lights, z_m = int(rng.integers(4, 25)), rng.uniform(0.7, 1.6)
    return Scene(
        camera=CAMERA,
        dock=Dock(0.30, lights=lights),
        pose=Pose(
            position_m=(rng.uniform(-0.1, 0.1) * z_m, rng.uniform(-0.1, 0.1) * z_m, z_m),
            theta_x_deg=rng.uniform(-25, 25),
            theta_y_deg=rng.uniform(-25, 25),
            roll_deg=rng.uniform(0, 90),
        ),
        lights=Lights(
            level=math.exp(rng.uniform(math.log(8), math.log(8000))),
            radius_m=rng.uniform(0.002, 0.006),
            brightness=tuple(rng.uniform(0.8, 1.2, lights).tolist()),
        ),
        water=water_of_turbidity(rng.uniform(0, 0.5)),
        background=Background(level=rng.uniform(2, 40)),
        sensor=Sensor(read_noise_levels=rng.uniform(0.3, 3)),
        seed=seed,
    )


def middle_light(scene: Scene) -> tuple[float, float]:
    """Middle light's share of what is cut off of its core, and its height in deviations of the noise."""
    truth, found = truth_of(scene), []
    light = sum(light_of(scene), background_picture(scene, scene.water))
    for x, y in np.rint(truth.lights_px[truth.visible]).astype(int):
        near = light[max(0, y - 12) : y + 13, max(0, x - 12) : x + 13]
        around = light[max(0, y - 25) : y + 26, max(0, x - 25) : x + 26]
        water, peak = np.percentile(around, 20), min(light[y - 3 : y + 4, x - 3 : x + 4].max(), 255.0)
        core = near[near >= (water + peak) / 2]
        noise = math.sqrt(water / scene.sensor.electrons_per_level + scene.sensor.read_noise_levels**2 + 1 / 12)
        found.append((np.mean(core >= 254.5), (peak - water) / noise))
    cut, contrast = np.median(found, axis=0).tolist()
    return cut, contrast


@pytest.mark.slow
def test_lights_are_called_saturated_or_drowned_where_they_are_and_good_in_between():
    seen = {"saturated": 0, "drowned": 0, "good": 0}
    for seed in range(36):
        scene = scene_of(seed)
        cut, contrast = middle_light(scene)
        if CUT_EITHER[0] < cut < CUT_EITHER[1] or CONTRAST_EITHER[0] < contrast < CONTRAST_EITHER[1]:
            continue
        image, _ = render(scene)
        hint = exposure_hint(image, estimate(image, scene.camera, scene.dock))
        wanted = "saturated" if cut >= CUT_EITHER[1] else "drowned" if contrast <= CONTRAST_EITHER[0] else "good"
        if hint.verdict in ("unknown", "dark"):
            assert wanted == "drowned", seed  # so dim that no dock was found
            continue
        assert hint.verdict == wanted, (seed, cut, contrast, hint)
        assert bool(hint.sentence) == (wanted != "good")
        seen[wanted] += 1
    assert min(seen.values()) >= 3, seen


def spots(peak: float, noise: float = 0.0, water: float = 20.0, kind: type = np.uint8) -> np.ndarray:
    """Ten Gaussian spots of two pixels' deviation, on a ring, of that height before they are cut off."""
    y, x = np.mgrid[:480, :640]
    levels = np.full((480, 640), water)
    for angle in 2 * np.pi * np.arange(10) / 10:
        levels += peak * np.exp(-((x - 320 - 120 * np.cos(angle)) ** 2 + (y - 240 - 120 * np.sin(angle)) ** 2) / 8)
    levels += noise * np.random.default_rng(0).standard_normal(levels.shape)
    top = np.iinfo(kind).max
    return np.clip(np.rint(levels * (top / 255)), 0, top).astype(kind)


def hint_of(image):
    return exposure_hint(image, estimate(image, CAMERA, Dock(0.30, 10)))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize(
    ("peak", "sentence"),
    [
        (150, ""),
        (300, ""),  # a few pixels of each
        (600, "10 of 10 lights are saturated: halve the exposure."),
        (2500, "10 of 10 lights are saturated: take a quarter of the exposure."),
    ],
)
def test_what_to_do_about_saturated_lights(kind, peak, sentence):
    assert hint_of(spots(peak, kind=kind)).sentence == sentence


def test_colour_counts_by_its_brightest_channel():
    grey = spots(600)
    assert hint_of(np.dstack([grey // 8, grey // 8, grey])).verdict == "saturated"


@pytest.mark.parametrize(
    ("water", "what"), [(20.0, "double the exposure, or have"), (160.0, "have brighter lamps, or")]
)
def test_what_to_do_about_drowned_lights(water, what):
    hint = hint_of(spots(20, noise=4.0, water=water))
    assert hint.verdict == "drowned"
    assert re.match(r"(\d+) of \1 lights hardly stand out of the water, by \d times its noise: ", hint.sentence)
    assert what in hint.sentence


@pytest.mark.parametrize(
    ("level", "verdict", "words"),
    [
        (30, "dark", f"The picture is dark, its brightest level 30 of 255: {LONGER}."),
        (120, "unknown", ""),
        (255, "saturated", "100 % of the picture is saturated: halve the exposure."),
    ],
)
def test_pictures_without_a_dock(level, verdict, words):
    hint = hint_of(np.full((480, 640), level, np.uint8))
    assert (hint.verdict, hint.sentence) == (verdict, words)


def test_a_hint_comes_once_when_it_holds_for_a_while():
    watch, dock = ExposureWatch(), Dock(0.30, 10)
    bright, good = ((Frame(image, 0, 0.0, ""), estimate(image, CAMERA, dock)) for image in (spots(600), spots(150)))
    assert not any(watch.see(*(bright if number % 10 == 0 else good)) for number in range(40))
    said = [watch.see(*bright) for _ in range(60)]
    assert [text for text in said if text] == ["10 of 10 lights are saturated: halve the exposure."]
    assert watch.hint.verdict == "saturated"
    assert not any(watch.see(*good) for _ in range(30))
    assert watch.hint.verdict == "good"
    assert not any(watch.see(*bright) for _ in range(30))
