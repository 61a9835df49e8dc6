"""What the program is made of: its own files, in a checkout or a wheel, and the versions of its libraries."""

import functools
import platform
import tomllib
from pathlib import Path
from typing import Any

_PACKAGE = Path(__file__).resolve().parent
# Those that a number passes through on its way.
_LIBRARIES = {"numpy": "numpy", "opencv": "opencv-python-headless", "scipy": "scipy", "numba": "numba"}


def static_path(name: str) -> Path:
    """Path of a file in ``static/``."""
    in_wheel = _PACKAGE / "static"
    return (in_wheel if in_wheel.is_dir() else _PACKAGE.parent / "static") / name


@functools.cache
def read_toml(name: str) -> dict[str, Any]:
    """What a TOML file of ``static/`` holds; it is read once, and not to be changed."""
    return tomllib.loads(static_path(name).read_text(encoding="utf-8"))


@functools.cache
def versions() -> dict[str, str]:
    """Versions of the program, Python and the libraries that compute, and the kind of machine; not to be changed."""
    libraries = {name: _version(package) for name, package in _LIBRARIES.items()}
    machine = f"{platform.system()} {platform.machine()}"
    return {"dockpose": _version("dockpose"), "python": platform.python_version(), **libraries, "machine": machine}


def with_versions(line: dict[str, Any]) -> dict[str, Any]:
    """A JSON object of schema 1 with the versions added under "program"."""
    return line | {"program": versions()}


def _version(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version  # takes longer to import than all else here

    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
