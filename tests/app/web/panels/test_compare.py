import base64
from dataclasses import replace

import cv2
import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view, compared, error_words, same_comparison
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.state.parameters import put
from dockpose.app.web.panels.compare import comparison_numbers, method_words

from tests.support.methods import registered


@pytest.fixture(scope="module")
def found(view):
    return compare_view(view, Progress(lambda share: None))


def test_each_method_has_its_numbers_and_a_verdict_where_the_truth_is_known(view, found):
    words = {name: method_words(one, view) for name, one in found.items()}
    assert tuple(words) == compared()
    assert (words["hats"]["kind"], words["hats"]["verdict"][:16]) == ("right", "Right: off by 0.")
    lines = dict(words["hats"]["lines"])
    assert lines["Level"] == str(found["hats"].threshold.level)
    assert (lines["Groups, lights"], lines["z"], lines["Likely"]) == ("10, 10", "110.0 cm", "100 %")
    unknown = replace(view, truth=None)
    assert error_words(found["hats"], unknown) == ""
    assert method_words(found["hats"], unknown)["verdict"] == "Dock found"
    nothing = method_words(analyse(put(view, "min_area_px", 999)).estimate, view)
    assert nothing["kind"] == "wrong"
    assert nothing["verdict"].startswith("No dock: ")
    assert "_" not in nothing["verdict"]
    assert "z" not in dict(nothing["lines"])


def test_what_is_drawn_lies_in_the_crop_where_the_picture_is_bright(view, found):
    numbers = comparison_numbers(found, view)
    data = np.frombuffer(base64.b64decode(numbers["picture"]), np.uint8)
    crop = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
    assert crop is not None
    assert crop.shape == (numbers["height"], numbers["width"])
    hats = next(one for one in numbers["methods"] if one["name"] == "hats")
    assert len(hats["groups"]) == len(hats["onRing"]) == 10
    for x, y in hats["groups"]:
        assert crop[int(y), int(x)] >= found["hats"].threshold.level  # a canvas counts from a pixel's corner
    kept = np.zeros(crop.size, bool)
    for start, length in hats["kept"]:
        kept[start : start + length] = True
    np.testing.assert_array_equal(kept.reshape(crop.shape), crop >= found["hats"].threshold.level)


def test_a_comparison_is_of_a_picture_with_its_settings_whatever_method_is_in_use(view):
    assert same_comparison(view, with_method(view, "otsu"))
    assert same_comparison(view, with_method(view, "fixed", 99))
    assert not same_comparison(view, with_mask(view, 0, 0, 9, 9))
    assert not same_comparison(view, replace(view, image=view.image.copy()))


def test_methods_of_ones_own_have_cards_and_one_that_fails_stops_none(view):
    with registered(mine=("Mine", lambda grey: 100), broken=("Broken", lambda grey: grey[0, 0, 0])):
        found = compare_view(view, Progress(lambda share: None))
        cards = {card["name"]: card for card in comparison_numbers(found, view)["methods"]}
    assert (cards["mine"]["label"], cards["mine"]["kind"]) == ("Mine", "right")
    assert cards["broken"]["kind"] == "wrong"
    assert cards["broken"]["verdict"].startswith("Threshold method 'broken' failed: IndexError")
    assert cards["hats"]["kind"] == "right"
