"""Docks of several rings: which of them a picture shows, and one pose of the dock by all of these."""

import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock, DockRing
from dockpose.estimate.result import Estimate
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError
from dockpose.lights.ring import Ring
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose
from dockpose.pose.detection import detection_of, found_in_words, judged, why_no_dock
from dockpose.pose.fixed import fixed_to
from dockpose.pose.refine import light_rays, on_planes
from dockpose.pose.solve import find_poses
from dockpose.pose.uncertainty import KnownErrors, PoseErrors
from dockpose.settings import Settings

_OUT = np.array([0.0, 0.0, -1.0])
_NEAR = 0.08  # of a ring's radius: how far off its circle its lights may be, by the pose of another ring
_SHARE = 0.5  # of a ring's lights that must be there, and four of them, for it to be seen beside another
_APART_PX, _EDGE_PX = 8.0, 4.0  # lights that are nearer to each other or to the edge are not missed where not seen
# Errors of two rings' poses that their own do not show: lights slightly out of place.
_LEAST_RAD, _LEAST_SHARE = math.radians(0.2), 1e-3
_GATE = 36.0  # squared Mahalanobis distance, of six numbers, within which two rings are of one dock
_MOST_ODDS = 20.0  # of one candidate against the other, by what another ring says
_COMPLETE, _EXACT_PX = 0.75, 1.0  # share of its lights, and their residual, of a ring that no other level betters


@dataclass(frozen=True)
class _Seen:
    """Rings of one dock that a picture shows together, first the one by which the others were found."""

    dock: Dock
    rings: tuple[tuple[DockRing, Estimate], ...]
    missed: int  # lights of others that should be in view, and are not

    @property
    def lights(self) -> int:
        """How many lights speak for it, less those that speak against it."""
        return sum(one.lights_on_ring or 0 for _, one in self.rings) - self.missed

    @property
    def rank(self) -> tuple[int, float]:
        """Of two with as many lights, the one that is less likely chance."""
        return self.lights, self.rings[0][1].detection or 0.0

    @cached_property
    def taken(self) -> np.ndarray:
        """Which groups (N,) are its lights."""
        return np.any([one.ring.on_ring for _, one in self.rings if one.ring is not None], axis=0)

    def betters(self, other: "_Seen") -> bool:
        """Whether it explains the same lights better or, of two docks in view, is the nearer one."""
        if len(self.taken) != len(other.taken) or (self.taken & other.taken).any():
            return self.rank > other.rank
        mine, theirs = (np.linalg.norm(each.rings[0][1].candidates[0].position_m) for each in (self, other))
        return bool(mine < theirs) and self.lights >= _SHARE * other.lights

    @cached_property
    def is_exact(self) -> bool:
        """Whether it explains nearly all lights of the first ring, nearly where they should be."""
        ring, one = self.rings[0]
        pose = one.selected
        complete = (one.lights_on_ring or 0) >= max(MIN_POINTS, _COMPLETE * (ring.lights or 0))
        return complete and self.missed == 0 and pose is not None and (pose.rms_px or 0.0) <= _EXACT_PX


def of_rings(
    search: Callable[..., Estimate],
    image: Any,
    camera: Camera,
    dock: Dock,
    settings: Settings,
    *,
    fall_back: bool,
    like: Estimate | None,
) -> Estimate:
    """Find a dock of several rings in one picture by ``search``, which is :func:`estimate`, for each of them."""
    begin = time.perf_counter()
    like = like and (like.of_ring or like)
    tried, best = [], None
    largest_first = sorted(dock.rings, key=lambda ring: -ring.diameter)
    for thorough, ring in itertools.product((False, True) if fall_back else (False,), largest_first):
        like = search(image, camera, ring.dock, settings, fall_back=thorough, like=like)
        tried.append(like)
        for seen in [_completed(one, ring, dock) for one in rings_of(like)]:
            best = seen if best is None or seen.betters(best) else best
        if best is not None and best.is_exact:
            break
    elapsed_ms = 1000 * (time.perf_counter() - begin)
    if best is None:
        farthest = max(tried, key=lambda one: (one.ellipse is not None, one.lights_on_ring or 0))
        return replace(farthest, dock=dock, elapsed_ms=elapsed_ms)
    return replace(_joined(best), elapsed_ms=elapsed_ms)


def lights_of_all(found: Estimate) -> np.ndarray:
    """Which groups (N,) are lights of any ring of a dock of several."""
    one = found.of_ring or found
    return _completed(one, _named(found.rings[0], found.dock), found.dock).taken


def joined_with(one: Estimate, name: str, dock: Dock) -> Estimate:
    """A dock of several rings, by the estimate of that of this name, among whose groups are the others' lights."""
    return replace(_joined(_completed(one, _named(name, dock), dock)), elapsed_ms=one.elapsed_ms)


def _named(name: str, dock: Dock) -> DockRing:
    return next(ring for ring in dock.rings if ring.name == name)


def rings_of(found: Estimate) -> Iterator[Estimate]:
    """A frame's estimate, if it shows a dock, and then as it would be of each other ring in view."""
    if found.status != "ok" or not found.candidates:
        return
    yield found
    own = found.of_ring or found
    ring, markers, camera, dock = own.ring, own.markers, own.camera, own.dock
    if ring is None or markers is None:
        return
    every, area_px2 = (ring.on_ring, *ring.rivals), float(own.width * own.height)
    for number, on_ring in enumerate(ring.rivals, 1):
        other = Ring(on_ring, ring.reason, rivals=every[:number] + every[number + 1 :], alike=ring.alike)
        try:
            ellipse, choice, log_chance, reason = judged(other, markers, camera, dock, area_px2)
        except NoEllipseError:
            continue
        if reason is None:
            words, detection = found_in_words(other, choice, camera, dock), detection_of(log_chance, ring.alike)
            one = replace(own, message=words, ring=other, ellipse=ellipse, choice=choice, detection=detection)
            seen = next((each for each in found.dock.rings if each.name in found.rings[:1]), None)
            yield one if seen is None else _joined(_Seen(found.dock, ((seen, one),), 0))


def _completed(one: Estimate, ring: DockRing, dock: Dock) -> _Seen:
    """What a picture shows of a dock of which one ring was found."""
    rings, missed = [(ring, one)], 0
    for other in dock.rings:
        if other is not ring:
            beside, absent = _beside(rings, other, dock)
            rings += [] if beside is None else [(other, beside)]
            missed += absent
    return _Seen(dock, tuple(rings), missed)


def _beside(rings: Sequence[tuple[DockRing, Estimate]], other: DockRing, dock: Dock) -> tuple[Estimate | None, int]:
    """Another ring of the dock where those seen say that it is, and how many of its lights are missed."""
    ring, one = rings[0]
    assert one.markers is not None
    taken = np.any([each.ring.on_ring for _, each in rings if each.ring is not None], axis=0)
    camera, markers, lights = one.camera, one.markers, other.lights or 0
    there = [
        fixed_to(_of_dock(pose, ring, camera), dock, other.position_m, other.normal, camera) for pose in one.candidates
    ]
    places = [_on_circle(pose, other, markers.points_px, camera) & ~taken for pose in there]
    near = max(places, key=lambda flags: int(flags.sum()))
    expected = camera.project(there[0].position_m + other.light_points() @ there[0].rotation.T)
    apart = np.linalg.norm(expected - np.roll(expected, 1, axis=0), axis=1)
    size = np.array([one.width, one.height]) - 1 - _EDGE_PX
    in_view = bool(((expected > _EDGE_PX) & (expected < size)).all() and (apart > _APART_PX).all())
    absent = lights if in_view and there[0].position_m[2] > 0 else 0
    if not max(4, _SHARE * lights) <= near.sum() <= lights or (near.sum() < MIN_POINTS and near.sum() < lights):
        return None, absent
    found = Ring(near, "")
    try:
        ellipse, choice = find_poses(markers.points_px[near], camera, other.dock)
    except NoEllipseError:
        return None, absent
    if why_no_dock(found, markers, ellipse, choice, camera, other.dock, -math.inf) is not None:
        return None, absent
    beside = replace(one, dock=other.dock, ring=found, ellipse=ellipse, choice=choice)
    mine, others = (_all_of_dock(each, by) for each, by in ((one, ring), (beside, other)))
    fits = min(_agreed(a, b, camera)[1] for a in mine for b in others) <= _GATE
    return (beside, 0) if fits else (None, absent)


def _on_circle(pose: CirclePose, ring: DockRing, points_px: np.ndarray, camera: Camera) -> np.ndarray:
    """Which of the points (N, 2) lie on a ring's circle, if it has this pose."""
    rays = light_rays(points_px, camera, float(pose.position_m[2]))
    centre = pose.position_m + ring.lamp_depth_m * pose.rotation[:, 2]
    (flat,) = on_planes(rays, pose.rotation[None], centre[None])
    return np.abs(np.linalg.norm(flat, axis=1) / ring.radius - 1) < _NEAR


def _of_dock(pose: CirclePose, ring: DockRing, camera: Camera) -> CirclePose:
    """The dock's pose by that of one of its rings."""
    x, y, z = (-ring.frame.T @ ring.position_m).tolist()
    out_x, out_y, out_z = (ring.frame.T @ _OUT).tolist()
    return fixed_to(pose, ring.dock, (x, y, z), (out_x, out_y, out_z), camera)


def _all_of_dock(one: Estimate, ring: DockRing) -> list[CirclePose]:
    return [_of_dock(pose, ring, one.camera) for pose in one.candidates]


def _joined(seen: _Seen) -> Estimate:
    """The estimate of the dock by all rings that were seen; the candidates are those of the one with most lights."""
    (ring, one), *others = sorted(seen.rings, key=lambda each: -(each[1].lights_on_ring or 0))
    assert one.choice is not None
    assert one.ring is not None
    poses = _weighed(ring, one, others)
    order = sorted(range(len(poses)), key=lambda index: -(poses[index].probability or 0.0))
    own = replace(one.choice, candidates=tuple(one.candidates[index] for index in order), selected=0)
    by = "spacing" if others and own.selected_by == "none" else own.selected_by
    choice = Choice(tuple(poses[index] for index in order), 0, by, own.lights, own.coincide)
    used = [other.ring.on_ring for _, other in others if other.ring is not None]
    rivals = tuple(rival for rival in one.ring.rivals if not any((rival & lights).any() for lights in used))
    alike = min(one.ring.alike, len(rivals))
    found = replace(one.ring, rivals=rivals, alike=alike)
    names = (ring.name, *(by.name for by, _ in others))
    of_ring = replace(one, ring=found, choice=own)
    return replace(
        of_ring,
        dock=seen.dock,
        choice=choice,
        message=f"{found_in_words(found, choice, one.camera, ring.dock)} Seen of the dock: {', '.join(names)}.",
        detection=one.detection and 1 / (1 / one.detection + alike - one.ring.alike),
        rings=names,
        of_ring=of_ring,
    )


def _weighed(ring: DockRing, one: Estimate, others: Sequence[tuple[DockRing, Estimate]]) -> list[CirclePose]:
    """The dock's poses by a ring's candidates and those of others, and how probable each is by all of them."""
    poses = _all_of_dock(one, ring)
    if not others:
        return poses
    logs = [math.log(max(pose.probability or 0.5, 1e-12)) for pose in poses]
    for by, other in others:
        options = _all_of_dock(other, by)
        for index, pose in enumerate(poses):
            joint = [(*_agreed(pose, each, one.camera), max(each.probability or 0.5, 1e-12)) for each in options]
            mean, square, probability = min(joint, key=lambda each: each[1] - 2 * math.log(each[2]))
            poses[index] = mean if square <= _GATE else pose  # the mean of what contradicts each other is neither
            logs[index] += math.log(probability) - square / 2
    odds = np.exp(np.maximum(np.array(logs) - max(logs), -_MOST_ODDS))
    return [replace(pose, probability=share) for pose, share in zip(poses, (odds / odds.sum()).tolist(), strict=True)]


def _agreed(one: CirclePose, other: CirclePose, camera: Camera) -> tuple[CirclePose, float]:
    """Of two poses of one dock the mean by their errors, and the squared Mahalanobis distance between them.

    What the camera is off moves both together, so that their errors are correlated (Bar-Shalom and Campo 1986).
    """
    assert one.errors is not None
    assert other.errors is not None
    least = np.repeat([(_LEAST_SHARE * float(np.linalg.norm(one.position_m))) ** 2, _LEAST_RAD**2], 3)
    pair = one.errors, other.errors
    turned = [_block(errors.rotation) for errors in pair]
    first, second = (
        turn @ sum((part for name, part in errors.parts.items() if name != "camera"), np.zeros((6, 6))) @ turn.T
        for turn, errors in zip(turned, pair, strict=True)
    )
    cameras = [turn @ errors.roots.get("camera", np.zeros((6, 1))) for turn, errors in zip(turned, pair, strict=True)]
    differs = cameras[0] - cameras[1]
    spread = first + second + differs @ differs.T
    apart = np.concatenate([other.position_m - one.position_m, np.cross(one.normal, other.normal)])
    gain = (first + cameras[0] @ differs.T) @ np.linalg.inv(spread)
    step = gain @ apart
    position, normal = one.position_m + step[:3], cv2.Rodrigues(step[3:])[0] @ one.normal
    mean = CirclePose.at(position, normal / np.linalg.norm(normal), camera, rms_px=one.rms_px, roll_rad=one.roll_rad)
    back = _block(mean.rotation).T
    weights = [back @ share @ turn for share, turn in zip((np.eye(6) - gain, gain), turned, strict=True)]
    picture = sum(w @ errors.parts["picture"] @ w.T for w, errors in zip(weights, pair, strict=True))
    roots = {}
    for name in one.errors.roots:
        each = [w @ errors.roots[name] for w, errors in zip(weights, pair, strict=True)]
        roots[name] = each[0] + each[1] if name == "camera" else np.hstack(each)  # of the camera the same number is off
    errors = PoseErrors(np.asarray(picture), mean.rotation, shared=KnownErrors(roots))
    sigmas = errors.sigmas["picture"]
    mean = replace(mean, errors=errors, sigma_position_m=sigmas[0], sigma_theta_rad=sigmas[1])
    return mean, float(apart @ np.linalg.inv(spread + 2 * np.diag(least)) @ apart)


def _block(rotation: np.ndarray) -> np.ndarray:
    """Matrix (6, 6) that takes rotations about a pose's own axes to those about the camera's."""
    block = np.eye(6)
    block[3:, 3:] = rotation
    return block
