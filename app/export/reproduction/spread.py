"""Figures 5 to 7: point spread functions, the picture of a lamp through each, and its histogram."""

import math
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np
from dockpose.app.drawing.colours import BARS_COLOUR, BLUE, GREEN, ORANGE, PURPLE, THRESHOLD_COLOUR
from dockpose.app.export.parts import Cell, Part, Rows
from dockpose.app.export.plots import PHOTO_DPI, SMALL, canvas, draw_histogram, show
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.simulate import Lights, Pose, Scene
from dockpose.simulate.optics.glow import light_of
from dockpose.simulate.optics.psf import ANGLES, PointSpread, Psf, point_spread
from dockpose.simulate.optics.water import Water
from dockpose.simulate.parts import Background, Lamp
from dockpose.simulate.render import expose
from dockpose.thresholds import LEVELS
from dockpose.thresholds.histogram import SMOOTHING
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# The published example of Hou et al.: theta0 = 0.03, w0 = 0.87, c r = 5.5; with c = 1 / m that is 5.5 m.
_WATER, _THETA0_RAD, _FAR_M = Water(0.13, 0.87), 0.03, 5.5
_BRIGHTEST = 220.0  # grey levels of the brightest pixel, below saturation
_SIDE_PX, _FOCAL_PX = 161, 700.0
_LAMP_RADIUS_PX = 15.0  # so that the lamp's image is much wider than the lens blurs it
_PEAK_WIDTH = 10  # levels on either side of a peak that belong to it
_DISTANCES_M = (1.0, 3.0, _FAR_M)
_SEEN = (math.radians(0.01) < ANGLES) & (math.radians(60) > ANGLES)
_DRAWS = 3
_WITHIN_DEG = 1.0
_NEAR_M = 1.0  # where c r = 1, and direct light still counts
_TILT_DEG = 50.0
_STYLES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, ":"), (PURPLE, "-."))
_HOU, _POISSON, _VOSS = Psf("hou", theta0_rad=_THETA0_RAD), Psf("hou_poisson", theta0_rad=_THETA0_RAD), Psf()
_HEAD = (
    *("picture", "share of direct light", "share of glow", "of the glow within 1 deg", "peak at level"),
    *("pixels in the peak on the lamp (%)", "pixels in the peak, over those below", "direct light on the lamp (%)"),
)


class _LampPicture:
    """The picture of a lamp (H, W) as the camera stores it, with noise, and its histogram."""

    def __init__(self, scene: Scene, direct: np.ndarray, glow: np.ndarray) -> None:
        self.direct, self.glow = direct, glow  # (H, W): unscattered and scattered light in grey levels, without noise
        self.image = expose((scene.background.level + direct + glow).astype(np.float32), scene)
        is_lamp = direct >= direct.max() / 2  # at least half as much direct light as any
        self.counts = np.bincount(self.image.ravel(), minlength=LEVELS)
        self.counts_of_lamp = np.bincount(self.image[is_lamp], minlength=LEVELS)
        # The highest peak in the upper half of the levels that the picture has, lightly smoothed.
        half = int(self.image.max()) // 2
        self.peak = half + int(np.convolve(self.counts, SMOOTHING, mode="same")[half:].argmax())
        near = np.abs(self.image.astype(int) - self.peak) <= _PEAK_WIDTH
        self.share_of_lamp_in_peak = float(is_lamp[near].mean())
        # Pixels in the peak over those in as many levels just below it.
        width, start = 2 * _PEAK_WIDTH + 1, self.peak - _PEAK_WIDTH
        below = int(self.counts[max(0, start - width) : start].sum())
        self.prominence = int(self.counts[start : start + width].sum()) / below if below else math.inf
        on_lamp = float(direct[is_lamp].sum())
        self.share_of_direct = on_lamp / (on_lamp + float(glow[is_lamp].sum()))


def figure_5(seed: int) -> Part:
    """Hou's function, and the authors' with a Poisson number."""
    spreads = _spreads("Hou", _HOU)
    rng = np.random.default_rng([seed, *b"poisson"])
    drawn = {f"Poisson, draw {k + 1}": point_spread(_POISSON, _WATER, _FAR_M, rng) for k in range(_DRAWS)}
    faintest = min(drawn, key=lambda name: drawn[name].glow_share)  # all of them would hide each other
    hou, poisson = _lamp_pictures(*(_lamp_scene(psf, _FAR_M, seed) for psf in (_HOU, _POISSON)))
    pictures = {"Hou": hou, "Poisson": poisson}
    return Part.of(
        "figure_5",
        {"main": _draw({**spreads, faintest: drawn[faintest]}, pictures)},
        {"main": _table(pictures, {"Hou": spreads[f"Hou, {_FAR_M:g} m"]}), "curves": _curves(spreads)},
        picture=hou,
        mean=_WATER.scattering_per_m * _FAR_M,
        far_m=_FAR_M,
    )


def figure_6(seed: int) -> Part:
    """Voss' function, from the modulation transfer function."""
    spreads, hou = _spreads("Voss", _VOSS), point_spread(_HOU, _WATER, _FAR_M)
    near, _, far = spreads
    places = {far: (_VOSS, _FAR_M), near: (_VOSS, _NEAR_M), "Hou, for comparison": (_HOU, _FAR_M)}
    pictures = {name: _lamp_pictures(_lamp_scene(*place, seed))[0] for name, place in places.items()}
    both = {**spreads, "Hou, for comparison": hou}
    return Part.of(
        "figure_6",
        {"main": _draw(both, {name: pictures[name] for name in (far, near)})},
        {"main": _table(pictures, both), "curves": _curves(spreads)},
        **{"near": pictures[near], "far": pictures[far], "near_m": _NEAR_M, "far_m": _FAR_M},
        voss=spreads[far],
        hou=hou,
    )


def _spreads(name: str, psf: Psf) -> dict[str, PointSpread]:
    """A function at each of the distances."""
    return {f"{name}, {r:g} m": point_spread(psf, _WATER, r) for r in _DISTANCES_M}


def figure_7(seed: int) -> Part:
    """The asymmetric function: the symmetric one seen rotated."""
    at: dict[float, tuple[_LampPicture, ...]] = {}
    for distance_m in (_NEAR_M, _FAR_M):  # square on, rotated, and both in one picture
        scenes = [_lamp_scene(_VOSS, distance_m, seed, tilt_deg) for tilt_deg in (0.0, _TILT_DEG)]
        square, rotated = _lamp_pictures(*scenes)
        at[distance_m] = square, rotated, _side_by_side(square, rotated, scenes[0])
    (square, rotated, both), (*_, far) = at.values()
    pictures = {"symmetric": square, f"rotated by {_TILT_DEG:.0f} degrees": rotated, "both lamps": both}
    figure = canvas(8.6, 5.0, PHOTO_DPI)
    axes = figure.subplots(2, 3, width_ratios=(3, 3, 6))
    for (above, below), (key, picture) in zip(axes.T, pictures.items(), strict=True):
        show(above, picture.image, key)
        levels = np.geomspace(0.15, 0.75, 4) * float(picture.glow[:, :_SIDE_PX].max())
        above.contour(picture.glow, levels=levels, colors=ORANGE, linewidths=0.8)
        _draw_counts(below, picture)
        below.set_xlabel("grey level", fontsize=SMALL)
    for below in axes[1, 1:]:
        below.set_ylabel("")
    return Part.of(
        "figure_7",
        {"main": figure},
        {"main": _table({**pictures, f"both lamps at {_FAR_M:g} m": far}, {})},
        dimmed=math.cos(math.radians(_TILT_DEG)),
        **{"near": _two_peaks(both), "far": _two_peaks(far), "near_m": _NEAR_M, "far_m": _FAR_M},
    )


def _table(pictures: Mapping[str, _LampPicture], spreads: Mapping[str, PointSpread]) -> Rows:
    rows: list[Sequence[Cell]] = [_HEAD]
    for key, picture in pictures.items():
        shares: tuple[float | None, ...] = (None,) * 3
        if (spread := spreads.get(key)) is not None:
            shares = spread.direct_share, spread.glow_share, _glow_within(spread, math.radians(_WITHIN_DEG))
        of_peak = (100 * picture.share_of_lamp_in_peak, picture.prominence, 100 * picture.share_of_direct)
        rows.append((key, *shares, picture.peak, *of_peak))
    return rows


def _curves(spreads: Mapping[str, PointSpread]) -> Rows:
    columns = [np.degrees(ANGLES[_SEEN]), *(spread.glow_per_sr[_SEEN] for spread in spreads.values())]
    return [("angle (deg)", *(f"{key} (1/sr)" for key in spreads)), *np.column_stack(columns).tolist()]


def _draw(spreads: Mapping[str, PointSpread], pictures: Mapping[str, _LampPicture]) -> Figure:
    figure = canvas(8.6, 5.4, PHOTO_DPI)
    axes = figure.subplot_mosaic([["curves", 0, "counts 0"], ["curves", 1, "counts 1"]], width_ratios=(4, 3, 4))
    curves = axes["curves"]
    for (key, spread), (colour, line) in zip(spreads.items(), _STYLES, strict=False):
        curves.loglog(np.degrees(ANGLES[_SEEN]), spread.glow_per_sr[_SEEN], line, color=colour, label=key, lw=1.5)
    widest = math.degrees(_SIDE_PX / 2 / _FOCAL_PX)
    curves.axvspan(curves.get_xlim()[0], widest, color=BARS_COLOUR, alpha=0.15, lw=0)
    curves.set_xlim(0.01, 60)
    curves.set_xlabel("angle from the lamp (deg)", fontsize=SMALL)
    curves.set_ylabel("glow (1/sr)", fontsize=SMALL)
    curves.tick_params(labelsize=SMALL - 1)
    curves.legend(fontsize=SMALL, frameon=False, loc="lower left")
    for row, (key, picture) in enumerate(pictures.items()):
        show(axes[row], picture.image, key)
        _draw_counts(axes[f"counts {row}"], picture)
    axes["counts 1"].set_xlabel("grey level", fontsize=SMALL)
    return figure


def _draw_counts(axes: Axes, picture: _LampPicture) -> None:
    draw_histogram(axes, picture.counts)
    axes.plot(np.arange(LEVELS), picture.counts_of_lamp + 1, drawstyle="steps-mid", color=BLUE, lw=1.2)
    axes.plot([picture.peak], [2 * picture.counts[picture.peak] + 8], "v", color=THRESHOLD_COLOUR, ms=6)


def _lamp_scene(psf: Psf, distance_m: float, seed: int, tilt_deg: float = 0.0) -> Scene:
    """One lamp on a small camera's axis, 15 pixels in radius at any distance; a tilt turns the glow and dims it."""
    level, radius_m = math.cos(math.radians(tilt_deg)), _LAMP_RADIUS_PX / _FOCAL_PX * distance_m
    if tilt_deg:
        psf = msgspec.structs.replace(psf, tilt_deg=tilt_deg, tilt_axis_deg=90.0)
    return Scene(
        camera=Camera(_FOCAL_PX, _FOCAL_PX, (_SIDE_PX - 1) / 2, (_SIDE_PX - 1) / 2, _SIDE_PX, _SIDE_PX),
        dock=Dock(0.30, 3),
        pose=Pose(position_m=(0.0, 0.0, distance_m)),
        lights=Lights(missing=(0, 1, 2)),
        lamps=(Lamp(position_m=(0.0, 0.0, distance_m), level=level, radius_m=radius_m),),
        water=_WATER,
        psf=psf,
        background=Background(level=8.0),
        seed=seed,
    )


def _lamp_pictures(*scenes: Scene) -> list[_LampPicture]:
    """Expose pictures of lamps alike; the brightest pixel of the first gets ``_BRIGHTEST`` grey levels."""
    light = list(map(light_of, scenes))
    scale = (_BRIGHTEST - scenes[0].background.level) / float((light[0][0] + light[0][1]).max())
    pairs = zip(scenes, light, strict=True)
    return [_LampPicture(scene, scale * direct, scale * glow) for scene, (direct, glow) in pairs]


def _side_by_side(one: _LampPicture, other: _LampPicture, scene: Scene) -> _LampPicture:
    """Put two pictures into one, and expose it anew."""
    camera = msgspec.structs.replace(scene.camera, width=2 * _SIDE_PX)
    light = np.hstack([one.direct, other.direct]), np.hstack([one.glow, other.glow])
    return _LampPicture(msgspec.structs.replace(scene, camera=camera), *light)


def _two_peaks(both: _LampPicture) -> tuple[int, int, float]:
    """Levels of both peaks of :func:`_side_by_side`, the left lamp being brighter, and how far they run together."""
    # The least number of pixels between them over that at the lower peak: 1 where they are one, 0 if apart.
    wide = np.convolve(SMOOTHING, SMOOTHING)
    levels = []
    for half in (slice(0, _SIDE_PX), slice(_SIDE_PX, None)):
        direct = both.direct[:, half]
        counts = np.bincount(both.image[:, half][direct >= direct.max() / 2], minlength=LEVELS)
        levels.append(int(np.convolve(counts, wide, mode="same").argmax()))
    smooth = np.convolve(both.counts, wide, mode="same")
    low, high = sorted(levels)
    return levels[0], levels[1], float(smooth[low : high + 1].min() / min(smooth[low], smooth[high]))


def _glow_within(spread: PointSpread, angle_rad: float) -> float:
    """Share of the glow that arrives within an angle of the lamp: 2 pi int PSF theta dtheta, in the small angles."""
    inside = angle_rad >= ANGLES
    ring = 2 * math.pi * spread.glow_per_sr * ANGLES**2  # d(theta) = theta d(ln theta)
    return float(np.trapezoid(ring[inside], np.log(ANGLES[inside])) / np.trapezoid(ring, np.log(ANGLES)))
