"""What was typed becomes sequences, also those of a source that is added as docs/code.md says."""

import importlib
import shutil
import sys
from unittest import mock

import dockpose
import pytest
from dockpose import Camera, Dock

from tests.support.layout import ROOT

CAMERA, DOCK = Camera(350, 350, 159.5, 119.5, 320, 240), Dock(0.30, 10)
# The files that the recipe names: the source itself, by which text it is known, and where it is opened.
SOURCE = '''
from pathlib import Path

import numpy as np

from dockpose.sources.frames import Frame, Frames, SourceError


class Levels(Frames):
    """Grey pictures of the levels that a text file has, ten a second; what is no level is left out."""

    def __iter__(self):
        words = Path(self.source).read_text().split()
        if not words:
            raise SourceError(f"{self.source}: has no levels")
        for index, word in enumerate(words):
            if word.isdecimal():
                yield self._turned(Frame(np.full((4, 6), int(word), np.uint8), index, index / 10, self.source))
            else:
                self._skip(f"{self.source}: frame {index} is {word!r}; it must be a level")
'''
EDITS = {
    "names.py": [
        ('    SIMULATED = "simulated"\n', '    LEVELS = "levels"\n'),
        ("    ending = path.suffix.lower()\n", '    if ending == ".levels":\n        return Kind.LEVELS\n'),
    ],
    "opening.py": [
        ("from dockpose.sources.frames import Frames, SourceError, Tell\n", "from .levels import Levels\n"),
        ("        check_regular(source)\n", "    if kind is Kind.LEVELS:\n        return Levels(source, tell)\n"),
    ],
}


@pytest.fixture
def with_levels(tmp_path, monkeypatch):
    """The sources with one more, and what opens them for the command line and the page, all imported anew."""
    folder = tmp_path / "sources"
    shutil.copytree(ROOT / "pipeline" / "sources", folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "levels.py").write_text(SOURCE)
    for name, edits in EDITS.items():
        text = (folder / name).read_text()
        for after, line in edits:
            assert text.count(after) == 1
            text = text.replace(after, after + line)
        (folder / name).write_text(text)
    monkeypatch.setattr(dockpose, "__path__", [str(tmp_path), *dockpose.__path__])
    anew = ("dockpose.sources", "dockpose.app.inputs")
    known = {name: module for name, module in sys.modules.items() if name.startswith(anew)}
    with mock.patch.dict(sys.modules):
        for name in known:
            del sys.modules[name]
        yield [importlib.import_module(f"dockpose.app.inputs.{name}") for name in ("resolve", "sequences")]
    for name, module in known.items():  # an import also sets the name in the package above
        above, _, last = name.rpartition(".")
        setattr(sys.modules[above], last, module)


def test_a_source_that_is_added_in_three_files_opens_by_name_everywhere(with_levels, tmp_path):
    resolve, sequences = with_levels
    path, told = tmp_path / "dive.levels", []
    path.write_text("10 20 dark 40")
    (typed,) = resolve.resolve([str(path)], CAMERA, DOCK, told.append)
    for source in (typed, sequences.given(str(path), CAMERA, DOCK)):
        told.clear()
        with source.open(told.append) as frames:
            found = list(frames)
        levels = [(frame.index, frame.time_s, int(frame.image[0, 0])) for frame in found]
        assert levels == [(0, 0.0, 10), (1, 0.1, 20), (3, 0.3, 40)]
        assert (frames.skipped, frames.camera, frames.dock) == (1, CAMERA, DOCK)
        assert told == [f"{path}: frame 2 is 'dark'; it must be a level"]
    path.write_text("")
    with pytest.raises(ValueError, match=r"dive\.levels: has no levels"), typed.open(told.append) as frames:
        list(frames)
