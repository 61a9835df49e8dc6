import base64
import json
import re
from dataclasses import replace
from html import unescape
from typing import Any

import cv2
import numpy as np
import pytest
from dockpose.app.drawing.annotated import kept_pixels
from dockpose.app.errors import UserError
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.view import open_source
from dockpose.app.web.live import data_html, decoder
from dockpose.app.web.panels import view as shown
from dockpose.app.web.panels.detect import threshold_sentence
from dockpose.estimate import geometry
from dockpose.thresholds import Threshold
from msgspec import DecodeError


def fulfilled(view, text):
    views = []
    nobody: Any = None
    acts = shown.acts_in_picture(lambda function, client, *, reload=False: views.append(function(view)))
    request = decoder(acts).decode(text)
    acts[type(request)](request, nobody)
    return views[0]


@pytest.fixture(scope="module")
def tilted():
    return analyse(open_source("sample_images/tilted.png", None, None))


def overlay_numbers(analysis):
    return shown.lights_numbers(analysis.estimate) | shown.truth_numbers(analysis) | shown.pose_numbers(analysis)


def decoded(data):
    return np.asarray(cv2.imdecode(np.frombuffer(base64.b64decode(data["data"]), np.uint8), cv2.IMREAD_UNCHANGED))


def test_overlay_has_what_was_found(tilted):
    found, numbers = tilted.estimate, overlay_numbers(tilted)
    lights = [group for group in numbers["groups"] if group["onRing"]]
    assert sorted(int(group["label"]) for group in lights) == list(range(1, 11))
    np.testing.assert_allclose([group["at"] for group in numbers["groups"]], found.markers.points_px, atol=0.006)
    assert [(pose["name"], pose["chosen"]) for pose in numbers["poses"]] == [("A", True), ("B", False)]
    np.testing.assert_allclose(numbers["centre"], np.asarray(geometry.centres(found)[1]), atol=0.006)
    assert numbers["level"] == found.threshold.level
    assert numbers["kept"] is None
    assert len(data_html("overlay", numbers)) < 16_000


def test_outline_of_the_chosen_dock_runs_through_its_lights_and_a_length_there_is_that_of_its_diameter(tilted):
    numbers = overlay_numbers(tilted)
    outline = np.array(numbers["poses"][0]["outline"])
    for group in numbers["groups"]:
        # The outline has 120 points, so that none is nearer than half a step from some light.
        assert np.linalg.norm(outline - group["at"], axis=1).min() < 3.5

    # Seen squarely a dock of 30 cm is fx 0.30 / z pixels wide.
    pose = tilted.estimate.selected
    pixels = tilted.view.camera.fx * 0.30 / pose.position_m[2]
    assert pixels * overlay_numbers(tilted)["cmPerPx"] == pytest.approx(30, rel=0.01)


def test_truth_is_drawn_where_it_is_known(tilted):
    numbers = overlay_numbers(tilted)
    found, true = (np.array(one["outline"]) for one in (numbers["poses"][0], numbers["truth"]))
    assert np.linalg.norm(found - true, axis=1).max() < 0.5  # the pose that was found is the true one
    unknown = analyse(replace(tilted.view, truth=None))
    assert shown.truth_numbers(unknown) == {"truth": None}


def test_nothing_found_is_sent_as_such(tilted):
    numbers = overlay_numbers(analyse(put(tilted.view, "min_area_px", 1000)))
    assert numbers["poses"] == []
    assert (numbers["outline"], numbers["centre"], numbers["cmPerPx"]) == (None, None, None)
    json.dumps(numbers, allow_nan=False)


def test_level_per_light_sends_the_pixels_that_are_kept(tilted):
    found = analyse(with_method(tilted.view, "hats_local"))
    kept = np.zeros(tilted.view.image.shape[:2], bool).ravel()
    for first, number in overlay_numbers(found)["kept"]:
        kept[first : first + number] = True
    np.testing.assert_array_equal(kept, kept_pixels(tilted.view.image, found.estimate).ravel())
    levels = overlay_numbers(found)["levels"]
    assert levels == sorted(levels)
    threshold = found.estimate.threshold
    assert threshold is not None
    assert threshold.kept is not None
    pixels, lights = threshold.kept
    assert levels == sorted(int(pixels.level[lights == light].min()) for light in np.unique(lights))


def test_exact_picture_has_each_pixel_and_one_of_16_bits_is_sent_on_the_scale_of_the_levels(tilted):
    grey = tilted.view.image
    sent = shown.picture_data(grey, 1, True)
    assert (sent["isExact"], sent["type"], sent["width"], sent["height"]) == (True, "image/png", 640, 480)
    np.testing.assert_array_equal(decoded(sent), grey)
    deep = np.array([[0, 1000, 4095]], np.uint16)  # 12 bits are in use: 16 steps are a level
    np.testing.assert_array_equal(decoded(shown.picture_data(deep, 1, True)), [[0, 62, 255]])


def test_quick_and_huge_pictures_say_that_they_are_not_exact(tilted):
    quick = shown.picture_data(tilted.view.image, 1, False)
    assert (quick["type"], quick["isExact"]) == ("image/jpeg", False)
    huge = shown.picture_data(np.zeros((4000, 8000), np.uint8), 1, True)
    assert (huge["width"], huge["height"], huge["isExact"]) == (8000, 4000, False)
    assert decoded(huge).shape == (2000, 4000)


def test_outside_text_is_escaped(tilted):
    numbers = overlay_numbers(replace(tilted, view=replace(tilted.view, source="<img src=x>")))
    html = data_html("overlay", numbers)
    assert "<img" not in html
    text = re.fullmatch(r"<dockpose-data[^>]*>(.*)</dockpose-data>", html)
    assert text is not None
    assert json.loads(unescape(text[1]))["name"] == "<img src=x>"


def test_requests_are_carried_out(tilted):
    settings = fulfilled(tilted.view, '{"do":"level","number":1,"level":77}').settings
    assert (settings.method, settings.level) == ("fixed", 77)
    mask = '{"do":"mask","number":2,"x":-5,"y":10,"width":25,"height":30}'
    assert fulfilled(tilted.view, mask).settings.masks == with_mask(tilted.view, -5, 10, 25, 30).settings.masks


@pytest.mark.parametrize(
    "text",
    [
        *("", "[]", '{"do":"level","level":77}'),
        '{"do":"level","number":1,"level":"77"}',
        *('{"do":"level","number":1,"level":1e999}', '{"do":"run","number":1}'),
        '{"do":"mask","number":1,"x":0,"y":0,"width":null,"height":1}',
        '{"do":"level","number":1,"level":77,"more":1}',
    ],
)
def test_other_requests_are_refused(tilted, text):
    with pytest.raises(DecodeError):
        fulfilled(tilted.view, text)


def test_mask_off_the_picture_and_level_out_of_range_are_refused_or_clamped(tilted):
    with pytest.raises(UserError, match="covers nothing"):
        fulfilled(tilted.view, '{"do":"mask","number":1,"x":900,"y":0,"width":5,"height":5}')
    assert fulfilled(tilted.view, '{"do":"level","number":1,"level":9999}').settings.level == 255


def numbers_of(analysis):
    numbers = shown.HistogramNumbers().of(analysis, is_playing=False)
    assert numbers is not None
    return numbers


def test_numbers_are_those_of_the_threshold(analysis):
    threshold, numbers = analysis.estimate.threshold, numbers_of(analysis)
    assert numbers["counts"] == np.bincount(analysis.view.image.ravel(), minlength=256).tolist()
    assert len(numbers["counts"]) == len(numbers["groups"]) == 256
    assert numbers["groups"][threshold.level] == 10
    assert numbers["groups"][0] == -1
    assert numbers["groupsTop"] == 20
    assert sorted(peak["level"] for peak in numbers["peaks"]) == sorted(peak.level for peak in threshold.peaks)


def test_threshold_that_keeps_nothing(analysis):
    threshold = replace(analysis.estimate.threshold, level=256)
    numbers = shown.histogram_numbers(threshold.histogram, threshold)
    assert (numbers["peaks"], numbers["groupsTop"]) == ([], 10)
    assert "above 255" in threshold_sentence(replace(analysis.estimate, threshold=threshold))


def test_peaks_with_what_they_vote_for():
    """Three heaps of pixels: background 20, a dim light at 100, brighter ones at 180 and 190."""
    counts = np.zeros(256, int)
    counts[[20, 100, 180, 190]] = 9000, 40, 40, 40
    groups = np.full(256, -1)
    groups[50:101], groups[101:185], groups[185:191], groups[191:] = 4, 3, 1, 0
    threshold = Threshold("hats", 100, 100, counts, "", groups, floor=50)
    votes = {peak["level"]: peak["groups"] for peak in shown.histogram_numbers(counts, threshold)["peaks"]}
    assert votes == {190: 1, 180: 3, 100: 4}
    assert shown.groups_top(threshold) == 10


def test_level_set_by_hand_keeps_the_curve(analysis):
    by_hand = [analyse(with_method(analysis.view, "fixed", level)) for level in (40, 150)]
    numbers, before = shown.HistogramNumbers(), numbers_of(analysis)
    for level, one in zip((40, 150), by_hand, strict=True):
        now = numbers.of(one, is_playing=False) or {}
        assert one.view.settings.level == level
        for part in ("groups", "groupsTop", "peaks"):
            assert now[part] == before[part]
    masked = analyse(with_mask(by_hand[0].view, 0, 0, 320, 480))
    assert numbers_of(masked)["groups"] != before["groups"]


def test_no_curve_is_computed_while_playing_for_a_level_set_by_hand_and_nothing_where_all_is_masked(analysis):
    by_hand = analyse(with_method(analysis.view, "fixed", 150))
    assert set((shown.HistogramNumbers().of(by_hand, is_playing=True) or {})["groups"]) == {-1}
    masked = analyse(with_method(with_mask(analysis.view, 0, 0, 640, 480), "fixed", 150))
    assert shown.HistogramNumbers().of(masked, is_playing=False) is None
