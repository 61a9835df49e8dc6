# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false

import json
import math

import numpy as np
import pytest
from dockpose import Dock, estimate
from dockpose.files import FileError
from dockpose.labels import is_labels, labels_of, read_labels
from dockpose.sidecar import load_dock, sample_path

IMAGES = [{"id": 7, "file_name": "some/folder/a.png"}, {"id": "b", "file_name": "b.png"}]


def written(tmp_path, annotations, images=IMAGES):
    path = tmp_path / "labels.json"
    path.write_text(json.dumps({"images": images, "annotations": annotations, "categories": []}))
    return path


def test_keypoints_are_the_lights_of_the_picture_that_they_name_and_hidden_ones_are_left_out(tmp_path):
    keypoints = [1.5, 2.25, 2, 30, 40, 1, 0, 0, 0, 5, 6, 2]
    path = written(tmp_path, [{"image_id": 7, "keypoints": keypoints}, {"image_id": "b", "segmentation": []}])
    assert is_labels(path)
    (name, lights), *others = read_labels(path).items()
    assert (name, lights.lights_px, lights.snap, others) == ("a.png", ((1.5, 2.25), (5.0, 6.0)), False, [])


@pytest.mark.parametrize(
    ("annotations", "words"),
    [
        ([], "has no keypoints"),
        ([{"image_id": 7}], "has no keypoints"),
        ([{"image_id": 8, "keypoints": [1, 2, 2]}], "an annotation is of image 8, which is not in the file"),
        ([{"image_id": 7, "keypoints": [1, 2, 2, 3]}], r"a\.png has 4 numbers of keypoints"),
        ([{"image_id": 7, "keypoints": [1, 2, 2]}] * 2, r"a\.png has two rings of keypoints"),
        ([{"image_id": 7, "keypoints": ["x", 2, 2]}], "is not COCO's labels"),
        ("none", "is not COCO's labels"),
    ],
)
def test_labels_that_cannot_be_read_are_refused_with_their_file(tmp_path, annotations, words):
    with pytest.raises(FileError, match=rf"labels\.json: .*{words}"):
        read_labels(written(tmp_path, annotations))


@pytest.mark.parametrize("is_told", [True, False])
def test_what_was_found_is_read_again_as_it_was_in_ring_order(tmp_path, is_told):
    found = {name: estimate(sample_path(name)) for name in ("plain", "missing", "tilted")}
    if not is_told:
        for name, one in found.items():
            dock = Dock(load_dock(sample_path(name).with_suffix(".yaml")).diameter)
            found[name] = estimate(sample_path(name), one.camera, dock)
    path = tmp_path / "labels.json"
    path.write_text(json.dumps(labels_of((f"{name}.png", one) for name, one in found.items())))
    content, again = json.loads(path.read_text()), read_labels(path)
    assert len(content["categories"][0]["keypoints"]) == 10
    for (name, one), annotation in zip(found.items(), content["annotations"], strict=True):
        lights = one.markers.points_px[one.ring.on_ring]
        places = np.array(again[f"{name}.png"].lights_px)
        assert annotation["num_keypoints"] == len(lights) == len(places)
        assert len(annotation["keypoints"]) == 30
        assert max(np.linalg.norm(lights - place, axis=1).min() for place in places) < 1e-6
        x, y = (places - places.mean(axis=0)).T
        turns = np.diff(np.unwrap(np.arctan2(y, x)))
        assert (turns > 0).all()  # from one to the next clockwise, as y grows downwards
        assert turns.sum() < 2 * math.pi
    if is_told:
        hidden = np.array(content["annotations"][1]["keypoints"]).reshape(-1, 3)[:, 2]
        assert sorted(hidden) == [0] * 4 + [2] * 6  # three are dead and one is hidden


def test_a_picture_without_a_dock_is_listed_and_has_no_annotation(tmp_path):
    one = estimate(np.zeros((480, 640), np.uint8), estimate(sample_path("plain")).camera, Dock(0.3))
    labels = labels_of([("dark.png", one)])
    assert (len(labels["images"]), labels["annotations"], labels["categories"][0]["keypoints"]) == (1, [], [])
