"""Dock files: YAML with the key ``dock``, as beside the sample scenes."""

from pathlib import Path
from typing import Any

import msgspec
from dockpose import Camera, Dock
from dockpose.files.durable_files import write_whole
from dockpose.files.yaml_file import FileError, read_yaml, to_yaml


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
