"""Docks whose lights are not quite in their places: poses refined with where the lights really are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from dockpose.dock import Dock
from dockpose.pose.refine import Fit, LightRays, refine
from dockpose.pose.spacing import Placement
from dockpose.pose.uncertainty import log_odds

_ROUNDS, _LIKELY = 2, 2  # of refinement, for the likeliest turns
_SURE = 0.95  # probability from which the roll counts as known
_IN_ONE_TURN = 1e-9


def in_place(
    rays: LightRays, rotation: np.ndarray, position_m: np.ndarray, points_m: np.ndarray, circle_m: np.ndarray
) -> LightRays:
    """Rays (N) of lights as they would be if the lights were at their places on the circle.

    Parameters
    ----------
    rays : LightRays
        The rays of the lights.
    rotation : (3, 3) float array
        From the dock's frame to the camera's.
    position_m : (3,) float array, metres
        The dock's centre.
    points_m, circle_m : (N, 3) float array, metres
        Where the lights are, and where on the circle they should be, in the dock's frame.

    Returns
    -------
    LightRays
        Rays whose residuals, for lights on the circle, are those of the rays given, for the lights where they are.
    """
    real, nominal = points_m @ rotation.T + position_m, circle_m @ rotation.T + position_m
    moved = real[:, :2] / real[:, 2:] - nominal[:, :2] / nominal[:, 2:]
    starts = np.zeros(len(real)) if rays.starts_m is None else rays.starts_m
    nearer, nominally = 1 - starts / real[:, 2], 1 - starts / nominal[:, 2]
    tangents = (rays.tangents * nearer[:, None] - moved) / nominally[:, None]
    return replace(rays, tangents=tangents)


def refine_with_offsets(
    rotations: np.ndarray, positions_m: np.ndarray, placement: Placement, dock: Dock, rays: LightRays
) -> tuple[Fit, Placement]:
    """Refine poses of a dock whose lights' offsets are known, and tell its roll by them where they suffice.

    Parameters
    ----------
    rotations : (K, 3, 3) float array
        Where to start, roughly refined.
    positions_m : (K, 3) float array, metres
        Where to start.
    placement : Placement
        The lights that the points are, modulo the dock's symmetry.
    dock : Dock
        The dock, with offsets.
    rays : LightRays
        Rays of the N lights.

    Returns
    -------
    fit : Fit
        The refined poses.
    placement : Placement
        The lights that the points are, and the roll; modulo a turn where the offsets tell it.

    Notes
    -----
    A light that is off its place by a few millimetres shifts in the picture by an amount that hardly depends on the
    pose. It is taken out of the rays at the pose known so far, and the pose refined as that of a perfect dock, in turn.
    On an evenly spaced ring every turn by a light's spacing is tried, and the one with the least residuals taken.
    """
    count = dock.lights or placement.lights.shape[1]
    step = 2 * math.pi / count
    turns = range(count) if placement.period_rad < 2 * math.pi - _IN_ONE_TURN else range(1)
    best, lights, rolls, sure, least_px2 = [], [], [], True, math.inf
    for k in range(len(rotations)):
        rough = [_refined_alone((rotations[k], positions_m[k]), placement, k, turn, dock, rays, 1) for turn in turns]
        likely = np.argsort([float(fit.squares_px2[0]) for fit in rough], kind="stable")[:_LIKELY].tolist()
        fits = rough
        for turn in likely:
            start = rough[turn].rotations[0], rough[turn].positions_m[0]
            fits[turn] = _refined_alone(start, placement, k, turn, dock, rays, _ROUNDS)
        squares = np.array([float(fit.squares_px2[0]) for fit in fits])
        order = np.argsort(squares, kind="stable")
        turn = int(order[0])
        best.append(fits[turn])
        lights.append((placement.lights[k] + turn) % count)
        rolls.append(float(placement.rolls_rad[k]) - turn * step)
        if len(order) > 1 and squares[turn] < least_px2:
            least_px2, *others = squares[order].tolist()
            odds = [math.exp(-log_odds(least_px2, other, fits[turn].numbers)) for other in others]
            sure = 1 / (1 + sum(odds)) >= _SURE
    fit = Fit(
        rotations=np.concatenate([each.rotations for each in best]),
        positions_m=np.concatenate([each.positions_m for each in best]),
        squares_px2=np.concatenate([each.squares_px2 for each in best]),
        covariances=np.concatenate([each.covariances for each in best]),
        numbers=best[0].numbers,
        points=best[0].points,
    )
    period = 2 * math.pi if sure else placement.period_rad
    told = Placement(np.array(lights), np.array(rolls), placement.angles_rad, placement.fits, period)
    return fit, told


def _refined_alone(
    start: tuple[np.ndarray, np.ndarray],
    placement: Placement,
    k: int,
    turn: int,
    dock: Dock,
    rays: LightRays,
    rounds: int,
) -> Fit:
    """One pose refined with one assignment of the lights; its frame is that of the placement, without the roll."""
    count = dock.lights or placement.lights.shape[1]
    roll = float(placement.rolls_rad[k]) - turn * 2 * math.pi / count
    c, s = math.cos(roll), math.sin(roll)
    offsets = np.array(dock.offsets_m)[(placement.lights[k] + turn) % count] @ np.array(
        [[c, s, 0], [-s, c, 0], [0, 0, 1]]
    )
    angles = placement.angles_rad[k]
    circle = dock.radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    R, t = start
    fit = None
    for _ in range(rounds):
        corrected = in_place(rays, R, t, circle + offsets, circle)
        fit = refine(R[None], t[None], angles[None], dock.radius, corrected)
        R, t = fit.rotations[0], fit.positions_m[0]
    assert fit is not None
    return fit
