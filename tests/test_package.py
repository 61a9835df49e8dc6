"""What a wheel carries, and that it works away from the checkout."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True, timeout=120)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_static_and_samples_are_in_the_wheel(unpacked):
    for folder in ("static", "sample_images"):
        ours = {path.name for path in (ROOT / folder).iterdir() if path.is_file() and "screenshot" not in path.name}
        assert ours
        assert ours == {path.name for path in (unpacked / "dockpose/app" / folder).iterdir()}
    assert not (unpacked / "tests").exists()


def test_the_wheel_estimates_its_own_sample_outside_the_checkout(unpacked, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(unpacked)!r})\n"
        "import dockpose.app.cli; from dockpose.app.resources import sample_path\n"
        "print(dockpose.app.cli.__file__, file=sys.stderr)\n"
        "sys.exit(dockpose.app.cli.main(['estimate', str(sample_path('plain')), '--json', '-']))"
    )
    command = [sys.executable, "-I", "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert str(unpacked) in done.stderr
    line = json.loads(done.stdout)
    assert str(unpacked) in line["source"]
    assert line["status"] == "ok"


def test_pipeline_knows_nothing_of_the_app():
    for path in (ROOT / "pipeline").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "dockpose.app" not in text, path
        assert "viser" not in text, path
        assert "print(" not in text, path
