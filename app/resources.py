"""Where the project's own files are: beside the code in a checkout, inside the package in a wheel."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
FIRST_SAMPLE = "plain"


def _folder(name: str) -> Path:
    in_checkout = _PACKAGE.parent / name
    in_wheel = _PACKAGE / name
    return in_wheel if in_wheel.is_dir() else in_checkout


def static_path(name: str) -> Path:
    """Path of a file in ``static/``."""
    return _folder("static") / name


def samples_folder() -> Path:
    """The folder of the sample scenes."""
    return _folder("sample_images")


def sample_names() -> list[str]:
    """Names of the sample scenes, the one to show first at the front."""
    names = sorted(path.stem for path in samples_folder().glob("*.png"))
    return sorted(names, key=lambda name: name != FIRST_SAMPLE)


def sample_path(name: str) -> Path:
    """Path of the picture of a sample scene. Raises ValueError if there is none of that name."""
    if name not in sample_names():
        raise ValueError(f"sample is {name!r}; it must be one of {', '.join(sample_names())}")
    return samples_folder() / f"{name}.png"
