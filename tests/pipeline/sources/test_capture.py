import time
from dataclasses import replace

import cv2
import numpy as np
import pytest
from dockpose.sources import DEFAULT_CAPTURE, CaptureSettings, Live, camera_number, kind_of, open_frames
from dockpose.sources.kinds import Kind

from tests.support.cameras import V4l2Camera

GREY = [np.full((480, 640), level, np.uint8) for level in range(0, 250)]
DEEP = [np.full((480, 640), 257 * level + 3, np.uint16) for level in range(0, 250)]


def opened(monkeypatch, capture, pictures=GREY, source="0", **more):
    """The source, what it told, and the camera behind it."""
    make = V4l2Camera.make(pictures, rates_hz=more.pop("rates_hz", (10.0, 30.0, 200.0)), **more)
    monkeypatch.setattr(cv2, "VideoCapture", make)
    told = []
    frames = open_frames(source, told.append, capture=capture)
    assert isinstance(frames, Live)
    return frames, told, make.last


@pytest.mark.parametrize(
    ("source", "number"),
    [
        *(("0", 0), ("12", 12), ("/dev/video0", 0), ("/dev/video3", 3)),
        *((other, None) for other in ("video0", "/dev/null", "/dev/video", "-1", "0.png", "9" * 5000, "/dev/video0/x")),
    ],
)
def test_numbers_and_devices_name_a_camera_and_other_texts_none(source, number):
    assert camera_number(source) == number
    assert (kind_of(source) is Kind.CAMERA) == (number is not None)


def test_a_link_to_a_device_names_its_camera(monkeypatch):
    monkeypatch.setattr("pathlib.Path.resolve", lambda path: "/dev/video2")  # as /dev/v4l/by-id holds them
    assert camera_number("/dev/v4l/by-id/usb-046d_HD_Webcam-video-index0") == 2


def test_a_camera_that_gives_all_that_was_asked_says_so(monkeypatch):
    capture = CaptureSettings(1280, 720, exposure=50, gain=2, rate_hz=30, format="MJPG")
    frames, told, camera = opened(monkeypatch, capture)
    with frames:
        image = next(iter(frames)).image
    assert frames.about == "1280 x 720 MJPG at 30 frames/s; exposure 50 asked, 50 set; gain 2 asked, 2 set"
    assert (image.shape, image.dtype, told) == ((720, 1280, 3), np.uint8, [])
    assert not camera.is_auto
    assert camera.released


@pytest.mark.parametrize(
    ("capture", "more", "sentence"),
    [
        (CaptureSettings(exposure=50), {"controls": {}}, "camera 0: does not take an exposure of 50 and keeps its own"),
        (CaptureSettings(gain=7), {"controls": {}}, "camera 0: does not take a gain of 7 and keeps its own"),
        (CaptureSettings(format="Y16"), {}, "camera 0: does not give Y16 and goes on with YUYV"),
        (CaptureSettings(rate_hz=60), {}, "camera 0: does not give 60 frames/s and goes on with 30"),
        (CaptureSettings(800, 600), {}, "camera 0: does not give 800 x 600 and goes on with 640 x 480"),
    ],
)
def test_what_a_camera_refuses_is_said_once_and_it_goes_on(monkeypatch, capture, more, sentence):
    frames, told, _ = opened(monkeypatch, capture, **more)
    with frames:
        assert next(iter(frames)).image.shape == (480, 640, 3)
        frames.ask(capture)  # again: nothing new to say
        time.sleep(0.1)
    assert told == [sentence]
    assert " set" not in frames.about


@pytest.mark.parametrize(
    ("capture", "pictures", "formats"),
    [
        (CaptureSettings(format="Y16"), DEEP, ("YUYV", "Y16")),
        (CaptureSettings(format="GREY"), GREY, ("YUYV", "GREY")),
        (DEFAULT_CAPTURE, DEEP, ("Y16",)),  # which has nothing else
    ],
)
def test_grey_formats_keep_their_levels(monkeypatch, capture, pictures, formats):
    frames, told, _ = opened(monkeypatch, capture, pictures, formats=formats)
    with frames:
        frame = next(iter(frames))
    assert (frame.image.dtype, frame.image.shape) == (pictures[0].dtype, (480, 640))
    assert np.array_equal(frame.image, pictures[frame.index])
    assert told == []


def test_a_rate_is_changed_while_it_runs_and_an_exposure_without_interrupting(monkeypatch):
    capture = CaptureSettings(640, 480, exposure=50, rate_hz=200, format="MJPG")
    frames, told, camera = opened(monkeypatch, capture)
    with frames:
        next(iter(frames))
        frames.ask(replace(capture, exposure=25))
        index = next(iter(frames)).index
        while next(iter(frames)).index < index + 3:
            pass
        assert camera.interruptions == 0
        frames.ask(replace(capture, rate_hz=30))
        index = next(iter(frames)).index
        while next(iter(frames)).index < index + 3:
            pass
    assert frames.about == "640 x 480 MJPG at 30 frames/s; exposure 50 asked, 50 set"
    assert camera.interruptions == 1
    assert told == []


def test_times_are_those_of_the_driver_and_of_the_day(monkeypatch):
    frames, _, camera = opened(monkeypatch, DEFAULT_CAPTURE)
    with frames:
        seen = []
        for frame in frames:
            seen.append((frame, camera.stamp_s, time.time()))
            if len(seen) == 10:
                break
    for frame, _, now_s in seen:
        assert 0 <= now_s - frame.time_unix_s < 0.2
        assert frame.time_unix_s - frame.time_s == pytest.approx(seen[0][0].time_unix_s - seen[0][0].time_s, abs=2e-6)
    # By the driver's stamps: the frames' own differences, not those of our reading of them.
    steps_s = np.diff([frame.time_s for frame, _, _ in seen])
    assert (steps_s >= 1 / 200 - 1e-4).all()


def test_a_camera_without_stamps_has_the_times_of_arrival(monkeypatch):
    frames, _, _ = opened(monkeypatch, DEFAULT_CAPTURE)
    monkeypatch.setattr(V4l2Camera, "get", lambda self, control: -1.0)
    with frames:
        first = next(iter(frames))
    assert abs(time.time() - (first.time_unix_s or 0)) < 0.5
