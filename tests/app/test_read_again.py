"""What we write is read again to the same poses: bags of every kind of source, a ZIP file's picture, a session's."""

# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false

import json
import zipfile
from dataclasses import replace

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import estimate
from dockpose.app.cli import main
from dockpose.app.experiment import Session
from dockpose.app.export.bundle import picture_files, to_zip
from dockpose.app.export.recordings.ros import write_bag
from dockpose.app.export.video import VideoFile
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.view import open_source
from dockpose.camera.files import save_camera
from dockpose.camera.mark import COMMENT, to_jpeg
from dockpose.camera.port import FlatPort
from dockpose.lights.by_hand import ByHand
from dockpose.sidecar import sample_path
from dockpose.simulate import Approach, FilmPlan, film
from dockpose.sources import Bag, Kind, SourceError, kind_of, open_frames

from tests.support import bags
from tests.support.scenes import CAMERA, DOCK, random_scene

FRAMES = [
    frame.image
    for frame in film(FilmPlan(scene=random_scene(3), motion=Approach(start_m=1.3, end_m=1.2, frames=3, rate_hz=10.0)))
]
KNOWN = ["--dock-diameter", "0.30", "--lights", "10"]


def coloured(picture):
    """The same in three channels that differ."""
    return np.stack([picture // 2, picture, picture - picture // 4], axis=2)


def write_pictures(folder, ending, change):
    (folder / "in").mkdir()
    for number, picture in enumerate(FRAMES):
        cv2.imwrite(str(folder / f"in/{number}.{ending}"), change(picture))
    return str(folder / "in")


def write_video(folder, name):
    with VideoFile(folder / name, 10.0) as video:
        for number, picture in enumerate(FRAMES):
            video.write(coloured(picture) if name.endswith("mp4") else picture.astype(np.uint16) * 100, number / 10)
    return str(folder / name)


def write_bag_of(folder, compress):
    """A bag with the pictures on one topic, and with other topics."""
    entries = bags.frames(FRAMES)
    if compress:
        stamps = [(time_ns, message.header) for _, _, time_ns, message in entries]
        made = [bags.compressed(coloured(picture), "jpg") for picture in FRAMES]
        for message, (_, header) in zip(made, stamps, strict=True):
            message.header = header
        entries = [("/c", bags.COMPRESSED, at, each) for each, (at, _) in zip(made, stamps, strict=True)]
    return str(bags.write_mcap(folder / "run.mcap", [*entries, ("/words", bags.STRING, 1, bags.text("hello"))]))


SOURCES = {
    "JPEG files": lambda folder: (write_pictures(folder, "jpg", coloured), []),
    "PNG files of 16 bits": lambda folder: (write_pictures(folder, "png", lambda one: one.astype(np.uint16) * 200), []),
    "TIFF files in colour": lambda folder: (write_pictures(folder, "tif", coloured), []),
    "a sequence of pictures, turned": lambda folder: (write_pictures(folder, "jpg", coloured), ["--rotate", "90"]),
    "H.264 in colour": lambda folder: (write_video(folder, "run.mp4"), []),
    "FFV1 of 16 bits, turned": lambda folder: (write_video(folder, "run.mkv"), ["--rotate", "270"]),
    "a bag": lambda folder: (write_bag_of(folder, False), []),
    "a bag of JPEG": lambda folder: (write_bag_of(folder, True), []),
}


def poses(path):
    """Of each line the status, the choice, and the numbers of both candidates."""
    found = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["status"] for line in found] == ["ok"] * len(FRAMES)
    candidates = [[[*one["position_m"], *one["quaternion_xyzw"]] for one in line["candidates"]] for line in found]
    return [line["selected"] for line in found], np.array(candidates), [line["time_s"] for line in found]


@pytest.mark.slow
@pytest.mark.parametrize("name", SOURCES)
def test_a_bag_of_ours_gives_the_same_poses(tmp_path, name):
    source, options = SOURCES[name](tmp_path)
    options = options + (["--rate", "10"] if "sequence" in name else [])
    save_camera(CAMERA, tmp_path / "camera.yaml")
    words = ["--camera", str(tmp_path / "camera.yaml"), *KNOWN, *options, "--json", str(tmp_path / "one.jsonl")]
    assert main(["estimate", source, *words, "--out", str(tmp_path / "poses.mcap")]) == 0
    assert main(["estimate", str(tmp_path / "poses.mcap"), *KNOWN, "--json", str(tmp_path / "two.jsonl")]) == 0
    (chosen, before, times_s), (again, after, times_again_s) = (poses(tmp_path / f"{n}.jsonl") for n in ("one", "two"))
    np.testing.assert_allclose(after, before, rtol=0, atol=1e-9)
    assert again == chosen
    if times_s[0] is not None:
        assert times_again_s == pytest.approx(times_s, abs=1e-9)


def test_jpeg_and_png_go_into_the_bag_as_they_came(tmp_path):
    paths = [tmp_path / "a.jpg", tmp_path / "b.png"]
    for path, picture in zip(paths, FRAMES[:2], strict=True):
        cv2.imwrite(str(path), picture)
    save_camera(CAMERA, tmp_path / "camera.yaml")
    words = ["--camera", str(tmp_path / "camera.yaml"), *KNOWN, "--quiet", "--out", str(tmp_path / "poses.mcap")]
    assert main(["estimate", *map(str, paths), *words]) == 0
    with open_frames(tmp_path / "poses.mcap") as frames:
        assert [frame.encoded for frame in frames] == [path.read_bytes() for path in paths]


def test_without_pictures_it_is_small_and_no_source_of_pictures(tmp_path, capsys):
    words = ["--out", str(tmp_path / "poses.mcap"), "--no-pictures", "--quiet"]
    assert main(["estimate", str(sample_path("plain")), *words]) == 0
    assert (tmp_path / "poses.mcap").stat().st_size < 30_000
    assert main(["estimate", str(tmp_path / "poses.mcap"), *KNOWN]) == 1
    assert "no topic of the bag has pictures" in capsys.readouterr().err


def test_lights_set_by_hand_go_with_the_picture_into_a_zip_file_and_a_session(tmp_path, capfd):
    view = open_source(None, None, None)
    places = estimate(view.image, view.camera, view.dock).markers.points_px + [0.4, -0.3]
    by_hand = ByHand.checked(places[:7].tolist(), [True, False] * 3 + [True], 640, 480)
    analysis = analyse(replace(view, set_lights=by_hand))
    pose = analysis.estimate.selected.position_m
    (tmp_path / "all.zip").write_bytes(to_zip(picture_files(analysis)))
    with zipfile.ZipFile(tmp_path / "all.zip") as files:
        report, result = files.read("report.html").decode(), json.loads(files.read("result.json"))
        (tmp_path / "tank.png").write_bytes(files.read("picture.png"))
        (tmp_path / "tank.yaml").write_bytes(files.read("settings.yaml"))
    assert "lights were set by hand" in report
    assert (result["found_by"], result["by_hand"]["lights_px"]) == (
        "hand",
        [list(place) for place in by_hand.lights_px],
    )
    again = estimate(tmp_path / "tank.png")
    assert again.by_hand == by_hand
    np.testing.assert_allclose(again.selected.position_m, pose, rtol=1e-9)
    Session.create(tmp_path / "session").take(view.image, analysis.estimate, "tank.png")
    assert main(["estimate", "--session", str(tmp_path / "session")]) == 0
    assert "1 of 1 rows give the same numbers" in capfd.readouterr().out


@pytest.mark.slow
def test_what_is_drawn_on_is_refused_by_name_and_all_else_is_done(tmp_path, capsys):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "plain.png").write_bytes(sample_path("plain").read_bytes())
    words = ["--camera", str(sample_path("plain").with_suffix(".yaml")), *KNOWN]
    assert main(["estimate", str(folder), *words, "--annotate", str(folder)]) == 0  # plain-2.png beside plain.png
    capsys.readouterr()
    assert main(["estimate", str(folder), *words]) == 1
    output = capsys.readouterr()
    drawn = folder / "plain-2.png"
    assert (
        output.err
        == f"dockpose: {drawn}: is a picture that dockpose has drawn on; give the one that it was made from\n"
    )
    assert output.out.count("Dock found") == 1


@pytest.mark.parametrize("name", ["drawn.mp4", "drawn.mkv"])
def test_a_video_that_is_drawn_on_is_refused_and_a_plain_one_read(tmp_path, name):
    for comment in ("", COMMENT):
        with VideoFile(tmp_path / name, 10.0, metadata={"comment": comment}) as video:
            for number, picture in enumerate(FRAMES):
                video.write(coloured(picture), number / 10)
        if not comment:
            with open_frames(tmp_path / name) as frames:
                assert frames.count == 3
    with pytest.raises(SourceError, match=f"{name}: is a video that dockpose has drawn on"):
        open_frames(tmp_path / name)


def test_annotated_videos_are_marked(tmp_path, capsys):
    source = write_bag_of(tmp_path, False)
    save_camera(CAMERA, tmp_path / "camera.yaml")
    words = ["--camera", str(tmp_path / "camera.yaml"), *KNOWN, "--quiet"]
    assert main(["estimate", source, *words, "--annotate", str(tmp_path / "drawn.mp4")]) == 0
    assert main(["estimate", str(tmp_path / "drawn.mp4"), *words]) == 1
    assert "drawn.mp4: is a video that dockpose has drawn on" in capsys.readouterr().err


def test_annotated_pictures_in_bags_are_refused(tmp_path):
    """Those of version 0.3 and before, which are told by their topic and the poses' one beside it, and marked ones."""
    drawn, pose = bags.compressed(FRAMES[0], "jpg"), bags.text("a pose")
    of_ours = [("/auv/dock/image/compressed", bags.COMPRESSED, 1, drawn), ("/auv/dock/pose_a", bags.STRING, 2, pose)]
    words = "topic /auv/dock/image/compressed: has pictures that dockpose has drawn on; give what they were made from"
    with pytest.raises(SourceError, match=words):
        open_frames(bags.write_mcap(tmp_path / "old.mcap", of_ours))
    both = bags.write_mcap(tmp_path / "both.mcap", [*of_ours, *bags.frames(FRAMES)])
    with open_frames(both) as frames:
        assert isinstance(frames, Bag)
        assert frames.topic == bags.TOPIC
    with pytest.raises(SourceError, match=words):
        open_frames(both, topic="/auv/dock/image/compressed")
    with open_frames(bags.write_mcap(tmp_path / "other.mcap", of_ours[:1])) as frames:
        assert frames.count == 1
    drawn.data = np.frombuffer(to_jpeg(FRAMES[0]), np.uint8)
    marked = bags.write_mcap(tmp_path / "marked.mcap", [("/c", bags.COMPRESSED, 1, drawn)])
    with pytest.raises(
        SourceError, match="no picture of /c can be read: the first is a picture that dockpose has drawn on"
    ):
        open_frames(marked)


def test_a_folder_of_pictures_with_our_bag_in_it_stays_one(tmp_path):
    folder = write_pictures(tmp_path, "png", np.asarray)
    found = estimate(FRAMES[0], CAMERA, DOCK)
    write_bag(f"{folder}/poses.mcap", [(FRAMES[0], None, found)], tell=lambda text: None)
    assert kind_of(folder) is Kind.FOLDER


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"port": FlatPort(air_gap_m=0.02, glass_m=0.005)},
            "the camera, which is behind a flat port: give --camera when it is read again",
        ),
        ({"tone": "srgb"}, "the tone curve srgb: give --camera when it is read again"),
    ],
)
def test_what_no_message_holds_of_a_camera_is_told(tmp_path, changed, words):
    camera, told = msgspec.structs.replace(CAMERA, **changed), list[str]()
    found = estimate(FRAMES[0], camera, DOCK)
    write_bag(tmp_path / "poses.mcap", [(FRAMES[0], 0.0, found)], tell=told.append)
    assert told[0].endswith(words)
    with open_frames(tmp_path / "poses.mcap") as frames:
        assert (frames.camera is None) == ("port" in changed)
