"""A calibration in words: the camera with its standard errors, which terms were fixed and why, what to add."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from dockpose.camera.calibrate import BoardView, Calibration
from dockpose.camera.coverage import Coverage
from dockpose.camera.fitting import Rung
from dockpose.camera.port_fit import FittedPort

MEDIA = ("air", "water")
_SURE_SHARE = 0.01  # of the focal length: a larger standard error is said to be large
_PORT_BY = "calibrate once more with --in water --camera and the file of the air"


def camera_lines(done: Calibration, medium: str = "air", *, is_on_page: bool = False) -> Iterator[str]:
    """Sentences on a calibration, the most important first."""
    across, down = np.degrees(done.camera.field_of_view_rad)
    used = len(done.used)
    yield (
        f"{used} of {len(done.views)} pictures used, error {done.error_px:.3f} px; "
        f"the lens sees {across:.1f} x {down:.1f} degrees"
        + (" in air." if medium == "air" else ", as a pinhole in the water.")
    )
    yield f"Each with one sigma: {numbers_in_words(done)}."
    fx, sigma = done.camera.fx, done.sigmas.values["fx"]
    if sigma > _SURE_SHARE * fx:
        yield f"The focal length is only known to {100 * sigma / fx:.1f} %: tilt the board more, and come nearer."
    yield from lens_lines(done)
    near, far = done.distances_m
    if medium == "air":
        how = "tick Flat port in the tab Tank" if is_on_page else f"show it the board there, and {_PORT_BY}"
        yield (
            f"Calibrated in air, with the board at {near:.2f} to {far:.2f} m. Behind a flat port under water that is "
            f"not enough: {how}."
        )
    else:
        how = "tick Flat port in the tab Tank" if is_on_page else _PORT_BY
        yield (
            f"Calibrated in water, with the board at {near:.2f} to {far:.2f} m: behind a flat port this camera "
            f"holds at these distances only, behind a dome at all. For all distances calibrate in air, then {how}."
        )
    if done.counted_as == "corners":
        yield "The board's numbers were taken to count its inner corners, since no board of so many squares was found."
    if done.coverage.wanted:
        yield f"To be surer, add pictures with {advice(done.coverage)}."


def numbers_in_words(done: Calibration) -> str:
    """The camera's numbers with their standard errors: "fx 519.70 ± 0.23 px, ..., k1 -0.1801 ± 0.0010"."""
    camera, parts = done.camera, []
    for name, sigma in done.sigmas.values.items():
        if name in ("fx", "fy", "cx", "cy"):
            parts.append(f"{name} {getattr(camera, name):.2f} ± {sigma:.2f} px")
        else:
            order = done.lens.terms if done.lens.fisheye else ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
            parts.append(f"{name} {camera.distortion[order.index(name)]:.5f} ± {sigma:.5f}")
    return ", ".join(parts)


def lens_lines(done: Calibration) -> Iterator[str]:
    """Which lens model was taken and why; which of the usual coefficients were left at 0."""
    terms = ", ".join(done.lens.terms) or "no distortion"
    if done.rungs:
        tried = [rung for rung in done.rungs if np.isfinite(rung.held_out_px)]
        errors = ", ".join(f"{rung.lens.name} {rung.held_out_px:.3f}" for rung in tried)
        yield f"Lens: {done.lens.name} ({terms}). Errors of pictures left out of the fit, in px: {errors}."
    else:
        yield f"Lens: {done.lens.name} ({terms})."
    usual = tuple(term for term in done.fixed if term in ("k1", "k2", "p1", "p2", "k3"))
    if usual:
        yield f"{', '.join(usual)} fixed at 0: {_why_fixed(done, usual)}."


def _why_fixed(done: Calibration, fixed: Sequence[str]) -> str:
    if not done.rungs:
        return "too few pictures to tell" if len(done.used) < 6 else f"as --lens {done.lens.name} asks"
    own = next(rung for rung in done.rungs if rung.lens == done.lens)
    freer: list[Rung] = [rung for rung in done.rungs if set(rung.lens.terms) & set(fixed) and not rung.lens.fisheye]
    best = min(freer, key=lambda rung: rung.held_out_px)
    if not np.isfinite(best.held_out_px):
        return "with them the fit fails"
    return (
        f"pictures left out are met to {own.held_out_px:.3f} px without, and to {best.held_out_px:.3f} px "
        "at best with, which is no more than chance"
    )


def port_lines(found: FittedPort) -> Iterator[str]:
    """Sentences on a port that was fitted, the most important first."""
    port, sigma = found.camera.port, found.sigmas.values
    assert port is not None
    overall = float(np.sqrt((found.errors_px**2).mean()))
    yield (
        f"Air gap {1000 * port.air_gap_m:.1f} ± {1000 * sigma['air_gap']:.1f} mm (one sigma, from the camera's centre "
        f"of projection to the window); {len(found.errors_px)} boards, error {overall:.3f} px with the port."
    )
    if found.glass_is_told:
        yield f"Glass {1000 * port.glass_m:.1f} ± {1000 * sigma['glass']:.1f} mm."
    else:
        yield (
            f"Glass taken to be {1000 * port.glass_m:.1f} mm: the pictures cannot tell it from the gap (to "
            f"{1000 * found.glass_sigma_m:.0f} mm at best). Each mm more would make the gap "
            f"{found.gap_per_glass:.2f} mm longer, and change nothing else."
        )
    near, far = found.distances_m
    yield f"Water of index {port.water_index:g}, glass of {port.glass_index:g}; the board at {near:.2f} to {far:.2f} m."
    if found.without_px < overall * 1.1:
        yield f"With no gap at all the boards would be met as well, to {found.without_px:.3f} px."


def advice(coverage: Coverage) -> str:
    """What to photograph next, in words; empty where the pictures are enough."""
    return "; ".join(coverage.wanted)


def outcome(view: BoardView) -> str:
    """What became of a picture, in words."""
    if view.dropped:
        return f"dropped: {view.dropped}"
    if view.error_px is None:
        return f"{view.corners} corners"
    return f"{view.error_px:.3f} px over {view.corners} corners"
