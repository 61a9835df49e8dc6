"""Threshold methods that are there for the time of a test; and packages that bring some."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import patch

from dockpose import register_threshold
from dockpose.thresholds import METHODS


@contextlib.contextmanager
def registered(**methods: tuple[str, Callable]) -> Iterator[None]:
    """Register functions by their names, each with its title, and forget them afterwards."""
    with patch.object(METHODS, "_entries", dict(METHODS._entries)):
        for name, (title, function) in methods.items():
            register_threshold(name, title=title)(function)
        yield


def install(folder: Path, package: str, code: str, **points: str) -> None:
    """Lay a package into a folder as pip does: a module of that code, and its entry points."""
    folder.mkdir(exist_ok=True)
    (folder / f"{package}.py").write_text(code, encoding="utf-8")
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8")
    lines = "".join(f"{name} = {target}\n" for name, target in points.items())
    (about / "entry_points.txt").write_text(f"[dockpose.thresholds]\n{lines}", encoding="utf-8")


def run_beside(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the program where the packages of a folder are installed too."""
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-m", "dockpose.app.cli", *arguments]
    environment = os.environ | {"PYTHONPATH": path}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
