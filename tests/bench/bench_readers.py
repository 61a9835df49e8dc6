"""A bag of ours read by what Foxglove reads bags with, from npm, and by Rerun, from PyPI; both need the internet."""

import json
import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest
from dockpose import Dock, Entrance
from dockpose.app.cli import main
from dockpose.app.export.recordings.ros import TOPICS
from dockpose.app.inputs.pictures import save_dock

from tests.support import bags

FRAMES, DARK = 6, (2,)
PACKAGES = ("@mcap/core@2", "@foxglove/rosmsg@5", "@foxglove/rosmsg2-serialization@3", "fzstd@0.1")
RERUN = "rerun-sdk==0.41.0"
SECONDS = 600


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A bag with all topics, and the JSON lines of the same run beside it."""
    folder = tmp_path_factory.mktemp("bag")
    known = bags.write_approach(folder, FRAMES, DARK)
    save_dock(Dock(0.30, 10, entrance=Entrance(position_m=(0.0, 0.0, 0.25))), folder / "dock.yaml")
    (folder / "vehicle.yaml").write_text("T_body_camera: {position_m: [0.2, 0.0, 0.1], pitch_deg: -10}\nframe: frd\n")
    words = [*known[:2], "--dock", str(folder / "dock.yaml"), "--vehicle", str(folder / "vehicle.yaml")]
    files = ["--out", str(folder / "poses.mcap"), "--json", str(folder / "lines.jsonl")]
    assert main(["estimate", str(folder / "run.mcap"), *words, *files]) == 0
    return folder / "poses.mcap"


def run(*words: object, **more: object) -> str:
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=SECONDS, check=False, **more)  # pyright: ignore[reportCallIssue, reportArgumentType]
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_foxglove_s_reader_finds_every_message_with_its_numbers(bag, tmp_path):
    if shutil.which("npm") is None:
        pytest.skip("needs npm")
    shutil.copy(Path(__file__).with_name("read_bag.mjs"), tmp_path)
    run("npm", "install", "--silent", "--no-save", *PACKAGES, cwd=tmp_path)
    found = [json.loads(line) for line in run("node", "read_bag.mjs", bag, cwd=tmp_path).splitlines()]
    assert {each["topic"]: each["kind"] for each in found} == TOPICS
    lines = [json.loads(line) for line in bag.with_name("lines.jsonl").read_text().splitlines()]
    for topic in ("/diagnostics", "/dock/image", "/dock/annotations", "/dock/camera_info"):
        assert sum(each["topic"] == topic for each in found) == FRAMES
    poses = [each["fields"]["pose"]["pose"]["position"] for each in found if each["topic"] == "/dock/pose"]
    expected = [line["chosen"]["position_m"] for line in lines if line["chosen"]]
    assert [[pose[axis] for axis in "xyz"] for pose in poses] == expected
    drawn = [each["fields"] for each in found if each["topic"] == "/dock/annotations"]
    for fields, line in zip(drawn, lines, strict=True):
        lights = {(one["x_px"] + 0.5, one["y_px"] + 0.5) for one in line["markers"] if one["on_ring"]}
        assert lights <= {(one["position"]["x"], one["position"]["y"]) for one in fields["circles"]}
        assert all(one["points"] and one["thickness"] > 0 for one in fields["points"])


def test_rerun_converts_every_topic(bag, tmp_path):
    venv.create(tmp_path / "rerun", with_pip=True)
    bin_ = tmp_path / "rerun" / ("Scripts" if sys.platform == "win32" else "bin")
    run(bin_ / "pip", "install", "-q", RERUN)
    quiet = os.environ | {"RERUN_ANALYTICS": "0"}
    told = run(bin_ / "rerun", "mcap", "convert", bag, "-o", tmp_path / "poses.rrd", env=quiet)
    assert set(TOPICS) <= set(re.findall(r"/[\w/]+", told))
    assert "verified without error" in run(bin_ / "rerun", "rrd", "verify", tmp_path / "poses.rrd", env=quiet)
    chunks = run(bin_ / "rerun", "rrd", "print", tmp_path / "poses.rrd", env=quiet)
    assert "/dock/image - data columns: [CoordinateFrame:frame EncodedImage:blob]" in chunks
    assert "/dock/camera_info - data columns: [Pinhole:" in chunks
