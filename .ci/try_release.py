"""Install the wheel and the source distribution of a folder into fresh environments, and try each elsewhere."""

import json
import os
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

# No module of the checkout, nor what this user has compiled, helps what is tried.
_CLEAN = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "NUMBA", "VIRTUAL_ENV"))}
_NAMES = "from dockpose import Camera, Dock, Settings, estimate, open_frames, register_threshold; print('imported')"


def main() -> int:
    """Try both; returns 1 where one fails."""
    folder = Path(sys.argv[1]).resolve()
    for pattern in ("*.whl", "*.tar.gz"):
        (file,) = folder.glob(pattern)
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as place:
            try:
                _try(file, Path(place))
            except (AssertionError, subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
                print(f"{file.name} fails: {error}")
                print(getattr(error, "stderr", "") or "")
                return 1
        print(f"{file.name}: installed and tried in {time.perf_counter() - start:.0f} s", flush=True)
    return 0


def _try(file: Path, place: Path) -> None:
    """Install one file, and run what a stranger would run first."""
    elsewhere = place / "elsewhere"
    elsewhere.mkdir()
    venv.create(place / "env", with_pip=True)
    programs = place / "env" / ("Scripts" if os.name == "nt" else "bin")

    def run(program: str, *arguments: str) -> str:
        command = [str(programs / program), *arguments]
        done = subprocess.run(
            command, cwd=elsewhere, env=_CLEAN, capture_output=True, text=True, timeout=600, check=True
        )
        return done.stdout

    run("python", "-m", "pip", "--disable-pip-version-check", "install", "--quiet", str(file))
    version = run("dockpose", "--version").strip()
    assert version == f"dockpose {file.name.split('-')[1].removesuffix('.tar.gz')}", version
    assert run("python", "-m", "dockpose", "--version").strip() == version
    assert "estimate the dock's pose" in run("dockpose", "--help")
    assert run("python", "-c", _NAMES).strip() == "imported"
    assert run("dockpose", "doctor").endswith("nothing is broken\n")  # else its exit status tells
    found = [json.loads(line) for line in run("dockpose", "estimate", "sample_images", "--json", "-").splitlines()]
    assert len(found) > 10, len(found)
    assert all(one["status"] == "ok" for one in found), [one["message"] for one in found]
    assert str(place) in found[0]["source"], found[0]["source"]  # the samples are those of the installation
    assert list(elsewhere.iterdir()) == [], list(elsewhere.iterdir())


if __name__ == "__main__":
    sys.exit(main())
