"""What is known of a picture: the YAML beside it with camera, dock and true pose; dock files; the sample scenes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from dockpose.camera.camera import Camera
from dockpose.camera.files import load_camera
from dockpose.camera.formats.readers import is_known
from dockpose.dock import Dock
from dockpose.files import FileError, read_yaml
from dockpose.pose.known import KnownPose, read_known_pose

FIRST_SAMPLE = "plain"
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
