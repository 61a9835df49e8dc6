"""What we wrote is read back as the same docks over time, whatever the form."""

import json

import numpy as np
import pytest
from dockpose import estimate
from dockpose.app.cli import main
from dockpose.app.experiment import Session
from dockpose.app.export.truth.results import read_results
from dockpose.app.export.video import VideoFile
from dockpose.camera.files import save_camera
from dockpose.files import FileError
from dockpose.simulate import Approach, FilmPlan, film

from tests.support import bags
from tests.support.scenes import CAMERA, DOCK, random_scene
from tests.support.trajectories import known

FRAMES = 4
KNOWN = ["--dock-diameter", "0.30", "--lights", "10", "--quiet"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A film whose second frame is dark, and its results in each form."""
    folder = tmp_path_factory.mktemp("film")
    plan = FilmPlan(scene=random_scene(3), motion=Approach(start_m=1.3, end_m=1.2, frames=FRAMES, rate_hz=10.0))
    with VideoFile(folder / "film.mkv", 10.0) as video:
        for frame in film(plan):
            video.write(frame.image * 0 if frame.number == 2 else frame.image, frame.time_s)
    save_camera(CAMERA, folder / "camera.yaml")
    named = {"--json": "film.jsonl", "--csv": "film.csv", "--out": "film.mcap", "--camera": "camera.yaml"}
    forms = [word for option, name in named.items() for word in (option, str(folder / name))]
    assert main(["estimate", str(folder / "film.mkv"), *KNOWN, *forms]) == 0
    return folder


@pytest.fixture(scope="module")
def lines(folder):
    return [json.loads(line) for line in (folder / "film.jsonl").read_text().splitlines()]


@pytest.mark.parametrize("name", ["film.jsonl", "film.csv", "film.mcap"])
def test_docks_are_the_same(folder, lines, name):
    track = read_results(folder / name).track
    begin_s = 1.0 if name == "film.mcap" else 0.0  # a stamp of 0 stands for none
    np.testing.assert_allclose(track.times_s - begin_s, [0, 0.1, 0.2, 0.3], atol=1e-6)
    assert np.isnan(track.positions_m[1]).all()
    assert np.isnan(known(track.other_positions_m)[1]).all()
    for row in (0, 2, 3):
        chosen, other = (lines[row]["candidates"][lines[row]["selected"] ^ index] for index in (0, 1))
        np.testing.assert_allclose(track.positions_m[row], chosen["position_m"], rtol=1e-9)
        np.testing.assert_allclose(track.normals[row], chosen["normal"], atol=1e-9)
        np.testing.assert_allclose(known(track.other_positions_m)[row], other["position_m"], rtol=1e-9)
        np.testing.assert_allclose(known(track.other_normals)[row], other["normal"], atol=1e-9)
        sigmas = np.sqrt(np.diagonal(known(track.covariances_total)[row]))
        told = [*chosen["sigma_total_position_m"], *np.radians(chosen["sigma_total_theta_deg"])]
        np.testing.assert_allclose(sigmas, told, rtol=1e-4)
        if name != "film.mcap":  # whose messages have the total alone
            sigmas = np.sqrt(np.diagonal(track.covariances[row]))
            told = [*chosen["sigma_position_m"], *np.radians(chosen["sigma_theta_deg"])]
            np.testing.assert_allclose(sigmas, told, rtol=1e-4)


def test_camera_and_dock_come_with_the_lines(folder):
    track = read_results(folder / "film.jsonl").track
    assert (track.camera, track.dock) == (CAMERA, DOCK)
    camera = read_results(folder / "film.mcap").track.camera
    assert camera is not None
    assert np.array_equal(camera.matrix, CAMERA.matrix)
    assert read_results(folder / "film.csv").track.dock is None


def test_pictures_are_found_again(folder, lines):
    picture, line = read_results(folder / "film.jsonl").whole(3)
    assert line == lines[3]
    assert picture.shape == (480, 640)
    other, _ = read_results(folder / "film.mcap").whole(3)
    assert np.array_equal(picture, other)
    with pytest.raises(FileError, match="says not where its pictures are"):
        read_results(folder / "film.csv").whole(3)


@pytest.mark.parametrize("name", ["film.jsonl", "film.csv"])
def test_each_row_tells_its_film_and_which_frame_of_it_it_is(folder, name):
    assert read_results(folder / name).films == [("film.mkv", number) for number in range(FRAMES)]


def test_a_session_has_the_times_at_which_frames_were_taken(tmp_path, folder, lines):
    picture, _ = read_results(folder / "film.jsonl").whole(0)
    with Session.create(tmp_path / "day") as session:
        session.take(picture, estimate(picture, CAMERA, DOCK), "tank")
    results = read_results(tmp_path / "day")
    assert results.clock == "time_unix_s"
    assert results.track.times_s[0] > 1.7e9
    np.testing.assert_allclose(results.track.positions_m[0], lines[0]["chosen"]["position_m"], rtol=1e-6)
    assert np.array_equal(results.whole(0)[0], picture)


def test_the_time_of_day_is_taken_where_it_is_known(tmp_path, lines):
    path = tmp_path / "day.jsonl"
    path.write_text("".join(json.dumps({**line, "time_unix_s": 1e9 + row}) + "\n" for row, line in enumerate(lines)))
    results = read_results(path)
    assert results.clock == "time_unix_s"
    assert results.track.times_s.tolist() == [1e9, 1e9 + 1, 1e9 + 2, 1e9 + 3]


def test_frames_out_of_order_and_without_a_time_are_told(tmp_path, lines):
    path = tmp_path / "odd.jsonl"
    made = [lines[3], lines[0], {**lines[2], "time_s": None}, lines[0]]
    path.write_text("".join(json.dumps(line) + "\n" for line in made) + '{"schema":1,"sou')
    results = read_results(path)
    assert results.track.times_s == pytest.approx([0.0, 0.3])
    assert results.notes[0] == "odd.jsonl: line 5, the last, is cut short and left out"
    assert results.notes[1].startswith("odd.jsonl: 2 of 4 frames without a time, or with that of another, are left out")


BAD = {
    "a.jsonl": ('{"candidates": 3}\n', "line 1 is none of our results"),
    "far.jsonl": (
        '{"candidates": [{"position_m": [1e300, 0, 1], "normal": [0, 0, -1]}]}\n',
        "line 1 is none of our results",
    ),
    "none.jsonl": ('{"schema":1,"source":"a","time_s":null}\n', "has no frames with a time; none.jsonl: 1 of 1 frames"),
    "a.csv": ("source,frame,time_s,selected,a_x_m\nfilm,0,zero,A,1\n", "line 2 is no row of estimate --csv"),
    "picture": ("\x89PNG", "a picture"),
    "empty": ("", "is no results of ours"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_results_are_one_sentence(tmp_path, name):
    text, words = BAD[name]
    (tmp_path / name).write_text(text, encoding="latin-1")
    with pytest.raises(FileError, match=words):
        read_results(tmp_path / name)


def test_a_bag_of_others_has_no_results(tmp_path):
    path = bags.write_mcap(tmp_path / "run.mcap", [("/words", bags.STRING, 1, bags.text("hello"))])
    with pytest.raises(FileError, match="has no topics of ours"):
        read_results(path)
