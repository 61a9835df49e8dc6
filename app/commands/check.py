"""``dockpose check``: a session's measured values beside its estimates, and what a pattern in them means."""

import argparse
import math

import numpy as np
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, put, say
from dockpose.app.commands.progress import put_rich, table_of_numbers
from dockpose.app.drawing.numbers import MISSING, QUANTITIES, number
from dockpose.app.errors import UserError, blaming, check_place, writing
from dockpose.app.experiment import read_session
from dockpose.app.experiment.record import unlisted
from dockpose.app.export.words import Checked, check_session
from dockpose.app.inputs.pictures import save_dock
from dockpose.camera.files import save_camera
from dockpose.pose.tape import TAPE_M

_HEAD = ("row", *QUANTITIES[:3], "distance (cm)", *QUANTITIES[3:])
_PROTRACTOR_DEG = 0.5
KNOWN = {"tape": {"default": 1000 * TAPE_M}}


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose check``; returns the exit status."""
    if not arguments.tape > 0:
        raise UserError(f"--tape is {arguments.tape:g}; it must be above 0")
    for option, path in (("--out", arguments.out), ("--out-camera", arguments.out_camera)):
        if path is not None:
            check_place(path, option, is_new=True)
    with blaming(""):
        record = read_session(arguments.session)
    lacking = list(unlisted(record))
    for text in lacking:
        say(text)
    checked = check_session(record, arguments.tape / 1000)
    _print(checked)
    put(*checked.told)
    if checked.is_off and arguments.out is None and arguments.out_camera is None:
        put("--out dock.yaml writes the dock so corrected, --out-camera camera.yaml the camera.")
    if arguments.out is not None:
        with writing(f"--out {arguments.out}"):
            save_dock(checked.corrected_dock, arguments.out)
        diameter_m = checked.corrected_dock.diameter
        put(f"The dock with a diameter of {diameter_m:.4f} m is in {arguments.out}; estimate --dock takes it.")
    if arguments.out_camera is not None:
        with writing(f"--out-camera {arguments.out_camera}"):
            save_camera(checked.corrected_camera, arguments.out_camera)
        focal = f"{checked.corrected_camera.fx:.1f}"
        put(f"The camera with a focal length of {focal} px is in {arguments.out_camera}; estimate --camera takes it.")
    return EXIT_SOME_UNREADABLE if lacking else EXIT_ALL_READ


def _print(checked: Checked) -> None:
    """What is left, a row each, with its size in standard errors, and the root mean square."""
    table = table_of_numbers(_HEAD)
    fit, angles_deg = checked.fit, checked.angles_off_deg
    left_cm, sigmas_cm = 100 * fit.residuals_m, 100 * fit.sigmas_m
    for index, row in enumerate(checked.rows):
        if np.isnan([*left_cm[index], *angles_deg[index]]).all():
            continue
        lengths = [_cell(*pair) for pair in zip(left_cm[index], sigmas_cm[index], strict=True)]
        sigmas_deg = [
            math.hypot(sigma or 0.0, _PROTRACTOR_DEG) for sigma in (row.sigma_theta_x_deg, row.sigma_theta_y_deg)
        ]
        turns = [_cell(*pair) for pair in zip(angles_deg[index], sigmas_deg, strict=True)]
        left_out = " (left out)" if index in fit.slipped else ""
        table.add_row(f"{row.number}{left_out}", *lengths, *turns)
    kept = np.delete(np.column_stack([left_cm, angles_deg]), fit.slipped, axis=0)
    table.add_section()
    table.add_row("RMS", *(_rms(column) for column in kept.T))
    put_rich(
        "Estimated less measured, once the tank lies as the camera sees it; in brackets in standard errors:", table
    )


def _cell(off: float, sigma: float) -> str:
    return MISSING if math.isnan(off) else f"{number(off, 2, signed=True)} ({number(off / sigma, 1, signed=True)})"


def _rms(column: np.ndarray) -> str:
    known = column[~np.isnan(column)]
    return number(math.sqrt(float((known**2).mean())), 2) if len(known) else MISSING
