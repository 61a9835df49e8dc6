"""What sources give."""

import os
from collections.abc import Iterable

import numpy as np
from dockpose.sources import Frame, Frames, open_frames


def taken(source: str | os.PathLike[str], **how: object) -> tuple[list[Frame], list[str], Frames]:
    """All frames of a source, what it told meanwhile, and the source, closed."""
    told: list[str] = []
    with open_frames(source, told.append, **how) as frames:  # pyright: ignore[reportArgumentType]
        return list(frames), told, frames


def by_number_as_in_order(frames: Frames, count: int, numbers: Iterable[int], part: range) -> list[Frame]:
    """All frames of a recording, of which those numbers, and that part of it, are the same once more."""
    found = list(frames)
    assert [frame.index for frame in found] == list(range(count))
    again = [frames.at(number) for number in numbers]
    assert [frame.index for frame in again] == [*numbers]
    several = list(frames.between(part.start, part.stop))
    assert [frame.index for frame in several] == [*part]
    for frame in (*again, *several):
        assert frame.time_s == found[frame.index].time_s
        np.testing.assert_array_equal(frame.image, found[frame.index].image)
    return found
