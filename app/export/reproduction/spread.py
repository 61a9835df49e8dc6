"""Figures 5 to 7: point spread functions, the picture of a lamp through each, and its histogram."""

import math
from collections.abc import Mapping

import numpy as np
from dockpose.app.drawing.colours import BARS_COLOUR, BLUE, GREEN, ORANGE, PURPLE, THRESHOLD_COLOUR
from dockpose.app.export.parts import Cell, Part, Rows
from dockpose.app.export.reproduction.pictures import PHOTO_DPI, SMALL, canvas, draw_histogram, show
from dockpose.paper.lights import spread as lamps
from dockpose.paper.lights.spread import HOU_DISTANCE_M, HOU_THETA0_RAD, HOU_WATER, SIDE_PX, LampPicture, lamp_scene
from dockpose.simulate.optics.psf import ANGLES, PointSpread, Psf, hou_exponent, point_spread
from dockpose.thresholds import LEVELS
from matplotlib.axes import Axes
from matplotlib.figure import Figure

_DISTANCES_M = (1.0, 3.0, HOU_DISTANCE_M)
_SEEN = (math.radians(0.01) < ANGLES) & (math.radians(60) > ANGLES)
_DRAWS = 3
_WITHIN_DEG = 1.0
_NEAR_M = 1.0  # where c r = 1, and direct light still counts
_TILT_DEG, _OFFSET_PX = 50.0, 30
_STYLES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, ":"), (PURPLE, "-."))
_HOU, _POISSON, _VOSS = Psf("hou", theta0_rad=HOU_THETA0_RAD), Psf("hou_poisson", theta0_rad=HOU_THETA0_RAD), Psf()
_FOR_COMPARISON = "Hou, for comparison"
_HEAD = (
    *("picture", "share of direct light", "share of glow", f"of the glow within {_WITHIN_DEG:.0f} deg"),
    *("peak at level", "pixels in the peak on the lamp (%)", "pixels in the peak, over those below"),
    "direct light on the lamp (%)",
)


def figure_5(seed: int) -> Part:
    """Hou's function, and the authors' with a Poisson number."""
    spreads = {f"Hou, {r:g} m": point_spread(_HOU, HOU_WATER, r) for r in _DISTANCES_M}
    rng = np.random.default_rng([seed, *b"poisson"])
    drawn = {f"Poisson, draw {k + 1}": point_spread(_POISSON, HOU_WATER, HOU_DISTANCE_M, rng) for k in range(_DRAWS)}
    scenes = [lamp_scene(psf, HOU_WATER, HOU_DISTANCE_M, seed) for psf in (_HOU, _POISSON)]
    pictures: dict[str, LampPicture] = dict(zip(("Hou", "Poisson"), lamps.lamp_pictures(scenes), strict=True))
    direct = math.exp(-HOU_WATER.attenuation_per_m * HOU_DISTANCE_M)
    faintest = min(drawn, key=lambda name: drawn[name].glow_share)  # all of them would hide each other
    return Part.of(
        "figure_5",
        {"main": _draw({**spreads, faintest: drawn[faintest]}, pictures)},
        {"main": _table(pictures, {"Hou": spreads[f"Hou, {HOU_DISTANCE_M:g} m"]}), "curves": _curves(spreads)},
        far_m=HOU_DISTANCE_M,
        exponent=hou_exponent(_HOU, HOU_WATER, HOU_DISTANCE_M),
        picture=pictures["Hou"],
        mean=HOU_WATER.scattering_per_m * HOU_DISTANCE_M,
        numbers=[round(spread.glow_share / direct) for spread in drawn.values()],
        water=HOU_WATER,
        theta0=HOU_THETA0_RAD,
    )


def figure_6(seed: int) -> Part:
    """Voss' function, from the modulation transfer function."""
    spreads = {f"Voss, {r:g} m": point_spread(_VOSS, HOU_WATER, r) for r in _DISTANCES_M}
    hou = point_spread(_HOU, HOU_WATER, HOU_DISTANCE_M)
    far, near = f"Voss, {HOU_DISTANCE_M:g} m", f"Voss, {_NEAR_M:g} m"
    pictures = {name: _picture(_VOSS, distance, seed) for name, distance in ((far, HOU_DISTANCE_M), (near, _NEAR_M))}
    others = {_FOR_COMPARISON: _picture(_HOU, HOU_DISTANCE_M, seed)}
    both = {**spreads, _FOR_COMPARISON: hou}
    return Part.of(
        "figure_6",
        {"main": _draw(both, pictures)},
        {"main": _table({**pictures, **others}, both), "curves": _curves(spreads)},
        near_m=_NEAR_M,
        far_m=HOU_DISTANCE_M,
        near=pictures[near],
        far=pictures[far],
        other=others[_FOR_COMPARISON],
        within_deg=_WITHIN_DEG,
        within=[100 * lamps.glow_within(one, math.radians(_WITHIN_DEG)) for one in (spreads[far], hou)],
        voss=spreads[far],
        hou=hou,
        water=HOU_WATER,
        theta0=HOU_THETA0_RAD,
    )


def figure_7(seed: int) -> Part:
    """The asymmetric function: the symmetric one seen rotated."""
    (square, rotated, both), (_, _, far) = (_turned(distance_m, seed) for distance_m in (_NEAR_M, HOU_DISTANCE_M))
    pictures = {"symmetric": square, f"rotated by {_TILT_DEG:.0f} degrees": rotated, "both lamps": both}
    return Part.of(
        "figure_7",
        {"main": _draw_rotated(pictures)},
        {"main": _table({**pictures, f"both lamps at {HOU_DISTANCE_M:g} m": far}, {})},
        offset=_OFFSET_PX,
        sides=[lamps.lopsidedness(one, _OFFSET_PX) for one in (square, rotated)],
        near_m=_NEAR_M,
        far_m=HOU_DISTANCE_M,
        dimmed=math.cos(math.radians(_TILT_DEG)),
        near=lamps.two_peaks(both),
        far=lamps.two_peaks(far),
    )


def _picture(psf: Psf, distance_m: float, seed: int) -> LampPicture:
    return lamps.lamp_pictures([lamp_scene(psf, HOU_WATER, distance_m, seed)])[0]


def _turned(distance_m: float, seed: int) -> tuple[LampPicture, LampPicture, LampPicture]:
    """A lamp seen square on, one seen rotated, and both in one picture."""
    scenes = [lamp_scene(_VOSS, HOU_WATER, distance_m, seed, tilt_deg) for tilt_deg in (0.0, _TILT_DEG)]
    square, rotated = lamps.lamp_pictures(scenes)
    return square, rotated, lamps.side_by_side(square, rotated, scenes[0])


def _table(pictures: Mapping[str, LampPicture], spreads: Mapping[str, PointSpread]) -> Rows:
    rows: list[tuple[Cell, ...]] = [_HEAD]
    for key, picture in pictures.items():
        shares: tuple[Cell, ...] = (None,) * 3
        if (spread := spreads.get(key)) is not None:
            shares = spread.direct_share, spread.glow_share, lamps.glow_within(spread, math.radians(_WITHIN_DEG))
        of_peak = (100 * picture.share_of_lamp_in_peak, picture.prominence, 100 * picture.share_of_direct)
        rows.append((key, *shares, picture.peak, *of_peak))
    return rows


def _curves(spreads: Mapping[str, PointSpread]) -> Rows:
    columns = [np.degrees(ANGLES[_SEEN]), *(spread.glow_per_sr[_SEEN] for spread in spreads.values())]
    return [("angle (deg)", *(f"{key} (1/sr)" for key in spreads)), *np.column_stack(columns).tolist()]


def _draw(spreads: Mapping[str, PointSpread], pictures: Mapping[str, LampPicture]) -> Figure:
    figure = canvas(8.6, 5.4, PHOTO_DPI)
    axes = figure.subplot_mosaic([["curves", 0, "counts 0"], ["curves", 1, "counts 1"]], width_ratios=(4, 3, 4))
    curves = axes["curves"]
    for (key, spread), (colour, line) in zip(spreads.items(), _STYLES, strict=False):
        curves.loglog(np.degrees(ANGLES[_SEEN]), spread.glow_per_sr[_SEEN], line, color=colour, label=key, lw=1.5)
    curves.axvspan(
        curves.get_xlim()[0], math.degrees(SIDE_PX / 2 / lamps.FOCAL_PX), color=BARS_COLOUR, alpha=0.15, lw=0
    )
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


def _draw_rotated(pictures: Mapping[str, LampPicture]) -> Figure:
    figure = canvas(8.6, 5.0, PHOTO_DPI)
    axes = figure.subplots(2, 3, width_ratios=(3, 3, 6))
    for (above, below), (key, picture) in zip(axes.T, pictures.items(), strict=True):
        show(above, picture.image, key)
        levels = np.geomspace(0.15, 0.75, 4) * float(picture.glow[:, :SIDE_PX].max())
        above.contour(picture.glow, levels=levels, colors=ORANGE, linewidths=0.8)
        _draw_counts(below, picture)
        below.set_xlabel("grey level", fontsize=SMALL)
    for below in axes[1, 1:]:
        below.set_ylabel("")
    return figure


def _draw_counts(axes: Axes, picture: LampPicture) -> None:
    draw_histogram(axes, picture.counts)
    axes.plot(np.arange(LEVELS), picture.counts_of_lamp + 1, drawstyle="steps-mid", color=BLUE, lw=1.2)
    axes.plot([picture.peak], [2 * picture.counts[picture.peak] + 8], "v", color=THRESHOLD_COLOUR, ms=6)
