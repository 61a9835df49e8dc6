import numpy as np
from dockpose.paper.lights.scenes import draw_scene, draw_scenes
from dockpose.simulate import truth_of


def test_a_seed_gives_its_scenes_again_and_another_one_others():
    scenes = draw_scenes(5, 1)
    assert [hard for hard, _ in scenes] == [False, True]
    assert draw_scenes(5, 1) == scenes
    assert draw_scene(scenes[1][1].seed, hard=True) == scenes[1][1]
    assert len({scene.seed for _, scene in [*scenes, *draw_scenes(6, 1)]}) == 4


def test_plain_scenes_have_no_trouble_and_every_light_in_view():
    for _, scene in draw_scenes(1, 3)[:3]:
        assert not scene.texts
        assert scene.mirror is None
        assert scene.snow is None
        assert scene.sensor.jpeg_quality is None
        truth = truth_of(scene)
        assert truth.visible.all()
        assert truth.position_m[2] <= 3
        assert -truth.normal[2] >= np.cos(np.radians(40)) - 1e-9
