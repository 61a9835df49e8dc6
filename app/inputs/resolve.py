"""From what was typed to pictures and sequences with their camera and dock."""

import itertools
from collections.abc import Callable, Iterator, Sequence

from dockpose import Camera, Dock
from dockpose.app.inputs.pictures import Batch, expand
from dockpose.app.inputs.sequences import FrameSource, typed
from dockpose.files.yaml_file import FileError
from dockpose.sources import Kind, kind_of

_OF_PICTURES = (Kind.PICTURE, Kind.FOLDER, Kind.GLOB)


def resolve(
    sources: Sequence[str],
    camera: Camera | None,
    dock: Dock | None,
    report: Callable[[str], None],
    rate_hz: float | None = None,
    topic: str | None = None,
    rotate_deg: int = 0,
) -> list[Batch | FrameSource | None]:
    """Return what the sources stand for, in order.

    Pictures in a row make one Batch. With a rate they make a sequence instead: those typed one by one together, each
    folder and each glob by itself.
    """
    groups = [(group, expand(group) if _is_pictures(group[0]) else []) for group in _groups(sources, rate_hz)]
    found: list[Batch | FrameSource | None] = []
    for group, paths in groups:
        try:
            is_batch = paths and rate_hz is None
            found.append(
                Batch(paths, camera, dock, report, rotate_deg)
                if is_batch
                else typed(group[0], camera, dock, paths, rate_hz, topic, rotate_deg)
            )
        except FileError as error:
            report(str(error))
            found.append(None)
    return found


def _groups(sources: Sequence[str], rate_hz: float | None) -> Iterator[list[str]]:
    """Sources in a row that go together."""

    def group_of(numbered: tuple[int, str]) -> int:
        number, source = numbered
        goes_with_others = _is_pictures(source) if rate_hz is None else kind_of(source) is Kind.PICTURE
        return -1 if goes_with_others else number

    for _, group in itertools.groupby(enumerate(sources), group_of):
        yield [source for _, source in group]


def _is_pictures(source: str) -> bool:
    return kind_of(source) in _OF_PICTURES
