"""A bag as ``estimate --out`` writes it."""

import contextlib
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from dockpose import Estimate
from dockpose.app.export.data import to_png
from dockpose.app.export.recordings.ros import PoseFile, Seen
from dockpose.app.state.trust import trust_of
from dockpose.camera.image import as_picture


def write_bag(
    path: str | Path, frames: Iterable[tuple[np.ndarray, float | None, Estimate]], tell: Callable[[str], None]
) -> None:
    """Write pictures, their times in seconds or None, and what was found in them."""
    with contextlib.closing(PoseFile(Path(path), "dockpose", tell)) as file:
        for number, (image, time_s, found) in enumerate(frames):
            file.write(
                Seen("dockpose", number, found, trust_of(found), picture=to_png(as_picture(image))), time_s, None
            )
