"""Live streams, videos and simulated courses through ``dockpose estimate``."""

import contextlib
import csv
import itertools
import json
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import cv2
import msgspec
import numpy as np
import pytest
from dockpose.app.cli import main
from dockpose.app.commands.progress import FrameProgress, rate_text
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, film
from dockpose.simulate.files import save_sequence
from dockpose.sources import open_frames

from tests.support.cameras import V4l2Camera
from tests.support.mavlink import receiving
from tests.support.rtp import Sender, free_port
from tests.support.scenes import CAMERA, random_scene

SMALL = CAMERA.for_size(320, 240)
KNOWN = ["--dock-diameter", "0.3", "--lights", "10"]
FRAMES = 12


@pytest.fixture(scope="module")
def tank(tmp_path_factory):
    """A scene file with a motion, its video with the scene beside it, its pictures, and a camera file."""
    folder = tmp_path_factory.mktemp("tank")
    sequence = FilmPlan(
        scene=random_scene(4, camera=SMALL, position_m=(0.05, 0.0, 1.0)),
        motion=Approach(frames=FRAMES, start_m=1.2, end_m=0.8, rate_hz=20, drift_m=0.02),
    )
    for name in ("scene.yaml", "film.yaml"):
        save_sequence(sequence, folder / name)
    save_camera(SMALL, folder / "camera.yaml")
    (folder / "pictures").mkdir()
    writer = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"FFV1"), 20.0, (320, 240), False)
    for frame in film(sequence):
        writer.write(frame.image)
        cv2.imwrite(str(folder / "pictures" / f"frame_{frame.number:04d}.png"), frame.image)
    writer.release()
    return folder


@pytest.fixture
def here(tank, monkeypatch):
    monkeypatch.chdir(tank)
    return tank


def pictures_in(folder):
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((folder / "pictures").iterdir())]


def lines_of(text):
    return [json.loads(line) for line in text.splitlines()]


def without_times(lines):
    kept = ("status", "image", "camera", "dock", "settings", "threshold", "markers", "candidates", "selected", "track")
    return [{key: line[key] for key in kept} for line in lines]


def test_video_course_and_pictures_at_a_rate_give_the_same_tracked_lines(here, json_lines):
    found = {}
    for source in (["film.avi"], ["scene.yaml"], ["pictures", "--rate", "20", "--camera", "camera.yaml", *KNOWN]):
        found[source[0]] = json_lines("estimate", *source)
    video = found["film.avi"]
    assert [line["frame"] for line in video] == list(range(FRAMES))
    assert [line["time_s"] for line in video] == pytest.approx(np.arange(FRAMES) / 20)
    assert {line["source"] for line in video} == {"film.avi"}
    assert {line["sha256"] for line in video} == {None}
    assert [line["track"]["age"] for line in video] == list(range(1, FRAMES + 1))
    assert set(video[0]["track"]) == {"probability", "age", "predicted", "lost", "number"}
    assert without_times(found["scene.yaml"]) == without_times(video)
    assert without_times(found["pictures"]) == without_times(video)
    assert [line["time_s"] for line in found["pictures"]] == pytest.approx(np.arange(FRAMES) / 20)
    assert all(len(line["sha256"]) == 64 for line in found["pictures"])


def test_pictures_without_a_rate_are_not_tracked(here, json_lines):
    known = ["--camera", "camera.yaml", *KNOWN]
    lines = json_lines("estimate", "pictures/frame_0001.png", "pictures/frame_0002.png", *known)
    assert [(line["frame"], line["time_s"], line["track"]) for line in lines] == [(0, None, None)] * 2


def test_a_sequence_without_outputs_says_a_sentence_a_frame(here, capsys):
    assert main(["estimate", "film.avi"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert len(told) == FRAMES + 1
    assert told[-1] == f"{FRAMES} of {FRAMES} frames show a dock"
    assert told[3].startswith("film.avi frame 3 (0.150 s): 10 lights on the ring")


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [[], ["--jobs", "2"]], ids=["one", "split"])
def test_annotated_frames_are_numbered_and_overwrite_no_original(here, tmp_path, jobs):
    before = {path: path.read_bytes() for path in (here / "pictures").iterdir()}
    if jobs:
        assert main(["estimate", "film.avi", "--annotate", str(tmp_path / "out"), *jobs]) == 0
        names = sorted(path.name for path in (tmp_path / "out").iterdir())
        assert names == [f"frame_{number:04d}.png" for number in range(1, FRAMES + 1)]
        return
    assert main(["estimate", "film.avi", "--annotate", str(tmp_path / "out.mp4")]) == 0
    capture = cv2.VideoCapture(str(tmp_path / "out.mp4"))
    assert capture.get(cv2.CAP_PROP_FPS) == 20
    assert sum(capture.read()[0] for _ in range(FRAMES + 5)) == FRAMES
    known = ["--rate", "20", "--camera", "camera.yaml", *KNOWN]
    assert main(["estimate", "pictures", *known, "--annotate", "pictures"]) == 0
    assert {path: path.read_bytes() for path in before} == before
    for path in set((here / "pictures").iterdir()) - set(before):
        assert path.name.endswith("-2.png")
        path.unlink()


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["http://127.0.0.1:9/x"], 2, "http://127.0.0.1:9/x: which camera? Give --camera C.yaml"),
        (["http://127.0.0.1:9/x", "--camera", "camera.yaml"], 2, "how large is the dock?"),
        (["http://127.0.0.1:9/x", "--camera", "camera.yaml", *KNOWN], 1, "nothing answers there"),
        (["camera.yaml"], 1, "camera.yaml"),
        (["film.avi", "scene.yaml", "--annotate", "x.mp4"], 2, "a video is made of one sequence"),
        (["film.avi", "--camera", "wide.yaml"], 1, "the camera is for 640 x 400"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(here, refusal, arguments, status, message):
    save_camera(msgspec.structs.replace(CAMERA, height=400), here / "wide.yaml")
    assert message in refusal("estimate", *arguments, "--json", "-", status=status)


_obey = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # which a job in the background ignores


def test_progress_tells_rate_and_time_left_in_plain_lines(monkeypatch, capsys):
    assert rate_text(300, 1000, 30.0, 4) == "300 of 1000 frames, 30.0 a second, 4 dropped"
    assert rate_text(5, None, 2.5) == "5 frames, 2.5 a second"
    now_s = iter([0.0, *range(1, 100)])
    monkeypatch.setattr("dockpose.app.commands.progress.time.monotonic", lambda: next(now_s))
    with FrameProgress("film.avi") as progress:
        progress.total = 100
        for _ in range(25):
            progress.step()
    told = capsys.readouterr()
    assert told.out == ""
    assert len(told.err.splitlines()) == 2
    assert told.err.splitlines()[0].startswith("dockpose: film.avi: 10 of 100 frames, 1.0 a second")
    assert told.err.splitlines()[0].endswith("90 s left")


def run_camera(monkeypatch, pictures, *words, lines=0, **more):
    """Exit status of ``estimate 0`` with a camera that gives these pictures, until there are ``lines``, then Ctrl+C."""

    def at_end():
        if not camera.is_unplugged:  # each further try to read is another end, which needs no second signal
            camera.is_unplugged = True  # or a busy machine opens it anew before it comes to the signal
            main_thread = threading.main_thread().ident  # which may be waiting for a frame
            assert main_thread is not None
            signal.pthread_kill(main_thread, signal.SIGINT)

    camera = V4l2Camera.make(
        pictures,
        sizes=((320, 240), (640, 480)),
        on_end=at_end,
        rates_hz=(20.0,),
        again=lambda: sys.stdout.getvalue().count("\n") < lines,  # pyright: ignore[reportAttributeAccessIssue]
        **more,
    )
    monkeypatch.setattr(cv2, "VideoCapture", camera)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores Ctrl+C
    try:
        return main(["estimate", "0", *words, *KNOWN])
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_camera_gives_the_size_of_its_file_and_says_what_it_took(here, capsys, monkeypatch):
    pictures = pictures_in(here)
    words = ["--camera", "camera.yaml", "--json", "-", "--exposure", "120", "--gain", "2", "--format", "MJPG"]
    assert run_camera(monkeypatch, pictures, *words, lines=2) == 130
    told = capsys.readouterr()
    lines = lines_of(told.out)
    assert len(lines) >= 2
    assert all(line["status"] == "ok" and line["image"]["width"] == 320 for line in lines)
    assert all(abs(time.time() - line["time_unix_s"]) < 60 for line in lines)
    said = "dockpose: camera 0: 320 x 240 MJPG at 20 frames/s; exposure 120 asked, 117 set; gain 2 asked, 2 set"
    assert told.err.splitlines()[0] == said


@pytest.mark.parametrize("format", ["MJPG", "YUYV"])
def test_a_recorded_camera_gives_the_same_results_and_times_again(here, capsys, monkeypatch, tmp_path, format):
    pictures = pictures_in(here)
    path, known = tmp_path / "tank.mkv", ["--camera", "camera.yaml", "--json", "-"]
    assert run_camera(monkeypatch, pictures, *known, "--record", str(path), "--format", format) == 130
    told = capsys.readouterr()
    live = lines_of(told.out)
    assert f"{path}: {FRAMES} frames recorded" in told.err
    assert main(["estimate", str(path), *known, *KNOWN]) == 0
    again = {line["frame"]: line for line in lines_of(capsys.readouterr().out)}
    assert len(again) == FRAMES
    for number, line in enumerate(live):
        other = again[line["frame"]]
        assert other["time_s"] == pytest.approx(line["time_s"], abs=2e-6)
        assert other["time_unix_s"] == pytest.approx(line["time_unix_s"], abs=2e-6)
        # Behind a frame that was dropped, lights are followed from elsewhere than in the recording, which has it.
        off_m = 1e-9 if line["frame"] == number else 1e-4
        assert other["candidates"][0]["position_m"] == pytest.approx(line["candidates"][0]["position_m"], abs=off_m)


@pytest.mark.parametrize(
    ("sources", "name", "sentence"),
    [
        (["film.avi"], "tank.mkv", "film.avi is neither camera nor stream"),
        (["0", "1"], "tank.mkv", "give one camera or stream alone"),
        (["0"], "tank.mp4", "tank.mp4: a recording is a Matroska file; its name must end with .mkv"),
        (["0"], "there.mkv", "there.mkv: is there already, and a recording overwrites nothing"),
    ],
)
def test_a_recording_that_makes_no_sense_is_refused(here, refusal, tmp_path, sources, name, sentence):
    (tmp_path / "there.mkv").write_bytes(b"of yesterday")
    told = refusal("estimate", *sources, "--camera", "camera.yaml", *KNOWN, "--record", str(tmp_path / name))
    assert "--record " in told
    assert sentence in told
    assert (tmp_path / "there.mkv").read_bytes() == b"of yesterday"


def test_a_saturated_camera_is_told_once_what_to_do(here, capsys, monkeypatch):
    pictures = pictures_in(here)
    bright = [np.clip(12.0 * np.asarray(picture), 0, 255).astype(np.uint8) for picture in pictures] * 3
    assert run_camera(monkeypatch, bright, "--camera", "camera.yaml", "--json", "-", lines=3) == 130
    told = capsys.readouterr().err.splitlines()
    assert [line for line in told if "saturated: " in line and line.startswith("dockpose: camera 0: ")] != []
    assert sum("saturated" in line for line in told) == 1


def test_poses_over_frames_are_in_lines_and_rows(tmp_path):
    scene, lines, table = tmp_path / "scene.yaml", tmp_path / "a.jsonl", tmp_path / "a.csv"
    motion = Approach(start_m=2.0, end_m=1.8, frames=4, rate_hz=10.0)
    save_sequence(FilmPlan(scene=random_scene(3), motion=motion), scene)
    assert main(["estimate", str(scene), "--json", str(lines), "--csv", str(table)]) == 0
    found = [json.loads(line) for line in lines.read_text().splitlines()]
    assert [line["predicted"] is None for line in found] == [True] + [False] * 3
    rows = list(csv.DictReader(table.read_text().splitlines()))
    for row, line in zip(rows, found, strict=True):
        for name in ("chosen", "filtered"):
            assert float(row[f"{name}_z_m"]) == line[name]["position_m"][2]
            assert float(row[f"{name}_sigma_theta_y_deg"]) == line[name]["sigma_theta_deg"][1]
    assert rows[0]["predicted_x_m"] == ""


@contextlib.contextmanager
def a_vehicle_sends(folder, port):
    """Send the pictures to and fro, 30 times a second."""
    pictures = [np.stack([np.asarray(picture)] * 3, axis=-1) for picture in pictures_in(folder)]
    stop, sender = threading.Event(), Sender(port, "H264", (320, 240), 30, 10)

    def send() -> None:
        for picture in itertools.cycle([*pictures, *reversed(pictures)]):
            if stop.wait(1 / 30):
                break
            sender.send(picture)
        sender.close()

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@pytest.mark.extra
@pytest.mark.slow
def test_a_vehicles_stream_goes_to_its_autopilot_and_into_a_recording(here, tmp_path):
    """Each message is of a line in the results, and the dock is where the vehicle is not."""
    port = free_port()
    with receiving() as received, a_vehicle_sends(here, port):
        outputs = ["--json", str(tmp_path / "live.jsonl"), "--record", str(tmp_path / "kept.mkv")]
        words = ["estimate", f"rtp://127.0.0.1:{port}", "--camera", "camera.yaml", *KNOWN, *outputs]
        command = [sys.executable, "-m", "dockpose", *words, "--mavlink", received.address]
        process = subprocess.Popen(command, cwd=here, stderr=subprocess.PIPE, text=True, preexec_fn=_obey)
        try:
            messages = [received.next("VISION_POSITION_ESTIMATE") for _ in range(20)]
            process.send_signal(signal.SIGINT)
            told = process.communicate(timeout=60)[1]
        finally:
            process.kill()
            process.wait()
    assert process.returncode == 130
    assert "320 x 240 h264 from 127.0.0.1" in told
    assert f"{received.address}: " in told
    lines = {round(1e6 * line["time_unix_s"]): line for line in lines_of((tmp_path / "live.jsonl").read_text())}
    if messages[-1]["usec"] not in lines:  # it was stopped between sending and writing
        messages.pop()
    for message in messages:
        line = lines[message["usec"]]
        assert not line["track"]["predicted"]
        x, y, z = line["chosen"]["position_m"]
        assert np.linalg.norm([message["x"], message["y"], message["z"]]) == pytest.approx(np.linalg.norm([x, y, z]))
        assert message["x"] < -0.5
    with open_frames(str(tmp_path / "kept.mkv")) as kept:
        assert kept.count is not None
        assert kept.count >= 20


def test_a_recording_goes_to_no_autopilot(here, refusal):
    told = refusal("estimate", "film.avi", "--mavlink", "udpout:127.0.0.1:9", "--camera", "camera.yaml", *KNOWN)
    assert "sends what is seen now, but film.avi is a recording" in told
