"""Scene files: every number of a scene in one YAML, its picture and its truth beside it."""

from __future__ import annotations

from pathlib import Path

import cv2
import msgspec

from pipeline.camera_files import FileError, read_yaml, to_yaml
from pipeline.simulate.render import render
from pipeline.simulate.scene import Scene
from pipeline.simulate.truth import truth_dict
from pipeline.simulate.water import preset


def load_scene(path: str | Path) -> Scene:
    """Read a scene file; ``water`` may be the name of a preset, the truth that may be in it is left aside.

    Raises
    ------
    FileError
        if the file cannot be read, or a key is unknown, missing or wrong; it names the key.
    """
    content = read_yaml(path)
    content.pop("truth", None)
    try:
        if isinstance(content.get("water"), str):
            content["water"] = msgspec.to_builtins(preset(content["water"]))
        return msgspec.convert(content, Scene)
    except (msgspec.ValidationError, ValueError) as error:
        raise FileError(f"{path}: {error}") from error


def save_scene(scene: Scene, folder: str | Path, name: str) -> None:
    """Render a scene and write NAME.png, and NAME.yaml with the scene and its truth, into a folder."""
    image, truth = render(scene)
    encoded = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1]
    (Path(folder) / f"{name}.png").write_bytes(encoded.tobytes())
    content = msgspec.to_builtins(scene) | {"truth": truth_dict(scene, truth)}
    (Path(folder) / f"{name}.yaml").write_text(to_yaml(content), encoding="utf-8")


def render_folder(folder: str | Path) -> list[str]:
    """Render every scene file of a folder again; returns their names."""
    paths = sorted(Path(folder).glob("*.yaml"))
    for path in paths:
        save_scene(load_scene(path), folder, path.stem)
    return [path.stem for path in paths]
