"""Video in bags: each frame by its number and in order, at the bag's times."""

import numpy as np
import pytest
from dockpose.sources import SourceError, open_frames
from dockpose.sources.bags.decoding import FFMPEG_PACKET

from tests.support import bags, videos_in_bags
from tests.support.sources import taken
from tests.support.videos_in_bags import FOXGLOVE, FOXGLOVE_ROS


def number_of(frame):
    return round((frame.image.mean() - 20) / 5)


@pytest.mark.parametrize("codec", ["h264", "h265"])
@pytest.mark.parametrize("kind", [FOXGLOVE, FOXGLOVE_ROS, FFMPEG_PACKET])
def test_frames_come_in_order_and_by_number(tmp_path, kind, codec):
    path = videos_in_bags.write(tmp_path / "a.mcap", kind, codec, videos_in_bags.packets(codec))
    told = []
    with open_frames(path, told.append) as frames:
        found = list(frames)
        assert [number_of(frame) for frame in found] == list(range(40))
        assert found[0].image.shape == (72, 96, 3)
        assert [frame.time_s for frame in found] == pytest.approx(np.arange(40) / 10, abs=1e-9)
        assert found[7].time_unix_s == pytest.approx((bags.START_NS + 7 * bags.PERIOD_NS) / 1e9)
        for index in (39, 3, 20, 0, 26, 25, 12, 11):
            assert number_of(frames.at(index)) == index
    assert told == []


def test_frames_before_the_first_key_frame_cannot_be_shown_and_are_counted(tmp_path):
    data = videos_in_bags.packets("h264")[5:]
    path = videos_in_bags.write(tmp_path / "a.mcap", FOXGLOVE, "h264", data)
    found, told, frames = taken(path)
    assert [number_of(frame) for frame in found] == list(range(videos_in_bags.GROUP, 40))
    assert frames.skipped == videos_in_bags.GROUP - 5
    assert "no key frame came before it" in told[0]


@pytest.mark.parametrize("codec", ["h264", "h265"])
def test_a_packet_without_a_format_is_told_by_its_content(tmp_path, codec):
    path = videos_in_bags.write(tmp_path / "a.mcap", FOXGLOVE, "", videos_in_bags.packets(codec))
    assert [number_of(frame) for frame in taken(path)[0]] == list(range(40))


def test_another_coding_is_refused_by_name(tmp_path):
    path = videos_in_bags.write(tmp_path / "a.mcap", FOXGLOVE, "av1", [b"\x12\0"] * 3)
    with pytest.raises(SourceError, match=r"can be read: the first has video of the format 'av1'; h264 and h265 are"):
        taken(path)


def test_a_message_that_is_cut_within_a_slice_of_h265_spoils_its_group_alone(tmp_path):
    pictures = [np.random.default_rng(number).integers(60, 200, (72, 96)).astype(np.uint8) for number in range(40)]
    data = videos_in_bags.packets("h265", pictures=pictures)
    path = videos_in_bags.write(tmp_path / "a.mcap", FOXGLOVE, "h265", data)
    whole = {frame.index: frame.image.tobytes() for frame in taken(path)[0]}
    assert len(whole) == 40
    for number in (14, 20):
        data[number] = data[number][: len(data[number]) * 2 // 3]
    found, told, frames = taken(videos_in_bags.write(tmp_path / "a.mcap", FOXGLOVE, "h265", data))
    assert [frame.index for frame in found] == [*range(14), *range(24, 40)]
    assert all(frame.image.tobytes() == whole[frame.index] for frame in found)
    assert (frames.skipped, "has a damaged packet" in told[0]) == (10, True)
