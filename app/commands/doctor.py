"""``dockpose doctor``: whether all that dockpose needs is there and works, for a report of a fault."""
# Nothing secret is told: no token, no address, no name but those of packages.

import argparse
import contextlib
import io
import os
import platform
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

import av
import cv2
import numpy as np
from av.codec import Codec
from av.error import FFmpegError
from dockpose import Settings, estimate
from dockpose.app.commands.console import EXIT_ALL_READ, put
from dockpose.app.commands.output import open_lines, write_line
from dockpose.app.export.video import VideoFile
from dockpose.app.inputs.pictures import load_sample
from dockpose.app.state.preferences import config_folder
from dockpose.app.web.server.options import DEFAULT_PORT, SESSIONS_FOLDER
from dockpose.pixels import bright
from dockpose.pose.known import pose_error
from dockpose.sidecar import FIRST_SAMPLE
from dockpose.sources import open_frames
from dockpose.text import one_line
from dockpose.thresholds import METHODS

EXIT_BROKEN = 1
OK, WARNING, BROKEN = "ok", "warning", "broken"
_NEEDED = ("numpy", "opencv-python-headless", "scipy", "scikit-image", "numba", "av", "viser", "msgspec", "matplotlib")
_OPENCV = "opencv-python-headless"
_OTHER_OPENCV = ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
_OPTIONAL = ("pandas", "distributed", "rosbags", "mcap")
_PICTURES = (".png", ".jpg", ".tiff", ".bmp", ".webp", ".pgm")
_NEEDED_PICTURES = ("png", "jpg")
# Decoder, and the encoder and pixels that try it; without one it is only asked for.
_VIDEOS = {
    "ffv1": ("ffv1", "gray"),
    "mjpeg": ("mjpeg", "yuvj420p"),
    "h264": ("libx264", "yuv420p"),
    "hevc": None,  # its encoder prints
    "vp9": None,
    "av1": None,
}
_NEEDED_VIDEOS = ("ffv1", "mjpeg", "h264")
_LEVELS = (20, 120, 220)  # of the small video's frames
_MOST_ERROR_M, _MOST_ERROR_DEG = 0.005, 0.5


@dataclass(frozen=True)
class Finding:
    """What a check found, as a line of text and for JSON."""

    name: str
    state: str
    text: str
    more: dict[str, Any] = field(default_factory=dict)


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose doctor``; returns the exit status, which is 1 where something is broken."""
    broken = 0
    with contextlib.ExitStack() as files:
        lines = open_lines(arguments.json, files)
        for finding in findings():
            broken += finding.state == BROKEN
            if lines is not None:
                write_line(lines, {"check": finding.name, "state": finding.state, "text": finding.text} | finding.more)
            else:
                put(f"{finding.state:7} {finding.name:20} {finding.text}")
        if lines is None:
            put("nothing is broken" if not broken else f"{broken} broken, see above")
    return EXIT_BROKEN if broken else EXIT_ALL_READ


def findings() -> Iterator[Finding]:
    """Yield what each check finds; one that fails itself is broken."""
    for name, check in CHECKS.items():
        try:
            for finding in check():
                yield replace(finding, text=one_line(without_home(finding.text)))
        except Exception as error:  # whatever is wrong here is what people want to read
            yield Finding(name, BROKEN, one_line(without_home(f"{type(error).__name__}: {error}")))


def without_home(text: str) -> str:
    """The text with the home folder as ~, since its path tells a name."""
    try:
        home = str(Path.home())
    except RuntimeError:
        return text
    return text if home in ("", "/") else text.replace(home, "~")


def _versions() -> Iterator[Finding]:
    yield Finding("dockpose", OK, version("dockpose"))
    yield Finding("python", OK, f"{platform.python_implementation()} {platform.python_version()}, {sys.prefix}")
    yield Finding("system", OK, f"{platform.platform()}, {os.cpu_count()} cores")
    for package in _NEEDED:
        # OpenCV has several distributions, of which one is enough.
        other = f"{cv2.__version__}, of another distribution" if package == _OPENCV else None
        state = OK if _installed(package) else WARNING if other else BROKEN
        yield Finding(package, state, _installed(package) or other or "not installed")
    yield from _other_opencv()
    yield from (Finding(package, OK, _installed(package) or "not installed (optional)") for package in _OPTIONAL)


def _installed(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _other_opencv() -> Iterator[Finding]:
    """A finding for each build of OpenCV beside ours, since both are the one folder cv2."""
    for package in _OTHER_OPENCV:
        if _installed(package) and _installed(_OPENCV):
            text = (
                f"{package} and {_OPENCV} overwrite each other's files, so that the one loses its windows or other "
                f"parts; uninstall both, then install only the one that you need"
            )
            yield Finding(package, WARNING, text)


def _pictures() -> Iterator[Finding]:
    image = np.arange(64, dtype=np.uint8).reshape(8, 8)
    yield _decoders("pictures", {ending[1:]: _comes_back(image, ending) for ending in _PICTURES}, _NEEDED_PICTURES)


def _comes_back(image: np.ndarray, ending: str) -> bool:
    try:
        data = cv2.imencode(ending, image)[1]
        decoded = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
    except cv2.error:
        return False
    return decoded is not None and decoded.shape == image.shape


def _videos() -> Iterator[Finding]:
    yield _decoders("videos", {name: _decodes(name, encoder) for name, encoder in _VIDEOS.items()}, _NEEDED_VIDEOS)
    yield _film()


def _film() -> Finding:
    """Write a small video and read it back as the program reads every video."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mkv"
        try:
            with VideoFile(path, 10.0) as video:
                for level in _LEVELS:
                    video.write(np.full((48, 64), level, np.uint8))
            with open_frames(str(path)) as frames:
                found = [(frame.time_s, int(frame.image[24, 32])) for frame in frames]
        except Exception as error:  # whatever a version of PyAV does
            return Finding("film", BROKEN, f"a small video cannot be read: {type(error).__name__}: {error}")
    if found != [(number / 10, level) for number, level in enumerate(_LEVELS)]:
        return Finding("film", BROKEN, f"a small video of {len(_LEVELS)} frames is read wrongly: {found}")
    return Finding("film", OK, f"a small video of {len(_LEVELS)} frames was written and read back")


def _decoders(what: str, works: dict[str, bool], needed: Sequence[str]) -> Finding:
    can, fails = ([name for name, is_read in works.items() if is_read == wanted] for wanted in (True, False))
    state = BROKEN if set(fails) & set(needed) else WARNING if fails else OK
    cannot = f"; {', '.join(fails)} cannot" if fails else ""
    return Finding(what, state, f"{', '.join(can) or 'none'} can be read{cannot}")


def _decodes(name: str, encoder: tuple[str, str] | None) -> bool:
    """Whether a frame that was encoded can be decoded; where nothing here encodes it, whether there is a decoder."""
    if encoder is None or not _has_codec(encoder[0], "w"):
        return _has_codec(name, "r")
    file = io.BytesIO()
    try:
        with av.open(file, "w", format="matroska") as video:
            stream: Any = video.add_stream(encoder[0], rate=10)
            stream.width, stream.height, stream.pix_fmt = 64, 64, encoder[1]
            frame = av.VideoFrame.from_ndarray(np.full((64, 64, 3), 90, np.uint8), format="rgb24")
            video.mux([*stream.encode(frame), *stream.encode(None)])
        file.seek(0)
        with av.open(file, "r") as written:
            return next(written.decode(video=0)).width == 64
    except (FFmpegError, ValueError, StopIteration):
        return False


def _has_codec(name: str, mode: Literal["r", "w"]) -> bool:
    try:
        Codec(name, mode)
    except ValueError:
        return False
    return True


def _cameras() -> Iterator[Finding]:
    """Those that the system lists: none is opened, which could hang, or take one from the program that uses it."""
    if not sys.platform.startswith("linux"):
        yield Finding("cameras", OK, "are not listed on this system without opening them; try dockpose serve 0")
        return
    found = []
    for device in sorted(Path("/dev").glob("video*")):
        name = Path("/sys/class/video4linux") / device.name / "name"
        words = name.read_text(encoding="utf-8", errors="replace").strip() if name.exists() else "no name"
        denied = "" if os.access(device, os.R_OK | os.W_OK) else ", which this user may not open (group video)"
        found.append(f"{device} ({words}{denied})")
    yield Finding("cameras", OK, "; ".join(found) or "none in /dev")


def _port() -> Iterator[Finding]:
    with socket.socket() as any_free:
        any_free.bind(("127.0.0.1", 0))
        free = any_free.getsockname()[1]
    with socket.socket() as wanted:
        if os.name != "nt":
            wanted.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            wanted.bind(("127.0.0.1", DEFAULT_PORT))
        except OSError:
            yield Finding("port", WARNING, f"{DEFAULT_PORT} is taken; dockpose serve --port {free} would do")
            return
    yield Finding("port", OK, f"{DEFAULT_PORT} is free")


def _folders() -> Iterator[Finding]:
    yield _writable("temporary folder", Path(tempfile.gettempdir()), BROKEN, "")
    yield _writable("sessions", SESSIONS_FOLDER.absolute(), WARNING, "; dockpose serve --sessions FOLDER names another")
    settings = config_folder()
    if settings is None:
        yield Finding("settings", WARNING, "no home folder, so that the page forgets its settings")
    else:
        yield _writable("settings", settings, WARNING, "; the page forgets its settings")


def _writable(name: str, folder: Path, otherwise: str, advice: str) -> Finding:
    """Write into a folder, or into the nearest one above that exists."""
    place = next(one for one in (folder, *folder.parents) if one.exists())
    try:
        with tempfile.TemporaryFile(dir=place) as file:
            file.write(b"dockpose")
    except OSError as error:
        return Finding(name, otherwise, f"{folder} cannot be written ({error.strerror}){advice}")
    return Finding(name, OK, f"{folder} can be written")


def _methods() -> Iterator[Finding]:
    told: list[str] = []
    with METHODS.telling(told.append):
        own = [name for name in METHODS if METHODS.is_own(name)]
    for problem in told:
        yield Finding("threshold methods", BROKEN, problem)
    packages = f", and of packages {', '.join(own)}" if own else ""
    yield Finding("threshold methods", OK, f"{len(METHODS) - len(own)} of dockpose's own{packages}")


def _self_test() -> Iterator[Finding]:
    """One picture whose pose is known; then whether the loops that were compiled for it are kept."""
    sample = load_sample(FIRST_SAMPLE)
    start = time.perf_counter()
    found = estimate(sample.image, sample.camera, sample.dock, Settings())
    seconds = time.perf_counter() - start
    error = pose_error(found.selected, sample.truth)
    if error is None or sample.truth is None or found.selected is None:
        yield Finding("self test", BROKEN, f"sample {FIRST_SAMPLE}: {found.message}")
    else:
        distance_m, angle_deg = float(error.distance_m), float(np.degrees(error.angle_rad))
        state = OK if distance_m <= _MOST_ERROR_M and angle_deg <= _MOST_ERROR_DEG else BROKEN
        expected, position = list(sample.truth.position_m), found.selected.position_m.tolist()
        text = (
            f"sample {FIRST_SAMPLE}: expected {_place(expected)}, found {_place(position)}, off by "
            f"{1000 * distance_m:.2f} mm and {angle_deg:.3f} deg, in {seconds:.1f} s"
        )
        more = {"expected_m": expected, "found_m": position, "error_m": distance_m, "error_deg": angle_deg}
        yield Finding("self test", state, text, more)
    yield _compiled()


def _place(position_m: list[float]) -> str:
    return "({:.3f}, {:.3f}, {:.3f}) m".format(*position_m)


def _compiled() -> Finding:
    loop: Any = bright._at_least
    cache = getattr(loop, "_cache", None)
    if not hasattr(loop, "py_func"):
        return Finding("compiled loops", WARNING, "are not compiled, since NUMBA_DISABLE_JIT is set: all is slow")
    folder = getattr(cache, "cache_path", None)
    if not folder or not any(Path(folder).glob("bright.*.nbi")):
        return Finding("compiled loops", WARNING, "are not kept: each start takes up to half a minute longer")
    return Finding("compiled loops", OK, f"are kept in {folder}")


CHECKS: dict[str, Callable[[], Iterator[Finding]]] = {
    "versions": _versions,
    "pictures": _pictures,
    "videos": _videos,
    "cameras": _cameras,
    "port": _port,
    "folders": _folders,
    "threshold methods": _methods,
    "self test": _self_test,
}
