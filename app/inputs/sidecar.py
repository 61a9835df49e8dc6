"""Pictures with a YAML beside them that tells their camera, their dock and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.app.resources import sample_path
from dockpose.camera.files import FileError, load_camera, read_yaml
from dockpose.camera.image import read
from dockpose.pose.known import KnownPose, read_known_pose


@dataclass(frozen=True)
class Sample:
    """A picture, what it was taken with, and where the dock really is; None where that is not known."""

    name: str
    image: np.ndarray
    camera: Camera
    dock: Dock
    truth: KnownPose | None


@dataclass(frozen=True)
class Sidecar:
    """What the YAML beside a picture says; None for what it leaves out."""

    camera: Camera | None = None
    dock: Dock | None = None
    truth: KnownPose | None = None


def load_sample(name: str) -> Sample:
    """Load the sample scene of that name."""
    path = sample_path(name)
    sidecar = read_sidecar(path)
    if sidecar.camera is None or sidecar.dock is None:
        raise FileError(f"{path.with_suffix('.yaml')}: a sample scene needs the keys camera and dock")
    return Sample(name, read(path), sidecar.camera, sidecar.dock, sidecar.truth)


def read_sidecar(picture: Path) -> Sidecar:
    """Read NAME.yaml beside NAME.png; an empty Sidecar where there is none."""
    path = picture.with_suffix(".yaml")
    if not path.is_file():
        return Sidecar()
    content = read_yaml(path)
    has_camera = "camera" in content or "camera_matrix" in content
    return Sidecar(
        camera=load_camera(path) if has_camera else None,
        dock=_dock(content["dock"], path) if "dock" in content else None,
        truth=read_known_pose(content.get("truth")),
    )


def _dock(content: Any, path: Path) -> Dock:
    try:
        return msgspec.convert(content, Dock)
    except msgspec.ValidationError as error:
        raise FileError(f"{path}: dock: {error}") from error
