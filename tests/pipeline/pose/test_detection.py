import numpy as np
import pytest
from dockpose import Dock, estimate
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.pose.detection import accept_pose, detection_of, evenly_spaced_part, why_no_dock
from dockpose.pose.number import odds_of_lit
from dockpose.pose.solve import find_poses
from msgspec.structs import replace

from tests.support.scenes import CAMERA, DOCK
from tests.support.two_docks import drawn, lights_m


def test_each_ring_that_could_as_well_be_the_dock_counts_against_it():
    for alike, probability in ((0, 1.0), (1, 1 / 2), (3, 1 / 4)):
        ring = Ring(np.ones(10, dtype=bool), "", lights=10, alike=alike)
        assert seen(ring, DOCK) == pytest.approx(probability)
    docks = [(lights_m(np.array([x, 0.0, 2.0]), (0.2, 0.3)), 150, 0.004) for x in (-0.35, 0.35)]
    one, both = (estimate(drawn(those, 0), CAMERA, DOCK).detection for those in (docks[:1], docks))
    assert one is not None
    assert both is not None
    assert one > 0.99
    assert both < 0.6


# By hand: where the share that is lit has the density 17/3 x share^(14/3), both of 2 are seen with 17/23, one of them
# with 2 x 17/23 x 3/20; where any number is as likely, each with 1/3.
@pytest.mark.parametrize(("lit", "lights", "odds"), [(2, 2, 3 * 17 / 23), (1, 2, 3 * 2 * 17 / 23 * 3 / 20)])
def test_the_odds_of_how_many_lights_are_lit_are_those_of_a_beta_binomial(lit, lights, odds):
    assert odds_of_lit(lit, lights) == pytest.approx(odds)


def seen(ring, dock, off_px=0.0):
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2), rms_px=off_px)
    return detection_of(-50.0, ring, Choice((pose, pose), 0, "spacing", None), CAMERA, dock)


@pytest.mark.parametrize(
    ("lit", "lights", "is_sure"),
    [(7, 19, False), (5, 10, False), (9, 20, False), (10, 16, False), (6, 8, True), (7, 7, True), (40, 48, True)],
)
def test_a_ring_of_an_unknown_number_with_few_of_its_places_filled_is_never_sure(lit, lights, is_sure):
    ring = Ring(np.ones(lit, dtype=bool), "", lights=lights)
    assert (seen(ring, Dock(0.30)) >= 0.95) == is_sure
    assert seen(ring, Dock(0.30)) >= 0.5
    assert seen(ring, Dock(0.30, lights)) == pytest.approx(1.0)


SEEN_AT = "they are seen at 0, 45, 72, 108, 144, 180, 216, 252, 288, 324 degrees, up to 4 off even spacing."


@pytest.mark.parametrize(
    ("lights", "by", "words"),
    [
        (10, "spacing", f"on an ellipse, but 4.2 px off the dock's: {SEEN_AT}"),
        (10, "none", f"on an ellipse, but not spaced as the dock's lights are: {SEEN_AT}"),
        (12, "spacing", "on a ring, but so inexactly, 4.2 px, that it may be chance."),
        (12, "none", "not spaced as the dock's lights are: other lights, another dock, or another camera."),
    ],
)
def test_why_lights_are_not_the_docks_is_said_with_their_angles(lights, by, words):
    """Square on 1 m ahead; the second of ten is 9 degrees on: 4.5 off, if the others are as far to the other side."""
    angles = np.radians(36 * np.arange(10) - 170 + [0, 9, *[0] * 8])
    points_px = CAMERA.project(np.column_stack([0.15 * np.cos(angles), 0.15 * np.sin(angles), np.ones(10)]))
    markers, ring = Markers(points_px, np.full(10, 20), np.full(10, 200)), Ring(np.ones(10, dtype=bool), "")
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2), rms_px=4.2)
    choice = Choice((pose, pose), 0, by, None)
    reason = str(why_no_dock(ring, markers, choice, CAMERA, Dock(0.30, lights), 1e9))
    assert reason.startswith("10 groups lie on ")
    assert words in reason
    assert by == "none" or why_no_dock(ring, markers, choice, CAMERA, Dock(0.3, 10), -99) is None


def test_lights_of_an_unknown_number_farther_off_than_hands_put_them_may_be_anything():
    ring, radius_px = Ring(np.ones(7, dtype=bool), "", lights=7), CAMERA.fx * 0.15
    assert seen(ring, Dock(0.30), 0.06 * radius_px) > 0.95
    assert seen(ring, Dock(0.30), 0.07 * radius_px) == pytest.approx(0.5)
    assert seen(ring, Dock(0.30, 7), 0.07 * radius_px) == pytest.approx(1.0)


def test_a_number_that_another_focal_length_would_change_is_not_taken_for_told():
    # Twenty-three of 24 lights, as even as those of 23 by the wrong camera: the side and the number are the right ones.
    dock, normal = Dock(0.30, 24), rotation_from_angles(0.5, 0.3)
    points_px = CAMERA.project(np.array([0.02, 0.01, 0.5]) + dock.light_points()[1:] @ normal.T)
    markers = Markers(points_px, np.full(23, 20), np.full(23, 200))
    other = replace(CAMERA, fx=0.6 * CAMERA.fx, fy=0.6 * CAMERA.fy)
    ring = Ring(np.ones(23, dtype=bool), "", lights=23)
    assert find_poses(points_px, other, Dock(0.30))[1].number == 23
    _, choice, _, reason = accept_pose(ring, markers, other, Dock(0.30), float(CAMERA.width * CAMERA.height))
    assert reason is None
    assert (choice.number, choice.focal_px) == (24, pytest.approx(CAMERA.fx, rel=0.05))


def test_groups_between_the_lights_places_are_left_out_of_an_evenly_spaced_ring_and_nothing_else_is():
    """Square on 1 m ahead: nine lights of ten, and a reflection half-way between two on the rim."""
    places = np.radians(36 * np.append(np.arange(9), 3.5) + 20)
    points_px = CAMERA.project(np.column_stack([0.15 * np.cos(places), 0.15 * np.sin(places), np.ones(10)]))
    markers = Markers(points_px, np.full(10, 20), np.full(10, 200))
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2))
    choice = Choice((pose, pose), 0, "none", None)
    is_light = np.arange(10) < 9
    ring = Ring(np.ones(10, dtype=bool), "All.")
    part = evenly_spaced_part(ring, markers, choice, CAMERA, DOCK)
    assert part.on_ring.tolist() == is_light.tolist()
    assert part.reason == "All. 1 of them lie between places."
    assert part.ellipse is None
    assert evenly_spaced_part(Ring(is_light, "All."), markers, choice, CAMERA, DOCK) is None
    for other in (Dock(0.30), Dock(0.30, 9), Dock(0.30, angles_deg=tuple(36.0 * np.arange(10)))):
        assert evenly_spaced_part(ring, markers, choice, CAMERA, other) is None
