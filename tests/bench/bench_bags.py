"""An MCAP of a thousand frames, written by another library, against the same pictures; and cuts all over a bag."""

import json
import time

import cv2
import numpy as np
import pytest
from dockpose import simulate
from dockpose.app.cli import main
from dockpose.camera.files import save_camera
from dockpose.sources import Bag, SourceError
from mcap.writer import CompressionType

from tests.support import bags
from tests.support.scenes import CAMERA, random_scene

FRAMES, CUTS = 1000, 100
DOCK_WORDS = ["--dock-diameter", "0.30", "--lights", "10"]
_OF_THE_FILE = ("source", "sha256", "camera", "elapsed_ms", "time_s", "time_unix_s")


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    motion = simulate.Approach(start_m=4.0, end_m=0.8, frames=FRAMES, rate_hz=10.0, drift_m=0.005, drift_deg=0.5)
    return [frame.image for frame in simulate.film(simulate.FilmPlan(scene=random_scene(3), motion=motion))]


def test_a_thousand_frames_give_the_same_poses(pictures, tmp_path):
    (tmp_path / "pictures").mkdir()
    for number, picture in enumerate(pictures):
        cv2.imwrite(str(tmp_path / "pictures" / f"{number:04d}.png"), picture)
    save_camera(CAMERA, tmp_path / "camera.yaml")
    bags.write_mcap(tmp_path / "run.mcap", bags.frames(pictures))
    lines = {}
    for name, words in (("pictures", ["--rate", "10"]), ("run.mcap", [])):
        out, begin_s = tmp_path / f"{name}.jsonl", time.process_time()
        words = [*words, "--camera", str(tmp_path / "camera.yaml"), *DOCK_WORDS, "--json", str(out)]
        assert main(["estimate", str(tmp_path / name), *words]) == 0
        found = [json.loads(line) for line in out.read_text().splitlines()]
        lines[name] = [{key: line[key] for key in line if key not in _OF_THE_FILE} for line in found]
        print(f"\n{name}: {len(found)} frames, {1e3 * (time.process_time() - begin_s) / FRAMES:.2f} ms CPU a frame")
    same = sum(a == b for a, b in zip(lines["pictures"], lines["run.mcap"], strict=True))
    print(f"frames with the same result, bit by bit: {same} of {FRAMES}")
    assert same == FRAMES


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
def test_cuts_all_over_a_bag(pictures, tmp_path, compression):
    """Noise of camera pictures; what is whole is known by where the writer puts messages without compression."""
    shown = pictures[:60]
    whole = bags.write_mcap(tmp_path / "whole.mcap", bags.frames(shown), compression=compression).read_bytes()
    rng, counts = np.random.default_rng(0), []
    for _ in range(CUTS):
        cut, told = int(rng.integers(50, len(whole) - 10)), []
        path = tmp_path / "cut.mcap"
        path.write_bytes(whole[:cut])
        try:
            with Bag(str(path), told.append) as bag:
                found = list(bag)
        except SourceError:  # not even one frame is there
            found = []
        if compression is CompressionType.NONE:
            assert len(found) == sum(whole.find(one.tobytes()) + one.nbytes <= cut for one in shown)
        assert all(np.array_equal(frame.image, one) for frame, one in zip(found, shown, strict=False))
        counts.append(len(found) - int(cut / len(whole) * len(shown)))
        assert len(told) == (1 if found else len(told))
    print(
        f"\n{compression.name}: frames found beyond the share of the file that is there: {min(counts)} to {max(counts)}"
    )
