"""Run the quick tests under every Python that pyproject.toml names and that is found, but the one that runs this."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
# Reports, examples, documents and slow tests are the same under each, and take most of the time.
TESTS = ("-m", "not slow and not extra", "tests/pipeline", "tests/app", "--ignore", "tests/pipeline/paper")


def main() -> int:
    """Print which were run and which not found. Returns 1 where one fails."""
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    found = {name: program for name in PYTHONS if name != here and (program := find(name)) is not None}
    failed = [name for name, program in found.items() if not passes(name, program)]
    missing = [name for name in PYTHONS if name != here and name not in found]
    print(f"ran under Python {', '.join(found) or 'none'} beside {here}; not found: {', '.join(missing) or 'none'}")
    print(f"failed: {', '.join(failed) or 'none'}", flush=True)
    return 1 if failed else 0


def find(name: str) -> str | None:
    """A program that is that Python: on the path, or the newest of pyenv's."""
    programs = [shutil.which(f"python{name}")]
    if shutil.which("pyenv"):
        done = subprocess.run(["pyenv", "root"], capture_output=True, text=True, check=False)
        versions = Path(done.stdout.strip(), "versions").glob(f"{name}.*/bin/python")
        programs += map(str, sorted(versions, key=_version, reverse=True))
    return next((one for one in programs if one and is_python(one, name)), None)


def _version(program: Path) -> list[int]:
    return [int(part) if part.isdigit() else -1 for part in program.parts[-3].split(".")]


def is_python(program: str, name: str) -> bool:
    """Whether a program runs, as pyenv's stand-ins may not, and is that Python."""
    code = "import sys, venv; print('%d.%d' % sys.version_info[:2])"
    done = subprocess.run([program, "-c", code], capture_output=True, text=True, check=False)
    return done.returncode == 0 and done.stdout.strip() == name


def passes(name: str, program: str) -> bool:
    """Make an environment where there is none, install into it, and run the tests."""
    folder = ROOT / f".venv-{name}"
    python = str(folder / ("Scripts" if os.name == "nt" else "bin") / "python")
    pip = [python, "-m", "pip", "--disable-pip-version-check", "install", "--no-compile", "--quiet"]
    tests = [python, "-m", "pytest", "--numprocesses", "2", "--dist", "loadfile", "--no-loadscope-reorder"]
    print(f"Python {name}", flush=True)
    steps = (
        [program, "-m", "venv", str(folder)],
        [*pip, "--editable", ".[test]"],
        [python, "-m", "tests.support.compile_loops"],
        [*tests, "-p", "no:cacheprovider", *TESTS],
    )
    return all(subprocess.run(step, cwd=ROOT, check=False).returncode == 0 for step in steps)


if __name__ == "__main__":
    sys.exit(main())
