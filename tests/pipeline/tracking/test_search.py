# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false, reportCallIssue=false

from dataclasses import replace

import numpy as np
import pytest
from dockpose import Dock, Settings, estimate
from dockpose.simulate import Approach, FilmPlan, film, render
from dockpose.tracking.search import BLOCK, Search

from tests.support.scenes import CAMERA, DOCK, random_scene
from tests.support.two_docks import drawn, lights_m

FIRST = BLOCK - 8  # so that a few frames reach over the end of a block


@pytest.fixture(scope="module")
def course():
    scene = random_scene(3, position_m=(0.05, 0.0, 3.6))
    motion = Approach(frames=16, start_m=4.0, end_m=3.6, drift_m=0.02)
    return list(film(FilmPlan(scene=scene, motion=motion)))


def seen(course, start=0, stop=None, settings=Settings()):  # noqa: B008
    search = Search(CAMERA, DOCK)
    return [
        search.see(frame.image, FIRST + number, frame.time_s, settings)
        for number, frame in list(enumerate(course))[start:stop]
    ]


def plain(found):
    return found.to_dict() | {"elapsed_ms": 0}


def test_the_first_frame_and_each_hundredth_are_searched_and_all_others_followed(course):
    found = seen(course)
    by = ["search" if number in (0, BLOCK - FIRST) else "following" for number in range(len(course))]
    assert [each.found_by for each in found] == by
    for frame, each in zip(course, found, strict=True):
        alone = estimate(frame.image, CAMERA, DOCK)
        assert each.lights_on_ring == alone.lights_on_ring
        np.testing.assert_allclose(each.selected.position_m, alone.selected.position_m, atol=1e-3)
        np.testing.assert_allclose(each.selected.sigma_position_m, alone.selected.sigma_position_m, rtol=0.5)


def test_centres_are_those_of_a_searched_picture(course):
    for frame, each in zip(course, seen(course), strict=True):
        alone = estimate(frame.image, CAMERA, DOCK)
        own, others = (one.markers.points_px[one.ring.on_ring] for one in (each, alone))
        apart = np.linalg.norm(own[:, None] - others[None], axis=2).min(axis=1)
        assert apart.max() < 0.05


def test_blocks_are_found_alike_in_any_order(course):
    border = BLOCK - FIRST
    second = [plain(found) for found in seen(course, border)]
    assert [plain(found) for found in seen(course, 0, border)] + second == [plain(found) for found in seen(course)]


def test_what_is_lost_is_searched_and_after_a_dark_frame_followed_again(course):
    search = Search(CAMERA, DOCK)
    for number in range(2):
        search.see(course[number].image, number, course[number].time_s, Settings())
    dark = search.see(np.full((480, 640), 20, np.uint8), 2, course[2].time_s, Settings())
    assert (dark.status, dark.found_by) == ("no_lights", "search")
    assert search.see(course[3].image, 3, course[3].time_s, Settings()).found_by == "following"


def changed_at_lights(lights, which, change):
    """How a picture of a near dock is found after itself, where some of its lights are painted otherwise."""
    dock = Dock(0.30, lights)
    scene = random_scene(3, dock=dock, position_m=(0.05, 0.0, 0.9), theta_x_deg=10.0, theta_y_deg=15.0)
    search, (image, truth) = Search(CAMERA, dock), render(scene)
    assert search.see(image, 0, 0.0, Settings()).lights_on_ring == lights
    image = image.copy()
    for x, y in truth.lights_px[which]:
        change(image[round(y) - 9 : round(y) + 10, round(x) - 9 : round(x) + 10])
    return search.see(image, 1, 0.1, Settings())


def dark(part):
    part[:] = part.min()


def speck(part):
    level = part.max()
    part[:] = part.min()
    part[9, 9] = level


def test_with_fewer_than_half_of_the_lights_the_picture_is_searched():
    found = [changed_at_lights(24, slice(out), dark) for out in (12, 13)]
    assert [(each.found_by, each.lights_on_ring) for each in found] == [("following", 12), ("search", 11)]


def test_what_is_of_another_size_than_its_light_is_not_followed():
    found = changed_at_lights(10, slice(1), speck)
    assert (found.found_by, found.lights_on_ring) == ("following", 9)


def test_a_picture_that_jumps_is_followed_to_where_it_went_and_its_other_ring_with_it():
    # Farther than lights are sought from their places, and no farther than a vehicle may shake the camera.
    docks = [(lights_m(np.array([x, 0.0, 2.0]), (0.2, 0.3)), 150, 0.004) for x in (-0.35, 0.35)]
    image, search, jump = drawn(docks, 0), Search(CAMERA, DOCK), (14, -11)
    before = search.see(image, 0, 0.0, Settings())
    now = search.see(np.roll(image, jump[::-1], axis=(0, 1)), 1, 0.1, Settings())
    assert (now.found_by, now.lights_on_ring, len(now.ring.rivals)) == ("following", 10, 1)
    for one, other in ((before.ring.on_ring, now.ring.on_ring), (before.ring.rivals[0], now.ring.rivals[0])):
        assert other.sum() == 10
        apart = np.linalg.norm((before.markers.points_px[one] + jump)[:, None] - now.markers.points_px[other], axis=2)
        assert apart.min(axis=1).max() < 0.05


def test_lights_that_come_nearer_grow_as_what_a_search_finds():
    search = Search(CAMERA, DOCK)
    found = [
        search.see(drawn([(lights_m(np.array([0.0, 0.0, z_m]), (0.2, 0.3)), 150, 0.008)], 0), n, n / 10, Settings())
        for n, z_m in enumerate((1.10, 1.04, 0.98, 0.93))
    ]
    assert [each.found_by for each in found] == ["search"] + ["following"] * 3
    areas = [float(np.median(each.markers.areas_px[each.ring.on_ring])) for each in found]
    assert areas[3] / areas[0] == pytest.approx((1.10 / 0.93) ** 2, rel=0.12)  # all pixels of blurred lamps


def test_beside_following_a_live_source_is_not_searched_again_at_once(course, monkeypatch):
    monkeypatch.setattr("dockpose.tracking.search._BESIDE_S", 1e9)
    search = Search(CAMERA, DOCK, is_live=True)
    found = [search.see(frame.image, n, frame.time_s, Settings()) for n, frame in enumerate(course[:2])]
    assert found[1].found_by == "following"
    assert search._beside is None  # pyright: ignore[reportPrivateUsage]


def test_other_settings_are_a_reason_to_search(course):
    search = Search(CAMERA, DOCK)
    search.see(course[0].image, 0, 0.0, Settings())
    other = Settings(masks=((0.0, 0.0, 5.0, 5.0),))
    assert search.see(course[1].image, 1, 0.1, other).found_by == "search"


def test_of_a_live_source_another_ring_is_noticed_beside_following(course, monkeypatch):
    monkeypatch.setattr("dockpose.tracking.search._BESIDE_S", 0.0)
    search = Search(CAMERA, DOCK, is_live=True)
    found = None
    for number in range(3):
        found = search.see(course[number].image, number, course[number].time_s, Settings())
        if search._beside is not None:  # pyright: ignore[reportPrivateUsage]
            search._beside.join()  # pyright: ignore[reportPrivateUsage]
    assert found.found_by == "following"
    elsewhere = estimate(render(random_scene(5, position_m=(-0.3, 0.1, 1.5)))[0], CAMERA, DOCK)
    monkeypatch.setattr("dockpose.tracking.search.estimate", lambda *arguments: elsewhere)
    search.see(course[3].image, 3, course[3].time_s, Settings())
    search._beside.join()  # pyright: ignore[reportPrivateUsage]
    assert search.see(course[4].image, 4, course[4].time_s, Settings()) is elsewhere
    monkeypatch.undo()
    search.see(course[5].image, 5, course[5].time_s, Settings())
    assert search.see(course[6].image, 6, course[6].time_s, Settings()).found_by == "following"


def test_a_ring_that_may_be_no_dock_is_searched_again_until_it_is_sure(course, monkeypatch):
    search, unsure = Search(CAMERA, DOCK), replace(estimate(course[0].image, CAMERA, DOCK), detection=0.6)
    monkeypatch.setattr("dockpose.tracking.search.estimate", lambda *arguments: unsure)
    search.see(course[0].image, 7, course[0].time_s, Settings())
    followed = [search.see(course[k].image, 7 + k, course[k].time_s, Settings()) for k in (1, 2, 3)]
    assert [each.found_by for each in followed] == ["following"] * 3
    assert max(each.detection for each in followed) <= 0.6
    monkeypatch.undo()
    search.see(course[4].image, 11, course[4].time_s, Settings())
    again = search.see(course[5].image, 20, course[5].time_s, Settings())
    assert again.found_by == "search"
    assert (again.detection or 0.0) > 0.95


@pytest.mark.parametrize("kind", ["colour", "16 bits", "float", "masked"])
def test_pictures_of_other_kinds_are_followed_or_searched(course, kind):
    search = Search(CAMERA, DOCK)
    for number in range(3):
        grey = course[number].image
        image = {
            "colour": np.repeat(grey[:, :, None], 3, axis=2),
            "16 bits": grey.astype(np.uint16) * 256,
            "float": grey / 255,
            "masked": np.ma.array(grey, mask=grey > 300),
        }[kind]
        found = search.see(image, number, course[number].time_s, Settings())
        alone = estimate(image, CAMERA, DOCK)
        assert found.bits == alone.bits
        np.testing.assert_allclose(found.selected.position_m, alone.selected.position_m, atol=1e-3)


def test_after_a_gap_in_which_a_track_is_lost_a_frame_is_searched(course):
    search = Search(CAMERA, DOCK)
    times_s = (0.0, 0.9, 2.0, 2.1)
    found = [
        search.see(frame.image, number, time_s, Settings())
        for number, (frame, time_s) in enumerate(zip(course, times_s, strict=False))
    ]
    assert [each.found_by for each in found] == ["search", "following", "search", "following"]
