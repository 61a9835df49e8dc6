"""The rows of the study: what every method makes of a scene, beside all that was drawn for it."""

import math

import numpy as np
from dockpose.estimate import Estimate, estimate
from dockpose.settings import Settings
from dockpose.study.draw import Drawn, Picture, draw, picture_of
from dockpose.study.judge import Value, judge
from dockpose.thresholds import METHODS as THRESHOLDS

PRODUCT, HATS = "hats_and_local", "hats"
RIVALS = ("otsu", "kapur", "kittler", "sezan")  # those of the paper


def methods() -> list[str]:
    """The program's default first, then all that are registered but a fixed level, which no one sets for each scene."""
    return [PRODUCT, *(name for name in THRESHOLDS if name != "fixed")]


def title_of(label: str) -> str:
    """A method's name for people."""
    title = THRESHOLDS.title(HATS if label == PRODUCT else label).partition(" (")[0]
    return f"{title} + local" if label == PRODUCT else title


def find(label: str, picture: Picture) -> Estimate:
    """Find the dock in a picture by a method, given the camera, the diameter and the number of lights."""
    scene, settings = picture.scene, Settings(method=HATS if label == PRODUCT else label)
    return estimate(picture.image, scene.camera, scene.dock, settings, fall_back=label == PRODUCT)


Row = dict[str, Value]
ELAPSED = "elapsed_ms"  # the only number that is timed
DIGITS = 6  # of numbers in files; leaves out the last digits, which differ between machines' linear algebra
_OF_WATER = ("absorption_per_m", "scattering_per_m", "attenuation_per_m")
_OF_SENSOR = ("read_noise_levels", "electrons_per_level", "blur_px", "motion_blur_px", "vignetting", "jpeg_quality")


def scene_rows(seed: int, index: int) -> list[Row]:
    """Draw and render scene ``index`` of the study with a seed, and try every method on it."""
    drawn = draw(seed, index)
    picture = picture_of(drawn)
    factors = {"scene": index, "seed": seed, **factors_of(drawn, picture)}
    rows = []
    for label in methods():
        found = find(label, picture)
        judged = judge(found, picture.truth, picture.scene.dock.radius, has_dock=drawn.has_dock)
        rows.append({**factors, "method": label, **judged, ELAPSED: round(found.elapsed_ms, 3)})
    return rows


def factors_of(drawn: Drawn, picture: Picture) -> Row:
    """All that was drawn for a scene, by name with units."""
    scene, truth = picture.scene, picture.truth
    camera, sensor, background, water = scene.camera, scene.sensor, scene.background, scene.water
    range_m = float(np.linalg.norm(truth.position_m))
    spacing = 2 * math.pi * scene.dock.radius / (scene.dock.lights or 1)
    cosine = float(-truth.normal @ truth.position_m) / range_m
    return {
        "has_dock": drawn.has_dock,
        "width_px": camera.width,
        "height_px": camera.height,
        "focal_px": camera.fx,
        "focal_widths": camera.fx / camera.width,
        "diameter_m": scene.dock.diameter,
        "range_m": range_m,
        "range_diameters": range_m / scene.dock.diameter,
        "attenuation_lengths": water.attenuation_per_m * range_m,
        "ring_radius_px": camera.fx * scene.dock.radius / float(truth.position_m[2]),
        "tilt_deg": math.degrees(math.acos(max(-1.0, min(1.0, cosine)))),
        "turbidity": drawn.turbidity,
        **{name: getattr(water, name) for name in _OF_WATER},
        "ambient_levels": background.level,
        "gradient_levels": math.hypot(background.gradient_x, background.gradient_y),
        "brightest_levels": drawn.brightest,
        "lit_share": picture.lit_share,
        "saturated_share": picture.saturated_share,
        **{name: getattr(sensor, name) for name in _OF_SENSOR},
        "lights": scene.dock.lights,
        "missing": len(scene.lights.missing),
        "lights_in_view": int(truth.visible.sum()),
        "lamp_spacings": scene.lights.radius_m / spacing,
        "strays": drawn.strays,
        "has_text": bool(scene.texts),
        "has_mirror": scene.mirror is not None,
        "snow_flakes": 0 if scene.snow is None else scene.snow.count,
    }


def as_text(value: Value) -> str:
    """A value in a file: nothing for None, 0 or 1 for truth values, numbers with ``DIGITS`` significant digits."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
