"""Sequences that the page can play: which there are, opening them, and reading their frames."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.sequences import SIMULATED, capture_from, choices, choose, given, is_sequence, sent, simulated
from dockpose.app.processing.following import FrameFollower, chosen_by_track
from dockpose.app.state.parameters import put
from dockpose.app.state.view import DEFAULT_DOCK, with_first_frame, with_frame
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, Pose, Scene
from dockpose.simulate.optics.water import preset
from dockpose.simulate.parts import Text
from dockpose.sources import CaptureSettings, Simulated, SourceError
from PIL import Image

from tests.support import bags

CAMERA = Camera(350, 350, 159.5, 119.5, 320, 240)
SCENE = Scene(
    camera=CAMERA,
    dock=Dock(0.30, 10),
    pose=Pose(position_m=(0.05, 0.02, 1.2), theta_x_deg=15, theta_y_deg=20),
    water=preset("tank"),
)
FILES = ["notes.txt", "../tank.avi", "/etc/passwd", "rtsp://127.0.0.1/x", "0", "", None, 3, "x.avi"]
NAMES = {"exposure": "Exposure", "gain": "Gain", "rate_hz": "Frames a second", "format": "Format"}


@pytest.fixture
def folder(tmp_path):
    """Two pictures in a folder, a video beside it with its YAML, and a text file."""
    (tmp_path / "shots").mkdir()
    for number, level in enumerate((0, 255)):
        cv2.imwrite(str(tmp_path / "shots" / f"shot{number}.png"), np.full((48, 64), level, np.uint8))
    writer = cv2.VideoWriter(str(tmp_path / "tank.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25, (320, 240))
    for level in (0, 100, 200):
        writer.write(np.full((240, 320, 3), level, np.uint8))
    writer.release()
    save_camera(CAMERA, tmp_path / "tank.yaml")
    (tmp_path / "notes.txt").write_text("not a video")
    return tmp_path


def refuse(text):
    raise AssertionError(text)


def test_choices_are_the_given_one_those_below_the_folder_and_simulated_ones(folder):
    first = given("/dev/videos/dive.mp4", None, None)
    assert choices(first, folder) == ["dive.mp4", "tank.avi", "pictures in shots", *SIMULATED]
    assert choices(None, None) == [*SIMULATED]


def test_video_comes_with_the_camera_beside_it(folder):
    with choose("tank.avi", None, folder, SCENE).open(refuse) as frames:
        assert (frames.count, frames.camera, frames.dock) == (3, CAMERA, None)


def test_pictures_of_a_folder_come_in_order(folder):
    frames = choose("pictures in shots", None, folder, SCENE).open(refuse)
    assert [int(frame.image.max()) for frame in frames] == [0, 255]


@pytest.mark.parametrize("name", [*FILES, "pictures in ..", "pictures in /etc", "pictures in nowhere"])
def test_browser_opens_nothing_else(folder, name):
    with pytest.raises(UserError, match="no sequence called" if name in FILES else "not"):
        choose(name, None, folder, SCENE)


def test_sent_video_is_played_and_deleted(folder):
    source = sent((folder / "tank.avi").read_bytes(), "my dive.avi")
    assert source.name == "my dive.avi"
    with source.open(refuse) as frames:
        assert [int(frame.image.mean().round(-2)) for frame in frames] == [0, 100, 200]
    assert source.folder is not None
    kept = source.folder.name
    source.discard()
    assert not Path(kept).exists()


def test_pages_are_a_sequence_of_a_folder_and_when_sent(folder, tmp_path):
    pages = [Image.fromarray(np.full((240, 320), level, np.uint8)) for level in (50, 150)]
    pages[0].save(tmp_path / "pages.tif", save_all=True, append_images=pages[1:])
    pages[0].save(tmp_path / "one.tif")
    assert [name for name in choices(None, tmp_path) if name.endswith(".tif")] == ["pages.tif"]
    source = sent((tmp_path / "pages.tif").read_bytes(), "pages.tif")
    with source.open(refuse) as frames:
        assert [int(frame.image.mean()) for frame in frames] == [50, 150]
    source.discard()
    with pytest.raises(UserError, match=r"one\.tif is not a video, a bag or a picture of several pages"):
        sent((tmp_path / "one.tif").read_bytes(), "one.tif")


def test_sent_file_that_is_no_video_is_named():
    for name in ("text.mp4", "text.txt"):
        with pytest.raises(UserError, match=name):
            sent(b"not a video at all", name).open(refuse)


def test_given_camera_and_dock_go_before_those_beside(folder):
    mine, dock = Camera(500, 500, 159.5, 119.5, 320, 240), Dock(0.5)
    with given(str(folder / "tank.avi"), mine, dock).open(refuse) as frames:
        assert (frames.camera, frames.dock) == (mine, dock)
    assert given(str(folder / "shots"), None, None).open(refuse).count == 2


def test_what_is_a_sequence(folder):
    for source in (str(folder), str(folder / "tank.avi"), "0", "rtsp://127.0.0.1/x"):
        assert is_sequence(source)
    assert not is_sequence(str(folder / "shots" / "shot0.png"))


def test_missing_video_is_told_at_the_start():
    with pytest.raises(SourceError, match=r"nowhere\.mp4"):
        given("nowhere.mp4", None, None).open(refuse)


@pytest.mark.parametrize("name", SIMULATED)
def test_simulated_courses_suit_the_dock(name):
    opened = simulated(name, SCENE).open(refuse)
    frames = opened.between(0, 2)
    first, second = next(frames), next(frames)
    assert first.image.shape == (240, 320)
    assert second.time_s == pytest.approx(1 / 25)
    assert (opened.camera, opened.dock) == (CAMERA, SCENE.dock)


def test_frame_keeps_the_camera_that_fits_and_guesses_where_none_does(view):
    same = with_frame(view, np.zeros((480, 640), np.uint8), "x, frame 1")
    assert (same.camera, same.notes, same.list_name, same.truth) == (view.camera, (), "sequence", None)
    other = with_frame(view, np.zeros((100, 300), np.uint8), "x, frame 1")
    assert (other.camera.width, other.camera.height) == (300, 100)
    assert "was assumed" in other.notes[0]
    brought = with_first_frame(view, np.zeros((240, 320), np.uint8), "x, frame 1", CAMERA, DEFAULT_DOCK)
    assert (brought.camera, brought.given_camera, brought.given_dock) == (CAMERA, CAMERA, DEFAULT_DOCK)


@pytest.fixture
def follower():
    motion = Approach(start_m=1.2, end_m=1.0, frames=20, rate_hz=10)
    sequence = FilmPlan(scene=SCENE, motion=motion)
    return FrameFollower(Simulated(sequence, "course"), "course", print)


def read(follower, view, index):
    frame = follower.frames.at(index)
    view = follower.view_of(view, frame)
    return view, follower.read(view, frame)


def test_frames_are_followed_one_after_the_other(follower, view):
    view, analysis = read(follower, view, 0)
    for index in range(1, 4):
        view, analysis = read(follower, view, index)
        assert analysis.tracked_frame.tracked.track.age == index + 1
    assert view.source == "course, frame 4 of 20, 0.30 s"
    assert analysis.estimate.selected.position_m[2] == pytest.approx(1.2 - 0.2 * 3 / 19, abs=0.01)
    assert len(follower.trajectory.rows()) == 4


def test_a_leap_and_another_dock_begin_a_new_track(follower, view):
    for index in range(3):
        view, analysis = read(follower, view, index)
    view, analysis = read(follower, view, 10)
    assert analysis.tracked_frame is not None
    assert analysis.tracked_frame.tracked.track.age == 1
    view, analysis = read(follower, put(view, "diameter_cm", 40), 11)
    assert analysis.tracked_frame is not None
    assert analysis.tracked_frame.tracked.track.age == 1
    assert analysis.estimate.selected.position_m[2] == pytest.approx((1.2 - 0.2 * 11 / 19) * 40 / 30, abs=0.02)
    view, analysis = read(follower, view, 12)
    assert analysis.tracked_frame.tracked.track.age == 2


def test_text_that_stays_put_is_masked_and_remains_so_after_a_leap(view, monkeypatch):
    monkeypatch.setattr("dockpose.tracking.search.follow", lambda *frame: "lost")  # which sees nothing but lights
    scene = msgspec.structs.replace(SCENE, texts=(Text(text="REC 7", x_px=5, y_px=215, height_px=16),))
    sequence, told = FilmPlan(scene=scene, motion=Approach(start_m=1.6, end_m=0.8, frames=40, drift_m=0.05)), []
    follower = FrameFollower(Simulated(sequence, "course"), "course", told.append)
    for index in range(12):
        view, analysis = read(follower, view, index)
        assert bool(analysis.estimate.settings.masks) == (index > 7)
    assert [sentence.split(": ")[1][:26] for sentence in told] == ["something bright stays put"]
    assert not view.settings.masks
    _, analysis = read(follower, view, 30)
    assert analysis.tracked_frame is not None
    assert analysis.tracked_frame.tracked.track.age == 1
    assert analysis.estimate.settings.masks
    _, analysis = read(follower, put(view, "diameter_cm", 40), 31)
    assert not analysis.estimate.settings.masks


def test_track_that_decides_is_shown_as_chosen_and_told(follower, view):
    _, analysis = read(follower, view, 0)
    tracked = analysis.tracked_frame.tracked
    other = 1 - tracked.estimate.choice.selected
    decided = type(tracked)(tracked.estimate, tracked.track, other, "tracking", tracked.estimate.candidates[other])
    found = chosen_by_track(decided)
    assert found.choice is not None
    assert (found.choice.selected, found.choice.selected_by) == (other, "tracking")
    assert "by pose B" in found.message
    assert math.isclose(found.elapsed_ms, tracked.estimate.elapsed_ms)


def test_frames_in_doubt_tell_their_probability_and_not_that_of_the_last_picture(follower, view):
    tracked = [read(follower, view, number)[1].tracked_frame.tracked for number in range(3)][-1]
    assert tracked.selected_by != "tracking"
    doubted = replace(tracked, track=replace(tracked.track, probability=0.88))
    message = chosen_by_track(doubted).message
    assert message.endswith("by pose A, which 3 frames make 88.0 % likely.")
    assert "likelier" in chosen_by_track(tracked).message


def test_a_bag_that_a_browser_sent_brings_its_pictures_and_camera(tmp_path):
    info = bags.camera_info((700.0, 0.0, 9.5, 0.0, 700.0, 4.5, 0.0, 0.0, 1.0), (20, 10))
    pictures = [np.zeros((10, 20), np.uint8)]
    entries = [("/camera/camera_info", bags.CAMERA_INFO, bags.START_NS, info), *bags.frames(pictures)]
    source, told = sent(bags.write_mcap(tmp_path / "a.mcap", entries).read_bytes(), "tank.mcap"), []
    with source.open(told.append) as frames:
        assert frames.count == 1
        assert frames.camera == Camera(700, 700, 9.5, 4.5, 20, 10, (0.0,) * 5)
    assert told == ["tank.mcap: the camera is that of the bag's topic /camera/camera_info"]
    source.discard()
    with pytest.raises(UserError, match=r"^broken\.mcap: is not an MCAP file"):
        sent(b"nothing", "broken.mcap").open(told.append)


def test_the_page_may_play_the_bags_of_its_folder(tmp_path):
    path = bags.write_mcap(tmp_path / "a.mcap", bags.frames([np.zeros((10, 20), np.uint8)]))
    assert "a.mcap" in choices(None, tmp_path)
    assert choose("a.mcap", None, tmp_path, SCENE).source == str(path)
    given_bag = given(str(path), None, None, bags.TOPIC)
    assert (given_bag.name, given_bag.topic) == ("a.mcap", bags.TOPIC)


def asked(**values):
    return {"exposure": None, "gain": "", "rate_hz": " ", "format": None} | values


def test_what_is_left_blank_is_left_to_the_camera():
    assert capture_from(asked(), NAMES) == CaptureSettings()


def test_text_and_numbers_are_taken():
    typed = asked(exposure="120", gain=2.5, rate_hz="30", format=" mjpg ")
    assert capture_from(typed, NAMES) == CaptureSettings(exposure=120, gain=2.5, rate_hz=30, format="MJPG")


def test_what_is_no_number_is_refused_by_its_name():
    """What else is refused is tried in tests/app/commands/test_arguments.py."""
    with pytest.raises(UserError, match="Exposure is 'long'; it must be a number"):
        capture_from(asked(exposure="long"), NAMES)
