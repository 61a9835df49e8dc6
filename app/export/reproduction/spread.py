"""Figures 5 to 7: point spread functions, the picture of a lamp through each, and its histogram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from dockpose.app.drawing.colours import BARS_COLOUR, BLUE, GREEN, ORANGE, PURPLE, THRESHOLD_COLOUR
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.app.export.reproduction.pictures import PHOTO_DPI, SMALL, show
from dockpose.paper.lights.spread import (
    FOCAL_PX,
    HOU_DISTANCE_M,
    HOU_THETA0_RAD,
    HOU_WATER,
    SIDE_PX,
    LampPicture,
    glow_within,
    lamp_picture,
    lamp_pictures,
    lamp_scene,
    lopsidedness,
    side_by_side,
    two_peaks,
)
from dockpose.simulate.optics.hankel import ANGLES
from dockpose.simulate.optics.psf import PointSpread, Psf, hou_exponent, point_spread
from dockpose.thresholds import LEVELS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DISTANCES_M = (1.0, 3.0, HOU_DISTANCE_M)
_DRAWS = 3
_WITHIN_DEG = 1.0
_NEAR_M = 1.0  # where c r = 1, and direct light still counts
_TILT_DEG, _OFFSET_PX = 50.0, 30
_STYLES = ((BLUE, "-"), (ORANGE, "--"), (GREEN, ":"), (PURPLE, "-."))
_HOU, _POISSON, _VOSS = Psf("hou", theta0_rad=HOU_THETA0_RAD), Psf("hou_poisson", theta0_rad=HOU_THETA0_RAD), Psf()
_HEAD = (
    *("picture", "share of direct light", "share of glow", f"of the glow within {_WITHIN_DEG:.0f} deg"),
    *("peak at level", "pixels in the peak on the lamp (%)", "pixels in the peak, over those below"),
    "direct light on the lamp (%)",
)
_WATER_WORDS = (
    f"The water has a = {HOU_WATER.absorption_per_m:g} and b = {HOU_WATER.scattering_per_m:g} per metre. With the lamp "
    f"{HOU_DISTANCE_M:g} m away, w0 = {HOU_WATER.albedo:.2f} and c r = "
    f"{HOU_WATER.attenuation_per_m * HOU_DISTANCE_M:.1f}, the published example of Hou's function with theta0 = "
    f"{HOU_THETA0_RAD:g}."
)


def figure_5(seed: int) -> Part:
    """Hou's function, and the authors' with a Poisson number."""
    spreads = {f"Hou, {r:g} m": point_spread(_HOU, HOU_WATER, r) for r in _DISTANCES_M}
    rng = np.random.default_rng([seed, *b"poisson"])
    drawn = {f"Poisson, draw {k + 1}": point_spread(_POISSON, HOU_WATER, HOU_DISTANCE_M, rng) for k in range(_DRAWS)}
    scenes = {"Hou": lamp_scene(_HOU, HOU_WATER, HOU_DISTANCE_M, seed)}
    scenes["Poisson"] = lamp_scene(_POISSON, HOU_WATER, HOU_DISTANCE_M, seed)
    pictures = dict(zip(scenes, lamp_pictures(list(scenes.values())), strict=True))
    mean = HOU_WATER.scattering_per_m * HOU_DISTANCE_M
    direct = math.exp(-HOU_WATER.attenuation_per_m * HOU_DISTANCE_M)
    numbers = [round(spread.glow_share / direct) for spread in drawn.values()]
    exponent = hou_exponent(_HOU, HOU_WATER, HOU_DISTANCE_M)
    return Part(
        key="figure_5",
        title="Figure 5: Hou's point spread function, and the authors' with a Poisson number",
        paper="The figures 5 to 7 show point spread functions, symmetric and not, with histograms: light that comes "
        "directly from a lamp makes a peak at the bright end. The symmetric one is Hou's, in which the authors put a "
        "Poisson random number in place of its mean b r.",
        ours=f"At {HOU_DISTANCE_M:g} m Hou's exponent is m = {exponent:.3f}. {_peak_words(pictures['Hou'])} The mean "
        f"number of scatterings is {mean:.2f}; {_DRAWS} draws gave {', '.join(map(str, numbers))}. The number scales "
        "the glow and leaves its shape as it is, so it makes a lamp's halo brighter or fainter from draw to draw.",
        differs=f"{_WATER_WORDS} The function is singular at 0; within 0.02 degrees it is taken as constant. The lamp "
        "is a disc of 15 pixels in radius, blurred by the lens, with noise: for a point of light there would be no "
        "plateau and no peak. Both pictures have the same exposure, so that the brightest pixel of Hou's has 220 "
        "levels and none is saturated. Of the paper's figures only the functions are known to us, not their "
        "numbers, so the shapes are to be compared, not the values.",
        plots=[_draw("figure_5", {**spreads, **_faintest(drawn)}, pictures)],
        tables=[
            _table("figure_5", pictures, {"Hou": spreads[f"Hou, {HOU_DISTANCE_M:g} m"]}),
            _curves("figure_5", spreads),
        ],
    )


def _faintest(drawn: Mapping[str, PointSpread]) -> dict[str, PointSpread]:
    """The draw with the fewest scatterings; all of them would hide each other."""
    name = min(drawn, key=lambda name: drawn[name].glow_share)
    return {name: drawn[name]}


def figure_6(seed: int) -> Part:
    """Voss' function, from the modulation transfer function."""
    spreads = {f"Voss, {r:g} m": point_spread(_VOSS, HOU_WATER, r) for r in _DISTANCES_M}
    hou = point_spread(_HOU, HOU_WATER, HOU_DISTANCE_M)
    far, near = f"Voss, {HOU_DISTANCE_M:g} m", f"Voss, {_NEAR_M:g} m"
    pictures = {
        name: lamp_picture(lamp_scene(_VOSS, HOU_WATER, distance_m, seed))
        for name, distance_m in ((far, HOU_DISTANCE_M), (near, _NEAR_M))
    }
    others = {"Hou, for comparison": lamp_picture(lamp_scene(_HOU, HOU_WATER, HOU_DISTANCE_M, seed))}
    within = [100 * glow_within(one, math.radians(_WITHIN_DEG)) for one in (spreads[far], hou)]
    return Part(
        key="figure_6",
        title="Figure 6: the point spread function of a modulation transfer function",
        paper="The second symmetric function is Voss', the zeroth-order Hankel transform of the water's modulation "
        "transfer function; its picture is to have a peak of direct light at the bright end of the histogram too.",
        ours=f"At {_NEAR_M:g} m: {_peak_words(pictures[near])} At {HOU_DISTANCE_M:g} m: {_peak_words(pictures[far])} "
        f"By Hou's function the lamp at {HOU_DISTANCE_M:g} m has a peak with "
        f"{_prominence(others['Hou, for comparison'])}. Within {_WITHIN_DEG:.0f} degree of the lamp there is "
        f"{within[0]:.1f} % of the glow by Voss and {within[1]:.1f} % by Hou; in all, the glow is "
        f"{spreads[far].glow_share:.3g} of the light by Voss and {hou.glow_share:.3g} by Hou.",
        differs=f"{_WATER_WORDS} The transfer function is Wells' small-angle form with Petzold's average phase "
        "function. Voss' function counts all light that is scattered and not absorbed, Hou's only what is scattered "
        "once, so at a large optical length they differ by far in the glow. That direct light makes the peak holds "
        f"at {_NEAR_M:g} m, where it is {100 * pictures[near].share_of_direct:.0f} % of the light on the lamp; at "
        f"{HOU_DISTANCE_M:g} m it is {100 * pictures[far].share_of_direct:.0f} %, and what stands at the bright end is "
        "mostly glow on the lamp itself, which falls off towards the lamp's edge and so spreads the peak over more "
        "levels.",
        plots=[_draw("figure_6", {**spreads, "Hou, for comparison": hou}, pictures)],
        tables=[
            _table("figure_6", {**pictures, **others}, {**spreads, "Hou, for comparison": hou}),
            _curves("figure_6", spreads),
        ],
    )


def figure_7(seed: int) -> Part:
    """The asymmetric function: the symmetric one seen rotated."""
    (square, rotated, both), (_, _, far) = (_turned(distance_m, seed) for distance_m in (_NEAR_M, HOU_DISTANCE_M))
    pictures = {"symmetric": square, f"rotated by {_TILT_DEG:.0f} degrees": rotated, "both lamps": both}
    sides = [lopsidedness(one, _OFFSET_PX) for one in (square, rotated)]
    peaks, far_peaks = two_peaks(both), two_peaks(far)
    return Part(
        key="figure_7",
        title="Figure 7: an asymmetric point spread function",
        paper="The asymmetric function is the symmetric one seen rotated, as of a lamp that is not seen square on. "
        "Lamps seen at an angle have a peak of their own in the histogram, a little lower than that of the others.",
        ours=f"{_OFFSET_PX} pixels from the lamp the glow on the left is {sides[1][0]:.2f} of that on the right when "
        f"rotated ({sides[0][0]:.2f} when not), and the glow at both sides {sides[1][1]:.2f} of that above and below "
        f"({sides[0][1]:.2f}). With both lamps in one picture at {_NEAR_M:g} m, the second one "
        f"{math.cos(math.radians(_TILT_DEG)):.2f} times as bright, they have peaks at the levels {peaks.bright} and "
        f"{peaks.dim}, between which the histogram falls to {100 * peaks.dip:.0f} % of the lower one. At "
        f"{HOU_DISTANCE_M:g} m the peaks are at {far_peaks.bright} and {far_peaks.dim}, and it falls to "
        f"{100 * far_peaks.dip:.0f} %.",
        differs="The rotation moves the glow alone; direct light stays a disc. The second lamp is dimmed by the cosine "
        "of the angle, as a flat lamp is. So how much lower its peak lies is set by how the lamp shines, not by the "
        "shape of the glow. The less of the light is direct, the less the two peaks stand apart. That each angle has a "
        "peak of its own is a reason why no single level suits all lamps.",
        plots=[_draw_rotated(pictures)],
        tables=[_table("figure_7", {**pictures, f"both lamps at {HOU_DISTANCE_M:g} m": far}, {})],
    )


def _turned(distance_m: float, seed: int) -> tuple[LampPicture, LampPicture, LampPicture]:
    """A lamp seen square on, one seen rotated, and both in one picture."""
    scenes = [lamp_scene(_VOSS, HOU_WATER, distance_m, seed, tilt_deg) for tilt_deg in (0.0, _TILT_DEG)]
    square, rotated = lamp_pictures(scenes)
    return square, rotated, side_by_side(square, rotated, scenes[0])


def _peak_words(picture: LampPicture) -> str:
    return (
        f"The histogram has a peak at level {picture.peak}, with {_prominence(picture)}; "
        f"{100 * picture.share_of_lamp_in_peak:.0f} % of its pixels see the lamp itself, whose light there is to "
        f"{100 * picture.share_of_direct:.0f} % direct."
    )


def _prominence(picture: LampPicture) -> str:
    return f"{picture.prominence:.1f} times as many pixels as the levels below it"


def _table(name: str, pictures: Mapping[str, LampPicture], spreads: Mapping[str, PointSpread]) -> NumberTable:
    rows = []
    for key, picture in pictures.items():
        spread = spreads.get(key)
        shares = (
            (None,) * 3
            if spread is None
            else (spread.direct_share, spread.glow_share, glow_within(spread, math.radians(_WITHIN_DEG)))
        )
        of_peak = (100 * picture.share_of_lamp_in_peak, picture.prominence, 100 * picture.share_of_direct)
        rows.append((key, *shares, picture.peak, *of_peak))
    return NumberTable(
        name, "What arrives of a lamp's light, and the peak at the bright end of its histogram.", _HEAD, rows
    )


def _curves(name: str, spreads: Mapping[str, PointSpread]) -> NumberTable:
    seen = _seen_angles()
    columns = [np.degrees(ANGLES[seen]), *(spread.glow_per_sr[seen] for spread in spreads.values())]
    head = ("angle (deg)", *(f"{key} (1/sr)" for key in spreads))
    return NumberTable(f"{name}_curves", "The functions.", head, np.column_stack(columns).tolist(), is_shown=False)


def _seen_angles() -> np.ndarray:
    return (math.radians(0.01) < ANGLES) & (math.radians(60) > ANGLES)


def _draw(name: str, spreads: Mapping[str, PointSpread], pictures: Mapping[str, LampPicture]) -> Plot:
    figure = new_figure(8.6, 5.4, PHOTO_DPI)
    axes = figure.subplots(2, 3, width_ratios=(4, 3, 4))
    grid = axes[0, 0].get_gridspec()
    axes[0, 0].remove()
    axes[1, 0].remove()
    curves = figure.add_subplot(grid[:, 0])
    seen = _seen_angles()
    for (key, spread), (colour, line) in zip(spreads.items(), _STYLES, strict=False):
        curves.loglog(np.degrees(ANGLES[seen]), spread.glow_per_sr[seen], line, color=colour, label=key, lw=1.5)
    curves.axvspan(curves.get_xlim()[0], math.degrees(SIDE_PX / 2 / FOCAL_PX), color=BARS_COLOUR, alpha=0.15, lw=0)
    curves.set_xlim(0.01, 60)
    curves.set_xlabel("angle from the lamp (deg)", fontsize=SMALL)
    curves.set_ylabel("glow (1/sr)", fontsize=SMALL)
    curves.tick_params(labelsize=SMALL - 1)
    curves.legend(fontsize=SMALL, frameon=False, loc="lower left")
    for row, (key, picture) in zip(axes, pictures.items(), strict=True):
        show(row[1], picture.image, key)
        _draw_counts(row[2], picture)
    axes[1, 2].set_xlabel("grey level", fontsize=SMALL)
    figure.set_layout_engine("constrained")
    caption = (
        "Left: glow against the angle from the lamp; the pictures show the grey range. Middle: the lamp through the "
        "function. Right: all pixels at each grey level (grey) and those that see the lamp itself (line); the triangle "
        "marks the peak at the bright end."
    )
    return Plot.of(name, caption, figure, is_photograph=True)


def _draw_rotated(pictures: Mapping[str, LampPicture]) -> Plot:
    figure = new_figure(8.6, 5.0, PHOTO_DPI)
    axes: Sequence[Sequence[Axes]] = figure.subplots(2, 3, width_ratios=(3, 3, 6))
    for column, (key, picture) in enumerate(pictures.items()):
        show(axes[0][column], picture.image, key)
        levels = np.geomspace(0.15, 0.75, 4) * float(picture.glow[:, :SIDE_PX].max())
        axes[0][column].contour(picture.glow, levels=levels, colors=ORANGE, linewidths=0.8)
        _draw_counts(axes[1][column], picture)
        axes[1][column].set_xlabel("grey level", fontsize=SMALL)
    for row in axes[1][1:]:
        row.set_ylabel("")
    figure.set_layout_engine("constrained")
    caption = (
        "Above: a lamp through the symmetric function, through the same seen rotated about the vertical, and both in "
        "one picture; contours are of equal glow. Below: all pixels at each grey level (grey) and those that see a "
        "lamp itself (line)."
    )
    return Plot.of("figure_7", caption, figure, is_photograph=True)


def _draw_counts(axes: Axes, picture: LampPicture) -> None:
    levels = np.arange(LEVELS)
    axes.fill_between(levels, picture.counts + 1, 1, step="mid", color=BARS_COLOUR)
    axes.plot(levels, picture.counts_of_lamp + 1, drawstyle="steps-mid", color=BLUE, lw=1.2)
    axes.plot([picture.peak], [2 * picture.counts[picture.peak] + 8], "v", color=THRESHOLD_COLOUR, ms=6)
    axes.set_yscale("log")
    axes.set_xlim(0, LEVELS - 1)
    axes.set_ylabel("pixels + 1", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL - 1)
