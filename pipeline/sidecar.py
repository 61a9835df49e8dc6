"""What is known of a picture: the YAML beside it with camera, dock and true pose; dock files; the sample scenes."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from dockpose.camera.camera import Camera
from dockpose.camera.files import load_camera
from dockpose.camera.formats.readers import is_known
from dockpose.dock import Dock
from dockpose.files import MOST_BYTES, FileError, read_small, read_yaml
from dockpose.lights.by_hand import ByHand
from dockpose.pose.known import KnownPose, read_known_pose

FIRST_SAMPLE = "plain"
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_PACKAGE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Sidecar:
    """What the YAML beside a picture says; None for what it leaves out."""

    camera: Camera | None = None
    dock: Dock | None = None
    truth: KnownPose | None = None


def read_sidecar(picture: Path) -> Sidecar:
    """Read NAME.yaml beside NAME.png; an empty Sidecar where there is none."""
    path = picture.with_suffix(".yaml")
    if not path.is_file():
        return Sidecar()
    content = read_yaml(path)
    has_camera = "camera" in content or is_known(content)
    return Sidecar(
        camera=load_camera(path) if has_camera else None,
        dock=dock_from(content["dock"], path) if "dock" in content else None,
        truth=read_known_pose(content.get("truth")),
    )


def lights_beside(picture: Path) -> ByHand | None:
    """The lights that NAME.yaml beside NAME.png says somebody has set; None where it says none, or is no YAML."""
    path = picture.with_suffix(".yaml")
    if not path.is_file():
        return None
    try:
        content = read_yaml(path)
    except FileError:  # camera and dock were given, so that nobody needs the file
        return None
    return _by_hand(content, path) if "lights_px" in content else None


def load_lights(path: str | Path) -> ByHand:
    """Read the lights that somebody has set, from YAML or JSON with ``lights_px`` or a table with a line x, y for each.

    Raises FileError where the file is neither.
    """
    text = read_small(path, MOST_BYTES).decode(errors="replace")
    rows = [re.split(r"[\s,;]+", line.strip(" \t,;")) for line in text.splitlines() if line.strip()]
    if rows and rows[0] == ["x", "y"]:
        rows = rows[1:]
    if rows and all(len(row) == 2 and _NUMBER.fullmatch(row[0]) and _NUMBER.fullmatch(row[1]) for row in rows):
        return _by_hand({"lights_px": [[float(x), float(y)] for x, y in rows]}, path)
    content = read_yaml(path)
    if "lights_px" not in content:
        raise FileError(f"{path}: has no key lights_px, and is no table of x, y")
    return _by_hand(content, path)


def _by_hand(content: dict[str, Any], path: str | Path) -> ByHand:
    try:
        return msgspec.convert({key: content[key] for key in ("lights_px", "snap") if key in content}, ByHand)
    except msgspec.ValidationError as error:
        raise FileError(f"{path}: lights_px: {error}") from error


def completed(path: Path, camera: Camera | None, dock: Dock | None) -> tuple[Camera, Dock]:
    """Camera and dock of a picture file; NAME.yaml beside it says what is None. Raises FileError where it does not."""
    if not path.is_file():
        raise FileError(f"{path}: there is no such file")
    beside = read_sidecar(path)
    camera, dock = camera or beside.camera, dock or beside.dock
    for name, value in (("camera", camera), ("dock", dock)):
        if value is None:
            raise FileError(f"{path}: which {name}? Pass {name}, or describe it in {path.stem}.yaml beside the picture")
    assert camera is not None
    assert dock is not None
    return camera, dock


def load_dock(path: str | Path) -> Dock:
    """Read the dock of a dock file, or of any YAML that has one.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Dock
        The dock that it describes.

    Raises
    ------
    FileError
        If the file cannot be read, is not YAML, or describes no dock.
    """
    content = read_yaml(path)
    if "dock" not in content:
        keys = ", ".join(map(str, content)) or "none"
        raise FileError(f"{path}: is not a dock file: it has no key dock; its keys are {keys}")
    return dock_from(content["dock"], path)


def dock_from(content: Any, path: str | Path) -> Dock:
    """The dock that a part of the file ``path`` describes. Raises FileError where it is not a dock."""
    try:
        return msgspec.convert(content, Dock)
    except msgspec.ValidationError as error:
        raise FileError(f"{path}: dock: {error}") from error


def samples_folder() -> Path:
    """The folder of the sample scenes, in a checkout or a wheel."""
    in_wheel = _PACKAGE / "sample_images"
    return in_wheel if in_wheel.is_dir() else _PACKAGE.parent / "sample_images"


def sample_names() -> list[str]:
    """Names of the sample scenes, the one to show first at the front."""
    names = sorted(path.stem for path in samples_folder().glob("*.png"))
    return sorted(names, key=lambda name: name != FIRST_SAMPLE)


def sample_path(name: str) -> Path:
    """Path of a sample scene's picture. Raises ValueError if there is none of that name."""
    if name not in sample_names():
        raise ValueError(f"sample is {name!r}; it must be one of {', '.join(sample_names())}")
    return samples_folder() / f"{name}.png"


def sample_source(text: str) -> str:
    """The samples' path for ``sample_images``, a scene's for its name, else the text; what is here goes first."""
    if Path(text).exists():
        return text
    if text.rstrip("/\\") == "sample_images":
        return str(samples_folder())
    return str(sample_path(text)) if text in sample_names() else text
