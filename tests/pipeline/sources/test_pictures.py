import io
from datetime import UTC, datetime

import pytest
from dockpose.sources import open_frames
from dockpose.sources.pictures import taken_unix_s
from PIL import ExifTags, Image

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


@pytest.mark.parametrize(
    "tags",
    [
        {},
        {"DateTimeOriginal": "2026:07:01 12:00:00"},  # of which zone?
        {"DateTimeOriginal": "2026:07:01 12:00:00", "OffsetTimeOriginal": "   :  "},
        {"DateTimeOriginal": "0000:00:00 00:00:00", "OffsetTimeOriginal": "+00:00"},
        {"OffsetTimeOriginal": "+00:00"},
    ],
)
def test_a_picture_that_does_not_say_all_of_it_tells_nothing(tags):
    assert taken_unix_s(picture(**tags)) is None


@pytest.mark.parametrize("data", [b"", b"II*\0", b"\xff\xd8\xff\xe1" + 60 * b"\xff", b"\x89PNG"])
def test_damaged_pictures_tell_nothing(data):
    assert taken_unix_s(data) is None


def test_frames_from_pictures_have_that_time(tmp_path):
    (tmp_path / "a.jpg").write_bytes(picture(DateTimeOriginal="2026:07:01 12:00:00", OffsetTimeOriginal="+00:00"))
    Image.new("L", (8, 6)).save(tmp_path / "b.png")
    with open_frames(str(tmp_path)) as frames:
        assert [frame.time_unix_s for frame in frames] == [NOON_S, None]
