"""The recipes of docs/code.md that change the program's files, followed to the letter in a copy of it."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TIMEOUT_S = 120


@dataclass(frozen=True)
class Copy:
    """A copy of the program that may be changed; files are named as in the checkout."""

    folder: Path
    package: Path

    def write(self, name: str, text: str) -> None:
        self._path(name).write_text(text)

    def change(self, name: str, before: str, after: str) -> None:
        """Replace what stands in a file once."""
        text = self._path(name).read_text()
        assert text.count(before) == 1
        self._path(name).write_text(text.replace(before, after))

    def run(self, code: str) -> list[str]:
        """What Python code prints that uses the copy, line by line."""
        environment = {**os.environ, "PYTHONPATH": str(self.folder)}
        command = [sys.executable, "-c", code]
        ran = subprocess.run(
            command, env=environment, cwd=self.folder, capture_output=True, text=True, timeout=TIMEOUT_S
        )
        assert ran.returncode == 0, ran.stderr
        return ran.stdout.splitlines()

    def _path(self, name: str) -> Path:
        top, _, rest = name.partition("/")
        return self.package / {"pipeline": "", "app": "app", "static": "app/static"}[top] / rest


@pytest.fixture
def copy(tmp_path):
    """With what was compiled, which need not be compiled again."""
    package = tmp_path / "dockpose"
    for folder, place in (
        ("pipeline", ""),
        ("app", "app"),
        ("static", "app/static"),
        ("sample_images", "sample_images"),
    ):
        shutil.copytree(ROOT / folder, package / place, dirs_exist_ok=True)
    return Copy(tmp_path, package)


def test_a_method_of_the_library_is_listed_and_used(copy):
    copy.write(
        "pipeline/thresholds/middle.py",
        '''"""Half way."""

import numpy as np
from dockpose.pixels.flood import LEVELS
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at


def middle(histogram: Histogram) -> Threshold:
    """Keep what is brighter than half the scale."""
    level = LEVELS // 2 if np.count_nonzero(histogram.counts) > 1 else LEVELS
    return threshold_at("middle", histogram, level, "It is half of the scale.")
''',
    )
    entry, line = 'middle=Entry("Half way", middle, SKY_BLUE, "s"),', "    fixed=Entry("
    assert entry in (ROOT / "docs" / "code.md").read_text(encoding="utf-8")
    copy.change("pipeline/thresholds/__init__.py", line, f"    {entry}\n{line}")
    copy.change(
        "pipeline/thresholds/__init__.py",
        "from dockpose.thresholds.methods import",
        "from dockpose.thresholds.middle import middle\nfrom dockpose.thresholds.methods import",
    )
    printed = copy.run(
        "import collections, numpy\n"
        "from dockpose.app import cli\n"
        "from dockpose.thresholds import METHODS, histogram_of\n"
        "looks = collections.Counter((entry.colour, entry.mark) for entry in METHODS.values())\n"
        "white = METHODS['middle'](histogram_of(numpy.full((4, 4), 255, numpy.uint8)), 2, None)\n"
        "print(max(looks.values()), white.level)\n"
        "cli.main(['compare', 'tilted'])\n"
        "cli.main(['estimate', 'tilted', '--method', 'middle'])"
    )
    assert printed[0] == "1 256"  # no other has its look, and a white picture keeps nothing
    assert any(line.split()[:2] == ["middle", "128"] for line in printed), printed
    assert any("the dock is" in line for line in printed), printed


def test_a_source_is_opened_by_its_name_and_gives_its_times(copy):
    copy.write(
        "pipeline/sources/ticks.py",
        '''"""Black pictures, two a second."""

import numpy as np
from dockpose.sources.frames import Frame, Indexed


class Ticks(Indexed):
    """As many as the file says."""

    def __init__(self, source, tell=None):
        super().__init__(source, tell)
        self.count = int(open(source).read())

    def _frame(self, index):
        if index == 1:
            raise ValueError(f"{self.source}: frame 1 is corrupt")
        return Frame(np.zeros((4, 6), np.uint8), index, index / 2, self.source)
''',
    )
    copy.change("pipeline/sources/kinds.py", '    VIDEO = "video"\n', '    VIDEO = "video"\n    TICKS = "ticks"\n')
    copy.change(
        "pipeline/sources/kinds.py",
        "    for endings, kind in (",
        '    if path.suffix == ".ticks":\n        return Kind.TICKS\n    for endings, kind in (',
    )
    copy.change(
        "pipeline/sources/opening.py",
        "    elif kind is Kind.PAGES:",
        "    elif kind is Kind.TICKS:\n        frames = Ticks(name, tell)\n    elif kind is Kind.PAGES:",
    )
    copy.change(
        "pipeline/sources/opening.py",
        "from dockpose.sources.video import Video\n",
        "from dockpose.sources.ticks import Ticks\nfrom dockpose.sources.video import Video\n",
    )
    (copy.folder / "some.ticks").write_text("3")
    (copy.folder / "none.ticks").write_text("0")
    assert copy.run(
        "from dockpose.sources import open_frames\n"
        "with open_frames('some.ticks', print) as frames:\n"
        "    print([(frame.index, frame.time_s) for frame in frames], frames.skipped)\n"
        "print(list(open_frames('none.ticks')))"
    ) == ["some.ticks: frame 1 is corrupt", "[(0, 0.0), (2, 1.0)] 1", "[]"]


def test_a_reader_of_camera_files_is_asked_by_what_stands_in_them(copy):
    copy.change(
        "pipeline/camera/formats/readers.py",
        '    (lambda content: "colmap" in content, _colmap),\n',
        '    (lambda content: "acme" in content, _acme),\n    (lambda content: "colmap" in content, _colmap),\n',
    )
    copy.change(
        "pipeline/camera/formats/readers.py",
        "READERS: tuple",
        """def _acme(content: Fields) -> Iterator[tuple[str, Described]]:
    focal, x, y = content["acme"]
    yield "camera", Described(np.array([[focal, 0, x], [0, focal, y], [0, 0, 1]]), [], tuple(content["of"]))


READERS: tuple""",
    )
    (copy.folder / "acme.json").write_text('{"acme": [500, 319.5, 239.5], "of": [640, 480]}')
    (copy.folder / "wrong.json").write_text('{"acme": [-5, 319.5, 239.5], "of": [640, 480]}')
    printed = copy.run(
        "from dockpose import load_camera\n"
        "camera = load_camera('acme.json')\n"
        "print(camera.fx, camera.cy, camera.width)\n"
        "try:\n    load_camera('wrong.json')\nexcept ValueError as error:\n    print(error)"
    )
    assert printed[0] == "500.0 239.5 640"
    assert "wrong.json" in printed[1]
    assert "fx is -5" in printed[1]


def test_a_panel_is_in_its_tab_and_shows_results(copy):
    copy.write(
        "app/web/panels/hello.py",
        '''"""A greeting."""

from dockpose.app.web.widgets import Panel


class HelloPanel(Panel):
    """How a picture was found."""

    def __init__(self, app):
        super().__init__(app)
        self.word = self.gui.add_text("Hello", "")

    def load(self, view):
        """Say hello to the method."""
        super().load(view)
        print("hello", view.settings.method)

    def show(self, analysis):
        """Say how it went."""
        super().show(analysis)
        print("shown", analysis.estimate.status, flush=True)
''',
    )
    copy.change("app/web/layout.py", '"Export": (ExportPanel,)', '"Export": (ExportPanel, HelloPanel)')
    copy.change(
        "app/web/layout.py",
        "from dockpose.app.web.panels.play import",
        "from dockpose.app.web.panels.hello import HelloPanel\nfrom dockpose.app.web.panels.play import",
    )
    printed = copy.run(
        "from dockpose.app.web.app import App\nwith App(port=0) as app:\n    assert app.wait_until_idle(60)\n"
    )
    assert "hello hats" in printed
    assert "shown ok" in printed
