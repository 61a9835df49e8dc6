"""A simulated course as frames, from a scene file in which the vehicle moves."""

from collections.abc import Iterator
from itertools import islice

from dockpose.estimate import estimate
from dockpose.simulate import ClosedLoop, FilmPlan, film
from dockpose.simulate.render import render
from dockpose.simulate.sequence import Observe, scenes
from dockpose.sources.frames import Frame, Frames, SourceError, Tell


class Simulated(Frames):
    """Frames of a simulated sequence, each rendered when it is due; what is found steers a closed loop."""

    def __init__(self, sequence: FilmPlan, source: str, tell: Tell | None = None) -> None:
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
