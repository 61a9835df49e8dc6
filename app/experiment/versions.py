"""Which program and which libraries made a result, so that a later run that differs can say why."""

import functools
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

# Those that a number passes through on its way.
_LIBRARIES = {"numpy": "numpy", "opencv": "opencv-python-headless", "scipy": "scipy", "numba": "numba"}


@functools.cache
def _versions() -> tuple[tuple[str, str], ...]:
    found = [("dockpose", _version("dockpose")), ("python", platform.python_version())]
    found += [(name, _version(package)) for name, package in _LIBRARIES.items()]
    return (*found, ("machine", f"{platform.system()} {platform.machine()}"))


def versions() -> dict[str, str]:
    """Versions of the program, of Python and of the libraries that compute, and the kind of machine."""
    return dict(_versions())


def with_versions(line: dict[str, Any]) -> dict[str, Any]:
    """A JSON object of schema 1 with the versions added under "program"."""
    return line | {"program": versions()}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
