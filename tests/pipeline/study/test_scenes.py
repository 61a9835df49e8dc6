from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose.study.judge import OUTCOMES
from dockpose.study.scenes import ELAPSED, PRODUCT, as_text, find, methods, scene_rows


def untimed(rows):
    return [{name: as_text(value) for name, value in row.items() if name != ELAPSED} for row in rows]


@pytest.fixture(scope="module")
def rows():
    return scene_rows(1, 3)


def test_a_row_for_each_method_with_the_same_factors(rows):
    assert [row["method"] for row in rows] == methods()
    for name in ("scene", "seed", "range_m", "lit_share", "lights", "tilt_deg"):
        assert len({row[name] for row in rows}) == 1
    assert {row["outcome"] for row in rows} <= set(OUTCOMES)


def test_the_same_scene_gives_the_same_rows(rows):
    assert untimed(scene_rows(1, 3)) == untimed(rows)


def test_the_product_is_hats_with_its_fall_back(monkeypatch):
    asked = {}
    monkeypatch.setattr(
        "dockpose.study.scenes.estimate", lambda image, camera, dock, settings, fall_back: (settings.method, fall_back)
    )
    for label in methods():
        picture: Any = SimpleNamespace(image=None, scene=SimpleNamespace(camera=None, dock=None))
        asked[label] = find(label, picture)
    assert asked.pop(PRODUCT) == ("hats", True)
    assert asked == {label: (label, False) for label in methods()[1:]}
    assert "hats" in asked
    assert "fixed" not in asked


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (float("nan"), ""), (True, "1"), (np.False_, "0"), (3, "3"), (1 / 3, "0.333333"), ("ok", "ok")],
)
def test_values_as_text(value, text):
    assert as_text(value) == text
