"""``dockpose check``: a session's measured values beside its estimates, and what a pattern in them means."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.app.commands.arguments import Commands, add_options
from dockpose.app.commands.console import EXIT_ALL_READ, put, put_rich
from dockpose.app.drawing.numbers import MISSING, number, sigma_words
from dockpose.app.errors import UserError, blaming, check_place, writing
from dockpose.app.experiment import Row, read_session
from dockpose.app.export.parts import sentences
from dockpose.app.inputs.sidecar import save_dock
from dockpose.camera.sigma import errors_of
from dockpose.pose.circle import angles_of, rotation_from_angles
from dockpose.pose.shared import diameter_share
from dockpose.pose.tape import TAPE_M, Place, TapeFit, fit_tape
from rich import box
from rich.table import Table
from scipy.spatial.transform import Rotation

_HEAD = ("row", "x (cm)", "y (cm)", "z (cm)", "distance (cm)", "θx (°)", "θy (°)")
_PROTRACTOR_DEG = 0.5
_AXES = ("x", "y", "z")


def add_parser(commands: Commands) -> None:
    """Add the command ``check``."""
    parser = commands.add_parser("check", help="say what a session's measured values tell of dock, camera and tape")
    add_options(parser, "check", tape={"default": 1000 * TAPE_M})


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose check``; returns the exit status."""
    if not arguments.tape > 0:
        raise UserError(f"--tape is {arguments.tape:g}; it must be above 0")
    if arguments.out is not None:
        check_place(arguments.out, "--out", is_new=True)
    with blaming(""):
        record = read_session(arguments.session)
    rows = [row for row in record.rows if row.z_cm is not None]
    places = [_place(row) for row in rows]
    try:
        fit = fit_tape(places, arguments.tape / 1000)
    except ValueError as error:
        raise UserError(f"{arguments.session}: {error}") from error
    angles = np.array([_angles_off(row, fit) for row in rows])
    _print(rows, fit, angles)
    put(*_told(rows, fit))
    line = record.line(rows[-1])
    _correct(arguments.out, fit, msgspec.convert(line["camera"], Camera), msgspec.convert(line["dock"], Dock))
    return EXIT_ALL_READ


def _place(row: Row) -> Place:
    """A row in metres; nan for what was not measured."""

    def metres(*names: str) -> np.ndarray:
        return np.array([math.nan if (cm := getattr(row, name)) is None else cm / 100 for name in names])

    sigmas = np.nan_to_num(metres(*(f"sigma_{axis}_cm" for axis in _AXES)))
    measured = metres(*(f"measured_{axis}_cm" for axis in _AXES))
    return Place(metres(*(f"{axis}_cm" for axis in _AXES)), sigmas, measured, float(metres("distance_cm")[0]))


def _angles_off(row: Row, fit: TapeFit) -> tuple[float, float]:
    """Pitch and yaw in the tank less those measured, in degrees; nan where they were not."""
    assert row.theta_x_deg is not None
    assert row.theta_y_deg is not None
    normal = -rotation_from_angles(math.radians(row.theta_x_deg), math.radians(row.theta_y_deg))[:, 2]
    found = np.degrees(angles_of(Rotation.from_rotvec(fit.turn_rad).apply(normal)))
    true = (row.measured_theta_x_deg, row.measured_theta_y_deg)
    off = [
        math.nan if angle is None else math.remainder(one - angle, 360) for one, angle in zip(found, true, strict=True)
    ]
    return off[0], off[1]


def _print(rows: Sequence[Row], fit: TapeFit, angles_deg: np.ndarray) -> None:
    """What is left, a row each, with its size in standard errors, and the root mean square."""
    table = Table(box=box.SIMPLE)
    for name in _HEAD:
        table.add_column(name, justify="right")
    left_cm, sigmas_cm = 100 * fit.residuals_m, 100 * fit.sigmas_m
    for index, row in enumerate(rows):
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


def _told(rows: Sequence[Row], fit: TapeFit) -> list[str]:
    """What the differences mean, the gravest first."""
    slipped = []
    for index in fit.slipped:
        off, sigma = np.abs(fit.residuals_m[index]), fit.sigmas_m[index]
        worst = int(np.nanargmax(off / sigma))
        slipped.append((rows[index].number, 100 * off[worst], off[worst] / sigma[worst]))
    turns = zip(_AXES, np.degrees(fit.turn_rad), np.degrees(fit.turn_sigma_rad), strict=True)
    return sentences("check.txt", "told", fit, slipped, [turn for turn in turns if fit.is_sure(*turn[1:])])


def _correct(out: Path | None, fit: TapeFit, camera: Camera, dock: Dock) -> None:
    """Say whether the scale contradicts what the files say, and write the dock with the diameter that it leads to."""
    names, errors = errors_of(camera)
    focal = math.sqrt(errors[names.index("fx"), names.index("fx")]) / camera.fx if "fx" in names else 0.0
    allowed = math.hypot(focal, diameter_share(dock))
    diameter_m, sigma_m = fit.scale * dock.diameter, fit.scale_sigma * dock.diameter
    if fit.is_sure(fit.scale - 1, math.hypot(allowed, fit.scale_sigma)):
        offer = "." if out is not None else "; --out dock.yaml writes it."
        put(
            f"That is more than camera and dock file allow ({sigma_words(100 * allowed)} %). If it is the diameter, "
            f"that is {diameter_m:.4f} ± {sigma_words(sigma_m)} m, not {dock.diameter:g} m{offer}"
        )
    if out is not None:
        with writing(f"--out {out}"):
            save_dock(msgspec.structs.replace(dock, diameter=diameter_m, diameter_sigma_m=sigma_m), out)
        put(f"The dock with a diameter of {diameter_m:.4f} m is in {out}; estimate --dock {out} uses it.")
