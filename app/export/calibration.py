"""A calibration in words: the camera with its standard errors, which terms were fixed and why, what to add."""

import numpy as np
from dockpose.app.export.parts import sentences
from dockpose.camera.calibrate import BoardView, Calibration
from dockpose.camera.coverage import Coverage
from dockpose.camera.port_fit import FittedPort

MEDIA = ("air", "water")
_USUAL = ("k1", "k2", "p1", "p2", "k3")
_SURE_SHARE = 0.01  # of the focal length: a larger standard error is said to be large


def camera_lines(done: Calibration, medium: str = "air", *, is_on_page: bool = False) -> list[str]:
    """Sentences on a calibration, the most important first."""
    view_deg, numbers = tuple(np.degrees(done.camera.field_of_view_rad)), numbers_in_words(done)
    fixed = [term for term in done.fixed if term in _USUAL]
    freer = [rung for rung in done.rungs if set(rung.lens.terms) & set(fixed) and not rung.lens.fisheye]
    why = fixed, min((rung.held_out_px for rung in freer), default=np.nan)
    return sentences("calibration.txt", "camera", done, medium, is_on_page, view_deg, numbers, _SURE_SHARE, *why)


def port_lines(found: FittedPort) -> list[str]:
    """Sentences on a port that was fitted, the most important first."""
    return sentences("calibration.txt", "port", found, float(np.sqrt((found.errors_px**2).mean())))


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
