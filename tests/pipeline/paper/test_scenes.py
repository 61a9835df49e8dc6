import numpy as np
from dockpose.paper.scenes import draw_scene, draw_scenes
from dockpose.simulate import truth_of


def test_a_seed_gives_its_scenes_again_and_another_one_others():
    plain, hard = draw_scenes(5, 1)
    assert draw_scenes(5, 1) == [plain, hard]
    assert draw_scene(hard.scene.seed, hard=True) == hard
    assert draw_scene(hard.scene.seed, hard=False) != hard
    assert len({one.scene.seed for one in [plain, hard, *draw_scenes(6, 1)]}) == 4


def test_plain_scenes_have_no_trouble_and_every_light_in_view():
    plain, hard = np.split(np.array(draw_scenes(1, 12), dtype=object), 2)
    for one in plain:
        scene, truth = one.scene, truth_of(one.scene)
        assert (scene.texts, scene.mirror, scene.snow, scene.sensor.jpeg_quality) == ((), None, None, None)
        assert truth.visible.all()
        assert truth.position_m[2] <= 3
        assert -truth.normal[2] >= np.cos(np.radians(40)) - 1e-9
        assert 100 <= one.brightest <= 1000
    for part in ("texts", "mirror", "snow"):
        assert any(getattr(one.scene, part) for one in hard)
