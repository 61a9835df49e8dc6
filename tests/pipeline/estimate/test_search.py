import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.estimate import search, stages
from dockpose.estimate.attempt import Attempt
from dockpose.estimate.flow import picture_in
from dockpose.lights.ellipse import fit_ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose

from tests.support.scenes import CAMERA

ANGLES = np.radians([0, 62, 117, 183, 240, 297])


def attempt(off_px=0.0, sigma_px: float | None = 0.1, count=6, log_chance=-10.0):
    """Six lights of 100 pixels on a circle of 80, the second farther from its middle by so much, and known so well."""
    radii = np.full(6, 80.0)
    radii[1] += off_px
    points = (320 + radii * [np.cos(ANGLES), np.sin(ANGLES)]).T[:count]
    covariances = None
    if sigma_px is not None:
        covariances = np.tile(0.1**2 * np.eye(2), (count, 1, 1))
        covariances[1] = sigma_px**2 * np.eye(2)
    shown = np.full(count, 100)
    markers = Markers(points, shown, shown, covariances_px2=covariances)
    stages = {"markers": markers, "ring": Ring(np.ones(count, dtype=bool), ""), "ellipse": fit_ellipse(points)}
    return Attempt("ok", "", stages, log_chance)


@pytest.mark.parametrize(
    ("other", "better"),
    [
        (attempt(4.0, 3.0), True),  # moved within the light, and worse known
        (attempt(4.0, None), True),  # and nothing known of it
        (attempt(4.0, 0.1), False),  # as well known
        (attempt(7.0, 3.0), False),  # another light: 100 pixels reach 5.6 px
        (attempt(0.0, 3.0, count=5), False),  # not all of them
        (Attempt("not_a_ring", "", {}), False),
    ],
)
def test_centres_that_are_worse_known_are_no_better_for_being_nearer_to_even(other, better):
    assert attempt().has_better_centres_than(other) == better


def test_a_look_with_a_light_off_the_rim_does_not_hold_out_against_one_with_all_on_it():
    assert not attempt(4.0, 0.1).has_better_centres_than(attempt(0.0, 3.0))


@pytest.mark.parametrize(
    ("lights", "beside", "leaves"),
    [
        (6, (400.0, 322.0), False),  # the ring is whole
        (7, (400.0, 322.0), True),  # 3 px off the rim
        (7, (340.0, 322.0), False),  # well within it
    ],
)
def test_a_ring_that_lacks_lights_leaves_those_along_its_rim(lights, beside, leaves):
    found = attempt()
    points = np.vstack([found.stages["markers"].points_px, [beside]])
    on_ring = np.array([True] * 6 + [False])
    shown = np.full(7, 100)
    markers = Markers(points, shown, shown, cut=np.zeros(7, dtype=bool))
    ring = Ring(on_ring, "", lights=lights)
    assert Attempt("ok", "", found.stages | {"markers": markers, "ring": ring}).has_unexplained_groups == leaves
    cut = Markers(points, shown, shown, cut=~on_ring)
    assert not Attempt("ok", "", found.stages | {"markers": cut, "ring": ring}).has_unexplained_groups


@pytest.mark.parametrize(
    ("rms_px", "lights", "log_chance", "is_exact"),
    [(0.1, 6, -60.0, True), (9.0, 6, -60.0, False), (0.1, 12, -60.0, False), (0.1, 6, 0.0, False)],
)
def test_a_ring_is_exact_where_nearly_all_lights_are_in_their_places(rms_px, lights, log_chance, is_exact):
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2), rms_px=rms_px)
    ring = Ring(np.ones(6, dtype=bool), "", lights=lights)
    stages = attempt().stages | {"choice": Choice((pose, pose), 0, "spacing", None), "ring": ring}
    assert Attempt("ok", "", stages, log_chance).is_exact() == is_exact


@pytest.mark.parametrize(
    ("lit", "lights", "log_chance", "is_exact"),
    [
        # Of five or more only one that would be chance in a million pictures leaves nothing to better; four are
        # hardly ever so sure, and one in ten thousand must do.
        (6, 6, np.log(0.5e-6), True),
        (6, 6, np.log(2e-6), False),
        (4, 4, np.log(0.5e-4), True),
        (4, 4, np.log(2e-4), False),
        (3, 4, np.log(0.5e-4), False),
    ],
)
def test_four_lights_are_sure_where_more_would_have_to_be_surer(lit, lights, log_chance, is_exact):
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2), rms_px=0.1)
    ring = Ring(np.arange(6) < lit, "", lights=lights)
    stages = attempt().stages | {"choice": Choice((pose, pose), 0, "spacing", None), "ring": ring}
    assert Attempt("ok", "", stages, log_chance).is_exact() == is_exact


def test_looks_are_ranked_by_rings_of_five_then_any_then_all_of_the_lights_then_chance():
    def seen(lit, lights, status, log_chance=-1.0):
        return Attempt(status, "", {"ring": Ring(np.arange(8) < lit, "", lights=lights)}, log_chance)

    worst_first = [
        Attempt("no_lights", "", {}),
        seen(7, 8, "not_a_ring", -50.0),
        seen(8, 8, "not_a_ring", -1.0),  # all of them, if not where they should be
        seen(4, 8, "ok", -50.0),
        seen(5, 8, "ok", -20.0),
        seen(7, 8, "ok", -30.0),
        seen(8, 8, "ok", -2.0),
    ]
    assert sorted(reversed(worst_first), key=Attempt.rank) == worst_first


def drawn(lights: int, told: int, off: float = 0.0, seed: int = 0) -> Estimate:
    """An estimate of so many lamps of three pixels, off their places by a share of the radius, on black."""
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * np.arange(lights) / lights + rng.normal(0, off, lights)
    picture = np.zeros((480, 640), np.uint8)
    for x, y in np.column_stack([320 + 100 * np.cos(angles), 240 + 85 * np.sin(angles)]):
        cv2.circle(picture, (round(16 * x), round(16 * y)), 3 * 16, 255, -1, cv2.LINE_AA, 4)
    camera = Camera(640.0, 640.0, 319.5, 239.5, 640, 480)
    return estimate(cv2.GaussianBlur(picture, (0, 0), 1), camera, Dock(0.30, told))


@pytest.mark.parametrize("told", [5, 7, 9, 11, 12, 20])
def test_another_number_of_lights_is_named_rather_than_taken_for_a_part_of_the_dock(told):
    found = drawn(10, told)
    assert found.status == "not_a_ring"
    assert found.message.startswith(f"10 evenly spaced lights are in view; the dock has {told}: is that right?")
    assert found.ring is not None
    assert found.ring.lights == 10


def test_nothing_fainter_is_sought_where_another_number_is_named(monkeypatch):
    monkeypatch.setattr(search, "_faint", lambda *_: pytest.fail("a part of the ring may be taken for the dock"))
    assert drawn(10, 9).message.startswith("10 evenly spaced lights are in view")


@pytest.mark.parametrize("lights", [6, 8, 12])
def test_lights_a_twelfth_of_the_radius_off_along_the_rim_are_a_dock_where_nothing_else_is_in_view(lights):
    found = drawn(lights, lights, 0.08)
    assert found.status == "ok"
    assert found.lights_on_ring == lights
    # The picture's scale is known from across the rim, where the lights are in place: 0.15 m are 100 px.
    assert found.selected is not None
    assert found.selected.position_m[2] == pytest.approx(640 * 0.15 / 100, rel=0.02)


@pytest.mark.parametrize(
    ("by_one", "added"), [("ok", "By a level for each light the ring is surer"), ("not_a_ring", "No one level shows")]
)
def test_that_no_one_level_shows_the_ring_is_said_only_where_none_does(by_one, added, monkeypatch):
    pose = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2), rms_px=9.0)
    stages = attempt().stages | {"choice": Choice((pose, pose), 0, "spacing", None)}
    first, best = Attempt(by_one, "", stages, -20.0), Attempt("ok", "Six lights.", stages, -30.0)
    monkeypatch.setattr(search, "detect_once", lambda *_: first)
    monkeypatch.setattr(search, "_search_by_light", lambda *_: best)
    picture = picture_in(np.zeros((480, 640), np.uint8), CAMERA, Settings())
    assert search.search(picture, CAMERA, Dock(0.3, 6), Settings(), True)[1].startswith(f"Six lights. {added}")


@pytest.mark.parametrize("is_ring", [True, False])
def test_white_is_looked_at_by_itself_only_where_something_hints_at_a_ring(monkeypatch, is_ring):
    """White lamps at night: eight strewn ones, or a part of a ring of twelve with as many strewn ones beside it."""
    rng = np.random.default_rng(5)
    lamps = rng.uniform([40, 40], [600, 440], (8, 2))
    if is_ring:
        turns = 2 * np.pi * np.arange(6) / 12
        lamps = np.vstack([lamps, np.array([320, 240]) + 110 * np.column_stack([np.cos(turns), np.sin(turns)])])
    image = np.zeros((480, 640, 3)) + [40, 20, 10]
    for x, y in lamps.tolist():
        cv2.circle(image, (round(16 * x), round(16 * y)), 4 * 16, (230, 230, 230), -1, cv2.LINE_AA, shift=4)
    seen: list[bool] = []

    def detect_once(threshold, picture, *rest):
        seen.append(picture.min_channel)
        return stages.detect_once(threshold, picture, *rest)

    monkeypatch.setattr(search, "detect_once", detect_once)
    image = np.rint(image + rng.normal(0, 1.5, image.shape)).clip(0, 255).astype(np.uint8)
    assert estimate(image, CAMERA, Dock(0.3, 12)).status != "ok"
    assert any(seen) == is_ring
