"""``dockpose check`` on sessions whose measured values are known."""

import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from dockpose import Dock, estimate
from dockpose.app.cli import main
from dockpose.app.experiment import Session
from dockpose.camera.files import load_camera
from dockpose.sidecar import load_dock
from dockpose.simulate import Pose, render

from tests.support.scenes import CAMERA, DOCK, random_scene

WRONG = Dock(DOCK.diameter / 1.01, DOCK.lights)  # by which all ranges are 1 % short


@pytest.fixture(scope="module")
def estimates():
    """30 docks at known places, as estimated with a diameter that is wrong."""
    rng, found = np.random.default_rng(0), []
    while len(found) < 30:
        z = rng.uniform(0.8, 2.0)
        place = (float(rng.uniform(-0.2, 0.2) * z), float(rng.uniform(-0.15, 0.15) * z), float(z))
        pose = Pose(position_m=place, theta_x_deg=float(rng.uniform(-25, 25)), theta_y_deg=float(rng.uniform(-25, 25)))
        image, truth = render(msgspec.structs.replace(random_scene(1), pose=pose, seed=len(found)))
        result = estimate(image, CAMERA, WRONG)
        if result.status == "ok" and result.selected is not None:
            found.append((result, truth))
    return found


@pytest.fixture
def session(tmp_path):
    def make(estimates, name="day", *, shift_cm=0.0, columns=("x", "y", "z"), slip=None):
        rng, picture = np.random.default_rng(1), np.zeros((480, 640), np.uint8)
        with Session.create(tmp_path / name) as session:
            for number, (found, truth) in enumerate(estimates):
                tape_cm = 100 * truth.position_m + rng.normal(0, 0.2, 3) + [0, 0, shift_cm]
                tape_cm[2] += 12 * (number == slip)
                typed = {f"measured_{axis}_cm": round(float(tape_cm["xyz".index(axis)]), 1) for axis in columns}
                session.take(picture, found, f"{number}.png", None, **typed)
        return tmp_path / name

    return make


def test_a_diameter_that_is_one_per_cent_wrong_is_told_and_mended(estimates, session, capsys, tmp_path):
    folder, out, out_camera = session(estimates), tmp_path / "dock.yaml", tmp_path / "camera.yaml"
    assert main(["check", str(folder), "--out", str(out), "--out-camera", str(out_camera)]) == 0
    told = capsys.readouterr().out
    match = re.search(r"All ranges are ([\d.]+) ± ([\d.]+) % too short: the diameter or the focal length\.", told)
    assert match is not None, told
    share, sigma = map(float, match.groups())
    assert abs(share - 1) < 3 * sigma
    assert sigma < 0.3
    dock = load_dock(out)
    assert dock.diameter_sigma_m is not None
    assert dock.diameter == pytest.approx(DOCK.diameter, abs=3 * dock.diameter_sigma_m)
    assert "zero" not in told
    # With the diameter as it was, a focal length so much longer gives the same ranges.
    camera = load_camera(out_camera)
    assert camera.fx / CAMERA.fx == pytest.approx(dock.diameter / WRONG.diameter)
    assert camera.sigma.fx is not None
    assert camera.sigma.fx / CAMERA.fx == pytest.approx(dock.diameter_sigma_m / WRONG.diameter)


def test_an_error_within_what_the_files_allow_is_mended_too(estimates, session, capsys, tmp_path):
    ten = session(estimates[:10])
    assert main(["check", str(ten)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "too short: the diameter or the focal length. That is within what camera and dock file allow (" in told
    assert f"m, not {WRONG.diameter:.4f} m; if it is the focal length, that is 707." in told
    assert "--out dock.yaml writes the dock so corrected" in told
    assert main(["check", str(ten), "--out", str(tmp_path / "dock.yaml")]) == 0
    assert load_dock(tmp_path / "dock.yaml").diameter == pytest.approx(DOCK.diameter, rel=0.003)


def test_where_nothing_is_off_no_correction_is_offered(estimates, session, capsys):
    right = [
        (replace(found, choice=replace(found.choice, candidates=tuple(map(_enlarged, found.candidates)))), truth)
        for found, truth in estimates
    ]
    assert main(["check", str(session(right))]) == 0
    told = capsys.readouterr().out
    assert "Ranges have no common error" in told
    assert "If it is" not in told
    assert "--out" not in told


def _enlarged(pose):
    return replace(pose, position_m=1.01 * pose.position_m)


def test_a_tape_that_begins_elsewhere_is_told_apart(estimates, session, capsys):
    folder = session(estimates, shift_cm=1.2, columns=("z",))
    assert main(["check", str(folder)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "too short" in told
    match = re.search(r"Z is ([\d.]+) ± ([\d.]+) cm less than measured everywhere: the tape's zero\.", told)
    assert match is not None, told
    assert abs(float(match[1]) - 1.2) < 3 * float(match[2]) + 0.05


def test_a_mistyped_row_is_named(estimates, session, capsys):
    assert main(["check", str(session(estimates, slip=4))]) == 0
    told = capsys.readouterr().out
    assert re.search(r"Row 5 is off by 1[12]\.\d cm, \d\d standard errors: mistyped", told)
    assert "5 (left out)" in told


def test_what_cannot_be_checked_is_one_sentence(estimates, session, refusal, tmp_path):
    folder = session(estimates[:5], columns=())
    assert "3 rows with a pose and measured values are needed, and there are 0" in refusal("check", str(folder))
    assert "is not a session" in refusal("check", str(tmp_path / "none"))
    assert "--tape is 0; it must be above 0" in refusal("check", str(folder), "--tape", "0")
