"""The sample scenes that come with the program: simulated pictures whose camera, dock and true pose are known."""

from pathlib import Path

from dockpose.app.inputs.pictures import Picture
from dockpose.app.inputs.sidecar import read_sidecar
from dockpose.app.resources import data_folder
from dockpose.files.yaml_file import FileError
from dockpose.sources.pictures import read_picture

FIRST_SAMPLE = "plain"


def samples_folder() -> Path:
    """The folder of the sample scenes."""
    return data_folder("sample_images")


def sample_names() -> list[str]:
    """Names of the sample scenes, the one to show first at the front."""
    names = sorted(path.stem for path in samples_folder().glob("*.png"))
    return sorted(names, key=lambda name: name != FIRST_SAMPLE)


def sample_path(name: str) -> Path:
    """Path of a sample scene's picture. Raises ValueError if there is none of that name."""
    if name not in sample_names():
        raise ValueError(f"sample is {name!r}; it must be one of {', '.join(sample_names())}")
    return samples_folder() / f"{name}.png"


def load_sample(name: str) -> Picture:
    """Read a sample scene's picture, with its camera, dock and truth."""
    path = sample_path(name)
    beside = read_sidecar(path)
    if beside.camera is None or beside.dock is None:
        raise FileError(f"{path.with_suffix('.yaml')}: a sample scene needs the keys camera and dock")
    return Picture(path, *read_picture(path), beside.camera, beside.dock, beside.truth)


def sample_source(text: str) -> str:
    """The samples' path for ``sample_images``, a scene's for its name, else the text; what is here goes first."""
    if Path(text).exists():
        return text
    if text.rstrip("/\\") == "sample_images":
        return str(samples_folder())
    return str(sample_path(text)) if text in sample_names() else text
