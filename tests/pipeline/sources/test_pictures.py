import io
import struct
from datetime import UTC, datetime

import av
import numpy as np
import pytest
from dockpose import estimate
from dockpose.sources import Kind, SourceError, kind_of, open_frames
from dockpose.sources.pictures import taken_unix_s
from PIL import ExifTags, Image

from tests.support.scenes import CAMERA, DOCK
from tests.support.sources import taken

NOON_S = datetime(2026, 7, 1, 12, 0, 0, tzinfo=UTC).timestamp()


def picture(kind="JPEG", **tags):
    """A picture's bytes with EXIF tags by their names."""
    image, exif = Image.new("L", (8, 6)), Image.Exif()
    # Set as a whole: older versions of Pillow forget what is added to a part that is not there yet.
    exif[ExifTags.IFD.Exif] = {int(ExifTags.Base[name]): value for name, value in tags.items()}
    out = io.BytesIO()
    image.save(out, kind, exif=exif)
    return out.getvalue()


@pytest.mark.parametrize("kind", ["JPEG", "WEBP"])
@pytest.mark.parametrize(
    ("clock", "zone", "digits", "wanted_s"),
    [
        ("2026:07:01 12:00:00", "+00:00", None, NOON_S),
        ("2026:07:01 14:00:00", "+02:00", "25", NOON_S + 0.25),
        ("2026:07:01 06:30:00", "-05:30", "007", NOON_S + 0.007),
    ],
)
def test_a_picture_with_a_zone_tells_when_it_was_taken(kind, clock, zone, digits, wanted_s):
    more = {} if digits is None else {"SubsecTimeOriginal": digits}
    data = picture(kind, DateTimeOriginal=clock, OffsetTimeOriginal=zone, **more)
    assert taken_unix_s(data) == pytest.approx(wanted_s, abs=1e-6)


ZONE_ALONE = {"OffsetTimeOriginal": "+00:00"}
NOON = {"DateTimeOriginal": "2026:07:01 12:00:00"}  # of which zone?


@pytest.mark.parametrize(
    "data",
    [
        *(picture(**tags) for tags in ({}, NOON, ZONE_ALONE, NOON | {"OffsetTimeOriginal": "   :  "})),
        picture(**ZONE_ALONE, DateTimeOriginal="0000:00:00 00:00:00"),
        *(b"", b"II*\0", b"\xff\xd8\xff\xe1" + 60 * b"\xff", b"\x89PNG"),
    ],
)
def test_a_picture_that_does_not_say_all_of_it_or_is_damaged_tells_nothing(data):
    assert taken_unix_s(data) is None


def test_frames_from_pictures_have_that_time(tmp_path):
    (tmp_path / "a.jpg").write_bytes(picture(**NOON, **ZONE_ALONE))
    Image.new("L", (8, 6)).save(tmp_path / "b.png")
    assert [frame.time_unix_s for frame in taken(tmp_path)[0]] == [NOON_S, None]


SCENE = np.random.default_rng(0).integers(0, 256, (48, 64), dtype=np.uint8)
# Where x and y go in a video's display matrix that says the same as EXIF's number.
MATRICES = [(1, 0, 0, 1), (-1, 0, 0, 1), (-1, 0, 0, -1), (1, 0, 0, -1), (0, 1, 1, 0), (0, 1, -1, 0), (0, -1, -1, 0)]
MATRICES.append((0, -1, 1, 0))


def tagged(kind, number):
    """A still's bytes, or a video's, with an orientation by EXIF's number."""
    file = io.BytesIO()
    if kind != "MP4":
        exif = Image.Exif()
        exif[ExifTags.Base.Orientation] = number
        Image.fromarray(SCENE).save(file, kind, exif=exif, **({"lossless": True} if kind == "WEBP" else {}))
        return file.getvalue()
    with av.open(file, "w", "mp4") as container:
        stream = container.add_stream("mpeg4", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for _ in range(2):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(SCENE, format="gray")))
        container.mux(stream.encode(None))
    data, (a, b, c, d) = bytearray(file.getvalue()), MATRICES[number - 1]
    place = data.index(b"tkhd") + 44  # ISO 14496-12, section 8.3.2
    one, last = 1 << 16, 1 << 30
    assert struct.unpack(">9i", data[place : place + 36]) == (one, 0, 0, 0, one, 0, 0, 0, last)
    data[place : place + 36] = struct.pack(">9i", a * one, b * one, 0, c * one, d * one, 0, 0, 0, last)
    return bytes(data)


@pytest.mark.parametrize("number", range(1, 9))
@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF", "WEBP", "MP4"])
def test_pixels_stay_as_the_sensor_has_them_and_a_tag_is_named(kind, number, tmp_path):
    path, plain = tmp_path / f"a.{kind.lower()}", tmp_path / f"plain.{kind.lower()}"
    path.write_bytes(tagged(kind, number))
    plain.write_bytes(tagged(kind, 1))
    ((found, *_), told, _), ((wanted, *_), nothing, _) = taken(path), taken(plain)
    assert nothing == []
    np.testing.assert_array_equal(found.image, wanted.image)
    assert found.image.shape[:2] == (48, 64)
    assert len(told) == (number != 1)
    if told:
        assert told[0].startswith(f"{path}: its orientation tag {number} says that it lies ")
        assert ("--rotate" in told[0]) == (number in (3, 6, 8))


@pytest.mark.parametrize(("number", "degrees"), [(3, 180), (6, 90), (8, 270)])
def test_the_turn_that_is_advised_sets_the_picture_upright(number, degrees, tmp_path):
    (tmp_path / "a.png").write_bytes(tagged("PNG", number))
    upright = Image.fromarray(SCENE).transpose(Image.Transpose({3: 3, 6: 4, 8: 2}[number]))  # as its exif_transpose
    (found,), told, _ = taken(tmp_path / "a.png", rotate=degrees)
    np.testing.assert_array_equal(found.image, np.asarray(upright))
    assert f"--rotate {degrees} " in told[0]


def test_an_estimate_of_a_file_names_the_tag(tmp_path):
    (tmp_path / "a.png").write_bytes(tagged("PNG", 6))
    camera = type(CAMERA)(50, 50, 31.5, 23.5, 64, 48)
    message = estimate(tmp_path / "a.png", camera, DOCK).message
    assert "a.png: its orientation tag 6 says that it lies on its side" in message
    assert "orientation" not in estimate(SCENE, camera, DOCK).message


PAGES = [np.full((48, 64), level, np.uint8) for level in (0, 40, 80, 120)]


def paged(path, **how):
    first, *others = map(Image.fromarray, PAGES)
    first.save(path, save_all=True, append_images=others, **how)
    return path


@pytest.mark.parametrize(("ending", "how"), [("tiff", {}), ("tif", {"compression": "tiff_lzw"})])
def test_a_file_of_several_pictures_is_a_sequence(ending, how, tmp_path):
    path = paged(tmp_path / f"a.{ending}", **how)
    assert kind_of(str(path)) is Kind.PAGES
    with open_frames(path, pytest.fail) as frames:
        found = list(frames)
        assert frames.count == 4
        assert frames.at(2).image.max() == 80
        with pytest.raises(SourceError, match="frame 4 of 4 is not there"):
            frames.at(4)
    assert [frame.index for frame in found] == [0, 1, 2, 3]
    assert [frame.time_s for frame in found] == [None] * 4
    assert [(int(frame.image.min()), int(frame.image.max())) for frame in found] == [(n, n) for n in (0, 40, 80, 120)]
    assert [frame.time_s for frame in taken(path, rate_hz=4.0)[0]] == [0, 0.25, 0.5, 0.75]


def test_a_page_that_is_cut_short_is_left_out_with_a_sentence(tmp_path):
    path = paged(tmp_path / "a.tif")
    data = path.read_bytes()
    with Image.open(path) as picture:
        picture.seek(3)
        strip = getattr(picture, "tag_v2")[273][0]  # noqa: B009  # of its kind, which has no type
    place = data.index(struct.pack("<HHII", 273, 4, 1, strip))
    path.write_bytes(data[: place + 8] + struct.pack("<I", 2**31) + data[place + 12 :])
    found, told, frames = taken(path)
    assert [frame.index for frame in found] == [0, 1, 2]
    assert frames.skipped == 1
    assert [text.startswith(f"{path}: page 4: the picture is cut short") for text in told] == [True]


def test_a_folder_and_an_estimate_refuse_a_file_of_several_pictures(tmp_path):
    path = paged(tmp_path / "a.tif")
    Image.fromarray(SCENE).save(tmp_path / "b.gif")
    found, told, _ = taken(tmp_path)
    assert [frame.index for frame in found] == [1]
    assert told == [f"{path}: has 4 pages, which are a sequence; open it by itself, like a video"]
    with pytest.raises(ValueError, match="has 4 pages"):
        estimate(path, CAMERA, DOCK)


@pytest.mark.parametrize("source", [12.5, None, b"a.png", True, -1, ["a.png"]])
def test_what_names_no_source_is_refused_with_its_value(source):
    with pytest.raises(ValueError, match=r"source is .*; it must be a path, a camera's number or a stream's address"):
        open_frames(source)


def test_a_number_is_a_camera_even_beside_a_file_of_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Image.fromarray(SCENE).save(tmp_path / "97", "PNG")
    with pytest.raises(SourceError, match="camera 97"):
        open_frames(97)
    with open_frames("97") as frames:
        assert frames.count == 1
    with pytest.raises(ValueError, match="rotate is 45"):
        open_frames("97", rotate=45)


def test_no_name_is_not_the_folder_where_the_program_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Image.new("L", (8, 6)).save("a.png")
    assert len(taken(".")[0]) == 1
    with pytest.raises(SourceError, match=r"^the name of a source is empty"):
        open_frames("")
