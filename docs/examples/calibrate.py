"""Calibrate a camera from pictures of a chessboard, here drawn as a known camera sees it."""

import cv2
import numpy as np
from dockpose import calibrate
from dockpose.camera import Board, save_camera

board = Board(columns=10, rows=7, square_m=0.024)
squares = np.kron(np.indices((9, 12)).sum(axis=0) % 2, np.ones((40, 40))).astype(np.uint8) * 255
squares[:40], squares[-40:], squares[:, :40], squares[:, -40:] = 255, 255, 255, 255  # a white rim of one square
true = np.array([[600.0, 0, 322], [0, 600, 236], [0, 0, 1]])
rng, to_metres = np.random.default_rng(1), np.array([[0.0006, 0, -0.144], [0, 0.0006, -0.108], [0, 0, 1]])
pictures = []
for number in range(10):
    rotation = cv2.Rodrigues(rng.uniform(-0.5, 0.5, 3))[0]
    place = [*rng.uniform(-0.05, 0.05, 2), rng.uniform(0.35, 0.5)]
    seen = cv2.warpPerspective(squares, true @ np.column_stack([rotation[:, :2], place]) @ to_metres, (640, 480))
    pictures.append((f"picture {number}", cv2.GaussianBlur(seen, (0, 0), 0.8)))

found = calibrate(pictures, board)
print(f"fx {found.camera.fx:.1f} ± {found.sigmas.values['fx']:.1f} px, off by {found.error_px:.2f} px on average")
save_camera(found.camera, "camera.yaml")
