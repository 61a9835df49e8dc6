"""Where the dock is in one picture, with standard errors; writes the picture with what was found drawn in."""

from pathlib import Path

import cv2
from dockpose import Camera, Dock, estimate

picture = Path(__file__).parents[2] / "sample_images" / "plain.png"
camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)  # pixels
dock = Dock(diameter=0.30, lights=10)  # metres

found = estimate(picture, camera, dock)
print(found)
if found.selected is not None:
    x, y, z = found.selected.position_m  # right, down, ahead of the camera
    print(f"{z:.3f} m ahead, {x:.3f} m to the right, {y:.3f} m down")
cv2.imwrite("one_picture.png", found.draw())
