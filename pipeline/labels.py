"""Lights of many pictures in one file: keypoints as COCO has them (Lin et al. 2014; cocodataset.org, data format).

Places are in pixels of the decoded picture, pixel centres at integers.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import msgspec
import numpy as np
from dockpose.estimate.result import Estimate
from dockpose.files import MOST_BYTES, FileError, read_small
from dockpose.lights.by_hand import ByHand

_FOUND = 2  # visibility of a keypoint that is labelled and seen
_Id: TypeAlias = int | str


class _Image(msgspec.Struct):
    id: _Id
    file_name: str


class _Annotation(msgspec.Struct):
    image_id: _Id
    keypoints: Annotated[list[float], msgspec.Meta(min_length=3)] | None = None  # x, y and visibility of each


class _Labels(msgspec.Struct):
    images: list[_Image]
    annotations: list[_Annotation]


def is_labels(path: str | Path) -> bool:
    """Whether a file may hold lights of many pictures. Raises FileError where it cannot be read."""
    return b'"annotations"' in read_small(path, MOST_BYTES)


def read_labels(path: str | Path) -> dict[str, ByHand]:
    """Read the lights of each picture, by its file name, from keypoints as COCO has them.

    Keypoints that are hidden or not labelled are left out. Raises FileError for none, or two docks in a picture.
    """
    try:
        labels = msgspec.json.decode(read_small(path, MOST_BYTES), type=_Labels)
    except msgspec.DecodeError as error:
        raise FileError(f"{path}: is not COCO's labels: {error}") from error
    names = {one.id: Path(one.file_name).name for one in labels.images}
    lights: dict[str, ByHand] = {}
    for one in labels.annotations:
        if one.keypoints is None:
            continue
        name, triples = names.get(one.image_id), np.array(one.keypoints)
        if name is None:
            raise FileError(f"{path}: an annotation is of image {one.image_id}, which is not in the file")
        if name in lights:
            raise FileError(f"{path}: {name} has two rings of keypoints; one dock in a picture is read")
        if len(triples) % 3:
            raise FileError(f"{path}: {name} has {len(triples)} numbers of keypoints; there must be three of each")
        seen = triples.reshape(-1, 3)[triples[2::3] == _FOUND, :2]
        lights[name] = ByHand(tuple((x, y) for x, y in seen.tolist()))
    if not lights:
        raise FileError(f"{path}: has no keypoints")
    return lights


def labels_of(pictures: Iterable[tuple[str, Estimate]]) -> dict[str, Any]:
    """Return the lights found in pictures, by file name, as COCO's keypoints: in ring order, visible where found."""
    images, found = list[dict[str, Any]](), list[tuple[int, np.ndarray]]()
    for number, (name, one) in enumerate(pictures, 1):
        images.append({"id": number, "file_name": name, "width": one.width, "height": one.height})
        if one.ring is not None and one.markers is not None and one.status == "ok":
            found.append((number, _in_ring_order(one)))
    most = max((len(points) for _, points in found), default=0)
    names = [f"light {light + 1}" for light in range(most)]
    edges = [[light + 1, (light + 1) % most + 1] for light in range(most)]
    return {
        "images": images,
        "annotations": [_annotation(number, image, points, most) for number, (image, points) in enumerate(found, 1)],
        "categories": [{"id": 1, "name": "dock", "supercategory": "", "keypoints": names, "skeleton": edges}],
    }


def _in_ring_order(found: Estimate) -> np.ndarray:
    """Places (N, 2) of a dock's lights by their numbers, NaN of those that were not found; else around the ring."""
    assert found.markers is not None
    assert found.ring is not None
    points = found.markers.points_px[found.ring.on_ring]
    numbers = [light for light, on_ring in zip(found.light_numbers(), found.ring.on_ring, strict=True) if on_ring]
    if None in numbers or found.dock.lights is None:
        x, y = (points - points.mean(axis=0)).T
        return points[np.argsort(np.arctan2(y, x) % (2 * math.pi))]
    places = np.full((found.dock.lights, 2), np.nan)
    places[np.array(numbers, dtype=int)] = points
    return places


def _annotation(number: int, image: int, points: np.ndarray, most: int) -> dict[str, Any]:
    """One dock: its keypoints and the box around them."""
    seen = points[np.isfinite(points[:, 0])]
    keypoints = np.zeros((most, 3))
    keypoints[: len(points)][np.isfinite(points[:, 0])] = np.column_stack([seen, np.full(len(seen), _FOUND)])
    (left, top), (right, bottom) = seen.min(axis=0).tolist(), seen.max(axis=0).tolist()
    return {
        **{"id": number, "image_id": image, "category_id": 1, "iscrowd": 0, "num_keypoints": len(seen)},
        "keypoints": [value for x, y, flag in keypoints.tolist() for value in (x, y, int(flag))],
        **{"bbox": [left, top, right - left, bottom - top], "area": (right - left) * (bottom - top)},
    }
