"""The YAML beside a picture or video, with its camera, its dock and the true pose; dock files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.camera.files import load_camera
from dockpose.files.durable_files import write_whole
from dockpose.files.yaml_file import FileError, read_yaml, to_yaml
from dockpose.pose.known import KnownPose, read_known_pose


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
    has_camera = "camera" in content or "camera_matrix" in content
    return Sidecar(
        camera=load_camera(path) if has_camera else None,
        dock=dock_from(content["dock"], path) if "dock" in content else None,
        truth=read_known_pose(content.get("truth")),
    )


def camera_and_dock(path: Path, camera: Camera | None, dock: Dock | None) -> tuple[Camera, Dock]:
    """Find the camera and the dock of a file; where None is given, the YAML beside it says."""
    if camera is None or dock is None:
        if not path.is_file():
            raise FileError(f"{path}: there is no such file")
        beside = read_sidecar(path)
        camera, dock = camera or beside.camera, dock or beside.dock
    return known(str(path), camera, dock, f", or {path.stem}.yaml beside it")


def known(name: str, camera: Camera | None, dock: Dock | None, hint: str = "") -> tuple[Camera, Dock]:
    """Return the camera and the dock, and ask for what is missing: a UserError, about ``name``."""
    if camera is None:
        raise UserError(f"{name}: which camera? Give --camera C.yaml{hint}")
    if dock is None:
        raise UserError(f"{name}: how large is the dock? Give --dock-diameter in metres{hint}")
    return camera, dock


def load_dock(path: str | Path) -> Dock:
    """Read the dock of a dock file, or of any YAML that has one."""
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


def save_dock(dock: Dock, path: str | Path, camera: Camera | None = None) -> None:
    """Write a dock file that :func:`load_dock` reads back to the same numbers, with the camera where one is given."""
    content = {"dock": msgspec.to_builtins(dock)} | ({"camera": msgspec.to_builtins(camera)} if camera else {})
    write_whole(Path(path), to_yaml(content).encode())
