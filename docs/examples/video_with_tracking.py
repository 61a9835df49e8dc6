"""Follow the dock through a video: here an approach from 4 m to 1 m, which is simulated first."""

import cv2
from dockpose import Camera, Dock, Tracker, open_frames
from dockpose.simulate import Approach, FilmPlan, Pose, Scene, film

camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
dock = Dock(diameter=0.30, lights=10)
pose = Pose(position_m=(0.05, -0.03, 1.0), theta_x_deg=5, theta_y_deg=-20)
plan = FilmPlan(scene=Scene(camera=camera, dock=dock, pose=pose), motion=Approach(start_m=4, end_m=1, frames=12))
video = cv2.VideoWriter("approach.avi", cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (640, 480), isColor=False)
for rendered in film(plan):
    video.write(rendered.image)
video.release()

tracker = Tracker(camera, dock)
with open_frames("approach.avi") as frames:
    for frame in frames:
        seen = tracker.see(frame.image, frame.time_s)
        if seen.pose is not None and seen.track.probability is not None:
            print(f"{frame.time_s:.1f} s: {seen.pose.position_m[2]:.2f} m ahead, {seen.track.probability:.0%} sure")
