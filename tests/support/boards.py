"""Corners of boards as a known camera sees them, without a picture."""

import numpy as np
from dockpose import Camera
from dockpose.camera.board import Sighting
from dockpose.pose.circle import rotation_from_angles

COLUMNS, ROWS, SQUARE_M = 9, 6, 0.024  # inner corners
SIZE = (640, 480)
TRUE = Camera(520, 515, 322, 236, *SIZE, (-0.18, 0.05, 0.0, 0.0))


def corners_m(columns=COLUMNS, rows=ROWS):
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    return SQUARE_M * np.column_stack([column.ravel(), row.ravel(), 0.0 * row.ravel()])


def sightings(camera, seed, count=12, noise_px=0.1, tilt_rad=0.5, ranges_m=(0.25, 0.6)):
    """Boards anywhere in the picture, at random tilts and distances, with noise on their corners."""
    rng, flat, seen = np.random.default_rng(seed), corners_m(), []
    while len(seen) < count:
        rotation = rotation_from_angles(*rng.uniform([-tilt_rad, -tilt_rad, -0.3], [tilt_rad, tilt_rad, 0.3]))
        towards = camera.rays([rng.uniform([60, 60], [580, 420])])[0]
        middle = towards / towards[2] * rng.uniform(*ranges_m)
        picture_px = camera.project((flat - flat.mean(axis=0)) @ rotation.T + middle)
        if np.isfinite(picture_px).all() and (picture_px > 2).all() and (picture_px < np.array(SIZE) - 3).all():
            noisy = picture_px + rng.normal(0, noise_px, picture_px.shape)
            seen.append(Sighting(f"view{len(seen)}", flat.astype(np.float32), noisy.astype(np.float32), 2.0))
    return seen
