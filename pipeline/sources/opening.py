"""Open the source of frames that a text names, whichever kind it is."""

import os
from collections.abc import Iterator
from itertools import islice

import numpy as np
from dockpose.checks import check_turn
from dockpose.estimate import estimate
from dockpose.files import FileError
from dockpose.simulate import ClosedLoop, FilmPlan, film
from dockpose.simulate.files import load_sequence
from dockpose.simulate.render import render
from dockpose.simulate.sequence import Observe, scenes
from dockpose.sources.bags.bag import Bag
from dockpose.sources.bags.storage import check_regular
from dockpose.sources.blueos import SCHEME, stream_of
from dockpose.sources.capture import Camera, Capture, StreamCapture
from dockpose.sources.frames import Callback, Frame, Frames, SourceError
from dockpose.sources.kinds import DEFAULT_CAPTURE, CaptureSettings, Kind, camera_number, is_rtp, kind_of
from dockpose.sources.live import Live
from dockpose.sources.pictures import Pages, Pictures, list_pictures
from dockpose.sources.rtp.capture import RtpCapture
from dockpose.sources.video import Video
from dockpose.text import shown, without_secrets


class Simulated(Frames):
    """Frames of a simulated sequence, each rendered when it is due; what is found steers a closed loop."""

    def __init__(self, sequence: FilmPlan, source: str, tell: Callback | None = None) -> None:
        super().__init__(source, tell)
        self.sequence = sequence
        self.count = sequence.frames
        self.rate_hz = None if sequence.motion is None else sequence.motion.rate_hz
        self.camera, self.dock = sequence.scene.camera, sequence.scene.dock
        self._observe: Observe = lambda image, camera: estimate(image, camera, sequence.scene.dock).selected

    def __iter__(self) -> Iterator[Frame]:
        return self.between(0, self.sequence.frames)

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames with ``start`` <= index < ``stop``; a closed loop is first run up to there."""
        start = max(0, start)
        try:
            if isinstance(self.sequence.motion, ClosedLoop):
                for filmed in islice(film(self.sequence, self._observe), start, stop):
                    yield self._turned(Frame(filmed.image, filmed.number - 1, filmed.time_s, self.source))
                return
            for index, (time_s, scene) in enumerate(islice(scenes(self.sequence), start, stop), start):
                yield self._turned(Frame(render(scene)[0], index, time_s, self.source))
        except ValueError as error:
            raise SourceError(f"{self.source}: {error}") from error


TIMEOUT_S = 10.0


def open_frames(
    source: str | os.PathLike[str] | int,
    tell: Callback | None = None,
    *,
    rate_hz: float | None = None,
    timeout_s: float = TIMEOUT_S,
    grey: bool = False,
    capture: CaptureSettings = DEFAULT_CAPTURE,
    topic: str | None = None,
    rotate: int = 0,
) -> Frames:
    """Open the source that a path, a text or a number names: see :func:`dockpose.sources.kind_of`.

    Parameters
    ----------
    source : str, path-like or int
        Path of a picture, folder, video, bag or scene file, a glob, a camera's number or device, or a stream's address.
    tell : callable, optional
        Called with plain sentences about corrupt frames, and when a live source goes away and comes back, from
        whichever thread notices.
    rate_hz : float, hertz, optional
        Frame rate of pictures, which gives them times, and of videos whose frames have none; None for no times of
        pictures.
    timeout_s : float, seconds
        How long a stream may take to answer, and between two frames before it counts as lost.
    grey : bool
        Give the brightness alone of videos, streams and JPEG as a frame's image, which is cheaper; what to show is in
        colour still.
    capture : CaptureSettings
        What a camera is asked for; see ``Live.about`` for what it gives.
    topic : str, optional
        Which topic of a bag; None for the only one with pictures.
    rotate : {0, 90, 180, 270}, degrees
        By how much to turn the frames clockwise; :meth:`Camera.rotated` turns the camera with them. Tags of orientation
        are named to ``tell`` and not applied.

    Returns
    -------
    Frames
        Iterate and close it; as a context manager it closes itself.

    Raises
    ------
    ValueError
        If ``source`` is no text, path or number, or ``rotate`` none of these.
    SourceError
        If nothing has that name, it does not answer in time, or it yields no frames.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import cv2, numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for number in (10, 2):
    ...         written = cv2.imwrite(f"{folder}/frame{number}.png", np.zeros((4, 6), np.uint8))
    ...     with open_frames(folder, rate_hz=10.0) as frames:
    ...         [(frame.index, frame.time_s, Path(frame.name).name) for frame in frames]
    [(0, 0.0, 'frame2.png'), (1, 0.1, 'frame10.png')]
    """
    check_turn("rotate", rotate)
    kind, name = _kind_and_name(source)
    if kind not in (Kind.CAMERA, Kind.STREAM, Kind.FOLDER, Kind.GLOB):
        check_regular(name)
    frames: Frames
    if kind is Kind.VIDEO:
        frames = Video(name, tell, grey=grey, rate_hz=rate_hz)
    elif kind is Kind.PAGES:
        frames = Pages(name, rate_hz, tell)
    elif kind is Kind.BAG:
        frames = Bag(name, tell, topic)
    elif kind is Kind.SIMULATED:
        try:
            frames = Simulated(load_sequence(name), name, tell)
        except FileError as error:
            raise SourceError(str(error)) from error
    elif kind is Kind.CAMERA:
        number = camera_number(name) or 0
        frames = Live(f"camera {number}", lambda: Camera(number, grey=grey), tell, settings=capture)
    elif kind is Kind.STREAM and name.lower().startswith(SCHEME):
        frames = Live(name, lambda: _of_blueos(name, timeout_s, tell, grey), tell, waits=True)
    elif kind is Kind.STREAM and is_rtp(name):
        frames = Live(name, lambda: RtpCapture(name, tell or (lambda text: None), grey=grey), tell)
    elif kind is Kind.STREAM:
        frames = Live(name, lambda: StreamCapture(name, timeout_s, tell, grey=grey), tell)
    else:
        paths = list_pictures(name)
        if kind is Kind.PICTURE and not paths[0].exists():
            raise SourceError(f"{name}: there is no such file")
        frames = Pictures(paths, name, rate_hz, tell)
    frames.turn(rotate)
    return frames


def _of_blueos(name: str, timeout_s: float, tell: Callback | None, grey: bool) -> Capture:
    """What comes from the stream that BlueOS's camera manager names now."""
    there = stream_of(name, timeout_s)
    if tell is not None:
        tell(f"{name}: {without_secrets(there)}")
    if is_rtp(there):
        return RtpCapture(there, tell or (lambda text: None), grey=grey)
    return StreamCapture(there, timeout_s, tell, grey=grey)


def _kind_and_name(source: object) -> tuple[Kind, str]:
    if isinstance(source, (int, np.integer)) and not isinstance(source, bool) and source >= 0:
        return Kind.CAMERA, str(int(source))  # whether or not there is a file of that name
    name = os.fspath(source) if isinstance(source, (str, os.PathLike)) else None
    if not isinstance(name, str):
        raise ValueError(f"source is {shown(source)}; it must be a path, a camera's number or a stream's address")
    return kind_of(name), name
