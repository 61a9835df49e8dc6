from dataclasses import replace

import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.losses import Losses, losses, ranks
from dockpose.lights.markers import Markers
from msgspec.structs import replace as changed


def with_groups(found, points, areas):
    count = len(points)
    shown = np.full(count, 200)
    return replace(found, markers=Markers(np.array(points, float), np.array(areas), shown))


@pytest.fixture
def right(view):
    return analyse(view).estimate


def test_lights_that_are_missed_joined_and_strays_are_counted(view, right):
    lights = right.markers.points_px[right.ring.on_ring]
    between = (lights[0] + lights[1]) / 2
    apart = np.linalg.norm(lights[0] - lights[1])
    # A group over the first two, one on each of four more, and one in a corner: four of ten are missed.
    points = [between, *lights[2:6], [1.0, 1.0]]
    areas = [np.pi * apart**2 / 4 + 20, *[50] * 4, 9]
    other = with_groups(right, points, areas)
    assert losses({"one": right, "other": other}, right)["other"] == Losses(10, 4, 2, 1)
    assert losses({"one": right, "other": other}, right)["one"] == Losses(10, 0, 0, 0)


def test_of_a_scene_its_own_lights_count_though_no_method_found_a_dock(view, right):
    nothing = replace(right, status="no_lights", choice=None, ring=None)
    assert losses({"none": nothing}, nothing, view.scene)["none"] == Losses(10, 0, 0, 0)
    dead = changed(view.scene, lights=changed(view.scene.lights, missing=(0, 3)))
    assert losses({"none": nothing}, nothing, dead)["none"] == Losses(8, 0, 0, 2)


def test_words():
    assert Losses(10, 2, 4, 1).in_words() == "10 lights: 2 missed, 4 run together; 1 stray"
    assert Losses(8, 0, 0, 0).in_words() == "8 lights: all apart; 0 strays"


def test_methods_that_are_right_come_first_and_none_of_no_dock_last(view, right):
    nothing = replace(right, status="no_lights", choice=None, ring=None)
    moved = replace(view, truth=None)
    found = {"none": nothing, "right": right}
    assert list(ranks(found, view).items()) == list(ranks(found, moved).items()) == [("right", 1), ("none", 2)]
    assert losses({"none": nothing}, nothing) == {}


def test_results_that_the_picture_cannot_tell_apart_share_a_rank_in_their_order(view, right):
    sigma_m = right.selected.sigma_total_position_m[2]
    ahead = right.selected.position_m / np.linalg.norm(right.selected.position_m)

    def off(sigmas, rms_px):
        pose = replace(right.selected, position_m=right.selected.position_m + sigmas * sigma_m * ahead, rms_px=rms_px)
        candidates = tuple(pose if one is right.selected else one for one in right.choice.candidates)
        return replace(right, choice=replace(right.choice, candidates=candidates))

    found = {"first": off(0.4, 0.3), "far": off(0.6, 0.2), "best": off(0, 0.1)}
    assert list(ranks(found, view).items()) == [("first", 1), ("best", 1), ("far", 2)]
    other = replace(right, choice=replace(right.choice, selected=1 - right.choice.selected))
    assert ranks({"one": right, "other": other}, replace(view, truth=None))["other"] == 2
