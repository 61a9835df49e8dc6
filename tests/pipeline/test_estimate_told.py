"""How an estimate tells itself: in words, as a dictionary, as a table and as a picture."""

# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalCall=false

import builtins
import gc
import json
import math
import pickle
import sys
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.camera.camera import Camera
from dockpose.simulate import render

from tests.support.scenes import CAMERA, DOCK, random_scene


@pytest.fixture(scope="module")
def image():
    return render(random_scene(1))[0]


@pytest.fixture(scope="module")
def found(image):
    return estimate(image, CAMERA, DOCK)


@pytest.fixture(scope="module")
def nothing():
    return estimate(np.zeros((480, 640), np.uint8), CAMERA, DOCK)


def test_in_one_line(found, nothing):
    z_cm = 100 * found.selected.position_m[2]
    assert repr(found).startswith(f"<Estimate ok: 640 x 480, hats level {found.threshold.level}, 10 lights, x ")
    assert f" z {z_cm:.1f} ± " in repr(found)
    assert repr(found).endswith(" deg>")
    assert repr(nothing).startswith("<Estimate no_lights: 640 x 480, hats")
    for one in (found, nothing):
        assert "\n" not in repr(one)
        assert len(repr(one)) < 150


def test_in_a_few_lines_with_units(found, nothing):
    first, a, b = str(found).splitlines()
    assert first == found.message
    x, y, z = (f"{100 * value:.1f}" for value in found.selected.position_m)
    assert a.startswith("A (100 %, chosen): ")
    assert f"x {x} y {y} z {z} ± " in a
    assert " cm, theta x " in a
    assert b.startswith("B (0 %): x ")
    assert str(nothing) == nothing.message


def test_to_dict_is_what_json_takes_with_the_keys_of_the_command(found, nothing):
    assert json.loads(json.dumps(found.to_dict())) == found.to_dict()
    assert list(found.to_dict()) == list(nothing.to_dict())
    assert {"schema", "status", "candidates", "selected", "chosen", "threshold"} <= set(found.to_dict())


@pytest.mark.extra
def test_to_frame_of_no_dock_is_one_row_and_tables_fit_together(found, nothing):
    import pandas  # pyright: ignore[reportMissingImports]

    table = nothing.to_frame()
    assert table["status"].tolist() == ["no_lights"]
    assert table["z_m"].isna().all()
    assert not table["selected"].any()
    assert list(table) == list(found.to_frame())
    assert list(table.dtypes) == list(found.to_frame().dtypes)
    assert len(pandas.concat([found.to_frame(), table])) == 3


def test_rows_of_a_table_have_the_same_columns_whatever_was_found(found, nothing, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=list))  # a table is these rows
    rows, (empty,) = found.to_frame(), nothing.to_frame()
    assert [list(row) for row in rows] == [list(empty)] * 2
    for row, pose in zip(rows, found.candidates, strict=True):
        for kind in ("sigma", "sigma_total"):
            place, angle = getattr(pose, f"{kind}_position_m"), getattr(pose, f"{kind}_theta_rad")
            assert [row[f"{kind}_{axis}_m"] for axis in "xyz"] == list(place)
            assert [row[f"{kind}_theta_{axis}_deg"] for axis in "xy"] == pytest.approx(np.degrees(angle))
        assert [row[f"{axis}_m"] for axis in "xyz"] == list(pose.position_m)
        assert row["theta_y_deg"] == pytest.approx(math.degrees(pose.theta_y_rad))
        assert row["selected"] == (pose is found.selected)
        assert (row["status"], row["level"], row["detection"]) == ("ok", found.threshold.level, found.detection)
    assert [(row["pose"], row["lights_on_ring"]) for row in rows] == [("A", 10), ("B", 10)]
    assert (empty["status"], empty["pose"], empty["selected"], empty["lights_on_ring"]) == ("no_lights", "", False, 0)
    told = {"status", "pose", "selected", "method", "level", "lights_on_ring", "elapsed_ms", "message"}
    assert all(math.isnan(value) for key, value in empty.items() if key not in told)
    few = replace(found, choice=replace(found.choice, candidates=found.candidates[:1]))
    assert [row["pose"] for row in few.to_frame()] == ["A"]


def test_to_frame_without_pandas_is_one_sentence(found, monkeypatch):
    real = builtins.__import__

    def without_pandas(name, *rest, **more):
        if name == "pandas":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without_pandas)
    with pytest.raises(ValueError, match=r"^to_frame\(\) needs pandas: pip install pandas$"):
        found.to_frame()


def test_the_picture_is_drawn_where_the_lights_are(image, found):
    drawn = found.draw()
    assert drawn.shape == (480, 640, 3)
    assert (cv2.imdecode(np.frombuffer(found._repr_png_(), np.uint8), cv2.IMREAD_COLOR) == drawn).all()
    is_grey = (drawn == drawn[:, :, :1]).all(axis=2)
    untouched = is_grey & (np.indices(image.shape)[0] > 70)
    assert (drawn[untouched][:, 0] == image[untouched]).mean() > 0.99
    points = found.markers.points_px[found.ring.on_ring]
    radii = np.clip(2 * np.sqrt(found.markers.areas_px[found.ring.on_ring] / np.pi), 6, 24)
    for (x, y), radius in zip(points, radii, strict=True):
        part = drawn[round(y), round(x + radius) - 1 : round(x + radius) + 2].astype(int)
        assert (np.ptp(part, axis=1) > 40).any()  # something coloured where the circle goes


def test_the_drawing_does_not_keep_the_picture_alive(image):
    own = image.copy()
    found = estimate(own, CAMERA, DOCK)
    assert found.picture() is own
    with_picture = found.draw()
    del own
    gc.collect()
    assert found.picture() is None
    without = found.draw()
    assert without.shape == with_picture.shape
    assert without.mean() < with_picture.mean()


def test_of_a_file_it_is_read_again_and_a_file_that_is_gone_is_black(image, tmp_path):
    path = tmp_path / "tank.png"
    cv2.imwrite(str(path), image)
    found = estimate(path, CAMERA, DOCK)
    assert (found.picture() == image).all()
    before = found.draw()
    path.unlink()
    assert found.draw().mean() < before.mean()


def test_a_large_picture_is_drawn_smaller(image):
    large = cv2.resize(image, None, fx=4, fy=4)
    drawn = estimate(large, CAMERA.for_size(2560, 1920), DOCK).draw()
    assert drawn.shape == (900, 1200, 3)


def test_16_bits_colours_and_a_lens_are_drawn_too(image):
    lens = Camera(700, 700, 319.5, 239.5, 640, 480, distortion=(-0.2, 0.05, 0, 0))
    for one in (image.astype(np.uint16) << 8, np.dstack([image] * 3)):
        assert estimate(one, lens, DOCK, Settings(method="otsu")).draw().shape == (480, 640, 3)


def test_a_pickled_estimate_is_the_same_without_the_picture(found):
    again = pickle.loads(pickle.dumps(found))
    assert again.picture is None
    assert (str(again), repr(again)) == (str(found), repr(found))
    assert again.to_dict() == found.to_dict()
    assert again.draw().shape == (480, 640, 3)
