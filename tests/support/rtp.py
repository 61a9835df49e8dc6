"""RTP as FFmpeg sends it: caught on loopback, so that a test sends each datagram when and if it likes."""

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

import av
import numpy as np

from tests.support.layout import ROOT

CODERS = {"H264": "libx264", "H265": "libx265"}
_OPTIONS = {
    "libx264": {"preset": "ultrafast", "tune": "zerolatency", "x264-params": "repeat-headers=1:keyint={}:scenecut=0"},
    "libx265": {
        "preset": "ultrafast",
        "tune": "zerolatency",
        "x265-params": "repeat-headers=1:keyint={}:scenecut=0:log-level=none",
    },
}
_IS_LAST = 0x80


def free_port() -> int:
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Sender:
    """FFmpeg's coder and its RTP, with pictures (H, W, 3) BGR one by one to a port of this machine."""

    def __init__(
        self, port: int, coding: str, size: tuple[int, int], rate_hz: float, key_every: int, more: str = ""
    ) -> None:
        coder = CODERS[coding]
        options = {name: value.format(key_every) for name, value in _OPTIONS[coder].items()}
        options[f"{coder.removeprefix('lib')}-params"] += more
        options["crf"] = "20"
        self._container = av.open(f"rtp://127.0.0.1:{port}?pkt_size=1200", "w", format="rtp")
        rate = Fraction(rate_hz).limit_denominator(1000)
        self._stream: Any = self._container.add_stream(coder, rate=rate, options=options)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        self._sent = 0

    def send(self, picture: np.ndarray | None) -> int:
        """Send a picture, or with None those that the coder holds back; returns how many are sent."""
        frame = None
        if picture is not None:
            frame = av.VideoFrame.from_ndarray(picture, format="bgr24").reformat(format=self._stream.pix_fmt)
            frame.pts = self._sent
            self._sent += 1
        packets = self._stream.encode(frame)
        for packet in packets:
            self._container.mux(packet)
        return len(packets)

    def close(self) -> None:
        self._container.close()


def datagrams(
    pictures: Sequence[np.ndarray], coding: str = "H264", key_every: int = 10, more: str = ""
) -> list[list[bytes]]:
    """The datagrams of each picture, in the order in which a coder with some more options sends them."""
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as catcher:
        catcher.bind(("127.0.0.1", 0))
        catcher.settimeout(10)
        height, width = pictures[0].shape[:2]
        sender = Sender(catcher.getsockname()[1], coding, (width, height), 30, key_every, more)
        found: list[list[bytes]] = []
        for picture in (*pictures, None):
            for _ in range(sender.send(picture)):
                found.append([])
                while not found[-1] or not found[-1][-1][1] & _IS_LAST:
                    found[-1].append(catcher.recv(2**16))
        sender.close()
    return found


def restarted(data: bytes, by: int) -> bytes:
    """A datagram as another run of the sender would send it: another source, other numbers, another clock."""
    found = bytearray(data)
    for first, end in ((2, 4), (4, 8), (8, 12)):
        size = end - first
        found[first:end] = ((int.from_bytes(data[first:end], "big") + by) % 2 ** (8 * size)).to_bytes(size, "big")
    return bytes(found)


@contextlib.contextmanager
def sending(*words: object) -> Iterator[subprocess.Popen[str]]:
    """A process that sends as ``main`` says."""
    command = [sys.executable, "-m", "tests.support.rtp", *map(str, words)]
    process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def main(file: str, port: int, coding: str, rate_hz: float, key_every: int, lost: float, pauses: Sequence[str]) -> None:
    """Send the pictures of a NumPy file, each at its time, and write when; after N pictures pause, as N:SECONDS says.

    A relay of ours between FFmpeg and the port loses a share of the datagrams, by a fixed seed.
    """
    pictures = np.load(file)
    pause_s = {int(number): float(seconds) for number, seconds in (pause.split(":") for pause in pauses)}
    rng = np.random.default_rng(1)
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as relay:
        relay.bind(("127.0.0.1", 0))
        relay.setblocking(False)
        height, width = pictures.shape[1:3]
        sender = Sender(relay.getsockname()[1], coding, (width, height), rate_hz, key_every)
        due_s = time.monotonic()
        for number, picture in enumerate(pictures):
            due_s += pause_s.get(number, 0.0)
            time.sleep(max(0.0, due_s - time.monotonic()))
            due_s += 1 / rate_hz
            print(number, time.monotonic(), flush=True)
            sender.send(picture)
            while data := _waiting(relay):
                if rng.random() >= lost:
                    relay.sendto(data, ("127.0.0.1", port))
        sender.close()


def _waiting(relay: socket.socket) -> bytes:
    try:
        return relay.recv(2**16)
    except BlockingIOError:
        return b""


if __name__ == "__main__":
    path, number, coding, *rest = sys.argv[1:]
    main(path, int(number), coding, float(rest[0]), int(rest[1]), float(rest[2]), rest[3:])
