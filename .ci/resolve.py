"""Asks pip whether the oldest and the newest dependencies fit together on each Python that pyproject.toml names."""

import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
EXTRAS = ("mavlink", "ros")  # that users install


def main() -> int:
    """Print a line for each Python and kind. Returns 1 where one does not resolve."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pythons = [name.split(" :: ")[-1] for name in project["classifiers"] if ":: 3." in name]
    wanted = [*project["dependencies"], *(one for extra in EXTRAS for one in project["optional-dependencies"][extra])]
    failed = 0
    for python in pythons:
        for kind in ("oldest", "newest"):
            failed += not resolves(wanted, python, oldest(python) if kind == "oldest" else [], kind)
    return 1 if failed else 0


def oldest(python: str) -> list[str]:
    """Lines of the constraints whose markers hold for that Python; pip itself asks them of the Python that runs it."""
    lines = (ROOT / "tests/constraints-oldest.txt").read_text(encoding="utf-8").splitlines()
    wanted = [Requirement(line) for line in lines if line and not line.startswith("#")]
    here = {"python_version": python, "python_full_version": f"{python}.0"}
    return [f"{one.name}{one.specifier}" for one in wanted if one.marker is None or one.marker.evaluate(here)]


def resolves(dependencies: list[str], python: str, constraints: list[str], kind: str) -> bool:
    """Ask pip, and print what it would install, or why it cannot."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "constraints.txt"
        file.write_text("\n".join(constraints), encoding="utf-8")
        options = ["--dry-run", "--ignore-installed", "--only-binary=:all:", "--python-version", python]
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", *options]
        command += ["--target", folder, "--constraint", str(file), *dependencies]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    found = [line for line in done.stdout.splitlines() if line.startswith("Would install")]
    errors = [line for line in done.stderr.splitlines() if line.startswith("ERROR")]
    print(f"Python {python}, {kind}: {'; '.join(errors or found)}", flush=True)
    return done.returncode == 0


if __name__ == "__main__":
    sys.exit(main())
