"""The picture, what was found in it, and its histogram, as numbers that static/picture.js and histogram.js draw."""

import base64
import itertools
import math
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import length_words
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.comparison import histogram_in
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.web.choices import Change, Client
from dockpose.app.web.live import Acts, RequestBox, data_html, request_to
from dockpose.app.web.page import Page
from dockpose.app.web.panels.set_lights import SetLights
from dockpose.app.web.widgets import Panel
from dockpose.camera.image import to_levels
from dockpose.estimate import geometry
from dockpose.estimate.canvas import to_bgr8
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose
from dockpose.thresholds import LEVELS, Histogram, Threshold
from dockpose.thresholds.hats import hats

_JPEG_QUALITY = 85
_LEAST_GROUPS = 10  # that the histogram's axis has
_MOST_PIXELS = 24_000_000  # a larger picture is sent smaller
_OUTLINE_STEP = 2  # of the points on the ellipse, every second: a hundredth of a pixel off
_GROUP = ("at", "radius", "onRing", "label", "outward", "box")  # what is sent of each group of pixels
_COLOURS = {
    "light": colours.LIGHT_COLOUR,
    "dropped": colours.DROPPED_COLOUR,
    "small": colours.NOISE_COLOUR,
    "ellipse": colours.ELLIPSE_COLOUR,
    "mask": colours.MASK_COLOUR,
    "pose": colours.POSE_COLOURS[0],
    "pose-a": colours.POSE_COLOURS[0],
    "pose-b": colours.POSE_COLOURS[1],
    "truth": colours.TRUTH_COLOUR,
    "threshold": colours.THRESHOLD_COLOUR,
    "peaks": colours.PEAKS_COLOUR,
    "groups": colours.GROUPS_COLOUR,
    "bars": colours.BARS_COLOUR,
    "kept": colours.ORANGE,
}
LOOK = "; ".join(f"--{name}: {colour}" for name, colour in _COLOURS.items())  # of our elements, for their style sheet


class PicturePanel(Panel):
    """The picture with its histogram."""

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._serials, self._picture_serial = itertools.count(1), 0
        self._sent: np.ndarray | None = None
        self._is_exact = False
        self._numbers, self._histogram, self._lights, self._truth = HistogramNumbers(), {}, {}, {}
        self._hand = SetLights(app)
        acts: Acts = {**acts_in_picture(self.change), **self._hand.acts}
        requests = RequestBox(self.gui, "Done in the picture", acts)
        self.gui.add_html(f'<dockpose-picture channel="{requests.channel}" style="{LOOK}"></dockpose-picture>')
        self.gui.add_html(f'<dockpose-histogram style="{LOOK}"></dockpose-histogram>')
        self._picture = self.gui.add_html("")
        self._hand.begin()

    def show(self, analysis: Analysis) -> None:
        """Send the picture if it has changed, and put what was found in it."""
        last, self.analysis = self.analysis, analysis
        image, is_playing = analysis.view.image, self.app.is_playing
        if image is not self._sent or not (self._is_exact or is_playing):
            self._sent, self._is_exact, self._picture_serial = image, not is_playing, next(self._serials)
            self._picture.content = data_html("picture", picture_data(image, self._picture_serial, self._is_exact))
        if last is None or not _has_same_lights(last.estimate, analysis.estimate):
            self._lights = lights_numbers(analysis.estimate)
        if last is None or _truth_of(last) != _truth_of(analysis):
            self._truth = truth_numbers(analysis)
        numbers = self._lights | self._truth | pose_numbers(analysis)
        self.app.live.put(picture=self._picture_serial, overlay=numbers, isPlaying=is_playing)
        self._hand.show(analysis, self._picture_serial)
        histogram = self._numbers.of(analysis, is_playing=is_playing)
        if histogram is not None and histogram != self._histogram:
            self._histogram = histogram
            self.app.live.put(histogram=histogram | {"serial": next(self._serials)})


def acts_in_picture(change: Change) -> Acts:
    """What is done for a mask that was drawn, in pixels, and for a level to which the threshold was dragged."""

    def mask(request: Any, client: Client) -> None:
        change(lambda view: with_mask(view, request.x, request.y, request.width, request.height), client, reload=True)

    def level(request: Any, client: Client) -> None:
        change(lambda view: with_method(view, "fixed", request.level), client, reload=True)

    return {
        request_to("mask", x=float, y=float, width=float, height=float): mask,
        request_to("level", level=int): level,
    }


def picture_data(image: np.ndarray, serial: int, is_exact: bool) -> dict[str, Any]:
    """Return a picture as sent: without loss as a PNG where ``is_exact``, or else smaller and faster as a JPEG."""
    pixels = to_levels(image)[0] if image.ndim == 2 else to_bgr8(image)
    height, width = pixels.shape[:2]
    step = math.ceil(math.sqrt(width * height / _MOST_PIXELS))
    if step > 1:
        pixels = cv2.resize(pixels, (-(-width // step), -(-height // step)), interpolation=cv2.INTER_AREA)
    options = [] if is_exact else [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
    data = cv2.imencode(".png" if is_exact else ".jpg", pixels, options)[1]
    return {
        "serial": serial,
        "width": width,
        "height": height,
        "type": "image/png" if is_exact else "image/jpeg",
        "isExact": is_exact and step == 1 and (image.ndim == 2 or image.dtype == np.uint8),
        "data": base64.b64encode(data.tobytes()).decode(),
    }


def lights_numbers(found: Estimate) -> dict[str, Any]:
    """Return what is drawn of the lights, whichever the poses."""
    outline, threshold = geometry.outline(found), found.threshold
    kept = None if threshold is None else threshold.kept
    return {
        "level": LEVELS if threshold is None else threshold.level,
        "kept": None if kept is None else runs(kept[0].index),
        "levels": None if kept is None else levels_of_lights(kept[0].level, kept[1]),
        "groups": _groups(found),
        "outline": None if outline is None else _points(outline[::_OUTLINE_STEP]),
        "small": None if found.markers is None else [found.markers.dropped, found.settings.min_area_px],
    }


def pose_numbers(analysis: Analysis) -> dict[str, Any]:
    """Return what else is drawn, of the poses above all."""
    found, tracked = analysis.estimate, analysis.tracked_frame
    (ellipse, centre), bar = geometry.centres(found), geometry.scale_bar(found)
    return {
        "name": analysis.view.source,
        "frame": None if tracked is None else tracked.frame.index + 1,
        "ellipse": None if ellipse is None else _points([ellipse])[0],
        "centre": None if centre is None or not np.isfinite(centre).all() else _points([centre])[0],
        "extra": _points(geometry.extra_seen(found)[0]),
        "poses": [_pose(*named, found) for named in zip(POSE_NAMES, found.candidates, strict=False)],
        "dockRadius": found.dock.radius,
        "masks": [list(mask) for mask in found.settings.masks],
        "byHand": None if found.by_hand is None else msgspec.to_builtins(found.by_hand),
        "cmPerPx": None if bar is None else 100 * bar[0] / bar[1],
        "scale": None if bar is None else {"words": length_words(bar[0]), "px": bar[1]},
    }


def truth_numbers(analysis: Analysis) -> dict[str, Any]:
    """Return what is drawn of the true pose, where it is known."""
    truth = analysis.view.truth
    return {"truth": None if truth is None else _pose("Truth", truth, analysis.estimate)}


def _pose(name: str, pose: CirclePose | KnownPose, found: Estimate) -> dict[str, Any]:
    outline, axes, normal = geometry.pose_lines(pose, found)
    return {
        "place": np.round([*pose.position_m, *-pose.rotation[:, 2]], 4).tolist(),
        "name": name,
        "chosen": pose is found.selected,
        "outline": _points(outline),
        "axes": [_points(ends) for ends in axes],
        "normal": _points(normal),
        "extra": _points(geometry.extra_expected(pose, found)),
    }


def _groups(found: Estimate) -> list[dict[str, Any]]:
    if found.markers is None:
        return []
    count = len(found.markers)
    labels, outward = [""] * count, np.zeros((count, 2))
    for index, label, way in geometry.light_labels(found):
        labels[index], outward[index] = label, way
    radii = np.round(geometry.light_radii(found), 2).tolist()
    places = _points(found.markers.points_px), radii, geometry.on_ring(found).tolist()
    is_group = ~geometry.extra_seen(found)[1]
    parts = zip(*places, labels, _points(outward), found.markers.boxes_px.astype(int).tolist(), strict=True)
    return [dict(zip(_GROUP, part, strict=True)) for part in itertools.compress(parts, is_group)]


def levels_of_lights(levels: np.ndarray, lights: np.ndarray) -> list[int]:
    """Return the level of each light, in order: the lowest of its pixels' (n,), by the light (n,) that each is of."""
    lowest = np.full(int(lights.max(initial=-1)) + 1, LEVELS)
    np.minimum.at(lowest, lights, levels)
    return np.sort(lowest[lowest < LEVELS]).tolist()


def runs(indices: np.ndarray) -> list[list[int]]:
    """Return the first and the number of each run of consecutive numbers."""
    numbers = np.sort(indices)
    if len(numbers) == 0:
        return []
    pieces = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1)
    return [[int(piece[0]), len(piece)] for piece in pieces]


def _points(points: Any) -> list[list[float]]:
    """Return points (N, 2) as lists, to a hundredth of a pixel; what is not finite is left out."""
    array = np.asarray(points, dtype=float)
    return np.round(array[np.isfinite(array).all(axis=1)], 2).tolist()


def _truth_of(analysis: Analysis) -> tuple[Any, ...]:
    return analysis.view.truth, analysis.view.dock, analysis.view.camera


def _has_same_lights(one: Estimate, other: Estimate) -> bool:
    """Whether the lights of two estimates are drawn alike: they share a ring, and no port bends the ellipse."""
    is_same = one.ring is other.ring is not None and one.ellipse is other.ellipse and one.camera is other.camera
    return is_same and one.camera.port is None and one.light_numbers() == other.light_numbers()


class HistogramNumbers:
    """Makes the numbers; those that only another picture or other masks change are kept meanwhile."""

    def __init__(self) -> None:
        self._known: tuple[Any, ...] = ()
        self._histogram: Histogram | None = None
        self._curve: Threshold | None = None
        self._numbers: dict[str, Any] = {}

    def of(self, analysis: Analysis, *, is_playing: bool) -> dict[str, Any] | None:
        """Return the numbers; None where no threshold was reached."""
        threshold, settings = analysis.estimate.threshold, analysis.estimate.settings
        if threshold is None:
            return None
        known = analysis.view.image, settings.masks, settings.min_area_px
        histogram, curve = self._histogram, self._curve
        if histogram is None or known[0] is not self._known[0] or known[1:] != self._known[1:]:
            histogram, curve = histogram_in(analysis.view, analysis.estimate), None
        if (threshold.groups_at_level >= 0).any():
            curve = threshold
        elif curve is None and not is_playing and histogram.counts.any():
            curve = hats(histogram, settings.min_area_px)
        if histogram is not self._histogram or curve is not self._curve:
            self._numbers = histogram_numbers(histogram.counts, curve)
        self._known, self._histogram, self._curve = known, histogram, curve
        return self._numbers


def histogram_numbers(counts: np.ndarray, curve: Threshold | None) -> dict[str, Any]:
    """Return the pixels of each level, and what ``curve`` says of the groups that each leaves, -1 where unknown."""
    peaks = () if curve is None else curve.peaks
    return {
        "counts": counts.tolist(),
        "groups": [-1] * LEVELS if curve is None else curve.groups_at_level.tolist(),
        "groupsTop": groups_top(curve),
        "peaks": [{"level": peak.level, "groups": peak.groups, "votes": peak.votes} for peak in peaks],
    }


def groups_top(curve: Threshold | None) -> int:
    """Return the end of the axis of groups: twice those at the curve's level, in tens; far more below is noise."""
    at_level = int(curve.groups_at_level[curve.level]) if curve is not None and curve.level < LEVELS else 0
    return max(_LEAST_GROUPS, 10 * math.ceil(2 * at_level / 10))
