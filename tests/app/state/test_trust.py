"""Each rule by hand, one doubt at a time, on a result about which there is none."""

from dataclasses import replace

import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_pose_by_hand
from dockpose.app.state.parameters import put
from dockpose.app.state.trust import NO_POSE, VERDICTS, trust_in
from dockpose.lights.ring import tolerance_px
from msgspec.structs import replace as replaced

from tests.support.poses import with_sigmas
from tests.support.scenes import CAMERA
from tests.support.two_docks import drawn, lights_m


def with_choice(found, *, coincide=False, by="spacing", **pose):
    sigma_m = pose.pop("sigma_position_m", None)
    first = replace(found.candidates[0], **pose)
    if sigma_m is not None:
        first = with_sigmas(first, sigma_m)
    choice = replace(found.choice, candidates=(first, found.candidates[1]), selected_by=by, coincide=coincide)
    return replace(found, choice=choice)


def test_plain_scene_is_green_without_a_reason_and_no_pose_is_red(found):
    trust, none = trust_in(found), trust_in(replace(found, choice=None))
    assert (trust.colour, trust.sentence) == ("green", "Dock found.")
    assert (none.colour, none.verdict) == ("red", NO_POSE)


@pytest.mark.parametrize(
    ("probability", "colour"),
    [(0.5, "red"), (0.66, "red"), (0.67, "amber"), (0.94, "amber"), (0.95, "green"), (None, "red")],
)
def test_probability_of_the_pose(found, probability, colour):
    trust = trust_in(with_choice(found, probability=probability))
    assert trust.colour == colour
    assert (f"{100 * probability:.0f} %" if probability else "Nothing tells") in trust.sentence or colour == "green"


def test_toss_up_does_not_matter_where_both_poses_are_the_same_and_is_red_where_nothing_tells(found):
    assert trust_in(with_choice(found, probability=0.5, coincide=True)).colour == "green"
    untold = trust_in(with_choice(found, probability=0.5, by="none"))
    assert untold.reasons == ("Nothing tells which of the two poses is right.",)


@pytest.mark.parametrize(("probability", "colour"), [(0.5, "red"), (0.9, "amber"), (0.99, "green")])
def test_probability_of_a_track_goes_before_that_of_the_frame(found, probability, colour):
    for by in ("tracking", "none"):
        assert trust_in(with_choice(found, probability=0.3, by=by), probability=probability).colour == colour


@pytest.mark.parametrize(("share", "colour"), [(0.049, "green"), (0.051, "amber"), (0.101, "red"), (np.inf, "amber")])
def test_range_known_to_a_share_of_itself(found, share, colour):
    range_m = float(np.linalg.norm(found.selected.position_m))
    assert trust_in(with_choice(found, sigma_position_m=(0.0, 0.0, share * range_m))).colour == colour
    trust = trust_in(with_choice(found, position_m=np.array([0, 0, 20.9]), sigma_position_m=(0.1, 0.1, 2.9)))
    assert (trust.colour, trust.reasons) == ("red", ("The range is inexact: 20.9 ± 2.9 m (14 %).",))
    near = trust_in(with_choice(found, position_m=np.array([0, 0, 0.3]), sigma_position_m=(0.01, 0.01, 0.021)))
    assert near.reasons == ("The range is inexact: 0.30 ± 0.02 m (7 %).",)


@pytest.mark.parametrize(("times", "colour"), [(0.99, "green"), (1.01, "amber")])
def test_error_beyond_what_a_dock_is_built_to(found, times, colour):
    trust = trust_in(with_choice(found, rms_px=times * tolerance_px(found.ellipse.semi_axes_px[0])))
    assert trust.colour == colour
    assert ("learn-dock" in trust.sentence) == (colour == "amber")


@pytest.mark.parametrize(
    ("fx", "colour"), [(700, "green"), (706.9, "green"), (707.1, "amber"), (810, "amber"), (693, "amber")]
)
def test_fx_moved_without_fy(view, fx, colour):
    trust = analyse(put(view, "fx", fx)).trust  # the file says 700 for both
    assert trust.colour == colour
    assert (f"fx/fy is {fx / 700:.3f}, not 1.000 as given" in trust.sentence) == (colour == "amber")


def test_pixels_that_the_file_says_are_not_square_are_no_doubt(view):
    tall = replace(view, given_camera=replaced(view.camera, fx=840.0), camera=replaced(view.camera, fx=840.0))
    assert "fx/fy" not in analyse(tall).trust.sentence
    assert "fx/fy is 1.000, not 1.200" in analyse(put(tall, "fx", 700)).trust.sentence


def test_pose_by_hand_is_never_green_and_says_so(found, view):
    trust = analyse(with_pose_by_hand(view, found.candidates[0])).trust
    assert (trust.colour, trust.reasons) == ("amber", ("Pose A was chosen by hand; the program gives it 100 %.",))
    trust = analyse(with_pose_by_hand(view, found.candidates[1])).trust
    assert "Pose B was chosen by hand; the program gives it 0 %." in trust.reasons


def test_second_ring_is_named_with_its_place(view):
    levels = {-0.25: 200, 0.25: 110}  # of two that are as near and as bright either may be the dock
    docks = [(lights_m((x_m, 0.0, 2.0), (0.3, -0.3)), level, 0.004) for x_m, level in levels.items()]
    analysis = analyse(replace(view, image=drawn(docks, 1), camera=CAMERA))
    assert analysis.estimate.markers is not None
    assert analysis.estimate.ring is not None
    assert analysis.estimate.selected is not None
    rival = analysis.estimate.markers.points_px[analysis.estimate.ring.rivals[0]]
    x, y = rival.mean(axis=0)
    assert analysis.trust.colour == "amber"
    ours, _ = analysis.estimate.markers.points_px[analysis.estimate.ring.on_ring].mean(axis=0)
    assert abs(ours - x) == pytest.approx(CAMERA.fx * 0.5 / 2.0, rel=0.01)  # the other of the two
    assert analysis.trust.reasons == (f"A second ring, of {len(rival)} lights, is in view at ({x:.0f}, {y:.0f}) px.",)


def test_guessed_camera_three_lights_and_a_ring_that_may_be_chance_are_amber(found):
    three = np.arange(len(found.markers)) < 3
    for trust, words in (
        (trust_in(found, assumed=("camera",)), "assumed"),
        (trust_in(replace(found, ring=replace(found.ring, on_ring=three))), "3 lights fit a pose"),
        (trust_in(replace(found, detection=0.9)), "90 % sure"),
    ):
        assert (trust.colour, words in trust.sentence) == ("amber", True)
    assert trust_in(replace(found, detection=0.96)).colour == "green"


def test_gravest_reason_gives_the_colour_and_comes_first(found):
    trust = trust_in(with_choice(found, probability=0.5, sigma_position_m=(0, 0, 0.06)), assumed=("camera",))
    assert (trust.colour, trust.verdict, len(trust.reasons)) == ("red", VERDICTS["red"], 3)
    assert "toss-up" in trust.reasons[0]
