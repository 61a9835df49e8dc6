"""``dockpose doctor``: versions, decoders and one known pose, for a report of a fault."""
# Nothing secret is printed: no token, no address, no name but those of packages.

import argparse
import contextlib
import os
import platform
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

import cv2
import numpy as np
from av.codec import codecs_available
from dockpose import estimate
from dockpose.app.commands.console import EXIT_ALL_READ, put
from dockpose.app.commands.output import open_lines, write_line
from dockpose.app.inputs.pictures import load_sample
from dockpose.pose.known import pose_error
from dockpose.sidecar import FIRST_SAMPLE
from dockpose.text import one_line

EXIT_BROKEN = 1
OK, WARNING, BROKEN = "ok", "warning", "broken"
_NEEDED = ("numpy", "scipy", "scikit-image", "numba", "av", "viser", "msgspec", "matplotlib")
_OPENCV = ("opencv-python-headless", "opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
_OPTIONAL = ("pandas", "distributed", "rosbags", "mcap")
_DECODERS = {"pictures": ("png", "jpg", "tiff", "bmp", "webp"), "videos": ("ffv1", "mjpeg", "h264", "hevc", "av1")}
_NEEDED_DECODERS = {"png", "jpg", "ffv1", "mjpeg", "h264"}
_MOST_ERROR_M, _MOST_ERROR_DEG = 0.005, 0.5


class Finding(NamedTuple):
    """What a check found."""

    check: str
    state: str
    text: str


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose doctor``; returns the exit status, which is 1 where something is broken."""
    broken = 0
    with contextlib.ExitStack() as files:
        lines = open_lines(arguments.json, "--json", files)
        for finding in findings():
            broken += finding.state == BROKEN
            if lines is not None:
                write_line(lines, finding._asdict())
            else:
                put(f"{finding.state:7} {finding.check:20} {finding.text}")
        if lines is None:
            put("nothing is broken" if not broken else f"{broken} broken, see above")
    return EXIT_BROKEN if broken else EXIT_ALL_READ


def findings() -> Iterator[Finding]:
    """Yield what each check finds; one that fails itself is broken."""
    for name, check in CHECKS.items():
        try:
            yield from (finding._replace(text=_public(finding.text)) for finding in check())
        except Exception as error:  # whatever is wrong here is what people want to read
            yield Finding(name, BROKEN, _public(f"{type(error).__name__}: {error}"))


def _public(text: str) -> str:
    """One line of a text, with the home folder as ~, since its path tells a name."""
    home = os.path.expanduser("~")
    return one_line(text if home in ("", "/", "~") else text.replace(home, "~"))


def _versions() -> Iterator[Finding]:
    yield Finding("dockpose", OK, version("dockpose"))
    yield Finding("python", OK, f"{platform.python_implementation()} {platform.python_version()}, {sys.prefix}")
    yield Finding("system", OK, f"{platform.platform()}, {os.cpu_count()} cores")
    for name in _NEEDED:
        yield Finding(name, OK if _installed(name) else BROKEN, _installed(name) or "not installed")
    builds = [name for name in _OPENCV if _installed(name)]  # all of them are the one folder cv2
    text = "; ".join([cv2.__version__, *builds]) + (": uninstall all of them, then install one" if builds[1:] else "")
    yield Finding("opencv", OK if len(builds) == 1 else WARNING, text)
    yield from (Finding(name, OK, _installed(name) or "not installed (optional)") for name in _OPTIONAL)


def _installed(package: str) -> str | None:
    with contextlib.suppress(PackageNotFoundError):
        return version(package)
    return None


def _decoders() -> Iterator[Finding]:
    """Which kinds of pictures come back from their own file, and which videos have a decoder."""
    for what, names in _DECODERS.items():
        cannot = [name for name in names if not (name in codecs_available if what == "videos" else _comes_back(name))]
        state = BROKEN if _NEEDED_DECODERS.intersection(cannot) else WARNING if cannot else OK
        can = ", ".join(name for name in names if name not in cannot) or "none"
        fails = f"; {', '.join(cannot)} cannot" if cannot else ""
        yield Finding(what, state, f"{can} can be read{fails}")


def _comes_back(kind: str) -> bool:
    with contextlib.suppress(cv2.error):
        return cv2.imdecode(cv2.imencode(f".{kind}", np.eye(8, dtype=np.uint8))[1], cv2.IMREAD_UNCHANGED) is not None
    return False


def _self_test() -> Iterator[Finding]:
    """One picture whose pose is known."""
    sample = load_sample(FIRST_SAMPLE)
    found = estimate(sample.image, sample.camera, sample.dock)
    error = pose_error(found.selected, sample.truth)
    if error is None:
        yield Finding("self test", BROKEN, f"sample {FIRST_SAMPLE}: {found.message}")
        return
    error_m, error_deg = float(error.distance_m), float(np.degrees(error.angle_rad))
    state = OK if error_m <= _MOST_ERROR_M and error_deg <= _MOST_ERROR_DEG else BROKEN
    off = f"off by {1000 * error_m:.2f} mm and {error_deg:.3f} deg"
    yield Finding("self test", state, f"sample {FIRST_SAMPLE}: the pose is {off}")


CHECKS: dict[str, Callable[[], Iterator[Finding]]] = {
    "versions": _versions,
    "decoders": _decoders,
    "self test": _self_test,
}
