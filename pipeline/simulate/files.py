"""Scene files: all the numbers of a scene in one YAML file, with its picture and its truth."""

from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose.files import FileError, read_yaml, to_yaml, write_whole
from dockpose.simulate.optics.water import preset
from dockpose.simulate.render import render
from dockpose.simulate.scene import Scene, Truth, dock_rotation, truth_dict
from dockpose.simulate.sequence import FilmPlan, RenderedFrame

TRUTH_COLUMNS = (
    *("frame", "time_s", "x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg", "roll_deg"),
    *("visible_lights", "centre_x_px", "centre_y_px"),
)
TUM_COLUMNS = "timestamp tx ty tz qx qy qz qw"
_SMALLEST_FILES = 9  # PNG's highest compression


def load_scene(path: str | Path) -> Scene:
    """Read the scene file of a single picture.

    Parameters
    ----------
    path : str or Path
        The file. ``water`` may be the name of a preset; a ``truth`` is ignored.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    FileError
        If the file cannot be read, a key is unknown, missing or wrong (the text names it), or it has a motion.
    """
    sequence = load_sequence(path)
    if sequence.motion is not None:
        raise FileError(f"{path}: has a motion, so it is a sequence of pictures; one picture is wanted here")
    return sequence.scene


def load_sequence(path: str | Path) -> FilmPlan:
    """Read a scene file, with or without ``motion``; ``water`` may name a preset. FileError names what is wrong."""
    content = read_yaml(path)
    content.pop("truth", None)
    motion = content.pop("motion", None)
    try:
        if isinstance(content.get("water"), str):
            content["water"] = preset(content["water"])
        return msgspec.convert({"scene": msgspec.convert(content, Scene), "motion": motion}, FilmPlan)
    except (msgspec.ValidationError, ValueError) as error:
        raise FileError(f"{path}: {error}") from error


def save_scene(scene: Scene, folder: str | Path, name: str) -> None:
    """Render a scene, and write NAME.png and NAME.yaml (the scene and its truth) into a folder."""
    image, truth = render(scene)
    save_picture(image, scene, truth, folder, name, compression=_SMALLEST_FILES)


def save_picture(
    image: np.ndarray, scene: Scene, truth: Truth, folder: str | Path, name: str, compression: int | None = None
) -> None:
    """Write NAME.png and NAME.yaml (the scene and its truth); PNG's ``compression`` 0 to 9, None for a fast one."""
    parameters = [] if compression is None else [cv2.IMWRITE_PNG_COMPRESSION, compression]
    encoded = cv2.imencode(".png", image, parameters)[1]
    write_whole(Path(folder) / f"{name}.png", encoded.tobytes())
    content = msgspec.to_builtins(scene) | {"truth": truth_dict(scene, truth)}
    write_whole(Path(folder) / f"{name}.yaml", to_yaml(content).encode())


def save_sequence(sequence: FilmPlan, path: str | Path) -> None:
    """Write a scene file that :func:`load_sequence` reads back to the same numbers."""
    motion = {} if sequence.motion is None else {"motion": msgspec.to_builtins(sequence.motion)}
    write_whole(Path(path), to_yaml(msgspec.to_builtins(sequence.scene) | motion).encode())


def truth_row(frame: RenderedFrame) -> dict[str, Any]:
    """The truth of one frame of a sequence, by ``TRUTH_COLUMNS``; None for what has no image."""
    pose, centre = frame.scene.pose, frame.truth.centre_px
    x_px, y_px = (float(value) if np.isfinite(value) else None for value in centre)
    values = (
        *(frame.number, frame.time_s, *pose.position_m, pose.theta_x_deg, pose.theta_y_deg, pose.roll_deg),
        *(int(frame.truth.visible.sum()), x_px, y_px),
    )
    return dict(zip(TRUTH_COLUMNS, values, strict=True))


def tum_line(frame: RenderedFrame) -> str:
    """The camera in the dock's frame at one frame of a sequence, as a line of TUM's form."""
    from scipy.spatial.transform import Rotation  # takes a third of a second to import

    turned = dock_rotation(frame.scene).T
    place = -turned @ frame.scene.pose.position_m
    numbers = *place.tolist(), *Rotation.from_matrix(turned).as_quat(canonical=True).tolist()
    return f"{frame.time_s:.6f} {' '.join(f'{number:.9f}' for number in numbers)}\n"
