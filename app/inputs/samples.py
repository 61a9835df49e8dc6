"""The sample scenes that come with the program: simulated pictures whose camera, dock and true pose are known."""

from pathlib import Path

from dockpose.app.inputs.pictures import Picture
from dockpose.app.inputs.sidecar import read_sidecar
from dockpose.app.resources import data_folder
from dockpose.files.yaml_file import FileError
from dockpose.sources.pictures import read_picture

FIRST_SAMPLE = "plain"
# What each scene shows, in words; of some the methods in the tab Compare say different things.
SAMPLE_WORDS = {
    "plain": "A dock in clear water.",
    "bright_background": "Sunlit walls that are brighter than the dock's panel.",
    "burnt_in_text": "Letters written into the picture, as bright as the lights.",
    "colour_ring": "Red and blue lights, whose colours tell which is which.",
    "faint": "Small faint lights, and something brighter below. Otsu, Kittler and Sezan miss the dock.",
    "far": "Six metres away, in a 12-bit picture.",
    "flat_port": "Through a flat window.",
    "green_haze": "Green haze, and lights of very different size.",
    "harbour_glare": "Harbour water with patches of glare. Only HATS and HATS local find the dock.",
    "mirror": "The water's surface shows the ring a second time.",
    "missing": "Three lights are dead, and one is hidden.",
    "side_glow": "A glow beside faint lights. HATS by itself misses the dock, others find it; Yen is wrong.",
    "snow": "Bright specks in the water.",
    "sunlit": "Bright lights in sunlit water. Otsu and Kapur miss the dock.",
    "tilted": "Seen at 30 degrees.",
    "turbid": "Murky harbour water.",
}


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
    """The path of the samples for the word ``sample_images``, that of one scene for its name, else the text.

    A file or folder of that name in the current folder goes first.
    """
    if Path(text).exists():
        return text
    if text.rstrip("/\\") == "sample_images":
        return str(samples_folder())
    return str(sample_path(text)) if text in sample_names() else text
