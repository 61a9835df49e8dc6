import numpy as np
import pytest
from dockpose import Settings, estimate, register_threshold
from dockpose.palette import rgb
from dockpose.simulate import render
from dockpose.thresholds import METHODS, MethodError, histogram_of

from tests.support.methods import registered
from tests.support.scenes import CAMERA, DOCK, random_scene


def level_200(grey):
    return 200


def test_a_method_of_ones_own_stands_before_the_fixed_level():
    with registered(mine=("My method", level_200)):
        assert list(METHODS)[-2:] == ["mine", "fixed"]
        assert METHODS["mine"].title == "My method"
        assert Settings(method="mine").method == "mine"
    assert "mine" not in METHODS
    with pytest.raises(ValueError, match="method is 'mine'; it must be one of hats, hats_local, otsu"):
        Settings(method="mine")


def test_each_method_is_told_from_the_others_by_its_title_and_its_look():
    registers = {f"mine{number}": (f"Mine {number}", level_200) for number in range(8)}
    with registered(**registers):
        assert len({entry.title for entry in METHODS.values()}) == len(METHODS)
        library = [name for name in METHODS if name not in registers]
        for names in (library, list(registers)[:6]):
            assert len({(METHODS[name].colour, METHODS[name].mark) for name in names}) == len(names)
        assert not {METHODS[name].mark for name in library} & {METHODS[name].mark for name in registers}
        assert METHODS["mine6"].colour == METHODS["mine0"].colour  # in turn
        assert all(len(rgb(entry.colour)) == 3 for entry in METHODS.values())


def test_the_decorator_returns_the_function():
    with registered():
        assert register_threshold("mine")(level_200) is level_200
        assert METHODS["mine"].title == "mine"


def test_names_and_titles_of_others_are_refused():
    with registered(mine=("My method", level_200)):
        with pytest.raises(ValueError, match="'otsu', 'otsu': there is 'otsu', 'Otsu' already"):
            register_threshold("otsu")(level_200)
        with pytest.raises(ValueError, match="'other', 'My method': there is 'mine', 'My method' already"):
            register_threshold("other", title="My method")(lambda grey: 3)
        register_threshold("mine", title="My method")(lambda grey: 3)  # as a notebook's cell that runs again
        assert METHODS["mine"](histogram_of(GREY), 1, None).level == 3


@pytest.mark.parametrize("name", ["", "My method", "9", "x" * 41, "ä", None, 3])
def test_names_that_no_command_could_take_are_refused(name):
    with registered(), pytest.raises(ValueError, match=r"name is .*; it must be up to 40 small letters"):
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


# Of what one registers.

GREY = np.array([[10, 10, 10, 10], [10, 200, 10, 90], [10, 10, 10, 80]], np.uint8)


def threshold_by(function, grey: np.ndarray = GREY, counted=None):
    with registered(mine=("Mine", function)):
        return METHODS["mine"](histogram_of(grey, counted), 1, None)


@pytest.mark.parametrize(
    ("returned", "level"), [(80, 80), (79.5, 80), (np.float32(79.1), 80), (np.array(80), 80), (0, 0), (256, 256)]
)
def test_a_level_keeps_pixels_at_or_above_it(returned, level):
    threshold = threshold_by(lambda grey: returned)
    assert (threshold.method, threshold.level, threshold.native_level) == ("mine", level, level)
    assert threshold.reason == f"Mine returned level {level}."
    assert threshold.histogram[[10, 80, 90, 200]].tolist() == [9, 1, 1, 1]


def test_16_bits_come_as_they_are_and_their_level_goes_up_to_one_of_256():
    seen = []
    threshold = threshold_by(lambda grey: seen.append(grey) or 20_001, GREY.astype(np.uint16) << 8)
    assert seen[0].dtype == np.uint16
    assert seen[0].max() == 200 * 256
    assert (threshold.level, threshold.native_level) == (79, 79 * 256)  # 20,001 / 256 = 78.1
    twelve = threshold_by(lambda grey: 1000, GREY.astype(np.uint16) << 4)
    assert (twelve.level, twelve.native_level) == (63, 1008)
    assert threshold_by(lambda grey: 65536, GREY.astype(np.uint16) << 4).level == 256


def test_a_mask_keeps_its_groups_whatever_their_levels():
    threshold = threshold_by(lambda grey: (grey > 50) & (grey < 100))
    assert threshold.kept is not None
    pixels, groups = threshold.kept
    assert pixels.index.tolist() == [7, 11]
    assert pixels.level.tolist() == [90, 80]
    assert groups.tolist() == [0, 0]
    assert threshold.level == 80
    assert "keeps 2 pixels" in threshold.reason


def test_a_mask_keeps_nothing_of_what_is_masked():
    counted = np.ones(GREY.shape, np.uint8)
    counted[:, 3] = 0
    threshold = threshold_by(lambda grey: np.ones(grey.shape, bool), GREY, counted)
    assert threshold.kept is not None
    assert threshold.kept[0].index.tolist() == [0, 1, 2, 4, 5, 6, 8, 9, 10]
    nothing = threshold_by(lambda grey: np.zeros(grey.shape, bool))
    assert (nothing.level, nothing.kept) == (256, None)


def test_the_function_may_change_its_picture():
    grey = GREY.copy()
    threshold_by(lambda given: given.fill(0) or 80, grey)
    assert (grey == GREY).all()


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        (None, r"returned None; it must return a level or a mask \(3, 4\) of bool"),
        (True, "returned a bool; it must"),
        ("80", "returned a str; it must"),
        ((80.0, GREY), "returned a tuple; it must"),
        (3j, "returned a complex; it must"),
        (np.nan, "returned nan; a level of this picture is from 0 to 256, where 256 keeps nothing"),
        (-1, "returned -1; a level"),
        (257, "returned 257; a level"),
        (np.inf, "returned inf; a level"),
        (GREY, r"returned an array \(3, 4\) of uint8; a mask of this picture is \(3, 4\) of bool"),
        (np.ones((2, 2), bool), r"returned an array \(2, 2\) of bool; a mask of this picture is \(3, 4\) of bool"),
        (np.array(["a"]), r"returned an array \(1,\) of <U1"),
    ],
)
def test_what_is_neither_level_nor_mask_is_refused_by_name(returned, words):
    with pytest.raises(MethodError, match=f"threshold method 'mine' {words}"):
        threshold_by(lambda grey: returned)


@pytest.mark.parametrize("error", [ZeroDivisionError("by\nzero"), KeyError(), SystemExit(3), MemoryError("much")])
def test_whatever_is_raised_is_one_sentence(error):
    def fails(grey):
        raise error

    with pytest.raises(MethodError) as caught:
        threshold_by(fails)
    told = str(caught.value)
    assert told.startswith(f"threshold method 'mine' failed: {type(error).__name__}")
    assert "\n" not in told


def test_ctrl_c_goes_through():
    def stopped(grey):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        threshold_by(stopped)


def test_an_estimate_by_a_level_and_by_a_mask_of_ones_own():
    image, _ = render(random_scene(1))
    level = estimate(image, CAMERA, DOCK, Settings(method="otsu")).threshold.level  # pyright: ignore
    fixed = estimate(image, CAMERA, DOCK, Settings(method="fixed", level=level))
    with registered(by_level=("By level", lambda grey: level), by_mask=("By mask", lambda grey: grey >= level)):
        found = [estimate(image, CAMERA, DOCK, Settings(method=name)) for name in ("by_level", "by_mask")]
    for one in found:
        assert one.status == "ok"
        assert one.lights_on_ring == fixed.lights_on_ring
        assert one.selected is not None
        assert one.selected.position_m == pytest.approx(fixed.selected.position_m, abs=1e-3)  # pyright: ignore


def test_an_estimate_by_a_method_that_fails_says_so_and_raises_nothing():
    with registered(broken=("Broken", lambda grey: 1 // 0)):
        found = estimate(GREY, CAMERA.for_size(4, 3), DOCK, Settings(method="broken"))
    assert found.status == "method_failed"
    assert found.message.startswith("Threshold method 'broken' failed: ZeroDivisionError: ")
    assert found.threshold is None
    assert found.to_dict()["candidates"] == []
