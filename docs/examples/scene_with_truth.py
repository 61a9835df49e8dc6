"""How far an estimate is off: simulate a scene whose truth is known, in clear and in turbid water."""

import numpy as np
from dockpose import Camera, Dock, estimate
from dockpose.simulate import Pose, Scene, render, water_of_turbidity

camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
dock = Dock(diameter=0.30, lights=10)
pose = Pose(position_m=(0.1, 0.0, 1.5), theta_x_deg=-8, theta_y_deg=15)

for turbidity in (0.0, 0.5, 0.8):  # from clear to harbour water
    scene = Scene(camera=camera, dock=dock, pose=pose, water=water_of_turbidity(turbidity), seed=1)
    image, truth = render(scene)
    found = estimate(image, camera, dock)
    if found.selected is None:
        print(f"turbidity {turbidity}: {found.message}")
    else:
        error_mm = 1000 * np.linalg.norm(found.selected.position_m - np.array(pose.position_m))
        print(f"turbidity {turbidity}: off by {error_mm:.2f} mm, {truth.visible.sum()} lights in view")
