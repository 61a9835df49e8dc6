"""H.264 of many slices from GStreamer's RTSP server, with and without lost packets: no picture is made up."""

import subprocess
import time
from fractions import Fraction

import av
import numpy as np
import pytest
from dockpose.sources import open_frames

from tests.support.rtp import free_port

# GStreamer's bindings belong to the system's own Python, as of Debian's gir1.2-gst-rtsp-server-1.0 and python3-gi.
PYTHON = "/usr/bin/python3"
SERVER = """
import sys, gi
gi.require_version("Gst", "1.0"); gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer
Gst.init(None)
if len(sys.argv) > 1:
    server, factory = GstRtspServer.RTSPServer(), GstRtspServer.RTSPMediaFactory()
    server.set_service(sys.argv[1])
    factory.set_launch(f"( filesrc location={sys.argv[2]} ! matroskademux ! h264parse ! rtph264pay pt=96 mtu=600 "
                       f"! identity name=pay0 drop-probability={sys.argv[3]} )")
    server.get_mount_points().add_factory("/film", factory)
    server.attach(None)
    print("ready", flush=True)
    GLib.MainLoop().run()
"""
FRAMES, SECONDS = 200, 13.0
X264 = {"tune": "zerolatency", "x264-params": "log-level=none:sliced-threads=0:slices=8:keyint=25:scenecut=0"}


def has_server():
    try:
        return subprocess.run([PYTHON, "-c", SERVER], capture_output=True, timeout=60, check=False).returncode == 0
    except OSError:
        return False


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A film of noise with a bright bar that moves, and the bytes of each of its pictures."""
    path, rng = tmp_path_factory.mktemp("film") / "a.mkv", np.random.default_rng(0)
    with av.open(str(path), "w") as out:
        stream = out.add_stream("libx264", rate=25, options=X264)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        for number in range(FRAMES):
            picture = rng.integers(0, 40, (480, 640)).astype(np.uint8)
            picture[100:160, 2 * number : 2 * number + 40] = 250
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, 25)
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
    with open_frames(path, grey=True) as frames:
        return path, {frame.image.tobytes() for frame in frames}


@pytest.mark.skipif(not has_server(), reason="GStreamer's RTSP server is not installed")
@pytest.mark.parametrize("lost", [0.0, 0.0002, 0.0005, 0.002, 0.005])
def test_each_picture_that_is_given_is_one_of_the_film(film, lost):
    path, whole = film
    port, given, end_s = free_port(), [], time.monotonic() + SECONDS
    command = [PYTHON, "-c", SERVER, str(port), str(path), str(lost)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            assert server.stdout.readline() == "ready\n"
            with open_frames(f"rtsp://127.0.0.1:{port}/film", grey=True) as frames:
                for frame in frames:
                    given.append(frame.image.tobytes() in whole)
                    if time.monotonic() > end_s or frame.index >= FRAMES - 5:
                        break
                print(f"{lost:.2%} lost: {len(given)} given, {frames.skipped} left out")
        finally:
            server.kill()
    print(f"{given.count(False)} made up")
    assert len(given) > (FRAMES // 3 if not lost else 0)
    assert all(given)
