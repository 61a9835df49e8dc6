"""Where the project's own files are: beside the code in a checkout, inside the package in a wheel."""

import functools
import tomllib
from pathlib import Path
from typing import Any

_PACKAGE = Path(__file__).resolve().parent


def data_folder(name: str) -> Path:
    """Path of ``static`` or ``sample_images``."""
    in_wheel = _PACKAGE / name
    return in_wheel if in_wheel.is_dir() else _PACKAGE.parent / name


def static_path(name: str) -> Path:
    """Path of a file in ``static/``."""
    return data_folder("static") / name


@functools.cache
def read_toml(name: str) -> dict[str, Any]:
    """What a TOML file of ``static/`` holds; it is read once, and not to be changed."""
    return tomllib.loads(static_path(name).read_text(encoding="utf-8"))
