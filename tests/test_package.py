"""What the distribution carries, and that it works away from the checkout and beside whatever a lab has."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.support import layout

ROOT = Path(__file__).resolve().parents[1]
BUILD = "import sys; from setuptools import build_meta; print(getattr(build_meta, sys.argv[1])(sys.argv[2]))"
UNCOMPILED = {"NUMBA_DISABLE_JIT": "1"}  # compiling takes half a minute; installing the checkout has tried it
TEXTS = ("README.md", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "SECURITY.md", "LICENSES-THIRD-PARTY.md")
PLAIN = str(ROOT / "sample_images" / "plain.png")


def build(kind, source, target):
    command = [sys.executable, "-c", BUILD, f"build_{kind}", str(target)]
    subprocess.run(command, cwd=source, check=True, capture_output=True, timeout=600)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel that is built from the source distribution of a copy, so that nothing is left in the checkout."""
    folder = tmp_path_factory.mktemp("distribution")
    copy = folder / "copy"
    copy.mkdir()
    skip = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in ("app", "pipeline", "static", "sample_images", "docs"):
        shutil.copytree(ROOT / name, copy / name, ignore=skip)
    for name in ("pyproject.toml", "MANIFEST.in", "LICENSE", "Makefile", "mkdocs.yml", *TEXTS):
        shutil.copy(ROOT / name, copy)
    build("sdist", copy, folder)
    (sdist,) = folder.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    build("wheel", folder / sdist.name.removesuffix(".tar.gz"), folder)
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def unpacked(wheel):
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(wheel.parent / "site")
    return wheel.parent / "site"


@pytest.fixture
def lab(tmp_path):
    """A folder of somebody's own, with modules that are called as our folders are."""
    (tmp_path / "lab").mkdir()
    for name in ("pipeline.py", "static.py", "app/__init__.py", "app/cli.py"):
        (tmp_path / "lab" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "lab" / name).write_text("raise RuntimeError('a module of the lab was imported')\n")
    return tmp_path / "lab"


def run(arguments, cwd, **variables):
    return subprocess.run(
        [str(word) for word in arguments],
        env=os.environ | {name: str(value) for name, value in variables.items()},
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


@pytest.mark.slow
def test_the_wheel_has_one_name_at_its_top(unpacked):
    names = sorted(path.name for path in unpacked.iterdir())
    assert names[0] == "dockpose"
    assert [name.split("-")[0] + Path(name).suffix for name in names[1:]] == ["dockpose.dist-info"]


def test_all_code_is_in_the_wheel(unpacked):
    ours = {layout.module_name(path) for house in layout.HOUSES for path in layout.files(house)}
    parts = (path.relative_to(unpacked).with_suffix("").parts for path in (unpacked / "dockpose").rglob("*.py"))
    assert {".".join(one).removesuffix(".__init__") for one in parts} == ours
    assert (unpacked / "dockpose" / "py.typed").exists()
    assert (unpacked / "dockpose/simulate/optics/petzold.csv").exists()
    assert (unpacked / "dockpose/paper/tables.csv").exists()
    assert (unpacked / "dockpose/paper/scenes.toml").exists()


def test_static_and_samples_are_in_the_wheel(unpacked):
    for folder, place in (("static", "app/static"), ("sample_images", "sample_images")):
        ours = {path.name for path in (ROOT / folder).iterdir() if path.is_file() and "screenshot" not in path.name}
        assert ours
        assert ours == {path.name for path in (unpacked / "dockpose" / place).iterdir()}


def test_what_people_read_is_in_the_source_distribution(wheel):
    (archive,) = wheel.parent.glob("*.tar.gz")
    folder = wheel.parent / archive.name.removesuffix(".tar.gz")
    assert [
        name for name in (*TEXTS, "mkdocs.yml", "docs/index.md", "docs/site/hooks.py") if not (folder / name).exists()
    ] == []
    pictures = {path.name for path in (ROOT / "static").glob("screenshot*")}
    assert pictures == {path.name for path in (folder / "static").glob("screenshot*")}


def test_the_version_is_one(unpacked):
    import dockpose

    (metadata,) = unpacked.glob("dockpose-*.dist-info/METADATA")
    text = metadata.read_text(encoding="utf-8")
    assert f"\nVersion: {dockpose.__version__}\n" in text
    assert "\nRequires-Python: >=3.11\n" in text
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {dockpose.__version__}\n" in citation
    assert f"\n## [{dockpose.__version__}] - " in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_public_names_come_from_the_wheel(unpacked, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(unpacked)!r})\n"
        "from dockpose import Camera, Dock, Settings, Tracker, estimate, open_frames\n"
        "import dockpose, dockpose.thresholds, dockpose.simulate, dockpose.app\n"
        "print(dockpose.__file__)"
    )
    done = run([sys.executable, "-I", "-c", code], tmp_path)
    assert str(unpacked) in done.stdout, done.stderr


def test_the_wheel_estimates_its_own_sample_outside_the_checkout(unpacked, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(unpacked)!r})\n"
        "import dockpose.app.cli; from dockpose.sidecar import sample_path\n"
        "print(dockpose.app.cli.__file__, file=sys.stderr)\n"
        "sys.exit(dockpose.app.cli.main(['estimate', str(sample_path('plain')), '--json', '-']))"
    )
    done = run([sys.executable, "-I", "-c", code], tmp_path, **UNCOMPILED)
    assert done.returncode == 0, done.stderr
    assert str(unpacked) in done.stderr
    line = json.loads(done.stdout)
    assert str(unpacked) in line["source"]
    assert line["status"] == "ok"


@pytest.mark.slow
@pytest.mark.parametrize("installed", ["wheel", "editable"])
def test_modules_of_a_lab_called_pipeline_and_app_are_left_alone(installed, unpacked, lab):
    path = [lab] if installed == "editable" else [lab, unpacked]
    program = [sys.executable, "-m", "dockpose.app.cli", "estimate", PLAIN, "--json", "-"]
    done = run(program, lab, PYTHONPATH=os.pathsep.join(map(str, path)), **UNCOMPILED)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "ok"
    where = run([sys.executable, "-c", "import dockpose; print(dockpose.__file__)"], lab, PYTHONPATH=path[-1])
    assert (str(unpacked) in where.stdout) == (installed == "wheel")


@pytest.fixture
def read_only(unpacked, tmp_path):
    """An installation beside whose files nothing can be kept; for root too, since a file stands in each one's way."""
    site = tmp_path / "site"
    shutil.copytree(unpacked, site, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in ("lights", "pixels", "thresholds"):
        (site / "dockpose" / folder / "__pycache__").write_text("")
    return site


# A single loop is compiled: all of them take half a minute.
BRIGHT = """
import numpy as np
from dockpose.compiled import on_compiling
from dockpose.pixels.bright import bright_pixels
told = []
with on_compiling(lambda: told.append(1)):
    found = len(bright_pixels(np.full((2, 2), 9, np.uint8), 5))
print("compiling" if told else "kept", found)
"""
NOWHERE = {"HOME": "/dev/null/home", "XDG_CACHE_HOME": "/dev/null/cache", "NUMBA_CACHE_DIR": ""}


@pytest.mark.slow
def test_a_read_only_installation_compiles_each_time(read_only, tmp_path):
    for _ in range(2):
        done = run([sys.executable, "-B", "-c", BRIGHT], tmp_path, PYTHONPATH=read_only, **NOWHERE)
        assert done.stdout.split() == ["compiling", "4"], done.stderr
