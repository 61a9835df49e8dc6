import os
from pathlib import Path

import cv2
import numpy as np
import pytest
import zstandard
from dockpose.sources import Kind, kind_of
from PIL import Image

GREY = np.full((24, 32, 3), 71, np.uint8)
PACKET = b"\x47" + bytes(range(1, 188))


def encoded(ending: str) -> bytes:
    return cv2.imencode(ending, GREY)[1].tobytes()


@pytest.mark.parametrize(
    ("name", "begins", "kind"),
    [
        ("GL010373.LRV", b"\0\0\0\x14ftypmp41\0\0\0\0", Kind.VIDEO),
        ("tank", b"\0\0\0\x18ftyp3gp4\0\0\0\0", Kind.VIDEO),
        ("tank.png", b"\0\x10\0\0mdat\0\0\0\0", Kind.VIDEO),
        ("old.bag", b"\0\0\0\x08wide\0\x10\0\0mdat", Kind.VIDEO),
        ("tank.mcap", b"\x1a\x45\xdf\xa3\x9fB\x86\x81\x01", Kind.VIDEO),
        ("tank.jpg", b"RIFF\0\0\x10\0AVI LIST", Kind.VIDEO),
        ("tank.0", PACKET * 20, Kind.VIDEO),
        ("middle.0", PACKET[100:] + PACKET * 20, Kind.VIDEO),
        ("timed.0", (bytes(4) + PACKET) * 20, Kind.VIDEO),
        ("checked.0", (PACKET + bytes(16)) * 20, Kind.VIDEO),
        ("tank.dat", b"\0\0\x01\xba\x44\0\x04\0", Kind.VIDEO),
        ("tank.part", b"\0\0\0\x01\x67\x42\xc0\x1e", Kind.VIDEO),
        ("tank.nut", b"nut/multimedia container\0N", Kind.VIDEO),
        ("tank.rm", b".RMF\0\0\0\x12\0\0", Kind.VIDEO),
        ("tank.wtv", bytes.fromhex("b7d800203749da11a64e0007e95ead8d"), Kind.VIDEO),
        ("metadata.yaml", b"rosbag2_bagfile_information:\n  version: 9\n", Kind.BAG),
        ("icon.ico", b"\0\0\x01\0\x01\0\x20\x20", Kind.PICTURE),
        ("dive.bag.active", b"#ROSBAG V2.0\nE\0\0\0", Kind.BAG),
        ("dive.mp4", b"\x89MCAP0\r\n\x01", Kind.BAG),
        ("dive.yaml", b"SQLite format 3\0\x10\0", Kind.BAG),
        ("dive.db3.zstd", zstandard.ZstdCompressor().compress(b"SQLite format 3\0"), Kind.BAG),
        ("photo.mp4", encoded(".jpg"), Kind.PICTURE),
        ("photo.mcap", encoded(".png"), Kind.PICTURE),
        ("photo.ts", b"P5\n128 64\n255\n" + b"\x47" * 8192, Kind.PICTURE),
        ("photo.avi", encoded(".bmp"), Kind.PICTURE),
        ("photo.mov", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", Kind.PICTURE),
        ("photo.mkv", b"\0\0\0\x18ftypavif\0\0\0\0", Kind.PICTURE),
        ("film.mjpeg", encoded(".jpg"), Kind.VIDEO),
        ("film.mjpg", encoded(".png"), Kind.PICTURE),
        ("scene.yml", b"camera: {}\n", Kind.SIMULATED),
        ("words.mp4", b"these are words, no film", Kind.VIDEO),
        ("words.db3", b"these are words, no bag", Kind.BAG),
        ("words.insv", b"", Kind.VIDEO),
        ("words", b"GGGGGGGG", Kind.PICTURE),
    ],
)
def test_a_file_is_told_by_its_first_bytes_and_by_its_name_where_they_do_not_tell(tmp_path, name, begins, kind):
    (tmp_path / name).write_bytes(begins)
    assert kind_of(str(tmp_path / name)) is kind


def test_pages_are_found_under_any_name(tmp_path: Path):
    pages = [Image.new("L", (8, 8), level) for level in (0, 9)]
    pages[0].save(tmp_path / "stack.tif", save_all=True, append_images=pages[1:])
    os.rename(tmp_path / "stack.tif", tmp_path / "stack.mp4")
    assert kind_of(str(tmp_path / "stack.mp4")) is Kind.PAGES


def test_a_folder_with_a_picture_is_none_of_rosbag2_unless_its_description_is_there(tmp_path: Path):
    (tmp_path / "poses.mcap").write_bytes(b"\x89MCAP0\r\n")
    assert kind_of(str(tmp_path)) is Kind.BAG
    (tmp_path / "frame.png").write_bytes(encoded(".png"))
    assert kind_of(str(tmp_path)) is Kind.FOLDER
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    assert kind_of(str(tmp_path)) is Kind.BAG


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
def test_a_pipe_is_told_by_its_name_and_not_read(tmp_path: Path):
    os.mkfifo(tmp_path / "film.mp4")  # to open it would wait for a writer
    assert kind_of(str(tmp_path / "film.mp4")) is Kind.VIDEO
