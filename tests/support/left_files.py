"""Whether the files that a command left can be read, each by what reads its kind."""

import csv
import io
import json
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import av
import cv2
import numpy as np
import yaml
from av.error import FFmpegError
from dockpose.app.export import bundle
from dockpose.camera.files import load_camera
from dockpose.sources import SourceError, open_frames
from PIL import Image


def files_of(folder: Path) -> list[Path]:
    """Files that have their names, and not a temporary one."""
    return sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))


def faults(folder: Path, grows: tuple[str, ...]) -> list[str]:
    """Sentences on the files of a folder that their readers cannot read; those that grow may lack an end."""
    found = []
    for path in files_of(folder):
        is_growing = str(path.relative_to(folder)) in grows
        try:
            _read(path, is_growing)
        except (
            OSError,
            ValueError,
            AssertionError,
            SyntaxError,
            yaml.YAMLError,
            zipfile.BadZipFile,
            FFmpegError,
        ) as error:
            found.append(f"{path.name} ({path.stat().st_size} bytes): {type(error).__name__} {error}")
    return found


def _read(path: Path, is_growing: bool) -> None:
    """Read a file by what reads its kind. Raises one of several errors where that cannot be done."""
    data, ending = path.read_bytes(), path.suffix
    if is_growing:
        if ending in (".jsonl", ".csv", ".log"):
            _read_lines(path, data)
        elif data:  # a file that was just begun has no records
            _read_stream(path)
        return
    assert data, "is empty"
    if ending == ".png":
        Image.open(io.BytesIO(data)).load()
        assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) is not None
    elif ending == ".svg":
        ElementTree.fromstring(data)
    elif ending == ".json":
        json.loads(data)
    elif ending == ".jsonl":
        assert bundle.read_lines(path) if b'"schema"' in data else [json.loads(line) for line in data.splitlines()]
    elif ending == ".yaml":
        assert yaml.safe_load(data)
        if "camera" in path.name:
            load_camera(path)
    elif ending == ".zip":
        assert zipfile.ZipFile(io.BytesIO(data)).testzip() is None
    elif ending in (".mkv", ".mp4", ".avi", ".mcap"):
        _read_stream(path)
    elif ending == ".csv":
        rows = list(csv.reader(io.StringIO(data.decode(), newline="")))
        assert len({len(row) for row in rows}) == 1
    else:
        assert data.endswith((b"\n", b">")), "has no end"


def _read_lines(path: Path, data: bytes) -> None:
    whole = data[: data.rfind(b"\n") + 1]
    if path.suffix == ".jsonl":
        lines = [json.loads(line) for line in whole.splitlines()]
        if lines and "schema" in lines[0]:
            assert bundle.read_lines(path) == lines
    elif path.suffix == ".csv":
        rows = list(csv.reader(io.StringIO(whole.decode(), newline="")))
        assert len({len(row) for row in rows}) <= 1
    else:
        assert all(b" dockpose" in line for line in whole.splitlines())


def _read_stream(path: Path) -> None:
    """Read what there is of frames or messages; a file of a header alone has none."""
    told: list[str] = []
    if path.suffix == ".mcap":
        try:
            with open_frames(str(path), told.append) as frames:
                count = sum(1 for _ in frames)
        except SourceError:
            if path.stat().st_size >= 20_000:
                raise
            count = 0
    else:
        try:
            with av.open(str(path)) as container:
                count = sum(1 for _ in container.decode(video=0))
        except FFmpegError:
            if path.stat().st_size >= 1000:
                raise
            count = 0
    lines = path.with_name("a.jsonl")
    if path.suffix != ".mp4" and lines.exists() and b'"schema"' in (content := lines.read_bytes()):
        # A frame's line is written first, then its picture.
        assert count >= content.count(b"\n") - 2, f"has {count} frames, the lines {content.count(bytes([10]))}"
