"""The YAML beside a picture or video, with its camera, its dock and the true pose."""

from dataclasses import dataclass
from pathlib import Path

from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.dock_file import dock_from
from dockpose.camera.files import load_camera
from dockpose.files.yaml_file import FileError, read_yaml
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
