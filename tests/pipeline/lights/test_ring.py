import math

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.lights.chance import Scene
from dockpose.lights.ellipse import fit_ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.polygon import find_polygons
from dockpose.lights.ring import find_ring, spaced_as
from dockpose.pose.circle import rotation_from_angles

from tests.support.scenes import CAMERA

FOCAL_PX, AREA_PX2 = 700.0, 640.0 * 480.0


def lights(count=10, z_m=1.0, angles=(0.4, -0.3), roll=0.1, missing=(), centre=(0.05, 0.02)):
    """Images of a 0.30 m ring's lights."""
    turn = 2 * np.pi * np.arange(count) / count + roll
    ring = 0.15 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) @ rotation_from_angles(*angles).T
    return CAMERA.project(np.delete(np.array([*centre, z_m]) + ring, missing, axis=0))


def as_markers(points, areas=None, peaks=None):
    count = len(points)
    areas = np.full(count, 20) if areas is None else np.asarray(areas)
    return Markers(points, areas, np.full(count, 200) if peaks is None else np.asarray(peaks))


def ring_of(points, count: int | None = 10, **shapes):
    return find_ring(points, as_markers(points, **shapes), CAMERA, Dock(0.30, count), AREA_PX2)


def scene_of(points_px, focal_px=FOCAL_PX):
    """Points (N, 2) from the principal point, all as bright, of evenly spaced lights whose number is known."""
    return Scene(points_px, np.ones(len(points_px)), AREA_PX2, focal_px, True, 1, np.array([np.inf]))


def text(left=400.0, top=30.0, letters=19):
    """Centres of a row of letters: even steps, heights that differ a little."""
    rng = np.random.default_rng(4)
    return np.column_stack([left + 11.0 * np.arange(letters), top + rng.uniform(-2.5, 2.5, letters)])


def test_lights_alone_are_all_kept():
    ring = ring_of(lights())
    assert ring.on_ring.all()
    assert "All 10" in ring.reason


@pytest.mark.parametrize("seed", range(40))
def test_lights_are_told_from_text_snow_and_lamps_with_up_to_three_missing(seed):
    rng = np.random.default_rng(seed)
    missing = rng.choice(10, rng.integers(0, 4), replace=False)
    angles = rng.uniform(-0.6, 0.6, 2)
    ours = lights(z_m=rng.uniform(0.7, 2.5), angles=angles, roll=rng.uniform(0, 1), missing=missing)
    ours = ours + rng.normal(0, 0.1, ours.shape)
    snow = rng.uniform([0, 100], [640, 480], (rng.integers(0, 25), 2))
    snow = snow[np.linalg.norm(snow[:, None] - ours[None], axis=2).min(axis=1) > 12]
    points = np.vstack([ours, snow, text()])
    order = rng.permutation(len(points))
    ring = ring_of(points[order])
    assert ring.on_ring[np.argsort(order)][: len(ours)].all()
    assert ring.on_ring.sum() == len(ours)


def test_points_strewn_hint_at_a_ring_as_often_as_chance_says_and_no_more():
    """Of 200 draws, rings of which chance makes one in twenty pictures are in ten, give or take three deviations."""
    draws = [np.random.default_rng(seed).uniform([20, 20], [620, 460], (25, 2)) for seed in range(200)]
    hints = [ring_of(points, 8).least_log_chance < math.log(0.05) for points in draws]
    assert sum(hints) <= 10 + 3 * math.sqrt(10)


@pytest.mark.parametrize("seed", range(4))
def test_a_ring_is_found_among_more_lamps_that_are_as_bright_than_are_looked_at_first(seed):
    ours = lights(8, z_m=2.0)
    strays = np.random.default_rng(seed).uniform([20, 20], [620, 460], (60, 2))
    strays = strays[np.linalg.norm(strays[:, None] - ours, axis=2).min(axis=1) > 12][:40]
    assert ring_of(np.vstack([strays, ours]), 8).on_ring.tolist() == [False] * 40 + [True] * 8


def test_half_a_ring_among_strays_is_none_but_hints_at_one():
    strays = np.random.default_rng(1).uniform([20, 20], [620, 460], (12, 2))
    ring = ring_of(np.vstack([lights(8, missing=range(4)), strays]), 8)
    assert not ring.found
    assert ring.least_log_chance < 0  # fewer than one in such a picture by chance


@pytest.mark.parametrize(
    ("farther", "level", "is_kept"),
    [
        (1.002, 90, True),
        (1.05, 90, False),
        (1.004, 200, False),  # nearly as bright
    ],
)
def test_of_two_rings_as_far_away_as_builders_tell_the_brighter_is_the_dock(farther, level, is_kept):
    # Lamps 2 % of the radius off their places move the range of ten lights by .9 %.
    bright, dim = lights(z_m=1.5 * farther, centre=(-0.25, 0.0)), lights(z_m=1.5, centre=(0.25, 0.0))
    ring = ring_of(np.vstack([bright, dim]), peaks=np.array([220] * 10 + [level] * 10))
    assert ring.on_ring.tolist() == [is_kept] * 10 + [not is_kept] * 10
    assert level == 90 or ring.alike == 1


@pytest.mark.parametrize("count", [5, 8, 12])
def test_of_many_images_of_a_dock_the_dock_is_found_though_each_image_is_brighter(count):
    # Further away than the dock, as in two mirrors that face each other; together more than are looked at first.
    places = [(x, y, z) for x, z in ((-0.9, 3.2), (0.0, 2.9), (0.9, 3.5)) for y in (-0.65, 0.0, 0.65)]
    ours = lights(count, z_m=2.5, centre=(0.45, 0.3))
    images = [lights(count, z_m=z, centre=(x, y)) for x, y, z in places]
    areas = [6] * count + [48] * (count * len(images))
    ring = ring_of(np.vstack([ours, *images]), count, areas=areas)
    assert np.flatnonzero(ring.on_ring).tolist() == list(range(count))


# Nine faint lights on a bright slope, each of which falls apart into several groups.
SPLIT_PX = """
852.5 65.2 843.3 75.5 862.7 77.7 849.3 79.1 843.9 85.8 860.7 87.1 1015.5 140.5 1009.7 143.3 1006.1 155.2 1013.3 153.6
1023.0 153.3 1069.1 296.6 1067.1 306.9 1081.7 306.6 563.6 312.5 572.6 321.0 1074.4 314.2 554.6 323.3 562.5 321.2 568.2
329.4 576.2 325.8 560.2 333.4 557.0 335.5 570.1 334.8 1031.3 465.6 1021.2 481.7 1029.1 479.3 599.7 497.3 590.9 501.6
608.9 501.4 605.6 508.4 904.0 580.4 898.7 585.6 731.8 595.5
"""


def test_the_search_for_more_rings_ends_where_all_that_it_finds_is_one_that_is_known():
    points = np.array(SPLIT_PX.split(), dtype=float).reshape(-1, 2)
    camera, bright = Camera(1037.76, 1037.76, 639.5, 359.5, 1280, 720), np.isin(np.arange(34), [12, 13, 15, 17])
    ring = find_ring(points, as_markers(points, areas=np.where(bright, 10, 3)), camera, Dock(0.5, 9), 1280 * 720.0)
    assert "More lights lie on one ring than a part of 9" in ring.reason


def test_unlit_lamps_between_the_lights_are_no_lights_and_lit_ones_are():
    ours, between = lights(12, roll=0.1), lights(48, roll=0.2)
    points = np.vstack([ours, between[np.linalg.norm(between[:, None] - ours, axis=2).min(axis=1) > 5]])
    unlit = [400] * 12 + [10] * (len(points) - 12)
    assert np.flatnonzero(ring_of(points, 12, areas=unlit).on_ring).tolist() == list(range(12))
    refused = ring_of(points, 12, areas=[400] * len(points))
    assert not refused.found
    assert "More lights lie on one ring than a part of 12" in refused.reason


@pytest.mark.parametrize("count", [5, 6, 8, 12, 24])
def test_two_lamps_on_the_rim_of_any_dock_do_not_hide_it(count):
    between = lights(2 * count)[3:8:4]  # each half way from one light to the next
    points = np.vstack([lights(count), between])
    assert np.flatnonzero(ring_of(points, count).on_ring).tolist() == list(range(count))


def test_lights_of_very_unequal_size_are_kept():
    points = np.vstack([lights(6), text()])
    areas = np.array([3, 200, 12, 60, 400, 5] + [110] * 19)
    assert np.flatnonzero(ring_of(points, 6, areas=areas).on_ring).tolist() == list(range(6))


def test_a_ring_of_half_as_many_lights_is_not_the_dock():
    ring = ring_of(lights(8), 16)
    assert not ring.found
    assert "8 lights are evenly spaced, and the dock has 16" in ring.reason


def test_of_two_concentric_rings_the_one_with_the_dock_s_number_of_lights_is_it():
    inner, outer = lights(8, z_m=2.0), lights(16, z_m=1.0, centre=(0.025, 0.01))
    assert ring_of(np.vstack([inner, outer]), 16).on_ring.tolist() == [False] * 8 + [True] * 16
    assert ring_of(np.vstack([inner, outer]), 8).on_ring.tolist() == [True] * 8 + [False] * 16


def half_a_ring(seed):
    """Five lights of ten, whichever, good to 0.1 px, and one to three strays not within 20 px of them."""
    rng = np.random.default_rng([7, seed])
    angles, missing = rng.uniform(-0.5, 0.5, 2), rng.choice(10, 5, replace=False)
    ours = lights(z_m=rng.uniform(0.6, 1.2), angles=angles, roll=rng.uniform(0, 1), missing=missing)
    strays = rng.uniform(10, [630, 470], (40, 2))
    strays = strays[np.linalg.norm(strays[:, None] - ours, axis=2).min(axis=1) > 20][: 1 + seed % 3]
    return np.vstack([ours + rng.normal(0, 0.1, ours.shape), strays])


def test_any_five_of_ten_lights_are_found_beside_strays():
    found = [np.flatnonzero(ring_of(half_a_ring(seed)).on_ring).tolist() for seed in range(100)]
    assert sum(one == [0, 1, 2, 3, 4] for one in found) >= 97


def test_lights_seen_nearly_square_on_lie_where_the_nearest_pose_has_them():
    # Five lights good to 0.1 px; a pose that follows from how they are stretched alone stays off by two pixels.
    ours = half_a_ring(6)[:5]
    rings = find_polygons(scene_of(ours - [CAMERA.cx, CAMERA.cy]), [Dock(2.0, 10).light_points()[:, :2]])
    best = max((one.polygon for one in rings), key=lambda polygon: (len(polygon.members), -polygon.squares_px2))
    assert len(best.members) == 5
    assert best.squares_px2 < 5 * 0.2**2


def test_a_dock_whose_lights_are_two_per_cent_of_its_radius_out_of_place_is_still_one():
    rng = np.random.default_rng(0)
    ours = lights(5, z_m=1.05, angles=(0.1, 0.1)) + rng.uniform(-2, 2, (5, 2))
    assert ring_of(np.vstack([text(), ours]), 5).on_ring.sum() == 5


@pytest.mark.slow
@pytest.mark.parametrize("count", [10, None])
@pytest.mark.parametrize("seed", range(15))
def test_snow_and_text_without_a_dock_are_no_ring(count, seed):
    rng = np.random.default_rng(seed)
    points = np.vstack([rng.uniform([0, 60], [640, 480], (30, 2)), text()])
    shapes = {"areas": rng.integers(2, 60, len(points)), "peaks": rng.integers(60, 255, len(points))}
    ring = ring_of(points, count, **shapes)
    assert not ring.found
    assert "None of the 49 groups" in ring.reason


@pytest.mark.parametrize(
    ("angles_deg", "spaced"), [((), "evenly spaced lights"), ((0, 50, 130, 200, 290), "lights spaced as the dock's")]
)
def test_what_was_looked_for_in_vain_is_said(angles_deg, spaced):
    points, dock = text(letters=7), Dock(0.30, 5, angles_deg=angles_deg)
    ring = find_ring(points, as_markers(points), CAMERA, dock, AREA_PX2)
    assert ring.reason == f"None of the 7 groups of bright pixels form a ring of 5 {spaced}."


def test_without_the_number_of_lights_a_ring_is_still_found():
    assert ring_of(lights(9), None).on_ring.all()
    points = np.vstack([lights(10), text()])
    assert np.flatnonzero(ring_of(points, None).on_ring).tolist() == list(range(10))


@pytest.mark.parametrize(
    ("points", "count"),
    [
        *((points, 10) for points in (np.zeros((12, 2)), np.full((6, 2), 3.0), np.arange(20.0).reshape(10, 2))),
        (np.vstack([text(), text(20.0, 450.0, 6)]), None),  # two lines of text are no arc of a huge ring
    ],
)
def test_coincident_or_collinear_points_are_no_ring(points, count):
    assert not ring_of(points, count).found


def test_more_groups_than_can_be_looked_at_leave_the_brightest():
    rng = np.random.default_rng(1)
    ours = lights()
    snow = rng.uniform([0, 0], [640, 480], (390, 2))
    snow = snow[np.linalg.norm(snow[:, None] - ours[None], axis=2).min(axis=1) > 8]
    points = np.vstack([snow, ours])
    peaks = np.array([40] * len(snow) + [250] * 10)
    ring = ring_of(points, peaks=peaks, areas=np.where(peaks == 40, 3, 30))
    assert np.flatnonzero(ring.on_ring).tolist() == list(range(len(snow), len(points)))


def test_a_polygon_seen_from_impossibly_near_is_refused():
    # Seen from 0.7 m by a wide lens, a dock is bent by perspective as no lens with a long focal length would show it.
    places = Dock(2.0, 10).light_points()
    ring = 0.15 * places @ rotation_from_angles(0.7, 0.3).T
    seen = 250 * ring[:, :2] / (0.7 + ring[:, 2:])
    (best, *_) = find_polygons(scene_of(seen, 250.0), [places[:, :2]])
    assert len(best.members) == 10
    assert best.polygon.squares_px2 < 0.01
    others = find_polygons(scene_of(seen, 2500.0), [places[:, :2]])
    assert all(len(other.members) < 10 or other.polygon.squares_px2 > 1 for other in others)


def close(seed: int, count: int, strays: int, missing: int, tilt_deg: tuple[float, float]):
    """Points on a ring 0.15 to 0.25 m away from a wide lens, then strays, and the camera."""
    rng = np.random.default_rng([seed, count, strays])
    camera = Camera(320.0, 320.0, 319.5, 239.5, 640, 480)
    while True:
        z_m, tilt, around = rng.uniform(0.25, 0.4), np.radians(rng.uniform(*tilt_deg)), rng.uniform(0, 6.3)
        normal = np.array([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), -np.cos(tilt)])
        rotation = rotation_from_angles(np.arcsin(normal[1]), np.arctan2(-normal[0], -normal[2]))
        turn = 2 * np.pi * np.arange(count) / count + rng.uniform(0, 6.3)
        ring = 0.15 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) @ rotation.T
        points = camera.project(np.array([*rng.uniform(-0.05, 0.05, 2), z_m]) + ring)
        if (points > 5).all() and (points < [635, 475]).all():
            break
    points = np.delete(points, rng.choice(count, missing, replace=False), axis=0)
    ours = points + rng.normal(0, 0.2, points.shape)
    while len(points) < count - missing + strays:
        stray = rng.uniform(5, [635, 475])
        if np.linalg.norm(points - stray, axis=1).min() > 10:
            points = np.vstack([points, stray])
    return np.vstack([ours, points[len(ours) :]]), camera


@pytest.mark.parametrize(
    ("count", "strays", "missing", "tilt_deg", "least"),
    [
        # Chance alone hides few: ten strays come near a lamp's place in one ring of a hundred.
        *((*those, (35, 55), 19) for those in ((8, 10, 0), (8, 8, 1), (10, 20, 0), (10, 0, 1))),
        (10, 4, 1, (0, 8), 20),  # nearly square on
    ],
)
def test_a_ring_close_to_a_wide_lens_is_found_among_strays(count, strays, missing, tilt_deg, least):
    """Although perspective bends it."""
    right = 0
    for seed in range(20):
        points, camera = close(seed, count, strays, missing, tilt_deg)
        ring = find_ring(points, as_markers(points), camera, Dock(0.30, count), AREA_PX2)
        right += ring.on_ring.tolist() == [True] * (count - missing) + [False] * strays
    assert right >= least


@pytest.mark.parametrize("count", [5, 6, 8, 12])
def test_random_points_before_a_wide_lens_are_no_ring(count):
    camera, found = Camera(320.0, 320.0, 319.5, 239.5, 640, 480), 0
    for seed in range(60):
        points = np.random.default_rng([seed, count]).uniform([0, 0], [640, 480], (20 + seed, 2))
        found += find_ring(points, as_markers(points), camera, Dock(0.30, count), AREA_PX2).found
    assert found <= 1


@pytest.mark.parametrize("count", [8, 12])
@pytest.mark.parametrize("off_px", [3.0, 4.0])
def test_a_light_that_runs_together_with_a_bubble_is_left_out(count, off_px):
    """Its centre lies within what a light may be off, but without it the others lie exactly on a ring."""
    rng = np.random.default_rng(count)
    ring = lights(count) + rng.normal(0, 0.05, (count, 2))
    middle = ring.mean(axis=0)
    ring[3] += off_px * (ring[3] - middle) / np.hypot(*(ring[3] - middle))
    strays = rng.uniform([0, 0], [640, 480], (12, 2))
    found = ring_of(np.vstack([ring, strays[np.hypot(*(strays - middle).T) > 150]]), count)
    assert not found.on_ring[3]
    assert found.on_ring[:count].sum() == count - 1


@pytest.mark.parametrize("count", [5, 8, 12])
def test_a_learnt_dock_s_lights_are_sought_where_it_has_them(count):
    # A tenth of the radius off their places, four times what is taken for an evenly spaced ring.
    rng = np.random.default_rng(count)
    turn_rad = 2 * np.pi * np.arange(count) / count
    out_m = 0.015 * np.column_stack([np.cos(3 * turn_rad + 1), np.sin(2 * turn_rad), 0 * turn_rad])
    learnt = Dock(0.30, count, offsets_m=out_m.tolist())
    ours = CAMERA.project([0.1, 0.0, 1.1] + learnt.light_points() @ rotation_from_angles(0.3, -0.4, 1.0).T)
    strays = rng.uniform(20, [620, 460], (8, 2))
    points = np.vstack([ours, strays[np.linalg.norm(strays[:, None] - ours, axis=2).min(axis=1) > 20]])
    found = find_ring(points, as_markers(points), CAMERA, learnt, AREA_PX2)
    assert np.flatnonzero(found.on_ring).tolist() == list(range(count))
    assert not ring_of(points, count).on_ring[:count].all()


def run_together(points, pairs):
    """Points of which some neighbours, the first of each pair, are one group between them."""
    pairs = np.array(pairs)
    middles = (points[pairs] + points[(pairs + 1) % len(points)]) / 2
    return np.vstack([np.delete(points, [*pairs, *(pairs + 1) % len(points)], axis=0), middles])


def test_lights_that_run_together_do_not_hide_the_others():
    # 8 of 20 lights by themselves, the others as six groups, and three lamps elsewhere.
    pairs = [1, 4, 7, 10, 13, 16]
    points = np.vstack([run_together(lights(20), pairs), [[100.0, 400.0], [500.0, 60.0], [560.0, 300.0]]])
    ring = ring_of(points, 20)
    assert np.flatnonzero(ring.on_ring).tolist() == list(range(8))


def test_a_ring_of_another_number_of_lights_is_not_one_whose_lights_run_together():
    for count in (13, 15, 17, 19):
        points = np.vstack([lights(count), [[100.0, 400.0], [500.0, 60.0], [560.0, 300.0]]])
        assert not ring_of(points, 20).found, count


def test_a_nearer_ring_of_which_half_is_seen_does_not_pass_for_the_dock():
    half, whole = lights(z_m=1.0, centre=(-0.25, 0.0), missing=(1, 3, 4, 6, 8)), lights(z_m=1.3, centre=(0.25, 0.0))
    ring = ring_of(np.vstack([half, whole]))
    assert np.flatnonzero(ring.on_ring).tolist() == list(range(5, 15))


@pytest.mark.parametrize(("others", "words"), [(1, "A second ring is in view."), (2, "2 more rings are in view.")])
def test_how_many_more_rings_are_in_view_is_said(others, words):
    docks = [lights(z_m=2.0, centre=(x, 0.0)) for x in (-0.5, 0.0, 0.5)[: others + 1]]
    reason = ring_of(np.vstack(docks)).reason
    count = 10 * others
    assert reason == f"10 of {10 + count} groups lie on one ring; the other {count} do not. {words}"


def on_ellipse(angles_deg, off_px=0.0):
    angles = np.radians(angles_deg)
    off = off_px * np.cos(5 * angles)
    return np.column_stack([320 + (80 + off) * np.cos(angles), 240 + (60 + off) * np.sin(angles)])


def number(angles_deg, dock, off_px=0.0):
    points = on_ellipse(angles_deg, off_px)
    return spaced_as(points, fit_ellipse(points), dock, 12 / AREA_PX2)


EVEN_DEG, BY_HAND_DEG = np.arange(0, 360, 36.0), [0, 60, 75, 135, 150, 200, 215, 270, 285, 335]


def test_even_lights_are_of_their_own_number_or_of_the_docks_but_not_of_every_second_of_it():
    assert [number(EVEN_DEG, Dock(0.3, told)) for told in (None, 10, 20)] == [10, 10, None]
    assert number(EVEN_DEG[:9], Dock(0.3, 10)) == 10


def test_of_an_unknown_number_lights_that_hands_have_spaced_stay_open_unless_chance_or_a_gap_explains_them():
    assert number(BY_HAND_DEG, Dock(0.3)) == 0
    assert number(BY_HAND_DEG, Dock(0.3), off_px=2.5) is None  # any ten points lie as near to an ellipse
    assert number([0, 20, 45, 70, 100, 125, 150, 170, 195, 215], Dock(0.3)) is None  # 145 degrees without one
    assert number([0, 50, 130, 190, 300], Dock(0.3)) is None  # five points always lie on one


@pytest.mark.parametrize(("count", "told"), [(10, 10), (9, None)])
def test_a_dock_whose_angles_are_given_has_all_of_its_lights(count, told):
    assert number(BY_HAND_DEG[:count], Dock(0.3, angles_deg=tuple(BY_HAND_DEG))) == told
