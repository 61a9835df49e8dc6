# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from dockpose import Camera, Dock, Settings
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.tracking.hypotheses import Hypotheses, allowed_by, grown, posterior

CAMERA = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)


def seen(first, *, rms_px=(0.3, 0.3), lights=10, sigma_px=None, tilt=0.5, x_m=0.0, focal_px=None):
    """A frame with two poses tilted to either side, of which the first has this probability."""
    place_m, poses = np.array([x_m, 0.0, 1.0]), []
    for side, probability, off_px in zip((1, -1), (first, 1 - first), rms_px, strict=True):
        normal = -rotation_from_angles(0.0, side * tilt)[:, 2]
        told = {"rms_px": off_px, "probability": probability}
        sigmas = {"sigma_position_m": (1e-3, 1e-3, 5e-3), "sigma_theta_rad": (0.02, 0.02)}
        poses.append(replace(CirclePose.at(place_m, normal, CAMERA), **told, **sigmas))
    known = None if sigma_px is None else np.tile(sigma_px**2 * np.eye(2), (lights, 1, 1))
    areas = np.full(lights, 9)
    return SimpleNamespace(
        status="ok",
        candidates=tuple(poses),
        markers=Markers(np.zeros((lights, 2)), areas, areas, covariances_px2=known),
        ring=Ring(np.ones(lights, dtype=bool), ""),
        lights_on_ring=lights,
        ellipse=SimpleNamespace(semi_axes_px=(100.0, 80.0)),
        dock=Dock(0.30, 10),
        choice=SimpleNamespace(focal_px=focal_px),
    )


@pytest.mark.parametrize(
    ("first", "rms_px", "worth", "log_odds", "allowed"),
    [
        (0.8, (0.3, 0.3), 1.0, math.log(4), math.log(4)),
        (0.2, (0.3, 0.3), 1.0, -math.log(4), math.log(4)),
        (0.8, (0.3, 0.3), 0.5, math.log(2), math.log(4)),
        (0.999, (0.3, 0.3), 1.0, 2.0, math.log(999)),  # no frame is worth more
        (0.001, (0.3, 0.3), 1.0, -2.0, math.log(999)),
        # A dock may be built as far off as 4.2 px of a ring of 100, or 2 px of a small one.
        (0.4, (4.1, 4.3), 1.0, 20.0, math.log(1.5)),
        (0.6, (4.3, 4.1), 1.0, -20.0, math.log(1.5)),
        (0.6, (4.3, 4.4), 1.0, math.log(1.5), math.log(1.5)),
    ],
)
def test_a_track_begins_with_what_its_frame_tells_and_all_like_it_together_would(
    first, rms_px, worth, log_odds, allowed
):
    begun = Hypotheses.begin(seen(first, rms_px=rms_px), Settings(), worth)
    assert begun.allowed == pytest.approx(allowed)
    assert begun.told == pytest.approx(math.copysign(1 / (1 / abs(log_odds) + 1 / allowed), log_odds))
    assert begun.first == pytest.approx(1 / (1 + math.exp(-begun.told)))
    assert begun.chosen == (0 if log_odds > 0 else 1)
    assert begun.probability == pytest.approx(1 / (1 + math.exp(-abs(begun.told))))


def test_frames_have_in_common_what_of_their_residuals_is_no_noise_of_the_picture():
    """Ten lights off by 1 px, of which noise of 0.5 px along either axis does .25 x (20 - 6) of 10."""
    assert allowed_by(seen(0.8, rms_px=(1.0, 1.0), sigma_px=0.5)) == pytest.approx(math.log(4) / (1 - 0.25 * 14 / 10))
    assert allowed_by(seen(0.2, rms_px=(0.1, 0.1), sigma_px=0.5)) == pytest.approx(math.log(4) / 0.1)  # all is noise
    assert allowed_by(seen(0.8, rms_px=(0.0, 1.0), sigma_px=0.5)) == pytest.approx(math.log(4))
    assert allowed_by(seen(0.8, rms_px=(1.0, 1.0), sigma_px=math.nan)) == pytest.approx(math.log(4))
    # Of three lights, which leave nothing over, one number is told.
    assert allowed_by(seen(0.8, rms_px=(1.0, 1.0), lights=3, sigma_px=0.5)) == pytest.approx(
        math.log(4) / (1 - 0.25 / 3)
    )


def settled(first=0.8):
    """After a frame, a tenth of a second before the next."""
    return Hypotheses.begin(seen(first), Settings(), 1.0).predict(0.1, Settings())


def test_a_frame_as_expected_continues_both_chains_and_tells_what_is_new_of_it():
    after = settled().update(seen(0.8), Settings(), 1.0)
    assert after.seen == (0, 1)
    assert after.age == 2
    assert after.gap_s == 0.0
    # Two frames of ln 4 each that have all in common: 1 / (1 / (2 ln 4) + 1 / ln 4).
    assert after.told == pytest.approx(2 * math.log(4) / 3)
    assert after.first > settled().first


def test_a_frame_with_its_candidates_the_other_way_round_continues_the_same_chains():
    frame = seen(0.2)
    one, other = frame.candidates
    frame.candidates = (replace(other, probability=0.2), replace(one, probability=0.8))
    after = settled().update(frame, Settings(), 1.0)
    assert after.seen == (1, 0)
    assert after.told == pytest.approx(2 * math.log(4) / 3)
    for chain, index in zip(after.chains, (1, 0), strict=True):
        np.testing.assert_allclose(chain.normal, frame.candidates[index].normal, atol=0.01)


def test_a_dock_that_has_turned_beyond_the_gate_or_is_out_of_reach_does_not_continue():
    slow = Settings(max_turn_deg_per_s=30.0)
    assert settled().update(seen(0.8, tilt=0.9), slow, 1.0) is None  # 23 degrees in a tenth of a second
    assert settled().update(seen(0.8, tilt=0.55), slow, 1.0) is not None
    assert settled().update(seen(0.8, x_m=0.9), slow, 1.0) is None
    assert settled().update(seen(0.8, x_m=0.02), slow, 1.0) is not None


def test_motion_tells_nothing_by_a_camera_that_is_another():
    """One candidate has turned by three degrees more than the other."""
    frames = [seen(0.5, focal_px=focal_px) for focal_px in (None, 500.0)]
    for frame in frames:
        one, other = frame.candidates
        frame.candidates = (one, replace(other, normal=-rotation_from_angles(0.0, -0.56)[:, 2]))
    by_motion, without = (settled(0.5).update(frame, Settings(), 1.0).first for frame in frames)
    assert by_motion > 0.55
    assert without == pytest.approx(0.5, abs=1e-3)


def test_what_frames_tell_together_stays_below_what_they_share():
    assert grown(0.0, 2.0, 4.0) == pytest.approx(4 / 3)  # 1 / (1/2 + 1/4)
    assert grown(4 / 3, 2.0, 4.0) == pytest.approx(2.0)  # 1 / (1/4 + 1/4)
    assert grown(-4 / 3, -2.0, 4.0) == pytest.approx(-2.0)
    told = 0.0
    for _ in range(10_000):
        told = grown(told, 1.0, 1.5)
    assert 1.45 < told < 1.5


def test_what_speaks_against_earlier_frames_counts_in_full_down_to_even_odds_and_is_bounded_beyond():
    assert grown(3.0, -2.5, 4.0) == pytest.approx(0.5)
    assert grown(1.0, -2.5, 4.0) == pytest.approx(-12 / 11)  # 1.5 is left: 1 / (1/1.5 + 1/4)
    assert -0.72 < grown(-0.02, 20.0, 0.72) < 0.72
    assert grown(0.0, 3.0, 0.0) == pytest.approx(0.0, abs=1e-9)


def weights_by_hand(first, squares, log_odds, motion):
    """How likely chain and candidate go together: by how near it is among both, by the frame, and by motion."""
    squares = np.asarray(squares, dtype=float)
    fits = np.exp(-0.5 * squares) / np.exp(-0.5 * squares).sum(axis=1, keepdims=True)
    frame = np.array([1, np.exp(-log_odds)]) / (1 + np.exp(-log_odds))
    moved = np.exp(-0.5 * motion * np.minimum(squares.min(axis=1), 9.0))  # more than three sigmas count as three
    return np.array([[first], [1 - first]]) * fits * frame * moved[:, None]


@pytest.mark.parametrize(
    ("first", "squares", "log_odds"),
    [
        (0.7, [[0.1, 30], [25, 0.5]], 1.0),
        (0.7, [[30, 0.1], [0.5, 25]], 1.0),  # the frame has them the other way round
        (0.3, [[1, 4], [6, 12]], -0.5),
        (0.5, [[2, 3], [3, 2]], 0.0),
        (0.5, [[90.0, 16], [3, 90]], 0.3),
    ],
)
@pytest.mark.parametrize("motion", [0.5, 0.0])
def test_the_posterior_is_that_of_both_chains_and_both_candidates(first, squares, log_odds, motion):
    (kept, crossed), (crossed_back, kept_too) = weights_by_hand(first, squares, log_odds, motion)
    total = kept + crossed + crossed_back + kept_too
    order, probability = posterior(first, np.array(squares, dtype=float), log_odds, motion)
    if kept + kept_too >= crossed + crossed_back:
        assert order == (0, 1)
        assert probability == pytest.approx((kept + crossed_back) / total)
    else:
        assert order == (1, 0)
        assert probability == pytest.approx((crossed + kept_too) / total)


def test_no_chain_is_ever_given_up():
    near = np.array([[0.0, 900.0], [900.0, 0.0]])
    assert posterior(1.0, near, 20.0)[1] == 1 - 5e-4
    assert posterior(0.0, near, -20.0)[1] == 5e-4
