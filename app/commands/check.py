"""``dockpose check``: a session beside its measured values, or results beside a trajectory, and what both mean."""

import argparse
import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from dockpose import Camera, Dock, load_vehicle
from dockpose.app.commands.compare import columns
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, put, say
from dockpose.app.commands.export import check_out, write_out
from dockpose.app.commands.output import open_lines
from dockpose.app.commands.progress import put_rich, table_of_numbers
from dockpose.app.drawing.numbers import MISSING, QUANTITIES, number
from dockpose.app.errors import UserError, blaming, check_place, writing
from dockpose.app.experiment import read_session
from dockpose.app.experiment.record import unlisted
from dockpose.app.export.data import to_json
from dockpose.app.export.words import Checked, check_session, scaled_camera, scaled_dock
from dockpose.app.inputs.pictures import save_dock
from dockpose.camera.files import save_camera
from dockpose.files import to_yaml, write_whole
from dockpose.pose.tape import TAPE_M

if TYPE_CHECKING:
    from dockpose.truth import Placement

_HEAD = ("row", *QUANTITIES[:3], "distance (cm)", *QUANTITIES[3:])
_PROTRACTOR_DEG = 0.5
_HELD = ("mount", "dock_in_world")
_OF_TRUTH = ("columns", "topic", *_HELD, "offset", "json", "report", "out_vehicle")
_OF_MOUNT = ("position_m", "quaternion_xyzw", "position_sigma_m", "angle_sigma_deg")
KNOWN = {"tape": {"default": 1000 * TAPE_M}}


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose check``; returns the exit status."""
    if not arguments.tape > 0:
        raise UserError(f"--tape is {arguments.tape:g}; it must be above 0")
    for option in ("out", "out_camera", "out_vehicle"):
        if (path := getattr(arguments, option)) is not None:
            check_place(path, f"--{option.replace('_', '-')}", is_new=True)
    if arguments.truth is not None:
        return _run_against_trajectory(arguments)
    if given := [name for name in _OF_TRUTH if getattr(arguments, name) is not None]:
        raise UserError(f"--{given[0].replace('_', '-')} needs --truth, the file of a trajectory")
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
    _write_corrected(arguments, checked.corrected_dock, checked.corrected_camera)
    return EXIT_SOME_UNREADABLE if lacking else EXIT_ALL_READ


def _write_corrected(arguments: argparse.Namespace, dock: Dock | None, camera: Camera | None) -> None:
    for option, path, value in (("--out", arguments.out, dock), ("--out-camera", arguments.out_camera, camera)):
        if path is None:
            continue
        if value is None:
            raise UserError(f"{option} {path}: the results do not say what they were found with, or no scale was found")
        with writing(f"{option} {path}"):
            if isinstance(value, Dock):
                save_dock(value, path)
                kind, what = "dock", f"diameter of {value.diameter:.4f} m"
            else:
                save_camera(value, path)
                kind, what = "camera", f"focal length of {value.fx:.1f} px"
        put(f"The {kind} with a {what} is in {path}; estimate --{kind} takes it.")


def _run_against_trajectory(arguments: argparse.Namespace) -> int:
    from dockpose.app.export.truth.report import Compared  # what draws takes a while to import
    from dockpose.app.export.truth.results import read_results
    from dockpose.truth import read_trajectory
    from dockpose.truth.comparison import compare_trajectory

    if arguments.report is not None:
        check_out(arguments.report, "--report")
    with contextlib.ExitStack() as files:
        lines = open_lines(arguments.json, "--json", files)
        results = read_results(arguments.session)
        truth = read_trajectory(arguments.truth, columns=arguments.columns, topic=arguments.topic)
        held = {name: _placement(f"--{name.replace('_', '-')}", getattr(arguments, name)) for name in _HELD}
        with blaming(f"{arguments.session}: "):
            found = compare_trajectory(results.track, truth, offset_s=arguments.offset, **held)
        compared = Compared(arguments.session.name, truth.name, results, found)
        if lines is not None:
            lines.write(to_json(compared.report).decode())
    if arguments.json != "-":
        put(*compared.told)
        put(*columns("Root mean square error, and below it what 95 % stay under:", compared.table("rms")))
        put(*columns("", compared.table("most_95")))
    if arguments.report is not None:
        write_out(compared.files(), arguments.report, arguments.protected, "--report")
    known = results.track if found.scale is not None and found.scale_sigma is not None else None
    scale = (found.scale or 1.0, found.scale_sigma or 0.0)
    dock = None if known is None or known.dock is None else scaled_dock(known.dock, *scale)
    camera = None if known is None or known.camera is None else scaled_camera(known.camera, *scale)
    _write_corrected(arguments, dock, camera)
    if arguments.out_vehicle is not None:
        _write_mount(arguments.out_vehicle, found.mount)
    return EXIT_ALL_READ


def _placement(option: str, text: str | None) -> "Placement | None":
    """A placement as typed, or that of a vehicle file's mount."""
    from dockpose.truth import Placement

    if text is None:
        return None
    with contextlib.suppress(ValueError):
        numbers = [float(each) for each in text.split(",")]
        if len(numbers) == 3 or (len(numbers) in (4, 7) and math.hypot(*numbers[-4:]) > 1e-6):
            return Placement(numbers[:3] if len(numbers) != 4 else None, numbers[-4:] if len(numbers) != 3 else None)
    if option == "--mount" and Path(text).is_file():
        vehicle = load_vehicle(text)
        return Placement(vehicle.T_body_camera.position_m, vehicle.camera.quaternion_xyzw)
    raise UserError(f"{option} {text}: must be X,Y,Z in metres, a quaternion QX,QY,QZ,QW, or both with commas between")


def _write_mount(path: Path, mount: "Placement") -> None:
    """Write a vehicle file whose axes are those of the tracked body."""
    place, turn, sigmas, angles = (getattr(mount, name) for name in _OF_MOUNT)
    if place is None or turn is None:
        raise UserError(f"--out-vehicle {path}: the mount was not found; the motion does not tell it")
    sizes = [0.0 if one is None else math.sqrt(float(np.mean(np.square(one)))) for one in (sigmas, angles)]
    numbers = {"position_m": place, "quaternion_xyzw": turn, "position_sigma_m": sizes[0], "angle_sigma_deg": sizes[1]}
    content = {"T_body_camera": {name: np.asarray(value).tolist() for name, value in numbers.items()}, "frame": "flu"}
    with writing(f"--out-vehicle {path}"):
        write_whole(path, to_yaml(content).encode())
    put(f"The mount is in {path}; its frame is taken as flu: change that unless the tracked body has x ahead and z up.")


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
