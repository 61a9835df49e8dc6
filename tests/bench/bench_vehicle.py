"""A stand-in of a vehicle: GStreamer's H.264 of 1080p from a film, a link that loses 2 %, a camera manager, MAVProxy.

``MAVPROXY`` names mavproxy.py where it is not on the PATH. ``SECONDS`` says how long messages go through it (600). What
is slow is made so by the kernel's quota for processes (cgroup), as root: a quarter of two cores.
"""

import contextlib
import functools
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from fractions import Fraction
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import av
import numpy as np
import pytest
from dockpose import Camera, Dock, Settings
from dockpose.app.commands.ros import make_node
from dockpose.app.export.mavlink import Autopilot
from dockpose.app.inputs.pictures import save_dock
from dockpose.app.processing.following import Following
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, film, render
from dockpose.sources import open_frames

from tests.bench.bench_rtp import mark, number_of
from tests.support import bags, fake_rclpy
from tests.support.mavlink import receiving
from tests.support.rtp import free_port
from tests.support.scenes import random_scene

MAVPROXY = os.environ.get("MAVPROXY") or shutil.which("mavproxy.py")
SECONDS = float(os.environ.get("SECONDS", "600"))
CAMERA = Camera(fx=1400.0, fy=1400.0, cx=959.5, cy=539.5, width=1920, height=1080)
DOCK = Dock(diameter=0.30, lights=10)
RATE_HZ, FRAMES, WRONG_SHARE, STALE_S, DELAY_MS = 10, 100, 0.05, 0.5, 80
CGROUP, QUOTA = Path("/sys/fs/cgroup/cpu"), 0.5  # of one core: a quarter of each of two
needs_gstreamer = pytest.mark.skipif(shutil.which("gst-launch-1.0") is None, reason="needs GStreamer")
needs_quota = pytest.mark.skipif(not os.access(CGROUP, os.W_OK), reason="needs cgroup's quota")


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """An approach and a retreat as H.264, again and again at 10 and 30 Hz; and how far the dock is in each picture."""
    folder = tmp_path_factory.mktemp("films")
    scene = random_scene(4, camera=CAMERA, dock=DOCK, theta_x_deg=8.0, theta_y_deg=-12.0)
    shots = list(film(FilmPlan(scene=scene, motion=Approach(start_m=2.0, end_m=0.9, frames=FRAMES, rate_hz=30.0))))
    ranges_m = [float(np.linalg.norm(shot.scene.pose.position_m)) for shot in shots]
    order = [*range(FRAMES), *reversed(range(FRAMES))]
    pictures = [mark(shots[number].image, number) for number in order]
    once = folder / "once.mkv"
    options = {
        "preset": "veryfast",
        "tune": "zerolatency",
        "crf": "27",
        "x264-params": "keyint=10:scenecut=0:log-level=none",
    }
    with av.open(str(once), "w") as out:
        stream = out.add_stream("libx264", rate=RATE_HZ, options=options)
        stream.width, stream.height, stream.pix_fmt = CAMERA.width, CAMERA.height, "yuv420p"
        for number, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, RATE_HZ)
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
    for rate_hz, seconds in ((RATE_HZ, SECONDS + 120), (30, 240.0)):
        repeat(once, folder / f"{rate_hz}.mkv", rate_hz, math.ceil(seconds * rate_hz / len(order)))
    save_camera(CAMERA, folder / "camera.yaml")
    save_dock(DOCK, folder / "dock.yaml")
    return folder, ranges_m


def repeat(once, path, rate_hz, times):
    """Write a film's packets again and again, at another rate."""
    with av.open(str(once)) as source, av.open(str(path), "w") as out:
        packets = [packet for packet in source.demux(video=0) if packet.size]
        stream = out.add_stream_from_template(source.streams.video[0])
        step = round(1000 / rate_hz * 1000)
        for number in range(times * len(packets)):
            packet = av.Packet(bytes(packets[number % len(packets)]))
            packet.is_keyframe = packets[number % len(packets)].is_keyframe
            packet.stream, packet.time_base = stream, Fraction(1, 1_000_000)
            packet.pts = packet.dts = number * step
            out.mux(packet)


@contextlib.contextmanager
def camera(path, port, lost=0.0):
    """GStreamer sends a film at its rate, over a link that loses packets and delays them."""
    link = f"netsim drop-probability={lost} min-delay={DELAY_MS} max-delay={DELAY_MS} !" if lost else ""
    words = f"filesrc location={path} ! matroskademux ! h264parse config-interval=-1 ! rtph264pay pt=96 mtu=1200 "
    words += f"config-interval=-1 ! identity sync=true ! {link} udpsink host=127.0.0.1 port={port} sync=false"
    with running(["gst-launch-1.0", "-q", *words.split()]):
        yield


@contextlib.contextmanager
def running(command, **more):
    process = subprocess.Popen(command, start_new_session=True, **more)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@contextlib.contextmanager
def manager(port, rtp_port, after_s=0.0):
    """BlueOS's camera manager, which begins later."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            about = {"endpoints": ["udp://192.0.2.1:5600", f"udp://127.0.0.1:{rtp_port}"]}
            streams = [{"running": True, "video_and_stream": {"name": "Front", "stream_information": about}}]
            self.send_response(200)
            self.end_headers()
            self.wfile.write(json.dumps(streams).encode())

        def log_message(self, format, *args):
            """Nothing is printed."""

    def begin():
        time.sleep(after_s)
        servers.append(ThreadingHTTPServer(("127.0.0.1", port), Handler))
        servers[0].serve_forever()

    servers: list[ThreadingHTTPServer] = []
    thread = threading.Thread(target=begin, daemon=True)
    thread.start()
    yield f"blueos://127.0.0.1:{port}"
    for server in servers:
        server.shutdown()
        server.server_close()


@contextlib.contextmanager
def mavproxy(port, out):
    """MAVProxy between: it hears at a port, and passes on."""
    words = [f"--master=udpin:127.0.0.1:{port}", f"--out=udpout:127.0.0.1:{out}", "--daemon", "--non-interactive"]
    folder = Path("/tmp") / f"mavproxy-{port}"
    folder.mkdir()
    with running([sys.executable if MAVPROXY is None else MAVPROXY, *words, f"--state-basedir={folder}"], cwd=folder):
        yield
    shutil.rmtree(folder)


def listen(received, came):
    """Keep what comes until the receiver ends."""
    with contextlib.suppress(AssertionError):
        while True:
            came.append(received.next())


@needs_gstreamer
@pytest.mark.skipif(MAVPROXY is None, reason="needs MAVProxy")
@pytest.mark.parametrize("lost", [0.0, 0.02])
def test_ten_minutes_through_mavproxy_with_packets_of_the_camera_lost(films, lost):
    folder, ranges_m = films
    rtp, port, came, told = free_port(), free_port(), [], list[str]()
    sent: dict[int, int] = {}  # by its stamp, which picture a message is of
    with receiving(0.02, -0.01) as received, mavproxy(port, received.port):
        threading.Thread(target=listen, args=(received, came), daemon=True).start()
        with (
            manager(free_port(), rtp) as source,
            camera(folder / f"{RATE_HZ}.mkv", rtp, lost),
            contextlib.closing(Autopilot(f"udpout:127.0.0.1:{port}", tell=told.append)) as autopilot,
        ):
            following, end_s = Following(CAMERA, DOCK, Settings(), told.append, is_live=True), None
            with open_frames(source, told.append, grey=True) as frames:
                for frame in frames:
                    found = following.see(frame)
                    before = autopilot.sent
                    autopilot.see(frame, found.estimate, found.tracked, found.trust)
                    if autopilot.sent > before:
                        assert frame.time_unix_s is not None
                        sent[round(1e6 * frame.time_unix_s)] = number_of(frame.image)
                    end_s = end_s or time.monotonic() + SECONDS
                    if time.monotonic() > end_s:
                        break
                time.sleep(2.0)
                refused, left_out = autopilot.refused, frames.skipped
    messages = [one for one in came if one["mavpackettype"] == "VISION_POSITION_ESTIMATE"]
    stale = sum(one["at_s"] - one["usec"] / 1e6 > STALE_S for one in messages)
    off = [
        abs(math.hypot(one["x"], one["y"], one["z"]) / ranges_m[sent[one["usec"]]] - 1)
        for one in messages
        if one["usec"] in sent
    ]
    angles = sum(math.isnan(one["yaw"]) for one in messages)
    print(f"{lost:.0%} lost by the camera: {len(sent)} messages sent, {refused} frames not, {left_out} left out")
    print(f"{len(sent) - len(messages)} lost by MAVProxy, {stale} stale, {sum(one > WRONG_SHARE for one in off)} wrong")
    print(f"off by {max(off):.2%} of the range at most; {angles} without angles, before the heartbeat came")
    print("\n".join(line for line in told if "heartbeat" in line or "VISO" in line))
    assert len(messages) == len(sent) == len(off)
    assert stale == 0
    assert max(off) <= WRONG_SHARE
    # A picture has some five packets, a key frame, of which there is one a second, some twenty.
    assert len(sent) > (0.2 if lost else 0.95) * RATE_HZ * SECONDS


@functools.cache
def built():
    """The loops compiled into a folder, as the image has them."""
    folder = Path("/tmp") / f"dockpose-compiled-{os.getpid()}"
    command = [sys.executable, "-m", "dockpose.app.cli", "estimate", "sample_images", "--json", "/dev/null"]
    subprocess.run(command, env=os.environ | {"NUMBA_CACHE_DIR": str(folder)}, check=True, capture_output=True)
    return folder


@contextlib.contextmanager
def slow(command, **more):
    """Run a command on two cores, limited to a quarter; yields the process."""
    group = CGROUP / f"dockpose-{os.getpid()}"
    group.mkdir(exist_ok=True)
    (group / "cpu.cfs_period_us").write_text("10000")
    (group / "cpu.cfs_quota_us").write_text(str(round(10000 * QUOTA)))
    joined = ["sh", "-c", f'echo $$ > {group}/cgroup.procs; exec taskset -c 0,1 "$@"', "sh", *command]
    with running(joined, **more) as process:
        yield process
    with contextlib.suppress(OSError):  # where a process of it has not quite gone
        group.rmdir()


def estimating(source, folder, *more):
    known = ["--camera", str(folder / "camera.yaml"), "--dock", str(folder / "dock.yaml")]
    return [sys.executable, "-m", "dockpose.app.cli", "estimate", source, *known, *more]


def used(pid):
    """Processor time in seconds, and the most memory in MB, of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    ticks = int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK"), int(status["VmHWM"].split()[0]) / 1024


@needs_gstreamer
@needs_quota
def test_from_power_to_the_first_pose_and_memory_and_time_a_frame_on_two_slow_cores(films):
    folder, _ = films
    rtp = free_port()
    environment = os.environ | {"NUMBA_CACHE_DIR": str(built())}
    with receiving(0.02, -0.01) as received, camera(folder / "30.mkv", rtp), manager(free_port(), rtp, 3.0) as source:
        begun_s = time.monotonic()
        more = ["--mavlink", received.address, "--csv", str(folder / "slow.csv")]
        with slow(estimating(source, folder, *more), env=environment, stderr=(folder / "told").open("w")) as process:
            received.next("VISION_POSITION_ESTIMATE")
            first_s = time.monotonic() - begun_s
            time.sleep(10)
            rows, (before_s, _) = count_rows(folder), used(process.pid)
            time.sleep(40)
            frames, (after_s, memory_mb) = count_rows(folder) - rows, used(process.pid)
    per_ms = 1000 * (after_s - before_s) / frames
    print(f"first pose {first_s:.1f} s after the start, the camera manager after 3 s")
    print(f"{frames} frames in 40 s: {per_ms:.1f} ms of processor each, {40_000 / frames:.0f} ms by the clock")
    print(f"at most {memory_mb:.0f} MB of memory")
    assert first_s < 15


def count_rows(folder):
    return len((folder / "slow.csv").read_text().splitlines())


def test_a_node_that_is_off_costs_nothing_and_finds_a_pose_at_once_when_asked(monkeypatch):
    """Pictures of 1080p go on being published: the processor's time while it is off, and how soon there is a pose."""
    fake_rclpy.install(monkeypatch)
    scene = random_scene(4, camera=CAMERA, dock=DOCK)
    picture = render(scene)[0]
    info, image = bags.camera_info(CAMERA.matrix.ravel(), (1920, 1080)), bags.image(picture, "mono8")
    defaults = {"camera_file": "", "dock_file": "", "vehicle_file": "", "dock_diameter_m": 0.30, "lights": 10}
    node = make_node(defaults | {"method": "hats", "image_topic": "/camera/image_raw", "on_demand": True})
    node.trigger_configure()
    node.trigger_activate()

    def publish():
        for topic, message in (("/camera/camera_info", info), ("/camera/image_raw", image)):
            if topic in node.subscriptions_:
                node.subscriptions_[topic].take(message)

    def seconds_of(times):
        begun_s = time.process_time()
        for _ in range(times):
            publish()
            time.sleep(0.1)
        return time.process_time() - begun_s

    off_share = seconds_of(100) / 10
    assert node.published == []
    assert node.call("~/detect").success
    begun_s = time.monotonic()
    while not any(topic == "/dock/pose" for topic, _ in node.published):
        publish()
        assert time.monotonic() - begun_s < 20, node.said
    first_s = time.monotonic() - begun_s
    node.call("~/enable", data=False)
    node.published.clear()
    after_share = seconds_of(50) / 5
    print(f"off: {off_share:.2%} of a core; first pose {first_s:.2f} s after ~/detect; off again: {after_share:.2%}")
    assert node.published == []
    assert max(off_share, after_share) < 0.01
