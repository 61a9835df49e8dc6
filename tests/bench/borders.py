"""Try files in the forms that people complain of: ``python -m tests.bench.borders DATA``, a folder for each form."""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

DOCK = ("--dock-diameter", "0.30", "--lights", "10")
WITHIN_CM = 0.4  # noise of the range in these pictures, which have no error of calibration
_RANGE = re.compile(r"the dock is ([0-9.]+) cm ahead")


class Row(NamedTuple):
    """A command and what is right: how many frames show a dock, the first one's range, or else words of a sentence."""

    folder: str
    arguments: str
    frames: int = 0
    range_cm: float | None = None  # None: whatever it is, or no dock
    words: str = ""  # a pattern that what is printed has
    refused: str = ""  # a pattern of the sentence that would be right as well


def _each(folder: str, names: str, more: str = "", **right: object) -> list[Row]:
    return [Row(folder, f"{name} {more}".strip(), **right) for name in names.split()]  # type: ignore[arg-type]


ROWS = [
    *_each("lens_under_another_key", "meant.yaml mccalib_brown.yml", frames=1, range_cm=100.0),
    Row("lens_under_another_key", "typo.yaml", 1, 100.0, refused="distortion_coefficents"),
    *_each("fisheye_taken_as_radial", "meant.yaml gyroflow.json", frames=1, range_cm=100.0),
    Row("fisheye_taken_as_radial", "kd_fisheye.json", 1, words="k1.*k2.*p1.*p2"),
    *_each("size_in_the_file_not_read", "gyro_big.json bouguet_big.mat", frames=1, range_cm=100.0),
    *_each("stereo_ost_txt", "left.yaml ost_stereo.txt ost_stereo.txt#left", frames=1, range_cm=100.0),
    Row("stereo_ost_txt", "ost_stereo.txt", 1, words="left"),
    *_each("rect_is_in_corrected", "image_raw.mcap image_color_corrected.mcap", frames=1, range_cm=100.0),
    *_each("rect_ffmpeg", "rect_compressed.mcap rect_ffmpeg.mcap", frames=1, range_cm=100.0),
    Row("camera_info_contradicts_pictures", "roi_uncropped.mcap", 1, 100.0, refused="320 x 240"),
    Row("camera_info_contradicts_pictures", "binned_K.mcap", 1, 100.0, refused="binn|320 x 240"),
    *_each("bag_kinds", "foxglove_image.mcap foxglove_ros.mcap", "--camera ../dng_thumbnail/cam.yaml", frames=1),
    Row("bag_kinds", "h264_compressed.mcap --camera ../dng_thumbnail/cam.yaml", 1),
    Row("bag_kinds", "realsense.bag", 1, refused="info/camera_info"),
    *_each("bag_names", "killed.bag.active part_0.db3.zstd", "--camera ../dng_thumbnail/cam.yaml", frames=1),
    Row("blueos_recording", "blueos.mcap --camera cam.yaml", 60, 198.8),
    *_each("cover_before_the_film", "cover_last.mp4 cover_first.mp4", "--camera cam.yaml", frames=12, range_cm=100.0),
    Row("dng_thumbnail", "same.png --camera cam.yaml", 1, 599.9),
    Row("dng_thumbnail", "raw.dng --camera cam.yaml", 1, 599.9, refused="raw picture"),
    *_each("foxglove_sdk", "fg_sdk_image.mcap fg_sdk_raw.mcap", frames=1),
    *_each("foxglove_sdk", "fg_sdk_image.mcap fg_sdk_raw.mcap", "--camera cam.yaml", frames=1),
    Row("killed_wal", "killed.db3 --camera cam.yaml", words="5 frames"),
    Row("lost_slice", "clean.ts --camera cam.yaml", 60),
    Row("lost_slice", "lost_slice.ts --camera cam.yaml", 33, words="27 (frames )?left out"),
    *_each("one_hot_pixel", "same_without.png hot.png", "--camera cam.yaml", frames=1, range_cm=100.0),
    Row("preview_track_first", "two_tracks.mp4 --camera cam.yaml", 1, words="640 x 480|2 video"),
    *_each("video_names", "GL010373.LRV GL010373.3gp GL010373.insv", "--camera ../dng_thumbnail/cam.yaml", frames=1),
]
# Of each file the program that writes it, or its sibling that is read.
_WORDS = {
    "openicc.json": "OpenICC|OpenImuCameraCalibrator",
    "mrcal.cameramodel": "mrcal",
    "SN12345.conf": "ZED",
    "Calib_Results.m": r"Calib_Results\.mat",
    "depthai.json": "depthai|luxonis|oak",
    "transforms.json": "nerf|transforms",
    "basalt.json": "basalt",
    "meshroom.sfm": "meshroom",
    "fs_base64.yml": "base64",
    "K.txt": "lens|distortion|npz",
    "mtx.npy": "npz",
    "calibrationdata.tar.gz": r"ost\.yaml",
    "cameras.bin": r"cameras\.txt",
    "v73.mat": r"-v7\b",
}


def main(words: list[str] | None = None) -> int:
    """Try all rows and print a table; returns how many are wrong, at most 1."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="the folder with a folder for each form")
    parser.add_argument("part", nargs="*", help="only folders whose names begin so")
    asked = parser.parse_args(words)
    rows = [row for row in ROWS if not asked.part or row.folder.startswith(tuple(asked.part))]
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(asked.data, folder, dirs_exist_ok=True)
        for path in [Path(folder), *Path(folder).rglob("*")]:
            path.chmod(0o755 if path.is_dir() else 0o644)
        outcomes = [(row.folder, row.arguments, *tried(Path(folder), row)) for row in rows]
        if not asked.part or "words" in asked.part:
            outcomes += [("words", name, *in_words(Path(folder), name)) for name in _WORDS]
    for place, arguments, fault, said in outcomes:
        wrong += bool(fault)
        print(f"{'WRONG' if fault else 'right'}  {place}: {arguments}: {fault or said}")
        if fault:
            print(f"       {said}")
    print(f"{len(outcomes) - wrong} of {len(outcomes)} right")
    return min(wrong, 1)


def printed(folder: Path, *arguments: str) -> tuple[int, list[str]]:
    """Exit status of ``dockpose estimate`` in a folder, and the lines that it prints."""
    command = [sys.executable, "-m", "dockpose", "estimate", *arguments, *DOCK]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
    lines = (done.stderr + done.stdout).splitlines()
    return done.returncode, [line for line in lines if "compiling" not in line]


def tried(data: Path, row: Row) -> tuple[str, str]:
    """What is wrong with what a row prints, empty where nothing is, and the line that tells."""
    first, *more = row.arguments.split()
    is_camera = first.partition("#")[0].endswith((".yaml", ".yml", ".json", ".mat", ".txt"))
    picture = "pic.png" if row.folder.startswith("size") else "off.png"
    status, lines = printed(data / row.folder, *([picture, "--camera", first] if is_camera else [first]), *more)
    text = "\n".join(lines)
    if "Traceback" in text:
        return "an error escapes", lines[-1]
    shown = [float(match[1]) for line in lines if (match := _RANGE.search(line))]
    if row.refused and status and not shown:
        is_named = re.search(row.refused, text) is not None
        return ("" if is_named else f"refused, without {row.refused!r}"), lines[-1] if lines else ""
    if row.words and not re.search(row.words, text):
        return f"says nothing of {row.words!r}", lines[-1] if lines else ""
    if len(shown) < row.frames or (row.frames > 1 and len(shown) != row.frames):
        return f"{len(shown)} of {row.frames} frames show the dock", lines[-1] if lines else ""
    if row.range_cm is not None and abs(shown[0] - row.range_cm) > WITHIN_CM:
        return f"{shown[0]} cm, which is {row.range_cm}", lines[-1]
    return "", f"{len(shown)} frames" + (f", the first {shown[0]} cm ahead" if shown else "")


def in_words(data: Path, name: str) -> tuple[str, str]:
    """As :func:`tried`, of a file that has another program's form: it is read, or its sentence says whose it is."""
    status, lines = printed(data / "words", "pic.png", "--camera", name)
    text = "\n".join(lines)
    if status == 0 or re.search(_WORDS[name], text.replace(name, ""), re.IGNORECASE):
        return "", lines[-1] if lines else ""
    return f"says nothing of {_WORDS[name]!r}", lines[-1] if lines else ""


if __name__ == "__main__":
    sys.exit(main())
