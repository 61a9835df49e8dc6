"""Threshold methods judged over pictures whose lights are known, by hand or since they are simulated."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from statistics import median

import numpy as np
from dockpose import Estimate
from dockpose.app.processing.analysis import Analysis, analyse
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare
from dockpose.app.processing.losses import Losses, lost_of
from dockpose.app.state.view import View
from dockpose.paper.rivals import NAMES
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose, PoseError, pose_error
from dockpose.thresholds import METHODS

HEAD = ("method", "pictures", "lights found", "run together", "strays", "exactly the lights")
HEAD += ("docks found", "poses right", "off (mm)", "off (deg)")


@dataclass(frozen=True)
class Known:
    """Where the lights of a picture are (N, 2), in pixels, and the dock's pose, if it is known."""

    lights_px: np.ndarray
    pose: KnownPose | None


@dataclass(frozen=True)
class Judged:
    """What a method made of a picture."""

    picture: str
    method: str
    level: int | None
    lost: Losses
    status: str
    error: PoseError | None  # None without a dock, or where its pose is not known


def known_by_hand(found: Estimate) -> Known | None:
    """What is known of a picture whose lights somebody has set; None of others."""
    if found.by_hand is None or found.markers is None or not len(found.markers):
        return None
    pose = found.selected
    return Known(found.markers.points_px, None if pose is None else _known(pose))


def _known(pose: CirclePose) -> KnownPose:
    x, y, z = (float(one) for one in pose.position_m)
    return KnownPose((x, y, z), math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad))


def judged_by(analysis: Analysis) -> View:
    """Return the view with the pose of lights that were set by hand for its truth, where no other is known."""
    known = known_by_hand(analysis.estimate)
    is_needed = known is not None and known.pose is not None and analysis.view.known_pose is None
    return replace(analysis.view, truth=known.pose) if known is not None and is_needed else analysis.view


def judged_views(views: Iterable[View], progress: Progress) -> list[Judged]:
    """Judge every method on the pictures whose lights are set, by these."""
    rows = list[Judged]()
    for view in progress.over([view for view in views if view.set_lights is not None]):
        known = known_by_hand(analyse(view).estimate)
        if known is not None:
            found = compare(view.image, view.camera, view.dock, view.settings)
            rows += judged(view.source, found, known)
    return rows


def judged(picture: str, found: Mapping[str, Estimate], known: Known) -> Iterator[Judged]:
    """Judge each method's estimate of a picture."""
    for method, one in found.items():
        level = None if one.threshold is None else one.threshold.level
        error = pose_error(one.selected, known.pose)
        yield Judged(picture, method, level, lost_of(one, known.lights_px), one.status, error)


def summary(rows: Iterable[Judged]) -> list[tuple[str, ...]]:
    """Return a row for each method under ``HEAD``: sums over the pictures, and medians of how far poses are off."""
    of: dict[str, list[Judged]] = {}
    for row in rows:
        of.setdefault(row.method, []).append(row)
    return [(NAMES.get(method, METHODS[method].label), *_cells(mine)) for method, mine in of.items()]


def _cells(rows: list[Judged]) -> Iterator[str]:
    lights = sum(row.lost.lights for row in rows)
    errors = [row.error for row in rows if row.error is not None]
    yield str(len(rows))
    yield f"{lights - sum(row.lost.missed for row in rows)} of {lights}"
    yield str(sum(row.lost.joined for row in rows))
    yield str(sum(row.lost.strays for row in rows))
    yield str(sum(row.lost.missed == row.lost.joined == row.lost.strays == 0 for row in rows))
    yield str(sum(row.status == "ok" for row in rows))
    yield str(sum(error.agrees for error in errors))
    yield f"{1000 * median(error.distance_m for error in errors):.1f}" if errors else "-"
    yield f"{math.degrees(median(error.angle_rad for error in errors)):.1f}" if errors else "-"
