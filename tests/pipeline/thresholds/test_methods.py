import subprocess
import sys

import numpy as np
import pytest
from dockpose import Settings, estimate, register_threshold
from dockpose.app.processing.comparison import compare
from dockpose.palette import rgb
from dockpose.simulate import render
from dockpose.thresholds import METHODS, Histogram, Threshold
from dockpose.thresholds.histogram import threshold_at
from dockpose.thresholds.methods import Entry

from tests.support.methods import entered, install, registered
from tests.support.scenes import CAMERA, DOCK, random_scene


def level_200(grey):
    return 200


def test_a_method_of_ones_own_stands_before_the_fixed_level():
    with registered(mine=("My method", level_200)):
        assert list(METHODS)[-2:] == ["mine", "fixed"]
        assert METHODS.title("mine") == "My method"
        assert METHODS.is_own("mine")
        assert Settings(method="mine").method == "mine"
    assert "mine" not in METHODS
    assert not METHODS.is_own("hats")
    with pytest.raises(ValueError, match="method is 'mine'; it must be one of hats, hats_local, otsu"):
        Settings(method="mine")


def middle(histogram: Histogram) -> Threshold:
    """Half way from the darkest to the brightest level, as docs/code.md writes it."""
    present = np.flatnonzero(histogram.counts)
    level = 256 if len(present) < 2 else int(present[0] + present[-1] + 1) // 2
    return threshold_at("middle", histogram, level, "It is half way up.")


def test_a_method_of_the_library_takes_its_function_and_a_line_of_the_registry():
    with entered(middle=Entry("Half way", middle, "#123456", "h")):
        assert list(METHODS)[-2:] == ["middle", "fixed"]
        assert not METHODS.is_own("middle")
        assert (METHODS.title("middle"), METHODS.short("middle")) == ("Half way", "Half way")
        assert METHODS.look("middle") == ("#123456", "h")
        image, _ = render(random_scene(1))
        compared = compare(image, CAMERA, DOCK)["middle"]
        alone = estimate(image, CAMERA, DOCK, Settings(method="middle"))
        half = (int(image.min()) + int(image.max()) + 1) // 2
        levels = [None if one.threshold is None else one.threshold.level for one in (compared, alone)]
        assert levels == [half, half]


def test_each_method_is_told_from_the_others_by_its_title_and_its_look():
    registers = {f"mine{number}": (f"Mine {number}", level_200) for number in range(8)}
    with registered(**registers):
        assert len({METHODS.title(name) for name in METHODS}) == len(METHODS)
        library = [name for name in METHODS if not METHODS.is_own(name)]
        for names in (library, list(registers)[:6]):
            assert len({METHODS.look(name) for name in names}) == len(names)
        assert not {METHODS.look(name)[1] for name in library} & {METHODS.look(name)[1] for name in registers}
        assert METHODS.look("mine6") == METHODS.look("mine0")  # in turn
        assert all(len(rgb(METHODS.look(name)[0])) == 3 for name in METHODS)


def test_the_decorator_returns_the_function():
    with registered():
        assert register_threshold("mine")(level_200) is level_200
        assert METHODS.title("mine") == "mine"


def test_names_and_titles_of_others_are_refused():
    with registered(mine=("My method", level_200)):
        with pytest.raises(ValueError, match="there is a threshold method 'otsu' already, dockpose's own"):
            register_threshold("otsu")(level_200)
        with pytest.raises(
            ValueError, match=r"method 'mine' already, tests\.pipeline\.thresholds\.test_methods\.level"
        ):
            register_threshold("mine")(lambda grey: 3)
        with pytest.raises(ValueError, match="title of 'other' is 'My method', as that of the threshold method 'mine'"):
            register_threshold("other", title="My method")(lambda grey: 3)
        register_threshold("mine", title="My method")(level_200)  # as a notebook's cell that runs again


@pytest.mark.parametrize("name", ["", "My method", "9", "x" * 41, "ä", None, 3])
def test_names_that_no_command_could_take_are_refused(name):
    with registered(), pytest.raises(ValueError, match=r"name is .*; a threshold method is called by"):
        register_threshold(name)(level_200)


@pytest.mark.parametrize("title", ["", " ", "x" * 41, "two\nlines", 3])
def test_titles_that_fit_no_dropdown_are_refused(title):
    with registered(), pytest.raises(ValueError, match=r"title of 'mine' is .*; it must be a line of"):
        register_threshold("mine", title=title)(level_200)


def test_what_is_no_function_and_a_decorator_without_a_name_are_refused():
    with pytest.raises(ValueError, match="threshold method 'mine' is 200; it must be a function"):
        register_threshold("mine")(200)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="needs a name"):
        register_threshold(level_200)  # pyright: ignore[reportArgumentType]


DECORATED = """
from dockpose import register_threshold

@register_threshold("glow", title="Glow of the lab")
def glow(grey):
    return 7
"""
CODE = """
from dockpose.thresholds import METHODS
import sys
assert "glowlab" not in sys.modules  # the default needs no package
METHODS["hats"]
assert "glowlab" not in sys.modules
print(METHODS.title("glow"), [name for name in METHODS if METHODS.is_own(name)])
"""


@pytest.mark.slow
def test_packages_are_loaded_when_asked_for_and_may_use_the_decorator_too(tmp_path):
    install(tmp_path, "glowlab", DECORATED, glow="glowlab:glow", by_module="glowlab")
    install(tmp_path, "otherlab", "def glow(grey): return 8", glow="otherlab:glow")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{CODE}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout == "Glow of the lab ['glow']\n"
    assert done.stderr == (
        "the threshold method 'glow' of otherlab is left out: there is a threshold method 'glow' already, "
        "glowlab.glow\n"
    )
